"""Says where the parts of a hand are, and how far from itself, an object and a table, compiled."""

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.hands.distances_kernel import (
    corners_of,
    hull_hull,
    hull_surface,
    nearest,
    reaching,
    squared,
    windings,
)
from grasp_core.hands.hand_arrays import HandArrays, SurfaceTree

INSIDE_WINDINGS = 0.5  # windings of a surface around a point from which the point counts as inside
DISTANCE_SLACK = 1e-9
"""Distance beyond a limit from which a quick bound on a distance decides, up to which hulls
overlap, and by which links of a posture may be nearer than is asked for [m]."""
FACE_AXES, BOX_AXES = 6, 15
"""Normals that may separate two boxes, and all axes, with those from edges."""
PARALLEL_EDGES = 1e-10
"""Sine of the angle between edges below which their cross product is no axis."""


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
def place_links(
    hand: HandArrays, palm_rotation: Array, palm_position: Array, angles: Array, R: Array, p: Array,
    W: Array,
) -> None:  # fmt: skip
    """Fill in where links are for one set of joint angles."""
    about, frame = np.empty((3, 3)), np.empty((3, 3))
    for f in range(len(hand.starts) - 1):
        before, origin = palm_rotation, palm_position
        for k in range(hand.starts[f], hand.starts[f + 1]):
            moved(before, origin, hand.positions[k], p[k])
            product(before, hand.rotations[k], frame)
            for i in range(3):
                W[k, i] = dotted(frame[i], hand.axes[k])
            turn(hand.axes[k], angles[k], about)
            product(frame, about, R[k])
            before, origin = R[k], p[k]


@loop()
def place_shapes(
    hand: HandArrays, palm_rotation: Array, palm_position: Array, R: Array, p: Array, turned: Array,
    middles: Array,
) -> None:  # fmt: skip
    """Fill in the axes, (s, 3, 3), and middles, (s, 3), of the shapes of a hand."""
    for s in range(len(hand.shape_links)):
        link = hand.shape_links[s]
        frame = palm_rotation if link < 0 else R[link]
        origin = palm_position if link < 0 else p[link]
        product(frame, hand.shape_rotations[s], turned[s])
        moved(frame, origin, hand.shape_positions[s], middles[s])


@loop()
def near_links(hand: HandArrays, middles: Array, limit: float, near: NDArray[np.bool_]) -> None:
    """Fill in which links, the palm first, may be as near as a limit, by their balls."""
    for a in range(len(hand.link_shapes)):
        for b in range(a):
            one, other, square = hand.link_shapes[a], hand.link_shapes[b], 0.0
            if one >= 0 and other >= 0:
                square = squared(middles[one], middles[other])
            reach = limit + hand.link_reaches[a] + hand.link_reaches[b]
            near[a, b] = near[b, a] = reach >= 0.0 and square <= reach * reach


@loop()
def may_be_near(middles: Array, reaches: Array, i: int, j: int, limit: float) -> bool:
    """Return whether balls of two shapes are as near as a limit; few arguments make calls cheap."""
    reach = limit + reaches[i] + reaches[j]
    return reach >= 0.0 and squared(middles[i], middles[j]) <= reach * reach


@loop(once=True)
def _separation(
    hand: HandArrays, turned: Array, middles: Array, i: int, j: int, limit: float, way: Array
) -> float:  # fmt: skip
    """Return how far the boxes of two shapes are apart at least, and fill in the way to the second.

    It is the farthest along a normal of either or the cross product of an edge of each (separating
    axes of convex bodies). If they overlap, the way is the least by which the second must move to
    be free. Ends with the first axis beyond the limit.
    """
    widest, one, other = -np.inf, turned[i].T.copy(), turned[j].T.copy()
    between, axis = middles[j] - middles[i], np.empty(3)
    for n in range(BOX_AXES):
        if n < FACE_AXES:
            copy(one[n // 2] if n % 2 == 0 else other[n // 2], axis)
        else:
            cross(one[n % 3], other[n // 3 - 2], axis)
            length = np.sqrt(dotted(axis, axis))
            if length < PARALLEL_EDGES:
                continue
            for k in range(3):
                axis[k] /= length
        ahead = dotted(axis, between)
        gap = abs(ahead)
        for k in range(3):
            gap -= hand.shape_sizes[i, k] * abs(dotted(axis, one[k]))
            gap -= hand.shape_sizes[j, k] * abs(dotted(axis, other[k]))
        if gap > widest:
            widest = gap
            for k in range(3):
                way[k] = axis[k] if ahead >= 0.0 else -axis[k]
            if widest > limit:
                break
    return widest


@loop()
def is_block(hand: HandArrays, s: int) -> bool:
    """Return whether a shape covers a fingertip that is a block."""
    finger = hand.shape_tips[s]
    return bool(finger >= 0 and hand.tip_firsts[finger + 1] - hand.tip_firsts[finger] > 1)


@loop()
def core_in(hand: HandArrays, R: Array, middle: Array, s: int) -> tuple[Array, float]:
    """Return corners (m, 3) whose hull is a shape, or its block, but for a rounding, and that."""
    if not is_block(hand, s):
        return corners_of(hand.shape_sizes[s], R, middle), float(hand.shape_radii[s])
    first, end = hand.tip_firsts[hand.shape_tips[s]], hand.tip_firsts[hand.shape_tips[s] + 1]
    corners = np.empty((end - first, 3))
    for c in range(first, end):
        moved(R, middle, hand.cover_corners[c], corners[c - first])
    return corners, float(hand.tip_roundings[hand.shape_tips[s]])


@loop()
def pair_distance(
    hand: HandArrays, turned: Array, middles: Array, i: int, j: int, limit: float, way: Array,
    point: Array,
) -> float:  # fmt: skip
    """Return the signed distance of two shapes of a hand, or a bound on it beyond a limit.

    Up to the limit, fills in the unit way from the first to the second, and the second's point. If
    hulls overlap, it is the least way by which their boxes, or what covers blocks, come apart.
    """
    radii = hand.shape_radii[i] + hand.shape_radii[j]
    apart = _separation(hand, turned, middles, i, j, limit + radii + DISTANCE_SLACK, way) - radii
    if apart > limit + DISTANCE_SLACK:
        return apart
    corners, own = core_in(hand, turned[i], middles[i], i)
    others, rounding = core_in(hand, turned[j], middles[j], j)
    near, both = np.empty(3), own + rounding
    exact = hull_hull(corners, others, limit + both, near, point)
    if exact > limit + both:
        return exact - both
    if exact > DISTANCE_SLACK:
        apart, length = exact - both, np.sqrt(squared(near, point))
        for k in range(3):
            way[k] = (point[k] - near[k]) / length
    else:
        copy(others[reaching(others, way, -1.0)], point)
    for k in range(3):
        point[k] -= rounding * way[k]
    return apart


@loop()
def of_itself(hand: HandArrays, turned: Array, middles: Array, need: float) -> float:
    """Return the least distance between shapes of a hand that must not overlap."""
    best, way, point = np.nextafter(need, np.inf), np.empty(3), np.empty(3)
    near = np.empty((len(hand.link_shapes), len(hand.link_shapes)), np.bool_)
    near_links(hand, middles, best, near)
    for n in range(len(hand.pairs)):
        i, j = hand.pairs[n, 0], hand.pairs[n, 1]
        if not near[hand.shape_links[i] + 1, hand.shape_links[j] + 1]:
            continue
        if may_be_near(middles, hand.shape_reaches, i, j, best):
            best = min(best, pair_distance(hand, turned, middles, i, j, best, way, point))
    return best


@loop()
def tip_surface(
    hand: HandArrays, turned: Array, middles: Array, tree: SurfaceTree, finger: int, near: Array,
    other: Array,
) -> float:  # fmt: skip
    """Return a surface's distance from a tip's hull, zero in it; its rounding where it touches."""
    s = hand.tip_shapes[finger]
    if is_block(hand, s):
        corners, _ = core_in(hand, turned[s], middles[s], s)
        return hull_surface(corners, np.inf, tree, near, other)
    copy(middles[s], near)
    nearest(near, np.inf, tree, other)
    return np.sqrt(squared(other, near))


@loop()
def deepest(corners: Array, tree: SurfaceTree, near: Array, other: Array) -> float:
    """Return the signed distance from a surface of the corner that is deepest in it."""
    best, at = np.inf, np.empty(3)
    for c in range(len(corners)):
        nearest(corners[c], np.inf, tree, at)
        away = np.sqrt(squared(corners[c], at))
        if windings(corners[c], tree.corners) > INSIDE_WINDINGS:
            away = -away
        if away < best:
            best = away
            copy(corners[c], near)
            copy(at, other)
    return best


@loop()
def of_object(
    hand: HandArrays, turned: Array, middles: Array, tree: SurfaceTree, needs: Array
) -> float:  # fmt: skip
    """Return the least distance of shapes from a surface beyond what each needs, if negative.

    A shape whose hull overlaps the surface, or is inside it, is as deep as the surface is large.
    """
    best, near, other = np.inf, np.empty(3), np.empty(3)
    low, high = tree.middles[0] - tree.radii[0], tree.middles[0] + tree.radii[0]
    for s in range(len(hand.shape_links)):
        reach = tree.radii[0] + hand.shape_reaches[s] + needs[s]
        if reach < 0.0 or squared(middles[s], tree.middles[0]) > reach * reach:
            continue
        corners, rounding = core_in(hand, turned[s], middles[s], s)
        apart = hull_surface(corners, needs[s] + rounding, tree, near, other)
        if (low < corners[0]).all() and (corners[0] < high).all() and apart > DISTANCE_SLACK:
            apart = 0.0 if windings(corners[0], tree.corners) > INSIDE_WINDINGS else apart
        best = min(best, apart - rounding - needs[s] if apart > DISTANCE_SLACK else -tree.radii[0])
    return best


@loop()
def of_table(hand: HandArrays, turned: Array, middles: Array, up: Array, height: float) -> float:
    """Return the least height of a hand's shapes over a plane."""
    best = np.inf
    for s in range(len(hand.shape_links)):
        corners, rounding = core_in(hand, turned[s], middles[s], s)
        for c in range(len(corners)):
            best = min(best, dotted(up, corners[c]) - height - rounding)
    return best


@loop()
def free_postures(
    hand: HandArrays, angles: Array, apart: float, widest: float, kept: Indices, tips: Array
) -> int:
    """Choose angles, (n, j), at which a hand is free and tips are near; return how many."""
    count, fingers, found = len(hand.axes), len(hand.tip_radii), 0
    R, p, W = np.empty((count, 3, 3)), np.empty((count, 3)), np.empty((count, 3))
    turned, middles = np.empty((len(hand.shape_links), 3, 3)), np.empty((len(hand.shape_links), 3))
    eye, zero, middle = np.eye(3), np.zeros(3), np.empty(3)
    for n in range(len(angles)):
        if found == len(kept):
            break
        place_links(hand, eye, zero, angles[n], R, p, W)
        middle[:] = 0.0
        for f in range(fingers):
            last = hand.starts[f + 1] - 1
            moved(R[last], p[last], hand.tip_centers[f], tips[found, f])
            for j in range(3):
                middle[j] += tips[found, f, j] / fingers
        near = True
        for f in range(fingers):
            near = near and squared(tips[found, f], middle) <= widest * widest
        if not near:
            continue
        place_shapes(hand, eye, zero, R, p, turned, middles)
        # parts may be built as near to each other as that
        if of_itself(hand, turned, middles, apart) >= apart - DISTANCE_SLACK:
            kept[found] = n
            found += 1
    return found
