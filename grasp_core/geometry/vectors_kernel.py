"""Computes products of vectors in space, compiled for other kernels."""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop


@loop()
def dotted(u: Array, v: Array) -> float:
    """Return the dot product of two vectors."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@loop()
def cross(u: Array, v: Array, crossed: Array) -> None:
    """Fill in the cross product of two vectors."""
    crossed[0] = u[1] * v[2] - u[2] * v[1]
    crossed[1] = u[2] * v[0] - u[0] * v[2]
    crossed[2] = u[0] * v[1] - u[1] * v[0]


@loop()
def angle_between(u: Array, v: Array) -> float:
    """Return the angle between two vectors [rad], accurate for nearly equal ones too."""
    crossed = np.empty(3)
    cross(u, v, crossed)
    return np.arctan2(np.sqrt(dotted(crossed, crossed)), dotted(u, v))


@loop()
def balancing_weights(axes: Array, weights: Array) -> None:
    """Fill in weights with sum w_i a_i = 0, (4,), like those of `grasp_core.cones.spanning`."""
    front, back, total = np.empty(3), np.empty(3), 0.0
    cross(axes[2], axes[3], back)
    cross(axes[0], axes[1], front)
    weights[0], weights[1] = dotted(back, axes[1]), -dotted(back, axes[0])
    weights[2], weights[3] = dotted(front, axes[3]), -dotted(front, axes[2])
    for i in range(4):
        total += weights[i]
    size = abs(weights[0]) + abs(weights[1]) + abs(weights[2]) + abs(weights[3])
    scale = np.sign(total) / max(size, np.finfo(np.float64).tiny)
    for i in range(4):
        weights[i] *= scale


@loop()
def focus_direction(axes: Array) -> Array:
    """Compute what `focus_direction` of `grasp_core.families.placements` computes."""
    weights, u = np.empty(4), np.empty(3)
    balancing_weights(axes, weights)
    for j in range(3):
        u[j] = weights[0] * axes[0, j] + weights[1] * axes[1, j]
    length = np.sqrt(dotted(u, u))
    for j in range(3):
        u[j] /= length
    return u


@loop()
def across(axis: Array, T: Array) -> tuple[Array, Array]:
    """Return two unit vectors across an axis; the first leans like the first column of T."""
    first, second, along = np.empty(3), np.empty(3), 0.0
    for j in range(3):
        along += T[j, 0] * axis[j]
    for j in range(3):
        first[j] = T[j, 0] - along * axis[j]
    length = np.sqrt(dotted(first, first))
    for j in range(3):
        first[j] /= length
    cross(axis, first, second)
    return first, second
