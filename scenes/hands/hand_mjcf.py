"""Writes a hand that holds an object as MJCF text: chains of hinges with servos of limited torque.

The palm is fixed in the world. Each link is a body on a hinge, turned as in the pose, so that all
hinges stand at zero; a servo on each has the motor's torque as its `forcerange`. Fingertips are the
balls that the analysis knows, and touch pads flush with the object's faces, as fingertips on slides
do (see `scenes.mjcf`). Shapes of links pass through the object: the pose is known to be clear of
it, and trials move it by micrometres. A link whose mass is not known has a small one, which gravity
does not pull.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from grasp_core.arrays import Array
from grasp_core.checked import instance, path_of
from grasp_core.files.text_files import write_parts
from grasp_core.hands.hand import PALM, Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from scenes.hands.chains_mjcf import (
    Chains,
    add_exclusions,
    add_fingers,
    add_servo,
    placed,
)
from scenes.hands.hand_layout import HandLayout, hand_layout
from scenes.mjcf import Scene, add_object, opened
from scenes.mjcf_text import Element, add_element, as_texts, document
from scenes.physics import PhysicsSettings

SCALED = (
    "A hand holds an object. Joints stand at the angles of the pose. The object's mass and the "
    "inertia of the joints are scaled to suit the grasp; torque limits are the motors'."
)
"""Comment at the top of every scene."""
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
    _add_hand(root, world, layout, physics)
    return document(root)


def _add_hand(root: Element, world: Element, layout: HandLayout, physics: PhysicsSettings) -> None:
    """Add the hand with its servos to a scene; the palm is fixed to its world."""
    contact = as_texts(physics.contact())
    pose = layout.palm_pose
    palm = add_element(world, "body", {"name": PALM, **placed(pose[:3, 3], pose[:3, :3])})
    tips = tuple(_tip(layout, number, contact) for number in range(len(layout.hand.fingers)))
    chains = Chains(
        layout.hand, layout.joints, layout.armature_kg_m2, tips, weighs=bool(layout.gravity.any())
    )
    add_fingers(palm, chains)
    add_exclusions(add_element(root, "contact", {}), layout.hand)
    actuators = add_element(root, "actuator", {})
    for joint, limit in zip(layout.hand.joints, layout.motors.limits.tolist(), strict=True):
        add_servo(
            actuators, joint.name, layout.servo_n_m_per_rad, layout.damping_n_m_s_per_rad, limit
        )


def _tip(layout: HandLayout, finger: int, contact: Mapping[str, object]) -> Mapping[str, object]:
    """Return what a fingertip touches: the pad at its contact, if it has one."""
    touching = [place for place, used in enumerate(layout.used_fingers) if used == finger]
    pads = {"conaffinity": 1 << touching[0]} if touching else {}
    return {"friction": (layout.friction, layout.torsion_m, 0.0), **contact, **pads}
