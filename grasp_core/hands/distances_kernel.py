"""Measures exact distances between hulls, triangles, points and surfaces, compiled.

Two hulls are nearest where the hull of the differences of their corners is nearest to the origin.
That point is approached as Gilbert, Johnson and Keerthi do: by the corner that reaches farthest
towards the origin, as long as there is one that reaches farther than the point itself. The point
lies in a triangle of corners; of the triangles that the new corner makes with two of the old ones,
that which is nearest to the origin is kept. Hulls that overlap have the distance zero.

Source: E. G. Gilbert, D. W. Johnson and S. S. Keerthi, A fast procedure for computing the distance
between complex objects in three-dimensional space, 1988.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.hands.hand_arrays import SurfaceTree

BOX_CORNERS = 8
MOST_CORNERS_TRIED = 100
"""Largest number of corners that are tried: the bound of the loop, which ends after ten or so."""
CLOSE = 1e-13
"""Share of a squared distance by which a corner must be nearer to the origin to count."""
TREE_DEPTH = 64
"""Places on the stack of a walk through the tree; a tree of 2^32 triangles needs fewer."""


@loop()
def squared(p: Array, q: Array) -> float:
    """Return the squared distance of two points."""
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@loop()
def point_triangle(p: Array, T: Array, near: Array, weights: Array) -> float:
    """Fill in the point of a triangle, (3, 3), nearest to a point, and return its squared distance.

    The last two corners may be one point.

    Source: C. Ericson, Real-Time Collision Detection, section 5.1.5 (regions of Voronoi).
    """
    ab, ac, ap = T[1] - T[0], T[2] - T[0], p - T[0]
    d1, d2 = dotted(ab, ap), dotted(ac, ap)
    bp, cp = p - T[1], p - T[2]
    d3, d4, d5, d6 = dotted(ab, bp), dotted(ac, bp), dotted(ab, cp), dotted(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, w = 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        total = va + vb + vc
        v, w = vb / total, vc / total
    weights[0], weights[1] = v, w
    for j in range(3):
        near[j] = T[0, j] + v * ab[j] + w * ac[j]
    return squared(p, near)


@loop()
def into_frame(R: Array, middle: Array, p: Array, out: Array) -> None:
    """Fill in a point's coordinates in the frame with axes R (columns) and the given origin."""
    for i in range(3):
        out[i] = (
            R[0, i] * (p[0] - middle[0])
            + R[1, i] * (p[1] - middle[1])
            + R[2, i] * (p[2] - middle[2])
        )


@loop()
def corners_of(h: Array, R: Array, middle: Array) -> Array:
    """Return the corners of a box with axes R (columns), (8, 3); corner k has the signs of k."""
    corners = np.empty((BOX_CORNERS, 3))
    for k in range(BOX_CORNERS):
        for i in range(3):
            corners[k, i] = middle[i]
            for j in range(3):
                corners[k, i] += R[i, j] * (h[j] if k >> j & 1 else -h[j])
    return corners


@loop()
def reaching(points: Array, way: Array, sign: float) -> int:
    """Return the number of the point that reaches farthest along sign * way."""
    best, farthest = 0, -np.inf
    for n in range(len(points)):
        height = sign * dotted(points[n], way)
        if height > farthest:
            best, farthest = n, height
    return best


@loop(once=True)
def _holds_origin(S: Array, w: Array) -> bool:
    """Return whether the origin is within the tetrahedron of a triangle S and a point w."""
    way, turns = np.empty(3), np.empty(4)
    for n in range(3):
        cross(S[n], S[(n + 1) % 3], way)
        turns[n] = dotted(way, w)
    cross(S[0], S[1], way)
    turns[3] = -dotted(way, S[2])
    return bool((turns > 0.0).all() or (turns < 0.0).all())


@loop(once=True)
def _nearer(S: Array, w: Array, at: Array) -> int:
    """Fill in the nearest point of S with w; return the corner that w replaces, -1 for none."""
    tried, zero, chosen, least = np.empty((3, 3)), np.zeros(3), -1, dotted(at, at)
    near, weights = np.empty(3), np.empty(2)
    for n in range(3):
        if S[n, 0] == w[0] and S[n, 1] == w[1] and S[n, 2] == w[2]:
            return -1
    if _holds_origin(S, w):
        at[:] = 0.0
        return 0
    for n in range(3):
        copy(S, tried)
        copy(w, tried[n])
        square = point_triangle(zero, tried, near, weights)
        if square < least:
            least, chosen = square, n
            copy(near, at)
    return chosen


@loop()
def hull_hull(
    corners: Array, others: Array, limit: float, near: Array, other: Array
) -> float:  # fmt: skip
    """Return the distance of two hulls, zero where they overlap; rounding never enlarges it."""
    at, S, w, zero = corners[0] - others[0], np.empty((3, 3)), np.empty(3), np.zeros(3)
    pairs, weights, apart = np.zeros((3, 2), np.int64), np.empty(2), 0.0
    for n in range(3):
        copy(at, S[n])
    for step in range(MOST_CORNERS_TRIED):
        square = dotted(at, at)
        if square == 0.0:
            apart = 0.0
            break
        i, j = reaching(corners, at, -1.0), reaching(others, at, 1.0)
        for k in range(3):
            w[k] = corners[i, k] - others[j, k]
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
        copy(w, S[place])
        pairs[place, 0], pairs[place, 1] = i, j
        if step == 0:  # a segment, whose second end counts twice
            copy(w, S[2])
            copy(pairs[1], pairs[2])
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
    hull: Array, within: float, tree: SurfaceTree, near: Array, other: Array
) -> float:  # fmt: skip
    """Return the distance of a hull, (m, 3), from a surface: zero in it, inf if not within."""
    stack, gaps = np.empty(TREE_DEPTH, np.int64), np.empty(TREE_DEPTH)
    depth, gap2 = 1, np.empty(2)
    best, found, p, s, middle = within, np.inf, np.empty(3), np.empty(3), np.empty((1, 3))
    stack[0], gaps[0] = 0, 0.0
    while depth > 0 and found > 0.0:
        depth -= 1
        node = stack[depth]
        if gaps[depth] > best:
            continue
        if tree.links[node, 0] < 0:
            for t in range(tree.links[node, 1], tree.links[node, 1] - tree.links[node, 0]):
                away = hull_hull(hull, tree.corners[t], best, p, s)
                if away <= best and away < found:
                    best = found = away
                    copy(p, near)
                    copy(s, other)
            continue
        for side in range(2):
            child = tree.links[node, side]
            copy(tree.middles[child], middle[0])
            radius = float(tree.radii[child])
            gap2[side] = hull_hull(hull, middle, best + radius, p, s) - radius
        far = 0 if gap2[0] > gap2[1] else 1
        for side in (far, 1 - far):
            if gap2[side] <= best:
                stack[depth], gaps[depth] = tree.links[node, side], gap2[side]
                depth += 1
    return found


@loop()
def nearest(p: Array, within: float, tree: SurfaceTree, near: Array) -> int:
    """Fill in the surface's point nearest to p; return its triangle, or -1 if not within."""
    stack, gaps, found, depth = np.empty(TREE_DEPTH, np.int64), np.empty(TREE_DEPTH), -1, 1
    best, at, gap2, weights = within * within, np.empty(3), np.empty(2), np.empty(2)
    stack[0], gaps[0] = 0, 0.0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if gaps[depth] > 0.0 and gaps[depth] * gaps[depth] >= best:
            continue
        if tree.links[node, 0] < 0:
            for t in range(tree.links[node, 1], tree.links[node, 1] - tree.links[node, 0]):
                square = point_triangle(p, tree.corners[t], at, weights)
                if square < best:
                    best, found = square, t
                    copy(at, near)
            continue
        for side in range(2):
            child = tree.links[node, side]
            gap2[side] = np.sqrt(squared(p, tree.middles[child])) - tree.radii[child]
        far = 0 if gap2[0] > gap2[1] else 1
        for side in (far, 1 - far):
            if gap2[side] <= 0.0 or gap2[side] * gap2[side] < best:
                stack[depth], gaps[depth] = tree.links[node, side], gap2[side]
                depth += 1
    return found


@loop()
def windings(p: Array, corners: Array) -> float:
    """Return how often a surface winds around a point: 1 inside, 0 outside.

    Source: A. Van Oosterom and J. Strackee, The solid angle of a plane triangle, 1983.
    """
    total, crossed = 0.0, np.empty(3)
    for t in range(len(corners)):
        a, b, c = corners[t, 0] - p, corners[t, 1] - p, corners[t, 2] - p
        cross(b, c, crossed)
        la, lb, lc = np.sqrt(dotted(a, a)), np.sqrt(dotted(b, b)), np.sqrt(dotted(c, c))
        below = la * lb * lc + dotted(a, b) * lc + dotted(b, c) * la + dotted(c, a) * lb
        total += 2.0 * np.arctan2(dotted(a, crossed), below)
    return total / (4.0 * np.pi)
