"""The grip of a hand changes its forces as chains of joints on servos do, by their kinematics."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.execution.grips import Grip
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.reach import stance_of
from tests.sim_validate.hands.executing import standing
from tests.tampering.changes import forged

SMALL = 1e-7
"""Size of a motion [m, rad] whose square is nothing beside it."""
HANDS = ("leap", pytest.param("allegro", marks=pytest.mark.slow))


def torques(hand, reach, k, joints, point_normal, force):
    """Return l_a . f of a finger at joint angles, with the ball touching along a normal, (m,)."""
    stance = stance_of(hand, reach)
    rho, own = stance.tip_radii[k], list(hand.chains[stance.fingers[k]])
    found = places(stance.hand, joints, stance.palm_pose)
    point = found.tips[0, stance.fingers[k]] + rho * point_normal
    arms = point - found.link_positions[0, own]
    return np.cross(found.joint_axes[0, own], arms) @ force


@pytest.mark.parametrize("name", HANDS)
def test_changes_of_force_balance_servos_that_follow_the_object(name):
    """At forces changed by (6), servos turn the joints so that fingertips follow the object."""
    reach, hand, _, best = standing(name)
    grip, stance = best.grip, stance_of(hand, reach)
    rng = np.random.default_rng(0)
    for motion in rng.normal(size=(5, 6)) * np.repeat([1.0, 1.0 / grip.size], 3):
        d, t = motion[:3], motion[3:]
        for k, finger in enumerate(stance.fingers):
            own, n, f = list(hand.chains[finger]), grip.normals[k], grip.squeeze[k]
            turned = n + SMALL * np.cross(t, n)
            changed = f + SMALL * grip.force_changes[k] @ motion
            rest = torques(hand, reach, k, stance.joints, n, f)
            joints = stance.joints.copy()
            for _ in range(20):
                more = torques(hand, reach, k, joints, turned, changed) - rest
                joints[own] = stance.joints[own] - more / grip.servo_n_m_per_rad
            dq = (joints - stance.joints)[own] / SMALL
            followed = np.cross(grip.joint_axes[k], grip.joint_arms[k]).T @ dq
            wanted = d + np.cross(t, grip.arms[k])
            assert followed == pytest.approx(wanted, abs=1e-3 * np.linalg.norm(wanted))


@pytest.mark.parametrize("name", HANDS)
def test_without_a_squeeze_a_hand_is_fingertips_on_springs(name):
    _, _, _, best = standing(name)
    loose = best.grip.squeezed(np.zeros_like(best.grip.squeeze))
    plain = Grip(loose.arms, loose.normals, loose.friction, loose.squeeze, loose.stiffness,
                 loose.tip_radius_m)  # fmt: skip
    assert loose.force_changes == pytest.approx(plain.force_changes, rel=1e-6, abs=1e-6)
    assert loose.grasp_stiffness == pytest.approx(plain.grasp_stiffness, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("name", HANDS)
def test_a_small_motion_changes_the_wrench_by_the_grasp_stiffness(name):
    """Forces, and the shift of the points that touch, as (6) and (8) say, for one motion each."""
    _, _, _, best = standing(name)
    grip = best.grip
    for motion in np.eye(6):
        t, total = motion[3:], np.zeros(6)
        for k, (r, n, f) in enumerate(zip(grip.arms, grip.normals, grip.squeeze, strict=True)):
            df = grip.force_changes[k] @ motion
            L = np.cross(grip.joint_axes[k], grip.joint_arms[k])
            moved = motion[:3] + np.cross(t, r)
            # the fingertip's turn from the rigid motion of its chain that follows the object, as
            # stiff servos find it: least squares in the metric of equal servos
            dq = np.linalg.lstsq(L.T, moved, rcond=None)[0]
            turn = grip.joint_axes[k].T @ dq
            shift = np.cross(t, r) + grip.tip_radius_m[k] * np.cross(t - turn, n)
            total += np.concatenate([df, np.cross(r, df) + np.cross(shift, f)])
        found = -grip.grasp_stiffness @ motion
        size = np.abs(found).max()
        assert total == pytest.approx(found, abs=0.02 * size)


def test_a_hand_that_executes_proves_its_squeeze():
    _, _, _, best = standing("leap")
    assert best.verify()
    assert isinstance(best.grip, gc.Grip)


def test_a_squeeze_of_joints_that_are_none_proves_nothing():
    """Axes that are too long, arms of no length, and servos that hold nothing."""
    _, _, _, best = standing("leap")
    grip = best.grip
    for wrong in (
        {"joint_axes": 2.0 * grip.joint_axes}, {"joint_axes": grip.joint_axes[:, :, :2]},
        {"joint_arms": 0.0 * grip.joint_arms}, {"joint_arms": grip.joint_arms[:, :1]},
        {"servo_n_m_per_rad": 0.0}, {"servo_n_m_per_rad": np.nan},
    ):  # fmt: skip
        assert not forged(best, grip=forged(grip, **wrong)).verify()
