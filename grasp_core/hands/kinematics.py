"""Says where links and fingertips of a hand are, and how fingertips move with the joints.

With origin p_k and axis w_k of joint k, both in the frame of the palm pose, a point x that a finger
carries moves by

    dx / dq_k = w_k x (x - p_k)                                                           (1)

where k is one of the finger's joints, and by nothing else.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, cross, frozen_copy, real_array
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.frames import POSE
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import hand_arrays


@dataclass(frozen=True, slots=True, eq=False)
class HandPlaces:
    """Where the parts of a hand are, for n sets of joint angles; read-only arrays."""

    link_rotations: Array  # axes of the links' frames, (n, joints, 3, 3)
    link_positions: Array  # origins of these frames, (n, joints, 3) [m]
    joint_axes: Array  # unit vectors of the joints' axes, (n, joints, 3)
    tips: Array  # middles of the fingertips' balls, (n, fingers, 3) [m]


def places(hand: Hand, joints: ArrayLike, palm_pose: ArrayLike | None = None) -> HandPlaces:
    """Compute where links and fingertips are at angles (j,) or (n, j), and one palm pose or n."""
    angles = np.atleast_2d(real_array(joints, "joints"))
    arrays = hand_arrays(hand)
    count, length = len(angles), len(arrays.axes)
    if angles.shape != (count, length):
        raise InputError(
            f"joints must have shape ({length},) or (n, {length}), got {np.shape(joints)}"
        )
    pose = np.eye(POSE) if palm_pose is None else real_array(palm_pose, "palm_pose")
    if pose.shape not in {(POSE, POSE), (count, POSE, POSE)}:
        raise InputError(f"palm_pose must have shape (4, 4) or ({count}, 4, 4), got {pose.shape}")
    poses = np.broadcast_to(pose, (count, POSE, POSE))
    R, p = np.empty((count, length, 3, 3)), np.empty((count, length, 3))
    W = np.empty_like(p)
    kernel = compiled("grasp_core.hands.collisions_kernel")
    for own, row, *found in zip(poses, angles, R, p, W, strict=True):
        kernel.chains(arrays, own[:3, :3].copy(), own[:3, 3].copy(), row, *found)
    last = arrays.starts[1:] - 1
    tips = p[:, last] + np.einsum("nfij,fj->nfi", R[:, last], arrays.tip_centers)
    return HandPlaces(*(frozen_copy(each) for each in (R, p, W, tips)))


def jacobian(hand: Hand, found: HandPlaces, link: int, points: Array) -> Array:
    """Compute the derivatives (1) of points (n, 3) that a link carries, (n, 3, joints) [m/rad]."""
    own = slice(hand_arrays(hand).link_firsts[link], link + 1)
    arms = points[:, None] - found.link_positions[:, own]
    J = np.zeros((len(points), 3, len(hand.joints)))
    J[:, :, own] = np.swapaxes(cross(found.joint_axes[:, own], arms), -1, -2)
    return J


def tip_jacobians(hand: Hand, joints: ArrayLike, palm_pose: ArrayLike | None = None) -> Array:
    """Compute the derivatives (1) of fingertips' middles, (n, fingers, 3, joints) [m/rad]."""
    found, ends = places(hand, joints, palm_pose), hand_arrays(hand).starts[1:] - 1
    each = [jacobian(hand, found, end, found.tips[:, f]) for f, end in enumerate(ends.tolist())]
    return np.stack(each, axis=1)


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the rotation by an angle about a unit axis by Rodrigues' formula, (3, 3)."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
