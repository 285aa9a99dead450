"""Chooses the wrenches that a grasp is tested with, and plans finger forces for them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from grasp_core.arrays import Array, cross, rounded, to_digits
from grasp_core.closure.contacts import (
    contact_frictions,
    contact_torsions,
    normal_and_tangential,
    stacked,
)
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limits import (
    WrenchBody,
    WrenchLimit,
    axis_wrenches,
    limit_of,
    weakest_from,
)
from grasp_core.values import Contact
from sim_validate.engine.schedules import TrialLoad, part
from sim_validate.engine.setup import AXIS_NAMES, RANDOM, WEAKEST, Agenda, Setup

NO_PUSH = 1e-9
"""Normal forces below this share of the largest one count as zero."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLoad:
    """One wrench that a grasp is tested with, and what the analysis predicts about it."""

    name: str
    load: TrialLoad
    """The wrench that is applied, and the finger forces planned for it."""
    predicted_limit: float
    limit: TrialLoad
    """The wrench at its predicted limit, and the finger forces that balance it."""
    required_friction: float
    """The friction coefficient that the planned forces need, with the torques of soft contacts."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadPlanner:
    """Contacts on an object as the analysis sees them: what they resist, with which forces."""

    body: Polyhedron
    contacts: Sequence[Contact]
    friction: float
    setup: Setup
    motors: Motors | None
    """Motors that make the contact forces; None for fingertips."""

    @property
    def resisted(self) -> WrenchBody:
        """The body of wrenches that are resisted, with torques about the centre of mass."""
        positions, normals = stacked(self.contacts)
        frictions, setup = contact_frictions(self.friction, len(self.contacts)), self.setup
        return WrenchBody(
            positions - self.body.center_of_mass, normals, frictions,
            setup.fingers.max_normal_force_n, self.motors,
            torsions=contact_torsions(setup.physics.torsion_m, frictions),
        )  # fmt: skip

    def limit(self, wrench: Array) -> WrenchLimit:
        """Find the largest multiple of a wrench that is resisted."""
        return limit_of(self.resisted, wrench)

    def planned(
        self, idle: TrialLoad, agenda: Agenda, only: str | None = None
    ) -> tuple[PlannedLoad, ...]:
        """Plan all wrenches to test, in order: along axes, weakest, random, the user's own.

        With the name of one, only that is planned, or all if none has this name.
        """
        share = self.setup.hold.load_share
        relative = [
            self._load(name, found, share * found.limit, idle)
            for name, find in _relative(self.resisted, self.body.radius, agenda).items()
            if only in (None, name)
            for found in [find()]
        ]
        own = [(each.name, each.wrench) for each in agenda.wrenches if only in (None, each.name)]
        return (*relative, *self.as_they_are(idle, own)) or self.planned(idle, agenda)

    def as_they_are(
        self, idle: TrialLoad, wrenches: Sequence[tuple[str, Array]]
    ) -> tuple[PlannedLoad, ...]:
        """Plan finger forces for wrenches that are applied as given, not at a share of a limit."""
        resisted = self.resisted
        return tuple(
            self._load(name, limit_of(resisted, wrench), 1.0, idle) for name, wrench in wrenches
        )

    def _load(self, name: str, found: WrenchLimit, multiple: float, idle: TrialLoad) -> PlannedLoad:
        """Plan a multiple of a wrench, with forces between those at rest and those at the limit.

        The friction that they need is the largest ratio of a tangential to a normal force.
        """
        wrench = to_digits(multiple * found.wrench)
        predicted = found.limit / multiple
        limit = TrialLoad(predicted * wrench, to_digits(found.forces))
        share = 1.0 / predicted if predicted > 0.0 else 0.0
        load = TrialLoad(wrench, part(idle, limit, share).forces if share else idle.forces)
        positions, normals = stacked(self.contacts)
        along, across = normal_and_tangential(load.forces, normals)
        pushing = along > NO_PUSH * along.max()
        along, across = along[pushing], across[pushing]
        if found.torques is not None:  # the normal force counts as far as the torque leaves it
            share = min(share, 1.0)
            # the torques about the normals, of least norm, that balance the load at rest
            arms = positions - self.body.center_of_mass
            missing = idle.wrench[3:] + cross(arms, idle.forces).sum(axis=0)
            resting = np.asarray(np.linalg.lstsq(normals.T, -missing, rcond=None)[0], dtype=float)
            torques = (1.0 - share) * resting + share * found.torques
            turning = np.abs(torques[pushing]) / self.setup.physics.torsion_m
            along = np.sqrt(np.maximum(along**2 - turning**2, (NO_PUSH * along) ** 2))
        required = rounded((across / along).max())
        return PlannedLoad(name, load, predicted, limit, required)


def _relative(
    resisted: WrenchBody, torque_scale: float, agenda: Agenda
) -> dict[str, Callable[[], WrenchLimit]]:
    """Name the wrenches that are applied at a share of their limit, and how to find each limit."""
    axes = [cache(partial(limit_of, resisted, wrench)) for wrench in axis_wrenches(torque_scale)]
    weakest = partial(weakest_from, resisted, (find() for find in axes), torque_scale)
    rng = np.random.default_rng(agenda.seed)
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    drawn = rng.normal(size=(agenda.random_wrenches, 6))
    units = scale * drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    others = {RANDOM.format(i): partial(limit_of, resisted, unit) for i, unit in enumerate(units)}
    return {**dict(zip(AXIS_NAMES, axes, strict=True)), WEAKEST: weakest, **others}
