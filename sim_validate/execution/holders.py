"""Tells what holds the object in an execution, and plans the execution with it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from numpy.typing import ArrayLike

from grasp_core.closure.contacts import contact_arrays, stacked
from grasp_core.errors import NoForcesError
from grasp_core.execution.best_squeeze import searched
from grasp_core.execution.grips import Grip, unsqueezed
from grasp_core.execution.loads import LoadSet, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from grasp_core.time_spent import TIME_SPENT
from grasp_core.values import Contact
from scenes.mujoco.fingertip_room import fitting_radius
from scenes.mujoco.held_scene import HeldScene, build_held_scene
from scenes.mujoco_options import PhysicsSettings
from sim_validate.execution.predictions import HeldDynamics
from sim_validate.execution.trials import Trial, trials_of
from sim_validate.execution.verdict import Skipped
from sim_validate.settings import ExecutionSettings

SURFACE_SPARE = 0.05
"""How much farther a curved surface is there than fingertips come, in object radii."""


@dataclass(frozen=True, slots=True, eq=False)
class Holder(ABC):
    """What holds the object in an execution: fingertips on springs, or a hand."""

    body: Polyhedron

    @abstractmethod
    def loose(self, settings: ExecutionSettings) -> tuple[Grip, Motors | None]:
        """Return the contacts before they are squeezed, and the motors behind them."""

    @abstractmethod
    def scene(self, settings: ExecutionSettings, best: BestSqueeze) -> HeldScene:
        """Build the scene in which a squeeze is executed."""

    def squeeze(self, settings: ExecutionSettings, loads: LoadSet | None = None) -> BestSqueeze:
        """Choose the squeeze of most weight in any direction, or of least push for given loads."""
        start, motors = self.loose(settings)
        most = settings.push_n if loads is None else None
        best = searched(start, loads or any_direction(settings.object_kg), most, motors)
        if best.scale == 0.0:
            within = "" if motors is None else " within the motors' torques"
            others = "other contacts" if motors is None else "stronger motors, another pose,"
            raise NoForcesError(
                f"no squeeze{within} carries any part of the weight in every direction; use "
                f"{others} or more friction"
            )
        return best

    def reach_m(self, settings: ExecutionSettings, grip: Grip) -> float | None:
        """Return how far tips come from contacts on a curved surface [m]; None for flat ones."""
        if self.body.patches is None:
            return None
        turn = settings.most_rad + math.radians(settings.off_deg)
        moved = settings.most_m + settings.off_mm / 1000.0
        return moved + (turn + SURFACE_SPARE) * self.body.radius + float(grip.tip_radius_m.max())


@dataclass(frozen=True, slots=True, eq=False)
class SpringFingers(Holder):
    """Fingertips on springs, which hold an object by contacts."""

    contacts: Sequence[Contact]
    friction: ArrayLike
    physics: PhysicsSettings | Mapping[str, Any] | None = None
    """Settings of the simulator, or those of the usual ones that differ, by name; None for the
    usual ones."""

    def loose(self, settings: ExecutionSettings) -> tuple[Grip, None]:
        """Return the contacts before they are squeezed; no motors limit fingertips."""
        stiffness = settings.tip_stiffness_n_per_m
        radius = tip_radius(self.body, self.contacts, settings)
        return unsqueezed(
            self.body, self.contacts, self.friction, stiffness=stiffness, tip_radius_m=radius
        ), None

    def scene(self, settings: ExecutionSettings, best: BestSqueeze) -> HeldScene:
        """Build the scene in which a squeeze is executed."""
        build = partial(
            build_held_scene, self.body, best.grip, settings,
            reach_m=self.reach_m(settings, best.grip),
        )  # fmt: skip
        if not isinstance(self.physics, Mapping):
            return build(physics=self.physics)
        usual = build()
        return build(physics=replace(usual.physics, **self.physics)) if self.physics else usual


def tip_radius(body: Polyhedron, contacts: Sequence[Contact], settings: ExecutionSettings) -> float:
    """Return the radius of the fingertips [m]: as in the settings, or one that fits."""
    if settings.tip_radius_m is not None:
        return settings.tip_radius_m
    return fitting_radius(body, *contact_arrays(*stacked(contacts)))


def planned(
    holder: Holder, settings: ExecutionSettings, best: BestSqueeze
) -> tuple[HeldScene, HeldDynamics, tuple[Trial, ...], tuple[Skipped, ...]]:
    """Plan an execution: its scene and dynamics, its trials, and those that are left out."""
    with TIME_SPENT.on("scenes"):
        scene = holder.scene(settings, best)
    dynamics = HeldDynamics(best.grip, scene.layout)
    trials = trials_of(holder.body, scene.layout, settings, dynamics.lowest_frequency)
    return scene, dynamics, *trials
