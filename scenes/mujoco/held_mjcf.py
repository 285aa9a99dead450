"""Writes a scene of execution as MJCF text: a free object, fingers on springs, a palm, a table.

The palm moves on three slides and three hinges whose armature is `PALM_ARMATURE` times the mass it
carries, so a force of armature times acceleration moves it on any path, and what it holds hardly
moves it. Fingers are its children: their bases accelerate with it. Fingertips touch the object's
own surface (see `surface`). The table touches the object's convex hull, and is far away until a
trial puts it under the object.

The friction of a contact is that of its fingertip; the object's own is zero, of which MuJoCo takes
the larger.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.execution.grips import Grip
from grasp_core.kinds import instance
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.held import HeldLayout, held_layout
from scenes.mujoco.mjcf_text import Element, SceneText, add_element, document, quaternion
from scenes.mujoco.physics import add_free_body, add_light, begin_scene
from scenes.settings import HeldSettings, PhysicsSettings

PALM_ARMATURE = 1e7
"""Armature of the palm's joints, relative to what the palm carries."""
PALM_SHARE = 1e-3
"""Mass of the palm itself, relative to the object's: a moving body must have one."""
FINGERTIPS, TABLE = 1, 2
AWAY = 100.0
"""Distance of the table until it is needed, in object radii."""
TRUE_MASS = (
    "The object has its true mass and is under gravity. Start from the keyframe `squeeze`, whose "
    "commands make the fingers hold it; with commands of zero they do not push."
)
SPRINGS = ("a", "b", "c")
"""Endings of the names of a fingertip's three slides."""
SAMPLE_S = 0.005
"""Duration of a sample: what is applied changes, and motion is recorded, once per sample [s]."""
FEWEST_STEPS, MOST_STEPS = 4, 128
"""Least and largest number of steps in a sample."""
STEP_RAD = 0.2
"""Largest angle by which the held object rings in a step: frequencies are then off by a fifth of a
percent."""
STEP_TIP = 0.8
"""Largest product of a step and a loose fingertip's rate: above two, it would never come to rest,
and contacts that slide slide farther the larger it is."""
ROUNDING = 1e-6
"""Part of a step that rounding may add to the number that is needed."""
CONTACT_STEPS = 2.0
"""Time constant of contacts, in steps; the simulator takes no less. With twice as much, contacts
that slide go half as far again beyond what they would with short steps."""
CONTACT_GIVE = 2e-3
"""Largest give of contacts at rest, relative to that of the springs behind them. Lightly pressed
contacts of light objects give the most, and their pushes would be off by as much."""
LEAST_GIVE = 1e-4
"""Least part of a contact's impedance that gives: the simulator takes no less."""
FLAGS = {"midphase": "disable", "island": "disable"}
"""MuJoCo's search for pairs within two bodies misses contacts that are less deep than a
ten-thousandth of the object, as all are here: objects on tables would fall, touch, and chatter. Its
search for parts that do not touch each other costs time, and finds one part."""
PALM = ("x", "y", "z", "about_x", "about_y", "about_z")
"""Endings of the names of the palm's slides and hinges, in the order of its joints."""


def held_physics(layout: HeldLayout) -> PhysicsSettings:
    """Return the settings of execution, in which contacts are harder than in closure tests.

    Where a contact is less than 2 micrometres deep, its impedance is less: a tip that slides on its
    springs while the palm turns has an acceleration that the simulator's contacts do not know, and
    would leave a surface that is as hard at once.

    Speeds are advanced first, with the forces of the old positions, and positions with the new
    speeds (semi-implicit Euler): a ring of frequency w appears faster by (w h)^2 / 24 with steps
    of h, and w h is `STEP_RAD` at most for the fastest ring of the held object. MuJoCo's implicit
    integrators make it slower by up to eight times as much, or let contacts chatter. Contacts
    settle in `CONTACT_STEPS` steps: their stiffness goes with the tip's mass over the square of
    that time, and so stays in proportion to the springs'. With the impedance d they give by
    (1 - d) (`CONTACT_STEPS` w h)^2 of what the springs give, a hundredth of a percent.
    """
    x, y, z = layout.gravity.tolist()
    rate = max(layout.fastest_ring / STEP_RAD, layout.fastest_tip / STEP_TIP)
    steps = math.ceil(SAMPLE_S * rate - ROUNDING)
    steps = min(max(steps, FEWEST_STEPS), MOST_STEPS)
    step = SAMPLE_S / steps
    settling = CONTACT_STEPS * step
    moved = 1.0 / (1.0 / layout.tip_mass_kg + 3.0 / layout.object_kg)
    give = max(CONTACT_GIVE * moved / (layout.stiffest * settling**2), LEAST_GIVE)
    return PhysicsSettings(
        timestep=step, integrator="Euler", impratio=300.0, gravity=(x, y, z),
        solimp=(1.0 - min(0.005, give), 1.0 - min(0.0005, give), 2e-6, 0.5, 1.0),
        solref=(settling, 1.0),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HeldScene(SceneText):
    """A held object as the text of a MuJoCo model, with the numbers it was made from."""

    layout: HeldLayout
    physics: PhysicsSettings


def build_held_scene(
    body: Polyhedron,
    grip: Grip,
    settings: HeldSettings,
    *,
    physics: PhysicsSettings | None = None,
    reach_m: float | None = None,
) -> HeldScene:
    """Make a MuJoCo scene of an object with its true mass, held by a grip.

    Args:
        body: The object.
        grip: Contacts on it, with springs and squeeze (see `gc.grip`).
        settings: Masses of object and fingers, damping, and the direction of gravity.
        physics: Simulation settings; None for those of `held_physics`.
        reach_m: Distance from the contacts up to which the surface is there to be touched; None for
            the object's radius. Scans with thousands of triangles are slow where it is large [m].

    Raises:
        InputError: A number is out of range.
    """
    layout = held_layout(body, grip, settings, reach_m)
    if physics is None:
        physics = held_physics(layout)
    elif not np.array_equal(instance(physics, PhysicsSettings, "physics").gravity, layout.gravity):
        raise InputError(
            f"physics.gravity must be that of the settings, {layout.gravity.tolist()}, "
            f"got {physics.gravity}"
        )
    physics.require_hard(
        "here", "squeezes and payloads are predicted for hard fingertips; leave it out, or "
        "simulate the grasp with validate",
    )  # fmt: skip
    return HeldScene(held_text(layout, physics), layout, physics)


def held_text(layout: HeldLayout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of a held object; equal layouts give equal texts."""
    root, world = opened(layout, physics)
    palm = add_palm(world, layout)
    for finger in range(len(layout.contacts)):
        _finger(palm, layout, physics, finger)
    actuators = add_element(root, "actuator", {})
    for finger in range(len(layout.contacts)):
        _springs(actuators, layout, finger)
    add_start(root, layout)
    return document(root)


def opened(layout: HeldLayout, physics: PhysicsSettings) -> tuple[Element, Element]:
    """Open a model with options, the object and the table; return it and its world."""
    mesh = (layout.vertices, layout.triangles)
    root, world = begin_scene(
        layout.name, TRUE_MASS, physics, layout.radius_m, mesh, flags=FLAGS, solids=layout.solids
    )
    add_light(world, layout.radius_m)
    body, contact = add_free_body(world, layout.object_kg, layout.inertia_kg_m2), physics.contact()
    smooth = {"conaffinity": 0, "friction": (0.0, 0.0, 0.0), "mass": 0.0, **contact}
    hull = {"name": "object", "type": "mesh", "mesh": "object", "contype": TABLE, "group": 1,
            "rgba": (0.55, 0.62, 0.70, 0.6)}  # fmt: skip
    add_element(body, "geom", {**hull, **smooth})
    for place in range(len(layout.solids)):
        name = f"surface{place}"
        solid = {"name": name, "type": "mesh", "mesh": name, "contype": FINGERTIPS, "group": 3,
                 "rgba": (0.9, 0.6, 0.2, 0.3)}  # fmt: skip
        add_element(body, "geom", {**solid, **smooth})
    away = AWAY * layout.radius_m * np.array([0.0, 0.0, -1.0])
    table = add_element(world, "body", {"name": "table", "mocap": "true", "pos": away})
    plane = {"name": "table", "type": "plane", "size": (10.0 * layout.radius_m,) * 2 + (0.01,),
             "contype": 0, "conaffinity": TABLE, "friction": (layout.friction.max(), 0.0, 0.0),
             "rgba": (0.8, 0.78, 0.74, 1.0)}  # fmt: skip
    add_element(table, "geom", plane | contact)
    return root, world


def add_start(root: Element, layout: HeldLayout) -> None:
    """Add the keyframe of a squeezed object, with the commands that squeeze."""
    told = layout.commands(np.ones((1, 1)), None)[0]
    home = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], np.zeros(6)])
    rest = np.concatenate([home, np.zeros(len(told))])
    keys = add_element(root, "keyframe", {})
    add_element(keys, "key", {"name": "squeeze", "qpos": rest, "ctrl": told})


def palm_armature(layout: HeldLayout) -> Array:
    """Return the armature of the palm's slides and hinges, (6,) [kg, kg m^2]."""
    carried = layout.object_kg + len(layout.contacts) * layout.tip_mass_kg
    slides = PALM_ARMATURE * carried
    return np.repeat([slides, slides * layout.radius_m**2], 3)


def add_palm(world: Element, layout: HeldLayout, name: str = "palm") -> Element:
    """Add the body that moves on slides and hinges, and return it."""
    body = add_element(world, "body", {"name": name, "pos": (0.0, 0.0, 0.0), "gravcomp": 1.0})
    for place, (way, armature) in enumerate(zip(PALM, palm_armature(layout), strict=True)):
        kind, axis = ("slide", "hinge")[place // 3], np.eye(3)[place % 3]
        _joint(body, {"name": f"palm_{way}", "type": kind, "axis": axis, "armature": armature})
    mass = PALM_SHARE * layout.object_kg
    inertia = (mass * layout.radius_m**2,) * 3
    own = {"pos": (0.0, 0.0, 0.0), "mass": mass, "diaginertia": inertia}
    add_element(body, "inertial", own)
    return body


def _joint(body: Element, attributes: dict[str, object]) -> None:
    plain = {"pos": (0.0, 0.0, 0.0), "limited": "false", "damping": 0.0, "stiffness": 0.0,
             "armature": 0.0, "frictionloss": 0.0}  # fmt: skip
    add_element(body, "joint", plain | attributes)


def _finger(palm: Element, layout: HeldLayout, physics: PhysicsSettings, finger: int) -> None:
    name, radius = f"finger{finger}", layout.tip_radius_m[finger]
    pose = {"pos": layout.tip_centers[finger], "quat": quaternion(layout.axes[finger])}
    body = add_element(palm, "body", {"name": name, "gravcomp": 1.0} | pose)
    for spring, axis in zip(SPRINGS, np.eye(3), strict=True):
        _joint(body, {"name": f"{name}_{spring}", "type": "slide", "axis": axis})
    inertia = (0.4 * layout.tip_mass_kg * radius**2,) * 3
    own = {"pos": (0.0, 0.0, 0.0), "mass": layout.tip_mass_kg, "diaginertia": inertia}
    add_element(body, "inertial", own)
    tip = {"name": name, "type": "sphere", "size": radius, "contype": 0,
           "conaffinity": FINGERTIPS, "friction": (layout.friction[finger], 0.0, 0.0),
           "mass": 0.0, "group": 0, "rgba": (0.8, 0.25, 0.2, 1.0)}  # fmt: skip
    add_element(body, "geom", tip | physics.contact())


def _springs(actuators: Element, layout: HeldLayout, finger: int) -> None:
    for place, spring in enumerate(SPRINGS):
        name = f"finger{finger}_{spring}"
        own = {"kp": layout.stiffness[finger, place], "kv": layout.damping[finger, place]}
        unlimited = {"ctrllimited": "false", "forcelimited": "false"}
        add_element(actuators, "position", {"name": name, "joint": name} | own | unlimited)
