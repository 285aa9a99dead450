"""Halves the depth of a pyramid until it has no inner point in common with triangles, compiled."""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted

MOST_HALVINGS = 12
"""Halvings of the depth after which a pyramid is left as it is: the object is a sheet there."""
PARALLEL_SINE = 1e-12
"""Sine of the angle between edges below which their cross product is no axis."""
TRIANGLE_CORNERS = 3


@loop()
def clear_depth(
    base: Array, inward: Array, depth: float, triangles: Array, near: Indices, slack: float
) -> float:
    """Return the largest of depth, depth / 2, ... at which a pyramid and triangles are separated.

    Takes `base` (n, 3) [m]; `inward` (3,); `depth`, `slack` [m]; `triangles` (t, 3, 3) [m]; `near`
    (m,).
    """
    n = len(base)
    solid, along = np.empty((n + 1, 3)), np.empty((2 * n, 3))
    for j in range(3):
        total = 0.0
        for i in range(n):
            total += base[i, j]
            solid[i, j], along[i, j] = base[i, j], base[(i + 1) % n, j] - base[i, j]
        solid[n, j] = total / n
    middle, first = solid[n].copy(), 0
    for halved in range(MOST_HALVINGS + 1):
        for j in range(3):
            solid[n, j] = middle[j] + depth * inward[j]
            for i in range(n):
                along[n + i, j] = solid[n, j] - solid[i, j]
        # a triangle that is clear of a pyramid is clear of all lower ones
        while first < len(near) and (
            _is_beside(middle, inward, depth, triangles[near[first]], slack)
            or _separated(solid, along, triangles[near[first]], slack)
        ):
            first += 1
        if first == len(near) or halved == MOST_HALVINGS:
            break
        depth *= 0.5
    return depth


@loop(once=True)
def _is_beside(middle: Array, inward: Array, depth: float, triangle: Array, slack: float) -> bool:
    """Return whether a triangle lies above the base or below the apex."""
    low, high = np.inf, -np.inf
    for k in range(TRIANGLE_CORNERS):
        height = 0.0
        for j in range(3):
            height += (triangle[k, j] - middle[j]) * inward[j]
        low, high = min(low, height), max(high, height)
    return high <= slack or low >= depth


@loop(once=True)
def _separated(solid: Array, along: Array, triangle: Array, slack: float) -> bool:
    """Return whether an axis separates a pyramid (n + 1, 3), with edges (2 n, 3), and a triangle.

    Axes are normals of the pyramid's slopes and of the triangle, and cross products of an edge of
    each; the base's normal is left to `_is_beside`.
    """
    n, axis, sides = len(solid) - 1, np.empty(3), np.empty((TRIANGLE_CORNERS, 3))
    for k in range(TRIANGLE_CORNERS):
        for j in range(3):
            sides[k, j] = triangle[(k + 1) % TRIANGLE_CORNERS, j] - triangle[k, j]
    cross(sides[0], sides[1], axis)
    if _apart(axis, solid, triangle, slack):
        return True
    for i in range(n):
        cross(along[i], along[n + i], axis)
        if _apart(axis, solid, triangle, slack):
            return True
    for i in range(2 * n * TRIANGLE_CORNERS):
        edge, side = along[i // TRIANGLE_CORNERS], sides[i % TRIANGLE_CORNERS]
        cross(edge, side, axis)
        least = PARALLEL_SINE * PARALLEL_SINE * dotted(edge, edge) * dotted(side, side)
        if dotted(axis, axis) > least and _apart(axis, solid, triangle, slack):
            return True
    return False


@loop()
def _apart(axis: Array, solid: Array, triangle: Array, slack: float) -> bool:
    """Return whether two sets of corners overlap along an axis by no more than some slack."""
    length = np.sqrt(dotted(axis, axis))
    if length == 0.0:
        return False
    low, high = np.inf, -np.inf
    for i in range(len(solid)):
        height = dotted(axis, solid[i])
        low, high = min(low, height), max(high, height)
    least, most = np.inf, -np.inf
    for k in range(TRIANGLE_CORNERS):
        height = dotted(axis, triangle[k])
        least, most = min(least, height), max(most, height)
    return max(least - high, low - most) >= -slack * length
