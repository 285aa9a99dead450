"""Places of links against plain products of matrices and finite differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import grasp_core as gc
from grasp_core.hands.hand_arrays import places, tip_jacobians


def turned(axis, angle):
    return Rotation.from_rotvec(angle * np.array(axis)).as_matrix()


def test_places_are_those_of_plain_products_of_matrices():
    hand, rng = gc.load_hand("leap"), np.random.default_rng(1)
    low, high = hand.ranges.T
    joints = rng.uniform(low, high, (5, len(low)))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turned([0.6, 0.0, 0.8], 1.1), [0.1, 0.2, 0.3]
    found = places(hand, joints, pose)
    for n, angles in enumerate(joints):
        k = 0
        for f, finger in enumerate(hand.fingers):
            R, p = pose[:3, :3], pose[:3, 3]
            for link in finger.links:
                p, R = p + R @ link.joint.position, R @ link.joint.rotation
                R = R @ turned(link.joint.axis, angles[k])
                assert found.link_positions[n, k] == pytest.approx(p, abs=1e-14)
                assert found.link_rotations[n, k] == pytest.approx(R, abs=1e-13)
                k += 1
            assert found.tips[n, f] == pytest.approx(p + R @ finger.tip.center, abs=1e-14)
        assert k == 16


def test_jacobians_are_differences_of_places():
    """Central differences at 1e-6 rad are off by the third derivative, below 1e-12, and rounding
    of 1e-17 m over 2e-6 rad, below 1e-10."""
    hand, rng = gc.load_hand("allegro"), np.random.default_rng(2)
    low, high = hand.ranges.T
    joints, step = rng.uniform(low, high), 1e-6
    J = tip_jacobians(hand, joints)[0]
    for k in range(len(joints)):
        ahead, behind = joints.copy(), joints.copy()
        ahead[k] += step
        behind[k] -= step
        moved = places(hand, ahead).tips[0] - places(hand, behind).tips[0]
        assert J[:, :, k] == pytest.approx(moved / (2.0 * step), abs=1e-9)
    assert np.abs(J).max() > 0.05
