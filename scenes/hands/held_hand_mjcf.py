"""Writes a scene in which a hand on a moving wrist holds an object of true mass, as MJCF text.

Object, table and the moving body are those of other scenes of execution (see
`scenes.execution.held_mjcf`). On that body stands the hand's palm, with its fingers as chains of
hinges; a servo on each has the motor's torque as its `forcerange`. Palm and links touch the object
where it comes to them, but for the last links, whose fingertips do.
"""

from grasp_core.execution.grips import Grip
from grasp_core.hands.hand import PALM, Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from scenes.execution.held import HeldSettings
from scenes.execution.held_mjcf import (
    FINGERTIPS,
    HeldScene,
    add_palm,
    add_start,
    held_physics,
    opened,
)
from scenes.hands.chains_mjcf import (
    Chains,
    add_exclusions,
    add_fingers,
    add_servo,
    placed,
)
from scenes.hands.held_hand import HeldHandLayout, held_hand_layout
from scenes.mjcf_text import add_element, document
from scenes.physics import PhysicsSettings

WRIST = "wrist"
LIGHT_KG = 1e-5
"""Mass of links: ten thousand times less than objects', so that no joint feels the wrist's motion
through them."""


def held_hand_scene(
    hand: Hand, body: Polyhedron, reach: HandReach, grip: Grip, mass_kg: float,
    settings: HeldSettings, reach_m: float | None = None,
) -> HeldScene:  # fmt: skip
    """Make a MuJoCo scene of an object with its true mass in a hand (see `held_hand_layout`)."""
    layout = held_hand_layout(hand, body, reach, grip, mass_kg, settings, reach_m)
    physics = held_physics(layout)
    return HeldScene(held_hand_text(layout, physics), layout, physics)


def held_hand_text(layout: HeldHandLayout, physics: PhysicsSettings) -> str:
    """Write the MJCF text of an object held by a hand; equal layouts give equal texts."""
    root, world = opened(layout, physics)
    wrist = add_palm(world, layout, WRIST)
    pose = layout.palm_pose
    palm = add_element(wrist, "body", {"name": PALM, **placed(pose[:3, 3], pose[:3, :3])})
    tips = [dict[str, object]() for _ in layout.hand.fingers]
    for contact, finger in enumerate(layout.used_fingers):
        tips[finger] = {"conaffinity": FINGERTIPS, "friction": _rubbing(layout, contact),
                        **physics.contact()}  # fmt: skip
    touching = {**physics.contact(), "friction": (float(layout.friction.max()), 0.0, 0.0)}
    chains = Chains(
        layout.hand, layout.angles, layout.armature_kg_m2, tuple(tips), light_kg=LIGHT_KG,
        touches=FINGERTIPS, contact=touching,
    )  # fmt: skip
    add_fingers(palm, chains)
    add_exclusions(add_element(root, "contact", {}), layout.hand)
    actuators = add_element(root, "actuator", {})
    limits = layout.motors.limits.tolist()
    for joint, limit in zip(layout.hand.joints, limits, strict=True):
        add_servo(
            actuators, joint.name, layout.servo_n_m_per_rad, layout.damping_n_m_s_per_rad, limit
        )
    add_start(root, layout)
    return document(root)


def _rubbing(layout: HeldHandLayout, contact: int) -> tuple[float, float, float]:
    return float(layout.friction[contact]), 0.0, 0.0
