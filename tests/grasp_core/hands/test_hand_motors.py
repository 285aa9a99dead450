"""Motors of a hand: joint torques are those that a step of the joints pays for."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.hands.kinematics import places
from tests.grasp_core.hands.gripping import reaches

STEP = 1e-6
CASES = [("allegro", "dodecahedron", 0.035), ("leap", "dodecahedron", 0.035)]


def strong(hand):
    return gc.load_hand(hand).with_torque_limits(0.35, "a test")


def stances(case):
    found = [each for each in reaches(*case) if each.reached]
    assert len(found) >= 3
    return found


@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_levers_are_how_far_contact_points_go_with_the_joints(case):
    hand = strong(case[0])
    for reach in stances(case):
        levers = gc.hand_motors(hand, reach).levers.reshape(len(hand.joints), -1, 3)
        starts = np.cumsum([0, *(len(finger.links) for finger in hand.fingers)])
        for joint in range(len(hand.joints)):
            for contact, finger in enumerate(reach.fingers):
                last = starts[finger + 1] - 1
                moved = []
                for way in (-STEP, STEP):
                    angles = reach.joints.copy()
                    angles[joint] += way
                    both = places(hand, np.array([reach.joints, angles]), reach.palm_pose)
                    R, p = both.link_rotations[:, last], both.link_positions[:, last]
                    local = R[0].T @ (reach.contacts[contact].position - p[0])
                    moved.append(p[1] + R[1] @ local)
                rate = (moved[1] - moved[0]) / (2.0 * STEP)
                assert levers[joint, contact] == pytest.approx(rate, abs=1e-8)


def test_gravity_is_the_rate_at_which_links_rise():
    hand = strong("leap")
    down = np.array([0.48, -0.6, 0.64])

    def height(angles, reach):
        found = places(hand, angles, reach.palm_pose)
        centers = [
            position + rotation @ link.center_of_mass
            for link, position, rotation in zip(
                hand.links, found.link_positions[0], found.link_rotations[0], strict=True
            )
        ]
        weights = np.array([GRAVITY_M_PER_S2 * link.mass_kg for link in hand.links])
        return -float(weights @ (np.array(centers) @ down))

    for reach in stances(CASES[1]):
        motors = gc.hand_motors(hand, reach, down=down)
        every = gc.hand_motors(hand, reach, any_orientation=True)
        for joint in range(len(hand.joints)):
            step = STEP * np.eye(len(hand.joints))[joint]
            work = height(reach.joints + step, reach) - height(reach.joints - step, reach)
            assert motors.gravity[joint] == pytest.approx(work / (2.0 * STEP), abs=1e-8)
        lost = 0.35 - every.limits
        assert (lost >= np.abs(motors.gravity) - 1e-12).all()
        assert not every.gravity.any()


def test_without_limits_masses_or_a_pose_there_are_no_motors():
    reach = stances(CASES[0])[0]
    with pytest.raises(InputError, match=r"must have a torque limit for each joint.*with_torque"):
        gc.hand_motors(gc.load_hand("allegro"), reach)
    with pytest.raises(InputError, match="mass and centre of mass of each link"):
        gc.hand_motors(strong("allegro"), reach, down=(0.0, 0.0, -1.0))
    nowhere = gc.HandReach("allegro", "c-0-1-2-3", "limit", "nothing was found", 5, 0.0)
    with pytest.raises(InputError, match="must have a pose, got none for grasp c-0-1-2-3"):
        gc.hand_motors(strong("allegro"), nowhere)
