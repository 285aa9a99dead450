"""Rotation matrices of quaternions, and of the hinges that the palm of a scene turns about."""

import numpy as np

from grasp_core.arrays import Array


def rotations(quaternions: Array) -> Array:
    """Return the rotation matrices of unit quaternions (w, x, y, z), (n, 4), as (n, 3, 3)."""
    w, x, y, z = quaternions.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ],
        axis=1,
    )


def hinged(angles: Array) -> Array:
    """Return the palm's rotation, (n, 3, 3): about x, then the turned y, then the turned z."""
    half = 0.5 * angles
    zero = np.zeros(len(angles))
    turn = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in range(3):
        parts = [np.cos(half[:, axis]), zero, zero, zero]
        parts[axis + 1] = np.sin(half[:, axis])
        turn = turn @ rotations(np.stack(parts, axis=1))
    return turn
