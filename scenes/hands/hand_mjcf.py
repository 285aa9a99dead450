"""Writes a hand that holds an object as MJCF text: chains of hinges with servos of limited torque.

The palm is fixed in the world. Each link is a body on a hinge, turned as in the pose, so that all
hinges stand at zero; a servo on each has the motor's torque as its `forcerange`. Fingertips are the
balls that the analysis knows, and touch pads flush with the object's faces, as fingertips on slides
do (see `scenes.mjcf`). Shapes of links may touch those of other fingers and of the palm, except
pairs that the hand lets overlap. They pass through the object: the pose is known to be clear of it,
and trials move it by micrometres. A link whose mass is not known has a small one, which gravity
does not pull.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.checked import instance, path_of
from grasp_core.files.whole_files import write_parts
from grasp_core.hands.hand import PALM, Hand, HandFinger, Link, LinkShape
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from scenes.hands.hand_layout import HandLayout, hand_layout
from scenes.mjcf import Scene, add_object, opened
from scenes.mjcf_text import Element, add_element, as_texts, document, quaternion
from scenes.physics import PhysicsSettings

SCALED = (
    "A hand holds an object. Joints stand at the angles of the pose. The object's mass and the "
    "inertia of the joints are scaled to suit the grasp; torque limits are the motors'."
)
"""Comment at the top of every scene."""
NOMINAL_KG = 1e-3
"""Mass of a link whose own is not known, or does not count [kg]."""
NOMINAL_M = 0.01
"""Radius of gyration of links [m]: small beside the inertia that servos are given."""
THIN_M = 1e-6
"""Least half-size of a box, for shapes that are flat [m]."""
SHAPES = 1 << 20
"""Bit of what the shapes of links may touch."""


IMPEDANCE = 0.999
"""Impedance of contacts. Links are light along some directions, so contacts give way by more than
under fingertips on slides, and stiff chains of joints lose force by it: with 0.99, up to half a
percent."""


def hand_physics() -> PhysicsSettings:
    """Return the settings of scenes with hands, whose contacts are harder than usual."""
    usual = PhysicsSettings()
    return replace(usual, solimp=(IMPEDANCE, IMPEDANCE, *usual.solimp[2:]))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandScene(Scene):
    """A hand that holds an object as the text of a MuJoCo model, with its numbers."""

    layout: HandLayout


def build_hand_scene(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float, *,
    down: tuple[float, float, float] | None = None, physics: PhysicsSettings | None = None,
) -> HandScene:  # fmt: skip
    """Make a MuJoCo scene of a hand that stands in a grasp.

    Args:
        hand: The hand, with a torque limit for each joint (`hand.with_torque_limits`).
        body: The object.
        reach: The pose in which the hand stands (see `gc.reach_with`).
        friction: Coulomb coefficient at every contact.
        down: Direction of gravity in the object's frame, which pulls at the links, (3,); None for
            none. The object has no weight: it is a load like any other.
        physics: Simulation settings; gravity in them is replaced by that of `down`.

    Raises:
        InputError: The hand, the object or the pose do not belong together.
    """
    given = hand_physics() if physics is None else instance(physics, PhysicsSettings, "physics")
    layout = hand_layout(hand, body, reach, friction, down)
    x, y, z = layout.gravity.tolist()
    used = replace(given, gravity=(x, y, z))
    return HandScene(hand_text(layout, used), layout, used, "pads")


def limited(scene: HandScene, limits: Array, friction: float) -> HandScene:
    """Return a scene with other torque limits, (joints,) [N m], and another friction.

    All else stays as it is, stiffness and commands too.
    """
    motors = replace(scene.layout.motors, limits=limits)
    layout = replace(scene.layout, motors=motors, friction=friction)
    return HandScene(hand_text(layout, scene.physics), layout, scene.physics, "pads")


def write_hand_scene(scene: HandScene, path: str | Path) -> Path:
    """Write the scene's text to a file and return its path.

    Raises:
        InputError: `scene` is not a scene, or `path` is not a path.
    """
    instance(scene, HandScene, "scene", "build_hand_scene makes one")
    return write_parts(path_of(path, "path"), [scene.xml.encode()])


def hand_text(layout: HandLayout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of a hand's layout; equal layouts give equal texts."""
    root, world = opened(layout, physics, SCALED)
    contact = as_texts(physics.contact())
    add_object(world, layout, contact, weightless=bool(layout.gravity.any()))
    add_hand(root, world, layout, physics)
    return document(root)


def add_hand(
    root: Element, world: Element, layout: HandLayout, physics: PhysicsSettings,
    shapes: dict[str, str] | None = None,
) -> None:  # fmt: skip
    """Add the hand with its servos to a scene.

    Args:
        root: The scene.
        world: Its world, to which the palm is fixed.
        layout: The hand's pose and servos.
        physics: Settings of the contacts of fingertips.
        shapes: Attributes that the shapes of links have besides their own.
    """
    contact, other = as_texts(physics.contact()), shapes or {}
    pose = layout.palm_pose
    palm = add_element(world, "body", {"name": PALM, **_placed(pose[:3, 3], pose[:3, :3])})
    for place, shape in enumerate(layout.hand.palm):
        _shape(palm, f"{PALM}_{place}", shape, other)
    angles = iter(layout.joints.tolist())
    for number, finger in enumerate(layout.hand.fingers):
        _finger(palm, layout, (number, finger), angles, (contact, other))
    _exclusions(add_element(root, "contact", {}), layout.hand)
    actuators = add_element(root, "actuator", {})
    for joint, limit in zip(layout.hand.joints, layout.motors.limits.tolist(), strict=True):
        _servo(actuators, layout, joint.name, limit)


def _placed(position: Array, rotation: Array) -> dict[str, object]:
    return {"pos": to_digits(position), "quat": quaternion(rotation)}


def _finger(
    palm: Element, layout: HandLayout, numbered: tuple[int, HandFinger], angles: Iterator[float],
    contacts: tuple[dict[str, str], dict[str, str]],
) -> None:  # fmt: skip
    """Add a finger; `contacts` are attributes of what touches: the fingertip, and other shapes."""
    (number, finger), (contact, other) = numbered, contacts
    parent = palm
    for link in finger.links:
        parent = _link(parent, layout, link, next(angles), other)
    touching = [place for place, used in enumerate(layout.used_fingers) if used == number]
    tip = {"name": f"tip_{finger.name}", "type": "sphere", "size": finger.tip.radius,
           "pos": finger.tip.center, "contype": 0, "conaffinity": 0, "mass": 0.0, "group": 0,
           "friction": (layout.friction, layout.torsion_m, 0.0),
           "rgba": (0.8, 0.25, 0.2, 1.0)}  # fmt: skip
    if touching:
        tip["conaffinity"] = 1 << touching[0]
    add_element(parent, "geom", tip | contact)


def _link(
    parent: Element, layout: HandLayout, link: Link, angle: float, other: dict[str, str]
) -> Element:
    joint, mass, center = link.joint, NOMINAL_KG, np.zeros(3)
    pulled = bool(layout.gravity.any())
    if pulled and link.mass_kg is not None and link.center_of_mass is not None:
        mass, center = link.mass_kg, link.center_of_mass
    turned = joint.rotation @ rotation_about(joint.axis, angle)
    lifted = 0.0 if pulled else 1.0
    body = add_element(
        parent, "body",
        {"name": link.name, "gravcomp": lifted, **_placed(joint.position, turned)},
    )  # fmt: skip
    add_element(
        body, "joint",
        {"name": joint.name, "type": "hinge", "axis": joint.axis, "pos": (0.0, 0.0, 0.0),
         "limited": "false", "damping": 0.0, "stiffness": 0.0,
         "armature": layout.armature_kg_m2, "frictionloss": 0.0},
    )  # fmt: skip
    inertia = (mass * NOMINAL_M**2,) * 3
    add_element(body, "inertial", {"pos": center, "mass": mass, "diaginertia": inertia})
    for place, shape in enumerate(link.shapes):
        _shape(body, f"{link.name}_{place}", shape, other)
    return body


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the rotation by an angle about a unit axis, (3, 3)."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across


def _shape(body: Element, name: str, shape: LinkShape, other: dict[str, str]) -> None:
    """Add a shape: a ball, a capsule, or the box inside a rounded one that meets its corners."""
    long = np.flatnonzero(shape.half_sizes > 0.0)
    own: dict[str, object] = {"name": name, "contype": SHAPES, "conaffinity": SHAPES,
                              "mass": 0.0, "group": 2, "rgba": (0.62, 0.66, 0.72, 1.0)}  # fmt: skip
    turned = shape.rotation
    if not long.size:
        own |= {"type": "sphere", "size": shape.radius}
    elif long.size == 1 and shape.radius:
        axis = int(long[0])
        turned = turned[:, [(axis + 1) % 3, (axis + 2) % 3, axis]]
        own |= {"type": "capsule", "size": (shape.radius, shape.half_sizes[axis])}
    else:
        own |= {
            "type": "box",
            "size": np.maximum(shape.half_sizes + shape.radius / math.sqrt(3.0), THIN_M),
        }
    add_element(body, "geom", own | other | _placed(shape.position, turned))


def _exclusions(contact: Element, hand: Hand) -> None:
    """Let neighbours of a chain overlap, and what the hand lets overlap."""
    pairs = {tuple(sorted(pair)) for pair in hand.ignored_pairs}
    for finger in hand.fingers:
        chain = [PALM, *(link.name for link in finger.links)]
        pairs |= {tuple(sorted(pair)) for pair in pairwise(chain)}
    for one, other in sorted(pairs):
        add_element(contact, "exclude", {"body1": one, "body2": other})


def _servo(actuators: Element, layout: HandLayout, name: str, limit: float) -> None:
    servo = {
        "name": name, "joint": name, "kp": layout.servo_n_m_per_rad,
        "kv": layout.damping_n_m_s_per_rad, "ctrllimited": "false", "forcelimited": "true",
        "forcerange": (-limit, limit),
    }  # fmt: skip
    add_element(actuators, "position", servo)
