"""Finds the point of a surface nearest to another, and the distance of boxes from it, compiled."""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.hands.distances.boxes_kernel import (
    box_triangle,
    into_frame,
    point_box,
    point_triangle,
)

DEEPEST = 64
"""Places on the stack of a walk through the tree; a tree of 2^32 triangles needs fewer."""


@loop()
def nearest(
    p: Array, within: float, corners: Array, middles: Array, radii: Array, links: Indices,
    near: Array,
) -> int:  # fmt: skip
    """Fill in the point of a surface nearest to a point, and return its triangle.

    Takes `p`, `near` (3,); `middles` (n, 3); `radii` (n,); `links` (n, 2). Gives the triangle's
    place in the tree, or -1 if none is within the distance.
    """
    stack, gaps, found, depth = np.empty(DEEPEST, np.int64), np.empty(DEEPEST), -1, 1
    best, at, gap2, weights = within * within, np.empty(3), np.empty(2), np.empty(2)
    stack[0], gaps[0] = 0, 0.0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if gaps[depth] > 0.0 and gaps[depth] * gaps[depth] >= best:
            continue
        if links[node, 0] < 0:
            for t in range(links[node, 1], links[node, 1] - links[node, 0]):
                square = point_triangle(p, corners[t], at, weights)
                if square < best:
                    best, found = square, t
                    near[:] = at
            continue
        for side in range(2):
            child, square = links[node, side], 0.0
            for j in range(3):
                square += (p[j] - middles[child, j]) ** 2
            gap2[side] = np.sqrt(square) - radii[child]
        far = 0 if gap2[0] > gap2[1] else 1
        for side in (far, 1 - far):
            if gap2[side] <= 0.0 or gap2[side] * gap2[side] < best:
                stack[depth], gaps[depth] = links[node, side], gap2[side]
                depth += 1
    return found


@loop()
def box_surface(
    h: Array, R: Array, middle: Array, limit: float, corners: Array, middles: Array, radii: Array,
    links: Indices,
) -> float:  # fmt: skip
    """Return the signed distance of a box from a surface, or some number above the limit.

    Takes `h`, `middle` (3,); `R` (3, 3); `middles` (n, 3); `radii` (n,); `links` (n, 2).
    """
    stack, depth, local, T = np.empty(DEEPEST, np.int64), 1, np.empty(3), np.empty((3, 3))
    best = np.nextafter(limit, np.inf)
    stack[0] = 0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        into_frame(R, middle, middles[node], local)
        if np.sqrt(point_box(local, h)) - radii[node] > max(best, 0.0):
            continue
        if links[node, 0] >= 0:
            stack[depth], stack[depth + 1] = links[node, 0], links[node, 1]
            depth += 2
            continue
        for t in range(links[node, 1], links[node, 1] - links[node, 0]):
            for k in range(3):
                into_frame(R, middle, corners[t, k], T[k])
            best = min(best, box_triangle(h, T, best))
    return best


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
