"""Measures exact distances of boxes from triangles, boxes and points, compiled.

Two convex bodies that do not overlap are nearest at a corner of one and a point of the other, or at
an edge of each. If they overlap, an axis among the normals and the cross products of edges shows
how far one must move to be free of the other (separating axes of convex bodies). Distances are
signed: a negative one is the least such way.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted

PARALLEL = 1e-10
"""Sine of the angle between edges below which their cross product is no axis."""
CORNERS = 3
BOX_CORNERS, BOX_EDGES = 8, 12


@loop()
def point_triangle(p: Array, T: Array, near: Array, weights: Array) -> float:
    """Fill in the point of a triangle, (3, 3), nearest to a point, and return its squared distance.

    The last two corners may be one point.

    Source: C. Ericson, Real-Time Collision Detection, section 5.1.5 (regions of Voronoi).

    Takes `p`, `near` (3,); `weights` (2,).
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
    square = 0.0
    for j in range(3):
        near[j] = T[0, j] + v * ab[j] + w * ac[j]
        square += (p[j] - near[j]) ** 2
    return square


@loop()
def segment_segment(a: Array, u: Array, b: Array, v: Array, between: Array, end: Array) -> float:
    """Return the squared distance of the segments a + s u and b + t v, s and t from 0 to 1.

    `between` is filled with the way from the first to the second, `end` with its end.

    Source: C. Ericson, Real-Time Collision Detection, section 5.1.9.
    """
    r = a - b
    uu, vv, uv, ur, vr = dotted(u, u), dotted(v, v), dotted(u, v), dotted(u, r), dotted(v, r)
    s, t = 0.0, 0.0
    if uu > 0.0 and vv > 0.0:
        whole = uu * vv - uv * uv
        if whole > PARALLEL * PARALLEL * uu * vv:
            s = min(max((uv * vr - ur * vv) / whole, 0.0), 1.0)
        t = (uv * s + vr) / vv
        if t < 0.0:
            t = 0.0
            s = min(max(-ur / uu, 0.0), 1.0)
        elif t > 1.0:
            t = 1.0
            s = min(max((uv - ur) / uu, 0.0), 1.0)
    elif uu > 0.0:
        s = min(max(-ur / uu, 0.0), 1.0)
    elif vv > 0.0:
        t = min(max(vr / vv, 0.0), 1.0)
    square = 0.0
    for j in range(3):
        end[j] = b[j] + t * v[j]
        between[j] = end[j] - a[j] - s * u[j]
        square += between[j] ** 2
    return square


@loop()
def point_box(p: Array, h: Array) -> float:
    """Return the squared distance of a point from the box |x_i| <= h_i, zero inside."""
    square = 0.0
    for j in range(3):
        out = max(abs(p[j]) - h[j], 0.0)
        square += out * out
    return square


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
def corners_of(h: Array, R: Array, middle: Array, out: Array) -> None:
    """Fill in the corners of a box with axes R (columns), (8, 3); corner k has the signs of k."""
    for k in range(BOX_CORNERS):
        for i in range(3):
            out[k, i] = middle[i]
            for j in range(3):
                out[k, i] += R[i, j] * (h[j] if k >> j & 1 else -h[j])


@loop()
def edges_of(corners: Array, starts: Array, along: Array) -> None:
    """Fill in where the edges of a box start and how they run, (12, 3) each."""
    n = 0
    for j in range(3):
        for k in range(BOX_CORNERS):
            if not k >> j & 1:
                for i in range(3):
                    starts[n, i] = corners[k, i]
                    along[n, i] = corners[k | 1 << j, i] - corners[k, i]
                n += 1


@loop()
def _gap(axis: Array, h: Array, points: Array) -> float:
    """Return how far a box |x_i| <= h_i and points are apart along an axis; -inf for no axis."""
    length = np.sqrt(dotted(axis, axis))
    if length < PARALLEL:
        return -np.inf
    reach = (abs(axis[0]) * h[0] + abs(axis[1]) * h[1] + abs(axis[2]) * h[2]) / length
    low, high = np.inf, -np.inf
    for k in range(len(points)):
        height = dotted(axis, points[k]) / length
        low, high = min(low, height), max(high, height)
    return max(low - reach, -high - reach)


@loop()
def box_triangle(h: Array, T: Array, limit: float) -> float:
    """Return the signed distance of the box |x_i| <= h_i from a triangle, (3, 3) in its frame.

    Takes `h` (3,).
    """
    axis, unit, sides = np.empty(3), np.zeros(3), np.empty((CORNERS, 3))
    for k in range(CORNERS):
        for j in range(3):
            sides[k, j] = T[(k + 1) % CORNERS, j] - T[k, j]
    cross(sides[0], sides[1], axis)
    widest = _gap(axis / max(np.sqrt(dotted(axis, axis)), 1e-300), h, T)
    for j in range(3):
        unit[:] = 0.0
        unit[j] = 1.0
        widest = max(widest, _gap(unit, h, T))
        if widest > limit:
            return widest
        for k in range(CORNERS):
            length = np.sqrt(dotted(sides[k], sides[k]))
            if length > 0.0:
                cross(unit, sides[k] / length, axis)
                widest = max(widest, _gap(axis, h, T))
    if widest <= 0.0 or widest > limit:
        return widest
    corners, starts, along = np.empty((8, 3)), np.empty((12, 3)), np.empty((12, 3))
    corners_of(h, np.eye(3), np.zeros(3), corners)
    edges_of(corners, starts, along)
    best, near, between, weights = np.inf, np.empty(3), np.empty(3), np.empty(2)
    for k in range(CORNERS):
        best = min(best, point_box(T[k], h))
    for k in range(BOX_CORNERS):
        best = min(best, point_triangle(corners[k], T, near, weights))
    for e in range(BOX_EDGES):
        for k in range(CORNERS):
            best = min(best, segment_segment(starts[e], along[e], T[k], sides[k], between, near))
    return np.sqrt(best)


@loop()
def _try_axis(axis: Array, h: Array, points: Array, widest: float, best: Array) -> float:
    """Return the larger of `widest` and the gap along an axis, and keep the axis if it is that."""
    length = np.sqrt(dotted(axis, axis))
    if length < PARALLEL:
        return widest
    reach = (abs(axis[0]) * h[0] + abs(axis[1]) * h[1] + abs(axis[2]) * h[2]) / length
    low, high = np.inf, -np.inf
    for k in range(len(points)):
        height = dotted(axis, points[k]) / length
        low, high = min(low, height), max(high, height)
    gap, sign = low - reach, 1.0
    if -high - reach > gap:
        gap, sign = -high - reach, -1.0
    if gap > widest:
        for j in range(3):
            best[j] = sign * axis[j] / length
        return gap
    return widest


@loop()
def box_box(
    h: Array, g: Array, R: Array, middle: Array, limit: float, way: Array, point: Array
) -> float:  # fmt: skip
    """Return the signed distance of the box |x_i| <= h_i from another box.

    Takes `h`, `g`, `middle`, `way`, `point` (3,); `R` (3, 3).
    """
    others = np.empty((8, 3))
    corners_of(g, R, middle, others)
    axis, unit, widest = np.empty(3), np.zeros(3), -np.inf
    for j in range(3):
        unit[:] = 0.0
        unit[j] = 1.0
        widest = _try_axis(unit, h, others, widest, way)
        for i in range(3):
            axis[i] = R[i, j]
        widest = _try_axis(axis, h, others, widest, way)
        if widest > limit:
            return widest
    for j in range(3):
        unit[:] = 0.0
        unit[j] = 1.0
        for k in range(3):
            for i in range(3):
                point[i] = R[i, k]
            cross(unit, point, axis)
            widest = _try_axis(axis, h, others, widest, way)
        if widest > limit:
            return widest
    if widest <= 0.0:
        lowest = np.inf
        for k in range(BOX_CORNERS):
            height = dotted(way, others[k])
            if height < lowest:
                lowest = height
                point[:] = others[k]
        return widest
    return _nearest_features(h, g, R, middle, others, way, point)


@loop()
def _nearest_features(
    h: Array, g: Array, R: Array, middle: Array, others: Array, way: Array, point: Array
) -> float:  # fmt: skip
    """Compute the distance of two boxes that do not overlap, from corners and edges."""
    corners, local, best = np.empty((8, 3)), np.empty(3), np.inf
    between, end = np.empty(3), np.empty(3)
    corners_of(h, np.eye(3), np.zeros(3), corners)
    for k in range(BOX_CORNERS):
        square = point_box(others[k], h)
        if square < best:
            best = square
            point[:] = others[k]
            for j in range(3):
                way[j] = others[k, j] - min(max(others[k, j], -h[j]), h[j])
        into_frame(R, middle, corners[k], local)
        square = point_box(local, g)
        if square < best:
            best = square
            for j in range(3):
                local[j] = min(max(local[j], -g[j]), g[j])
            for i in range(3):
                point[i] = middle[i]
                for j in range(3):
                    point[i] += R[i, j] * local[j]
                way[i] = point[i] - corners[k, i]
    starts, along, froms, ways = (
        np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 3))
    )  # fmt: skip
    edges_of(corners, starts, along)
    edges_of(others, froms, ways)
    for e in range(BOX_EDGES):
        for k in range(BOX_EDGES):
            square = segment_segment(starts[e], along[e], froms[k], ways[k], between, end)
            if square < best:
                best = square
                way[:], point[:] = between, end
    distance = np.sqrt(best)
    for j in range(3):
        way[j] /= max(distance, 1e-300)
    return distance
