"""Measures exact distances between hulls of points, and of these from surfaces, compiled.

Two hulls are nearest where the hull of the differences of their corners is nearest to the origin.
That point is approached as Gilbert, Johnson and Keerthi do: by the corner that reaches farthest
towards the origin, as long as there is one that reaches farther than the point itself. The point
lies in a triangle of corners; of the triangles that the new corner makes with two of the old ones,
that which is nearest to the origin is kept.

Source: E. G. Gilbert, D. W. Johnson and S. S. Keerthi, A fast procedure for computing the distance
between complex objects in three-dimensional space, 1988.
"""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.hands.distances.boxes_kernel import point_triangle
from grasp_core.hands.distances.surface_kernel import DEEPEST

MOST_STEPS = 100
"""Largest number of corners that are tried: the bound of the loop, which ends after ten or so."""
CLOSE = 1e-13
"""Share of a squared distance by which a corner must be nearer to the origin to count."""


@loop()
def _reaching(points: Array, way: Array, sign: float) -> int:
    """Return the number of the point that reaches farthest along sign * way."""
    best, farthest = 0, -np.inf
    for n in range(len(points)):
        height = sign * dotted(points[n], way)
        if height > farthest:
            best, farthest = n, height
    return best


@loop()
def _holds_origin(S: Array, w: Array) -> bool:
    """Return whether the origin is within the tetrahedron of a triangle S and a point w."""
    way, turns = np.empty(3), np.empty(4)
    for n in range(3):
        cross(S[n], S[(n + 1) % 3], way)
        turns[n] = dotted(way, w)
    cross(S[0], S[1], way)
    turns[3] = -dotted(way, S[2])
    return bool((turns > 0.0).all() or (turns < 0.0).all())


@loop()
def _nearer(S: Array, w: Array, at: Array) -> int:
    """Choose the corner of a triangle S that the point w replaces, and fill in the nearest point.

    Gives the corner's number, or -1 if no such triangle is nearer to the origin than `at`.
    """
    tried, zero, chosen, least = np.empty((3, 3)), np.zeros(3), -1, dotted(at, at)
    near, weights = np.empty(3), np.empty(2)
    for n in range(3):
        if S[n, 0] == w[0] and S[n, 1] == w[1] and S[n, 2] == w[2]:
            return -1
    if _holds_origin(S, w):
        at[:] = 0.0
        return 0
    for n in range(3):
        tried[:] = S
        tried[n] = w
        square = point_triangle(zero, tried, near, weights)
        if square < least:
            least, chosen = square, n
            at[:] = near
    return chosen


@loop()
def hull_hull(
    corners: Array, others: Array, limit: float, near: Array, other: Array
) -> float:  # fmt: skip
    """Return the distance between the hulls of two sets of corners, zero where they overlap.

    It is that of two planes between which no hull is, so that rounding never makes it too large.

    Takes `corners` (m, 3); `others` (n, 3); `near`, `other` (3,).
    """
    at, S, w, zero = corners[0] - others[0], np.empty((3, 3)), np.empty(3), np.zeros(3)
    pairs, weights, apart = np.zeros((3, 2), np.int64), np.empty(2), 0.0
    for n in range(3):
        S[n] = at
    for step in range(MOST_STEPS):
        square = dotted(at, at)
        if square == 0.0:
            apart = 0.0
            break
        i, j = _reaching(corners, at, -1.0), _reaching(others, at, 1.0)
        w[:] = corners[i] - others[j]
        ahead = dotted(at, w)
        apart = max(apart, ahead / np.sqrt(square))
        if apart > limit:
            return apart
        if square - ahead <= CLOSE * square:
            break
        place = 1
        if step > 0:
            place = _nearer(S, w, at)
            if place < 0:
                break
        S[place], pairs[place, 0], pairs[place, 1] = w, i, j
        if step == 0:  # a segment, whose second end counts twice
            S[2], pairs[2] = w, pairs[1]
            point_triangle(zero, S, at, weights)
    point_triangle(zero, S, w, weights)
    for j in range(3):
        near[j] = other[j] = 0.0
        for n in range(3):
            weight = 1.0 - weights[0] - weights[1] if n == 0 else weights[n - 1]
            near[j] += weight * corners[pairs[n, 0], j]
            other[j] += weight * others[pairs[n, 1], j]
    return apart


@loop()
def hull_surface(
    hull: Array, within: float, corners: Array, middles: Array, radii: Array, links: Indices,
    near: Array, other: Array,
) -> float:  # fmt: skip
    """Return the distance of the hull of corners (m, 3) from a surface, zero where they overlap.

    Takes `middles` (n, 3); `radii` (n,); `links` (n, 2); `near`, `other` (3,). Gives the distance,
    or infinity if the surface is not within the given one.
    """
    stack, gaps, depth, gap2 = np.empty(DEEPEST, np.int64), np.empty(DEEPEST), 1, np.empty(2)
    best, found, p, s, middle = within, np.inf, np.empty(3), np.empty(3), np.empty((1, 3))
    stack[0], gaps[0] = 0, 0.0
    while depth > 0 and found > 0.0:
        depth -= 1
        node = stack[depth]
        if gaps[depth] > best:
            continue
        if links[node, 0] < 0:
            for t in range(links[node, 1], links[node, 1] - links[node, 0]):
                away = hull_hull(hull, corners[t], best, p, s)
                if away <= best and away < found:
                    best = found = away
                    near[:], other[:] = p, s
            continue
        for side in range(2):
            child = links[node, side]
            middle[0] = middles[child]
            radius = float(radii[child])
            gap2[side] = hull_hull(hull, middle, best + radius, p, s) - radius
        far = 0 if gap2[0] > gap2[1] else 1
        for side in (far, 1 - far):
            if gap2[side] <= best:
                stack[depth], gaps[depth] = links[node, side], gap2[side]
                depth += 1
    return found
