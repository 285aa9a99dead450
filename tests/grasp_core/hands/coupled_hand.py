"""A gripper with three fingers that curl as they bend, and where it stands on a small box."""

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import grasp_core as gc
import scenes
from grasp_core.hands.hand import Coupling
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled
from tests.three_fingers import THREE_TIPS, three_fingers_file

CURLS = tuple(
    Coupling(f"{finger}_curl", f"{finger}_bend", ratio, offset)
    for finger, ratio, offset in (("thumb", 1.2, -0.1), ("left", 0.8, -0.2), ("right", 0.8, -0.2))
)
SPREAD = Coupling("right_spread", "left_spread", -1.0)
OBJECT, RADIUS = "box", 0.035


@cache
def coupled_hand(spreading=False):
    """The gripper, which has five motors for eight joints; or four, where two fingers spread."""
    with tempfile.TemporaryDirectory() as folder:
        plain = scenes.hand_from_file(three_fingers_file(Path(folder)), THREE_TIPS)
    return replace(plain, couplings=(*CURLS, SPREAD) if spreading else CURLS)


@cache
def coupled_reaches(spreading=False):
    """Where it stands in the best grasps of a small box."""
    body, hand = scaled(OBJECT, RADIUS), coupled_hand(spreading)
    found = [gc.reach_with(hand, body, g, FRICTION) for g in grasps(OBJECT, RADIUS)]
    return [each for each in found if each.reached]


def off(hand, joints):
    """The largest difference from what the couplings say."""
    angles = {joint.name: angle for joint, angle in zip(hand.joints, joints, strict=True)}
    return max(abs(angles[c.joint] - c.offset - c.ratio * angles[c.driver])
               for c in hand.couplings)  # fmt: skip
