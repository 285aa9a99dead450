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
HANDS = ("leap", "coupled", pytest.param("allegro", marks=pytest.mark.slow))


class Chain:
    """A finger at contact k by the hand's kinematics, with a pad that gives on its link."""

    def __init__(self, hand, stance, grip, k):
        self.hand, self.stance, self.give = hand, stance, grip.pad_m_per_n
        self.rho, self.own = stance.tip_radii[k], list(hand.chains[stance.fingers[k]])
        self.finger, self.force, self.normal = stance.fingers[k], grip.squeeze[k], grip.normals[k]
        self.turned = self.at(stance.joints).link_rotations[0, self.own[-1]]

    def at(self, joints):
        return places(self.stance.hand, joints, self.stance.palm_pose)

    def point(self, joints, normal, force):
        """Where it touches, (3,): the pad's force turns with the link that it gives on."""
        found = self.at(joints)
        R = found.link_rotations[0, self.own[-1]]
        give = R @ (self.turned.T @ self.force - R.T @ force) * self.give
        return found.tips[0, self.finger] + give + self.rho * normal

    def torques(self, joints, normal, force):
        """Torques of the contact force about all joints, (j,)."""
        found, all_joints = self.at(joints), np.zeros(len(joints))
        arms = self.point(joints, normal, force) - found.link_positions[0, self.own]
        all_joints[self.own] = np.cross(found.joint_axes[0, self.own], arms) @ force
        return all_joints


@pytest.mark.parametrize("name", [*HANDS, "spreading"])
def test_changes_of_force_balance_servos_that_follow_the_object(name):
    """At forces changed by (5), servos turn the joints so that fingertips follow the object."""
    reach, hand, _, best = standing(name)
    grip, stance, turning = best.grip, stance_of(hand, reach), hand.drives.turning
    chains = [Chain(hand, stance, grip, k) for k in range(len(grip.arms))]
    rest = sum(each.torques(stance.joints, each.normal, each.force) for each in chains)
    rng = np.random.default_rng(0)
    for motion in rng.normal(size=(5, 6)) * np.repeat([1.0, 1.0 / grip.size], 3):
        d, t = motion[:3], motion[3:]
        turned = [each.normal + SMALL * np.cross(t, each.normal) for each in chains]
        changed = [each.force + SMALL * grip.force_changes[k] @ motion
                   for k, each in enumerate(chains)]  # fmt: skip
        joints = stance.joints
        for _ in range(20):
            now = sum(map(Chain.torques, chains, [joints] * len(chains), turned, changed))
            joints = stance.joints - turning @ turning.T @ (now - rest) / grip.servo_n_m_per_rad
        for k, each in enumerate(chains):
            # the point that is carried along, with the normal that it had
            moved = each.point(joints, turned[k], changed[k]) - each.rho * turned[k]
            began = each.point(stance.joints, each.normal, each.force) - each.rho * each.normal
            R = each.at(joints).link_rotations[0, each.own[-1]] @ each.turned.T
            followed = (moved + each.rho * R @ each.normal - began - each.rho * each.normal) / SMALL
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
            # the fingertip's turn from the motion of its chain that follows the object, as stiff
            # servos find it: least squares in the metric of equal servos, less what a pad gives
            free = L.T @ grip.joint_ratios[k]
            dy = np.linalg.lstsq(free, moved + grip.pad_m_per_n * df, rcond=None)[0]
            turn = grip.joint_axes[k].T @ grip.joint_ratios[k] @ dy
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
