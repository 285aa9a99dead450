"""Writes rotations of tables of hands: by quaternions, and by turns about an axis."""

import math

import numpy as np

from grasp_core.arrays import Array


def from_quaternion(w: float, x: float, y: float, z: float) -> Array:
    """Return the rotation matrix of a quaternion of any length, (3, 3)."""
    a, b, c, d = np.array([w, x, y, z]) / math.sqrt(w * w + x * x + y * y + z * z)
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
            [2.0 * (b * c + a * d), a * a - b * b + c * c - d * d, 2.0 * (c * d - a * b)],
            [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )
