"""Published tests of grasps that run in MuJoCo, as values: loads, durations, thresholds, sources.

Fingers close and squeeze, then the object goes through runs, each from the squeezed grasp anew. A
run is a sequence of steps: a force on the object, a motion of the palm, or nothing. Directions are
those of the object's frame, whose z axis points up.
"""

import math
from dataclasses import field, replace
from itertools import chain
from typing import TypeAlias

import numpy as np

from grasp_core.allowed_values import Number, OrInfinity, one_of
from grasp_core.arrays import Array
from grasp_core.by_value import summary
from grasp_core.declared import Declared, declared
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.chains import Weld
from scenes.mujoco_options import PhysicsSettings

Triple: TypeAlias = tuple[float, float, float]
NOWHERE: Triple = (0.0, 0.0, 0.0)


@declared
class PublishedSource(Declared):
    """Files of a public repository in which a test is stated."""

    repository: str
    commit: str
    paths: tuple[str, ...]


@declared
class Step(Declared):
    """A part of a run: what acts on the object, and how the palm moves, for some time."""

    seconds: float
    pull_m_s2: Triple = NOWHERE
    """Force on the object over its mass [m/s^2]."""
    line_m: Triple = NOWHERE
    """Distance that the palm moves at constant speed [m]."""
    wave_m: Triple = NOWHERE
    """Amplitude of one sine of the palm [m]."""
    turn_deg: float = 0.0
    """Angle by which the palm turns about z at constant speed [deg]."""
    look_s: float | None = None
    """Time between looks at the object [s]; None to look at the end only."""

    def force(self, mass_kg: float) -> Array:
        """Return the force on an object of a mass, (3,) [N]."""
        return mass_kg * np.array(self.pull_m_s2)


ProtocolRun: TypeAlias = tuple[Step, ...]


@declared
class Passing(Declared):
    """When a run passes; displacement and turn count from before the fingers close."""

    most_m: OrInfinity = math.inf
    """Displacement below which a look passes [m]."""
    most_deg: OrInfinity = math.inf
    fingers: Number = 0
    most_overlap_m: float | None = None
    """Overlap of hand and object before closing up to which a grasp is tested at all [m]; None
    where the test does not ask."""


@declared
class PublishedProtocol(Declared):
    """The test of another tool as it is published."""

    name: str
    version: str
    """Which version of the test: branch or paper."""
    sources: tuple[PublishedSource, ...]
    ours: tuple[str, ...]
    """What is not as published here although it could be, or is not stated there; sentences."""
    friction: float
    timestep_s: float
    """Length of a step of its own simulator [s]."""
    runs: tuple[ProtocolRun, ...]
    passing: Passing
    mass_kg: float | None = None
    """Mass of every object [kg]; None where none is stated, and objects have water's density."""
    close_s: float = 0.0
    """Time in which fingers move from the open grasp to the contacts [s]; 0 to start there."""
    squeeze_s: float = 0.0
    """Time in which fingers begin to push [s]; 0 for at once."""
    servo_n_m_per_rad: float = 5.0
    """Stiffness of the servos of a hand's joints."""
    own_servos: bool = False
    """Whether hands whose files are known have the stiffness of these instead."""
    weld: Weld | None = None
    """What holds the root of a hand; None where its palm is fixed."""
    physics: PhysicsSettings = field(default_factory=PhysicsSettings)
    """Settings of MuJoCo, as published; the Jacobian is dense whatever the size of a hand."""

    def __repr__(self) -> str:
        return summary("PublishedProtocol", self.name, self.version, runs=len(self.runs))

    def mass_of(self, body: Polyhedron) -> float:
        """Return the mass that an object has in this test [kg].

        Raises:
            InputError: The test states no mass, and the object's volume is not known.
        """
        return body.mass_at(ASSUMED_DENSITY) if self.mass_kg is None else self.mass_kg

    def forces(self, mass_kg: float) -> tuple[Array, ...]:
        """Return the different forces that act on an object of a mass, (3,) each [N]."""
        found: dict[Triple, Array] = {}
        for step in chain.from_iterable(self.runs):
            force = step.force(mass_kg)
            x, y, z = force.tolist()
            if force.any():
                found.setdefault((x, y, z), force)
        return tuple(found.values())


ASSUMED_DENSITY = 1000.0
"""Density of objects whose mass a test does not state [kg/m^3]: that of water."""
SIX: tuple[Triple, ...] = (
    (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0),
    (0.0, 0.0, 1.0),
)  # fmt: skip
"""Directions along and against the axes, in the order of DexGraspBench."""


def _scaled(way: Triple, size: float) -> Triple:
    x, y, z = way
    return size * x, size * y, size * z


def _pulls(acceleration: float, seconds: float, look_s: float) -> tuple[ProtocolRun, ...]:
    return tuple(
        (Step(seconds, pull_m_s2=_scaled(way, acceleration), look_s=look_s),) for way in SIX
    )


DEX_PHYSICS = PhysicsSettings(
    timestep=0.004, integrator="implicitfast", impratio=10.0, noslip_iterations=2, torsion_m=0.02,
    tolerance=1e-8, solref=(0.0125, 1.0), solimp=(0.7, 0.97, 0.00055, 0.5, 2.0),
    ccd_iterations=50, multiccd=False,
)  # fmt: skip
"""Settings of DexGraspBench and Dexonomy. Contacts of a hand's geoms (solref 0.005 1, solimp 0.5
0.99 0.0001) with those of an object (MuJoCo's defaults, 0.02 1 and 0.9 0.95 0.001) are mixed by
MuJoCo: half of each. Shapes touch at one point, as in the version 3.3.2 that DexGraspBench asks
for: several points alone change 7 of 96 of its verdicts."""
DEX_OURS = (
    "What moves by less than 5 cm is the centre of mass, where theirs is the origin of the mesh.",
    "Convex objects are themselves, and others are covered with thin convex solids, where theirs "
    "are unions of convex pieces.",
)
DEX_LIMITS = Passing(most_m=0.05, most_deg=15.0, most_overlap_m=0.01)
ALLEGRO_FILE = "assets/hand/allegro/right_hand.xml"
DEXGRASPBENCH = PublishedProtocol(
    name="dexgraspbench",
    version="branch main",
    sources=(
        PublishedSource(
            "JYChen18/DexGraspBench", "1e7a5a6fce27cc92911080cbdc5ce9da56fddbf0",
            ("config/task/eval.yaml", "src/task/eval_func/fc_mocap.py",
             "src/task/eval_func/base.py", "src/util/hand_util.py", ALLEGRO_FILE),
        ),
    ),
    ours=DEX_OURS,
    friction=0.6,
    timestep_s=0.004,
    mass_kg=0.1,
    close_s=0.4,
    squeeze_s=0.4,
    servo_n_m_per_rad=5.0,
    own_servos=True,
    weld=Weld(),
    runs=_pulls(10.0, 2.0, 0.2),
    passing=DEX_LIMITS,
    physics=DEX_PHYSICS,
)  # fmt: skip
DEXGRASPBENCH_PAPER = replace(
    DEXGRASPBENCH,
    name="dexgraspbench-paper",
    version="branch baseline, the benchmark of the BODex paper (arXiv 2412.16490)",
    sources=(
        PublishedSource(
            "JYChen18/DexGraspBench", "9c961a4e54f1caf7d3821ccd22d142185f083607",
            ("config/task/eval.yaml", "src/task/eval_func/fc_mocap.py", ALLEGRO_FILE),
        ),
        PublishedSource(
            "JYChen18/DexGraspBench", "1e7a5a6fce27cc92911080cbdc5ce9da56fddbf0", ("README.md",)
        ),
    ),
    ours=(
        *DEX_OURS,
        "The servos' stiffness is the 1 that the README of the main branch gives for the paper; "
        "the stored branch has 2 for Allegro and 5 for Shadow.",
    ),
    mass_kg=0.03,
    servo_n_m_per_rad=1.0,
    own_servos=False,
)  # fmt: skip
DEXONOMY = PublishedProtocol(
    name="dexonomy",
    version="branch main, tasks of the type force_closure, hard: False",
    sources=(
        PublishedSource(
            "JYChen18/Dexonomy", "d561ff9df8545deef7a3f9e7cfb4045ef66f6913",
            ("dexonomy/config/op/eval.yaml", "dexonomy/config/base.yaml",
             "dexonomy/op/eval_data.py", "dexonomy/sim/mujoco_env.py",
             "dexonomy/util/traj_util.py"),
        ),
    ),
    ours=(
        *DEX_OURS,
        "The palm is fixed, where theirs is welded softly to a body that moves.",
    ),
    friction=0.6,
    timestep_s=0.004,
    mass_kg=0.1,
    close_s=0.1,
    squeeze_s=0.1,
    servo_n_m_per_rad=5.0,
    runs=_pulls(9.8, 2.0, 0.2),
    passing=Passing(most_m=0.05, most_deg=15.0),
    physics=DEX_PHYSICS,
)  # fmt: skip
SHAKE_M = 0.02
MJ_GRASP_SIM = PublishedProtocol(
    name="mj-grasp-sim",
    version="branch main, grasp_stability_evaluation_from_joints with its defaults",
    sources=(
        PublishedSource(
            "freiberg-roman/mj-grasp-sim", "efff5b32102d1675f64ce8a3984d46be56dff064",
            ("mgs/env/gravityless_object_grasping.py", "mgs/obj/ycb.py"),
        ),
    ),
    ours=(
        "Lift and shakes are forces on the object, by its mass and the palm's acceleration.",
        "Steps between looks in a shake are their ends, and every 0.1 s in the lift.",
        "Contacts have the object's settings, which theirs mix with those of each gripper.",
        "Objects have the density of water where theirs are weighed.",
    ),
    friction=1.0,
    timestep_s=0.001,
    close_s=0.4,
    squeeze_s=0.4,
    runs=(
        (
            Step(3.0, line_m=(0.0, 0.0, 0.1), look_s=0.1),
            Step(0.5, line_m=(0.0, 0.0, -SHAKE_M)),
            Step(0.5, line_m=(0.0, SHAKE_M, 0.0)),
            Step(1.0, line_m=(0.0, -2.0 * SHAKE_M, 0.0)),
        ),
    ),
    passing=Passing(fingers=1),
    physics=PhysicsSettings(
        timestep=0.001, integrator="implicitfast", impratio=3.0, noslip_iterations=2,
        noslip_tolerance=1e-8, tolerance=1e-8, torsion_m=0.3,
        solref=(0.001, 1.0), solimp=(0.998, 0.998, 0.001, 0.5, 2.0),
    ),
)  # fmt: skip
WAVE_S = 4.0
"""Duration of a shake: twice 1,000 steps of 2 ms."""
WAVE_M = 0.1
QUARTER_S = WAVE_S / 4.0
REST_S = 0.1
MOLMOSPACES = PublishedProtocol(
    name="molmospaces",
    version="branch main, run_rigid.py with its defaults",
    sources=(
        PublishedSource(
            "allenai/molmospaces", "1320b266d2b47aaa81c5f7a419cb9d3474e6994d",
            ("molmo_spaces/grasp_generation/main_scene.xml",
             "molmo_spaces/grasp_generation/run_rigid.py",
             "molmo_spaces/grasp_generation/pipeline/perturbations_test.py"),
        ),
    ),
    ours=(
        "Shakes and the turn are forces on the object, by its mass and the palm's acceleration.",
        "Both fingers of a gripper are two fingers here, whichever they are.",
        "Looks are at all four quarters of a shake, where theirs leave out two.",
        "The Jacobian is dense, where theirs is sparse: the same but for rounding, and right in "
        "MuJoCo 4.0.0, too.",
        "Friction and contacts are MuJoCo's defaults, as theirs come with each object's file; "
        "objects have the density of water.",
    ),
    friction=1.0,
    timestep_s=0.002,
    close_s=0.6,
    squeeze_s=0.6,
    runs=(
        (
            *(
                step
                for axis in (SIX[1], SIX[3], SIX[5])
                for step in (
                    Step(WAVE_S, wave_m=_scaled(axis, WAVE_M), look_s=QUARTER_S), Step(REST_S),
                ) * 2
            ),
            Step(10.0, turn_deg=360.0, look_s=2.5),
            Step(REST_S),
        ),
    ),
    passing=Passing(fingers=2),
    physics=PhysicsSettings(
        timestep=0.002, integrator="implicitfast", impratio=10.0, noslip_iterations=3,
        tolerance=1e-8, solref=(0.02, 1.0), solimp=(0.9, 0.95, 0.001, 0.5, 2.0),
    ),
)  # fmt: skip
PROTOCOLS = {
    protocol.name: protocol
    for protocol in (DEXGRASPBENCH, DEXGRASPBENCH_PAPER, DEXONOMY, MJ_GRASP_SIM, MOLMOSPACES)
}


def protocol_names() -> tuple[str, ...]:
    """Return the names of all published tests that grasps can be judged by."""
    return tuple(PROTOCOLS)


def protocol(name: str) -> PublishedProtocol:
    """Return a published test: its loads, durations and thresholds, with their sources.

    Args:
        name: One of `protocol_names()`.

    Raises:
        InputError: No test has this name.
    """
    one_of(name, PROTOCOLS, "name")
    return PROTOCOLS[name]
