"""Settings that users may choose: how trials are simulated, and which trials a grasp undergoes.

A file may name the wrenches that a task needs, each of which a grasp must hold in full:

    {"wrenches": [{"name": "lift", "force_n": [0, 0, -3], "torque_n_m": [0, 0, 0]}, ...]}

Torques are about the centre of mass; forces and torques are in the object's frame. A torque may be
left out, which means zero.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from annotated_types import Interval, Len

from grasp_core.allowed_values import LARGEST, SMALLEST, Seed, Vector
from grasp_core.arrays import Array, Wrench, frozen_copy, to_digits
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.files.file_kinds import WRENCH_FILE
from grasp_core.files.json_text import object_of, shown
from grasp_core.files.records import UNRECORDED, from_record
from grasp_core.files.text_files import read_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.settings import CHOSEN, named
from grasp_core.time_spent import TIME_SPENT
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene, build_scene, surface_of
from scenes.mujoco_options import PhysicsSettings
from scenes.settings import FingerSettings, ScaledScene
from sim_validate.files.toml_files import read_tables
from sim_validate.settings import ChosenTrials, FrictionProtocol, HoldProtocol, LimitProtocol

AXIS_NAMES = tuple(
    f"{sign}{kind}_{axis}" for sign in "+-" for kind in ("force", "torque") for axis in "xyz"
)
NAME = re.compile(r"[\w+\- ]{1,100}")
WEAKEST = "weakest"
RANDOM = "random_{}"
MOST_THREADS = 1024
HARD_CONDIM = 3
"""MuJoCo's `condim` of a contact whose force has a normal and two tangential parts."""


@declared
class Setup(ScaledScene):
    """How trials are simulated: physics, fingertips, surface, durations and thresholds.

    Raises:
        InputError: A part has the wrong type, a number is out of its range, or the physics is not
            the physics of the predictions.
    """

    fingers: FingerSettings = field(default_factory=FingerSettings)
    physics: PhysicsSettings = field(default_factory=PhysicsSettings)
    hold: HoldProtocol = field(default_factory=HoldProtocol)
    limit: LimitProtocol = field(default_factory=LimitProtocol)
    friction: FrictionProtocol = field(default_factory=FrictionProtocol)
    threads: Annotated[int, Interval(ge=1, le=MOST_THREADS), CHOSEN, UNRECORDED] = field(
        default=1, compare=False
    )
    """Number of threads that the simulator uses; results do not depend on it."""
    timeout_s: Annotated[float, Interval(gt=0.0, le=math.inf), CHOSEN, UNRECORDED] = field(
        default=math.inf, compare=False
    )
    """Time after which the trials of one contact set are stopped [s]."""

    def _check_together(self) -> None:
        physics = self.physics
        # forces that the analysis does not model
        if any(physics.gravity):
            raise InputError(
                f"physics.gravity must be zero, got {physics.gravity}: masses are scaled, so it "
                "would not be the object's weight; give the weight as a wrench (--weight-n, or "
                "Agenda.wrenches)"
            )
        if physics.condim != HARD_CONDIM:
            raise InputError(
                f"physics.condim must be {HARD_CONDIM}, got {physics.condim}: predictions are for "
                "hard fingers, whose contacts have friction and no torsion; for soft ones give "
                "physics.torsion_m"
            )

    def for_body(self, body: Polyhedron) -> Self:
        """Return the setup with what fingertips touch on an object, if it was left open."""
        return self if self.surface else replace(self, surface=surface_of(body))

    def closure(self, contacts: Grasp | Sequence[Contact], friction: float) -> ClosureCertificate:
        """Decide force closure by fingertips as soft as these."""
        return force_closure(contacts, friction=friction, torsion_m=self.physics.torsion_m)

    def critical_friction(self, contacts: Grasp | Sequence[Contact]) -> float:
        """Return the least friction of force closure by fingertips as soft as these."""
        return critical_friction(contacts, torsion_m=self.physics.torsion_m)

    @TIME_SPENT.on("scenes")
    def scene(
        self, body: Polyhedron, grasp: Grasp | Sequence[Contact], friction: float,
        squeeze: Array | None = None,
    ) -> Scene:  # fmt: skip
        """Build the MuJoCo scene of a grasp with these settings (see `build_scene`)."""
        return build_scene(
            body, grasp, friction, fingers=self.fingers, physics=self.physics,
            surface=self.surface, squeeze=squeeze,
        )  # fmt: skip


@declared
class NamedWrench(Declared):
    """An external wrench with a name that the user gives it."""

    name: str
    wrench: Wrench
    """Force, then torque about the centre of mass, in the object's frame, (6,) [N, N m]."""

    def _check_together(self) -> None:
        object.__setattr__(self, "wrench", frozen_copy(to_digits(self.wrench)))
        size = float(np.abs(self.wrench).max())
        if not SMALLEST <= size <= LARGEST:
            raise InputError(
                f"wrench {shown(self.name)}: its largest component must be from {SMALLEST:g} to "
                f"{LARGEST:g} (N or N m), got {size:g}"
            )
        if not NAME.fullmatch(self.name):
            raise InputError(
                f"a wrench's name has up to 100 letters, digits, '_', '+', '-' and spaces; "
                f"got {shown(self.name)}"
            )


@declared
class Agenda(ChosenTrials):
    """Which trials a grasp goes through.

    The twelve axis wrenches and the weakest one are always held, at a share of what the analysis
    says is resisted. Random wrenches are held at the same share. A user's wrenches are held as they
    are.
    """

    wrenches: tuple[NamedWrench, ...] = ()
    critical_friction: bool = True
    """Whether to find the critical friction in simulation."""
    controls: bool = True
    keep_traces: Annotated[bool, UNRECORDED] = field(default=False, compare=False)
    seed: Seed = 0
    """Seed of the random wrenches, of noise, and of how contacts are moved to make a negative
    control (contacts that must fail)."""

    def _check_together(self) -> None:
        drawn = (RANDOM.format(place) for place in range(self.random_wrenches))
        taken = {*AXIS_NAMES, WEAKEST, *drawn}
        for each in self.wrenches:
            if each.name in taken:
                raise InputError(
                    f"two wrenches are named {each.name!r}: give one of them another name"
                )
            taken.add(each.name)


def with_planned_radius(fingers: FingerSettings, planned: Finger | None) -> FingerSettings:
    """Give fingertips the radius that grasps are planned for, unless they have their own."""
    if planned is None or fingers.fingertip_radius_m is not None:
        return fingers
    return replace(fingers, fingertip_radius_m=planned.radius_m)


def setup_from_file(path: Path, setup: Setup) -> Setup:
    """Read settings from a TOML file and put them in place of those in `setup`.

    Its tables are `physics`, `fingers`, `hold`, `limit` and `friction`; all are optional.
    """
    tables = read_tables(path)
    with about(path):
        return Setup.of_table(tables, usual=setup)


def physics_from_file(path: Path) -> dict[str, Any]:
    """Read the settings in the table `physics` of a file, by name."""
    tables = read_tables(path)
    with about(path):
        given = named(tables, ("physics",), "").get("physics", {})
        if "gravity" in given:
            raise InputError(
                "physics.gravity is that of the earth; leave it out, and give its direction with "
                "--down"
            )
        checked = PhysicsSettings.of_table(given, "physics")
    return {name: getattr(checked, name) for name in given}


MOST_WRENCHES = 10_000


@declared
class GivenWrench(Declared):
    """A wrench of a file."""

    name: str
    """Up to 100 letters, digits, '_', '+', '-' and spaces."""
    force_n: Vector
    """Force in the object's frame."""
    torque_n_m: Vector = (0.0, 0.0, 0.0)
    """Torque about the centre of mass, in the object's frame."""


@declared
class WrenchFile(Declared):
    """The wrenches of a file, all with different names."""

    wrenches: Annotated[tuple[GivenWrench, ...], Len(1, MOST_WRENCHES)]
    """Wrenches that each grasp must hold in full."""

    def _check_together(self) -> None:
        names: set[str] = set()
        for number, each in enumerate(self.wrenches):
            if each.name in names:
                raise InputError(
                    f"wrenches[{number}].name: expected wrenches with different names, got two "
                    f"named {shown(each.name)}"
                )
            names.add(each.name)


def wrenches_from_file(path: Path) -> tuple[NamedWrench, ...]:
    """Read the wrenches of a file."""
    text = read_text(path)
    with about(path):
        return wrenches_from_json(text)


def wrenches_from_json(text: str) -> tuple[NamedWrench, ...]:
    """Parse the wrenches in the text of a file."""
    given = from_record(WrenchFile, object_of(text, WRENCH_FILE))
    return tuple(
        NamedWrench(each.name, np.array([*each.force_n, *each.torque_n_m]))
        for each in given.wrenches
    )


def weights(
    weight_n: float, downs: tuple[tuple[float, float, float], ...]
) -> tuple[NamedWrench, ...]:
    """Turn the object's weight into wrenches, one for each direction of gravity."""
    ways = [np.array(down) for down in downs] or [*np.eye(3), *-np.eye(3)]
    return tuple(
        NamedWrench(
            f"weight_{place}", np.concatenate([weight_n * way / np.linalg.norm(way), np.zeros(3)])
        )
        for place, way in enumerate(ways)
    )
