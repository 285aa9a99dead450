"""Motors of a hand: joint torques are those that a step of the joints pays for."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.hands.hand import Coupling
from sim_validate.hands.known_hand import hinged_hand
from sim_validate.hands.known_hand import stance as known_stance
from tests.grasp_core.hands.gripping import lifting_work, material_point, reaches

STEP = 1e-6
CASE = ("leap", "dodecahedron", 0.035)
DOWN = np.array([0.48, -0.6, 0.64])


def strong(hand):
    return gc.load_hand(hand).with_torque_limits(0.35, "a test")


def stance():
    """LEAP where it stands, with two joints that follow others and stand so, too."""
    reach, hand = next(each for each in reaches(*CASE) if each.reached), strong("leap")
    names, couplings = [joint.name for joint in hand.joints], []
    for driver, ratio in ((1, 0.7), (6, -0.4)):
        offset = reach.joints[driver + 1] - ratio * reach.joints[driver]
        couplings.append(Coupling(names[driver + 1], names[driver], ratio, offset))
    return reach, replace(hand, couplings=tuple(couplings))


def steps(hand):
    """The free joints with a step of all angles when each of them is turned on by a little."""
    names = [joint.name for joint in hand.joints]
    for joint in hand.free_joints:
        step = np.array([STEP if name == joint.name else 0.0 for name in names])
        for follower in hand.couplings:
            if follower.driver == joint.name:
                step[names.index(follower.joint)] = follower.ratio * STEP
        yield step


def test_levers_are_how_far_contact_points_go_with_the_joints_and_their_followers():
    reach, hand = stance()
    levers = gc.hand_motors(hand, reach).levers.reshape(14, -1, 3)
    for step, lever in zip(steps(hand), levers, strict=True):
        for contact in range(len(reach.fingers)):
            behind, ahead = (
                material_point(hand, reach, contact, reach.joints + way * step)
                for way in (-1.0, 1.0)
            )
            rate = (ahead - behind) / (2.0 * STEP)
            assert lever[contact] == pytest.approx(rate, abs=1e-8)


def test_gravity_is_the_rate_at_which_links_rise():
    reach, hand = stance()
    motors = gc.hand_motors(hand, reach, down=DOWN)
    for step, gravity in zip(steps(hand), motors.gravity, strict=True):
        low, high = (
            lifting_work(hand, reach, reach.joints + way * step, DOWN) for way in (-1.0, 1.0)
        )
        assert gravity == pytest.approx((high - low) / (2.0 * STEP), abs=1e-8)
    every = gc.hand_motors(hand, reach, any_orientation=True)
    assert (0.35 - every.limits >= np.abs(motors.gravity) - 1e-12).all()
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


def test_what_a_motor_of_several_joints_holds_is_not_known():
    hand = replace(hinged_hand(), shared_motors=("one motor pulls tendon t, which turns a, b",))
    with pytest.raises(InputError, match="tendon t, which turns a, b; graspproof judge"):
        gc.hand_motors(hand, known_stance(0.5))
