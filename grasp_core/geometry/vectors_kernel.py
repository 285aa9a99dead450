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
def crossed(u: Array, v: Array) -> tuple[float, float, float]:
    """Return the cross product of two vectors."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@loop()
def vanishing_weights(vectors: Array) -> tuple[float, float, float, float]:
    """Return w_i of sum w_i v_i = 0 by Cramer's rule: of one sign where vectors positively span."""
    one, two, three, four = vectors[0], vectors[1], vectors[2], vectors[3]
    (x, y, z), (u, v, w) = crossed(one, two), crossed(three, four)
    return (
        u * two[0] + v * two[1] + w * two[2],
        -(u * one[0] + v * one[1] + w * one[2]),
        x * four[0] + y * four[1] + z * four[2],
        -(x * three[0] + y * three[1] + z * three[2]),
    )


@loop()
def balancing_weights(vectors: Array, weights: Array) -> None:
    """Fill in weights of sum w_i v_i = 0, sum |w_i| = 1; positive if vectors span, (4,)."""
    a, b, c, d = vanishing_weights(vectors)
    size = abs(a) + abs(b) + abs(c) + abs(d)
    scale = np.sign(a + b + c + d) / max(size, np.finfo(np.float64).tiny)
    weights[0], weights[1], weights[2], weights[3] = scale * a, scale * b, scale * c, scale * d


@loop()
def focus_direction(axes: Array) -> Array:
    """Compute the direction u of the line through both foci of a pencil, (3,).

    The first focus belongs to fingers 0 and 1, the second to fingers 2 and 3. The direction lies in
    the planes of both pairs, and the first pair pushes along it: with positive weights lam of sum
    lam a = 0, u points along w = lam_0 a_0 + lam_1 a_1 = -lam_2 a_2 - lam_3 a_3.
    """
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
