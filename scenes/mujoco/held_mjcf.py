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
from scenes.mujoco.mjcf_text import Element, SceneText, add_element, document
from scenes.mujoco.scene_parts import (
    EXACT,
    FREE,
    HOME,
    ORIGIN,
    TABLE,
    add_fingertip,
    add_object,
    add_servo,
    begin_scene,
)
from scenes.settings import HeldSettings, PhysicsSettings

PALM_ARMATURE = 1e7
"""Armature of the palm's joints, relative to what the palm carries."""
PALM_SHARE = 1e-3
"""Mass of the palm itself, relative to the object's: a moving body must have one."""
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
    palm, actuators = add_palm(world, layout), add_element(root, "actuator", {})
    for finger, pose in enumerate(zip(layout.tip_centers, layout.axes, strict=True)):
        name, tip = f"finger{finger}", (layout.tip_mass_kg, float(layout.tip_radius_m[finger]))
        touching = {"friction": (layout.friction[finger], 0.0, 0.0), **physics.contact()}
        add_fingertip(palm, name, pose, SPRINGS, tip, touching)
        springs = zip(SPRINGS, layout.stiffness[finger], layout.damping[finger], strict=True)
        for spring, stiffness, damping in springs:
            add_servo(actuators, f"{name}_{spring}", stiffness, damping)
    add_start(root, layout)
    return document(root)


def opened(layout: HeldLayout, physics: PhysicsSettings) -> tuple[Element, Element]:
    """Open a model with options, the object and the table; return it and its world."""
    mesh = (layout.vertices, layout.triangles)
    root, world = begin_scene(
        layout.name, TRUE_MASS, physics, layout.radius_m, mesh, flags=EXACT, solids=layout.solids
    )
    contact = physics.contact()
    smooth = {"friction": (0.0, 0.0, 0.0), **contact}
    mass = layout.object_kg, layout.inertia_kg_m2
    add_object(world, mass, smooth, layout.solids, hull=TABLE)
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
    rest = np.concatenate([HOME, np.zeros(6 + len(told))])
    keys = add_element(root, "keyframe", {})
    add_element(keys, "key", {"name": "squeeze", "qpos": rest, "ctrl": told})


def palm_armature(layout: HeldLayout) -> Array:
    """Return the armature of the palm's slides and hinges, (6,) [kg, kg m^2]."""
    carried = layout.object_kg + len(layout.contacts) * layout.tip_mass_kg
    slides = PALM_ARMATURE * carried
    return np.repeat([slides, slides * layout.radius_m**2], 3)


def add_palm(world: Element, layout: HeldLayout, name: str = "palm") -> Element:
    """Add the body that moves on slides and hinges, and return it."""
    body = add_element(world, "body", {"name": name, "pos": ORIGIN, "gravcomp": 1.0})
    for place, (way, armature) in enumerate(zip(PALM, palm_armature(layout), strict=True)):
        kind, axis = ("slide", "hinge")[place // 3], np.eye(3)[place % 3]
        joint = {"name": f"palm_{way}", "type": kind, "axis": axis, "armature": armature}
        add_element(body, "joint", FREE | joint)
    mass = PALM_SHARE * layout.object_kg
    inertia = (mass * layout.radius_m**2,) * 3
    own = {"pos": ORIGIN, "mass": mass, "diaginertia": inertia}
    add_element(body, "inertial", own)
    return body
