"""Multiplies poses along the chains of a hand, compiled."""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop


@loop()
def turn(axis: Array, angle: float, out: Array) -> None:
    """Fill in the rotation about a unit axis, (3, 3), by Rodrigues' formula."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    k = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + k * x * x, k * x * y - s * z, k * x * z + s * y
    out[1, 0], out[1, 1], out[1, 2] = k * x * y + s * z, c + k * y * y, k * y * z - s * x
    out[2, 0], out[2, 1], out[2, 2] = k * x * z - s * y, k * y * z + s * x, c + k * z * z


@loop()
def product(A: Array, B: Array, out: Array) -> None:
    """Fill in the product of two (3, 3) matrices."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@loop()
def moved(R: Array, p: Array, local: Array, out: Array) -> None:
    """Fill in the point p + R local, (3,)."""
    for i in range(3):
        out[i] = p[i] + R[i, 0] * local[0] + R[i, 1] * local[1] + R[i, 2] * local[2]


@loop()
def chains(  # noqa: PLR0913, PLR0917 - the arrays of a hand
    positions: Array, rotations: Array, axes: Array, starts: Indices, palm_rotation: Array,
    palm_position: Array, angles: Array, R: Array, p: Array, W: Array,
) -> None:  # fmt: skip
    """Fill in where links are for one set of joint angles."""
    about, frame = np.empty((3, 3)), np.empty((3, 3))
    for f in range(len(starts) - 1):
        for k in range(starts[f], starts[f + 1]):
            if k == starts[f]:
                before, origin = palm_rotation, palm_position
            else:
                before, origin = R[k - 1], p[k - 1]
            moved(before, origin, positions[k], p[k])
            product(before, rotations[k], frame)
            for i in range(3):
                W[k, i] = (
                    frame[i, 0] * axes[k, 0] + frame[i, 1] * axes[k, 1] + frame[i, 2] * axes[k, 2]
                )
            turn(axes[k], angles[k], about)
            product(frame, about, R[k])


@loop()
def many_chains(  # noqa: PLR0913, PLR0917 - the arrays of a hand
    positions: Array, rotations: Array, axes: Array, starts: Indices, palm_poses: Array,
    angles: Array, R: Array, p: Array, W: Array,
) -> None:  # fmt: skip
    """Fill in where links are for many palm poses (n, 4, 4) and joint angles (n, j)."""
    for i in range(len(angles)):
        rotation, origin = palm_poses[i, :3, :3].copy(), palm_poses[i, :3, 3].copy()
        chains(positions, rotations, axes, starts, rotation, origin, angles[i], R[i], p[i], W[i])
