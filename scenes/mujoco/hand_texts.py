"""Writes a hand as the text of a file, so that it is read like any other hand's file."""

import numpy as np

from grasp_core.hands.hand import Hand
from scenes.hand_files.model_text import ModelText
from scenes.mujoco.chains import HandChains, hand_inertials
from scenes.mujoco.mjcf_text import (
    COMPILER,
    FINGERTIP_BIT,
    add_element,
    document,
    element,
    printable,
)
from scenes.mujoco.published_tests import HandServos, is_covered


def text_of_hand(hand: Hand, servos: HandServos) -> ModelText:
    """Write a hand as MJCF; the palm has the pose in its world that it has in its root."""
    used = [place for place, finger in enumerate(hand.fingers) if not is_covered(finger)]
    limits = [joint.torque_limit_n_m for joint in hand.free_joints]
    chains = HandChains(
        hand=hand, angles=np.zeros(len(hand.joints)), palm_pose=servos.root,
        used_fingers=tuple(used),
        limits=None if None in limits else np.array(limits, np.float64),
        servo_n_m_per_rad=servos.stiffness_n_m_per_rad, armature_kg_m2=0.0,
        damping_n_m_s_per_rad=servos.least_damping_n_m_s_per_rad, stops=True,
        inertials={**hand_inertials(hand), **servos.inertials},
    )  # fmt: skip
    parts = {tag: element(tag, {}) for tag in ("asset", "worldbody", "contact", "actuator")}
    chains.add_to(parts, parts["worldbody"], [{"conaffinity": FINGERTIP_BIT}] * len(used), {})
    root = element("mujoco", {"model": printable(hand.name)})
    add_element(root, "compiler", COMPILER)
    root.inside.extend(part for part in parts.values() if part.inside)
    return ModelText(document(root), files={}, unread={})
