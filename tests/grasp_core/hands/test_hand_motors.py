"""Motors of a hand: joint torques are those that a step of the joints pays for."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from tests.grasp_core.hands.gripping import lifting_work, material_point, reaches

STEP = 1e-6
CASE = ("leap", "dodecahedron", 0.035)


def strong(hand):
    return gc.load_hand(hand).with_torque_limits(0.35, "a test")


def stance():
    return next(each for each in reaches(*CASE) if each.reached)


def test_levers_are_how_far_contact_points_go_with_the_joints():
    hand, reach = strong("leap"), stance()
    levers = gc.hand_motors(hand, reach).levers.reshape(len(hand.joints), -1, 3)
    for joint, step in enumerate(STEP * np.eye(len(hand.joints))):
        for contact in range(len(reach.fingers)):
            behind, ahead = (
                material_point(hand, reach, contact, reach.joints + way * step)
                for way in (-1.0, 1.0)
            )
            rate = (ahead - behind) / (2.0 * STEP)
            assert levers[joint, contact] == pytest.approx(rate, abs=1e-8)


def test_gravity_is_the_rate_at_which_links_rise():
    hand, reach = strong("leap"), stance()
    down = np.array([0.48, -0.6, 0.64])
    motors = gc.hand_motors(hand, reach, down=down)
    every = gc.hand_motors(hand, reach, any_orientation=True)
    for joint, step in enumerate(STEP * np.eye(len(hand.joints))):
        low, high = (
            lifting_work(hand, reach, reach.joints + way * step, down) for way in (-1.0, 1.0)
        )
        assert motors.gravity[joint] == pytest.approx((high - low) / (2.0 * STEP), abs=1e-8)
    lost = 0.35 - every.limits
    assert (lost >= np.abs(motors.gravity) - 1e-12).all()
    assert not every.gravity.any()


def test_without_limits_masses_or_a_pose_there_are_no_motors():
    reach = reaches("allegro", *CASE[1:])[0]
    assert reach.reached
    with pytest.raises(InputError, match=r"must have a torque limit for each joint.*with_torque"):
        gc.hand_motors(gc.load_hand("allegro"), reach)
    with pytest.raises(InputError, match="mass and centre of mass of each link"):
        gc.hand_motors(strong("allegro"), reach, down=(0.0, 0.0, -1.0))
    nowhere = gc.HandReach("allegro", "c-0-1-2-3", "limit", "nothing was found", 5, 0.0)
    with pytest.raises(InputError, match="must have a pose, got none for grasp c-0-1-2-3"):
        gc.hand_motors(strong("allegro"), nowhere)
