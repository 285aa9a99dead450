"""Frames along directions, always completed in the same way, and angles that degrees keep exactly.

Two neighbouring numbers of radians may become the same degrees, and one of them stands for both:
every angle of a plan is such a number, so what a table shows in degrees can be turned back into it.
"""

import math
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array

MatrixRow: TypeAlias = tuple[float, float, float]
POSE_SIZE = 4
SAME_SIZE = 1e-7
"""Difference between components that does not count: rounding, in computing or in a file."""


def plane_tangents(x: float, y: float, z: float) -> tuple[MatrixRow, MatrixRow]:
    """Return two unit vectors that are orthogonal to each other and to the unit vector (x, y, z).

    The first is orthogonal also to the axis of the smallest component: the first axis whose
    component is as small, but for `SAME_SIZE`. With (x, y, z) in front, or behind, the three are
    right-handed.
    """
    smallest = min(abs(x), abs(y), abs(z)) + SAME_SIZE
    if abs(x) <= smallest:
        u, v, w = 0.0, -z, y
    elif abs(y) <= smallest:
        u, v, w = z, 0.0, -x
    else:
        u, v, w = -y, x, 0.0
    length = math.sqrt(u * u + v * v + w * w)
    u, v, w = u / length, v / length, w / length
    return (u, v, w), (y * w - z * v, z * u - x * w, x * v - y * u)


def poses_along(origins: Array, directions: Array) -> Array:
    """Return poses whose z axes run along given directions, (k, 4, 4)."""
    poses = np.tile(np.eye(POSE_SIZE), (len(origins), 1, 1))
    for pose, (x, y, z) in zip(poses, directions.tolist(), strict=True):
        pose[:3, :3] = np.array([*plane_tangents(x, y, z), (x, y, z)]).T
    poses[:, :3, 3] = origins
    return poses


def radians_of(degrees: float) -> float:
    """Return the angle [rad] that `math.degrees` turns into these degrees, or the usual one."""
    nearest = math.radians(degrees)
    beside = (math.nextafter(nearest, math.inf), math.nextafter(nearest, -math.inf))
    exact = (angle for angle in (nearest, *beside) if math.degrees(angle) == degrees)
    return next(exact, nearest)


def kept_angle(radians: float) -> float:
    """Return the angle that degrees keep for one: the same, or its neighbour in the last digit."""
    return radians_of(math.degrees(radians))
