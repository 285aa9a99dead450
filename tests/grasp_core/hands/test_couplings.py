"""Joints that follow others: hand-worked angles, poses, and torques by virtual work."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.hands.hand import Coupling
from tests.grasp_core.hands.coupled_hand import coupled_hand, coupled_reaches, off
from tests.grasp_core.hands.gripping import FRICTION, grasps, plain_hand, scaled

FALSE = {
    "unknown": (Coupling("f10", "elbow", 1.0), "single joints of the hand, got elbow"),
    "itself": (Coupling("f10", "f10", 1.0), "follow one free joint, got f10"),
    "a follower": (Coupling("f10", "f01", 1.0), "follow one free joint, got f10"),
    "two": (Coupling("f01", "f10", 1.0), "follow one free joint, got f01"),
    "no angle": (Coupling("f11", "f10", 1.0, 4.0), "got none for f10, f11"),
}


@pytest.fixture(scope="module")
def coupled():
    return coupled_hand()


@pytest.fixture(scope="module")
def reached():
    return coupled_reaches()


def test_poses_obey_couplings_and_the_ranges_of_all_joints(coupled, reached):
    assert len(reached) >= 2
    for each in reached:
        for joints in (each.joints, each.pregrasp):
            if joints is not None:
                assert off(coupled, joints) <= 1e-12
                for joint, angle in zip(coupled.joints, joints, strict=True):
                    assert joint.lowest <= angle <= joint.highest


def test_the_range_of_a_joint_ends_where_that_of_a_follower_does():
    """The follower turns by 2 q + 0.5 from -1.5 to 1.5, so that q is from -1 to 0.5."""
    hand = replace(plain_hand(), couplings=(Coupling("f01", "f00", 2.0, 0.5),))
    assert hand.ranges[:3] == pytest.approx(np.array([[-1.0, 0.5], [-1.5, 1.5], [-1.5, 1.5]]))
    back = replace(plain_hand(), couplings=(Coupling("f01", "f00", -2.0, 0.5),))
    assert back.ranges[:2] == pytest.approx(np.array([[-0.5, 1.0], [-1.5, 1.5]]))


@pytest.mark.parametrize("case", FALSE)
def test_couplings_that_cannot_be_are_refused(case):
    coupling, said = FALSE[case]
    with pytest.raises(InputError, match=said):
        replace(plain_hand(), couplings=(Coupling("f01", "f00", 1.0), coupling))


def test_followers_need_no_torque_limit(coupled, reached):
    fingers = tuple(
        replace(finger, links=tuple(
            replace(link, joint=replace(link.joint, torque_limit_n_m=None))
            if link.joint.name.endswith("curl") else link for link in finger.links
        ))
        for finger in coupled.fingers
    )  # fmt: skip
    each = reached[0]
    assert gc.hand_motors(replace(coupled, fingers=fingers), each).limits.tolist() == [0.5] * 5


def test_a_pose_that_breaks_couplings_is_refused(coupled, reached):
    joints = np.array(reached[0].joints)
    joints[1] += 0.01
    with pytest.raises(InputError, match=r"off by 0\.01 rad"):
        gc.hand_motors(coupled, replace(reached[0], joints=joints))


def test_fingers_that_curl_touch_with_blocks(coupled):
    fingers = []
    for finger in coupled.fingers:
        half = 0.55 * finger.tip.radius
        corners = half * np.array(list(product((-1.0, 1.0), repeat=3))) + finger.tip.center
        fingers.append(replace(finger, tip=replace(finger.tip, corners=corners, rounding=1e-4)))
    hand, body = replace(coupled, fingers=tuple(fingers)), scaled("box", 0.035)
    found = [gc.reach_with(hand, body, grasp, FRICTION) for grasp in grasps("box", 0.035)]
    joints = [each.joints for each in found if each.reached]
    closing = [each for each in found if each.reason != "no closure"]
    assert len(joints) == len(closing) > 1
    assert max(off(hand, each) for each in joints) <= 1e-12
