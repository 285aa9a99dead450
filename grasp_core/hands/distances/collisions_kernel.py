"""Measures how far a hand is from itself, from an object and from a table, compiled."""

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import dotted
from grasp_core.hands.distances.boxes_kernel import box_box, into_frame
from grasp_core.hands.distances.surface_kernel import box_surface, windings
from grasp_core.hands.kinematics_kernel import moved, product
from grasp_core.hands.loop_values import HandArrays, SurfaceTree

INSIDE = 0.5
"""Windings of a surface around a point from which the point counts as inside."""
ROUNDING = 1e-9
"""Distance beyond a limit from which a quick bound on a distance decides [m]."""


@loop()
def place_shapes(  # noqa: PLR0913, PLR0917 - poses in, poses out
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
    """Fill in which links, the palm first, may be as near to each other as a limit, by their balls.

    Args:
        hand: The hand.
        middles: Middles of its shapes, (s, 3).
        limit: The distance.
        near: Filled in both ways round, (j + 1, j + 1).
    """
    for a in range(len(hand.link_shapes)):
        for b in range(a):
            one, other, square = hand.link_shapes[a], hand.link_shapes[b], 0.0
            if one >= 0 and other >= 0:
                for k in range(3):
                    square += (middles[one, k] - middles[other, k]) ** 2
            reach = limit + hand.link_reaches[a] + hand.link_reaches[b]
            near[a, b] = near[b, a] = reach >= 0.0 and square <= reach * reach


@loop()
def may_be_near(middles: Array, reaches: Array, i: int, j: int, limit: float) -> bool:
    """Return whether two shapes may be as near as a limit, by the balls that hold them.

    A call with few arguments costs less than one with a whole hand.

    Args:
        middles: Middles of the shapes, (s, 3).
        reaches: Radii of the balls, (s,).
        i: The first shape.
        j: The second.
        limit: The distance.
    """
    square = 0.0
    for k in range(3):
        square += (middles[i, k] - middles[j, k]) ** 2
    reach = limit + reaches[i] + reaches[j]
    return reach >= 0.0 and square <= reach * reach


@loop()
def _apart_by_faces(hand: HandArrays, turned: Array, middles: Array, i: int, j: int) -> float:
    """Return how far the boxes of two shapes are apart at least, along the axes of either."""
    widest = -np.inf
    for one, other in ((i, j), (j, i)):
        for a in range(3):
            height, reach = 0.0, hand.shape_sizes[one, a]
            for k in range(3):
                height += turned[one, k, a] * (middles[other, k] - middles[one, k])
            for b in range(3):
                along = 0.0
                for k in range(3):
                    along += turned[one, k, a] * turned[other, k, b]
                reach += abs(along) * hand.shape_sizes[other, b]
            widest = max(widest, abs(height) - reach)
    return widest


@loop()
def pair_distance(  # noqa: PLR0913, PLR0917 - two shapes, and where they are nearest
    hand: HandArrays, turned: Array, middles: Array, i: int, j: int, limit: float, way: Array,
    point: Array,
) -> float:  # fmt: skip
    """Return the signed distance of two shapes of a hand.

    Args:
        hand: The hand.
        turned: Axes of its shapes, (s, 3, 3).
        middles: Their middles, (s, 3).
        i: The first shape.
        j: The second.
        limit: Distance above which some number above it is returned, and nothing is filled in.
        way: Filled with the unit vector along which the second moves away soonest, (3,).
        point: Filled with a point between the two, (3,).
    """
    both = hand.shape_radii[i] + hand.shape_radii[j]
    h, g = hand.shape_sizes[i], hand.shape_sizes[j]
    apart = _apart_by_faces(hand, turned, middles, i, j) - both
    if apart > limit + ROUNDING:
        return apart
    local, between, found, at = np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3)
    into_frame(turned[i], middles[i], middles[j], local)
    for a in range(3):
        for b in range(3):
            between[a, b] = (
                turned[i, 0, a] * turned[j, 0, b]
                + turned[i, 1, a] * turned[j, 1, b]
                + turned[i, 2, a] * turned[j, 2, b]
            )
    apart = box_box(h, g, between, local, limit + both, found, at) - both
    if apart <= limit:
        for a in range(3):
            at[a] -= found[a] * hand.shape_radii[j]
        moved(turned[i], middles[i], at, point)
        for a in range(3):
            way[a] = 0.0
            for b in range(3):
                way[a] += turned[i, a, b] * found[b]
    return apart


@loop()
def of_itself(
    hand: HandArrays, turned: Array, middles: Array, need: float, worst: Indices
) -> float:
    """Return the least distance between shapes of a hand that must not overlap.

    Args:
        hand: The hand.
        turned: Axes of its shapes, (s, 3, 3).
        middles: Their middles, (s, 3).
        need: Distance above which the exact one does not matter.
        worst: Filled with the two shapes that are nearest, (2,); -1 if none is below `need`.
    """
    best, way, point = np.nextafter(need, np.inf), np.empty(3), np.empty(3)
    near = np.empty((len(hand.link_shapes), len(hand.link_shapes)), np.bool_)
    near_links(hand, middles, best, near)
    worst[:] = -1
    for n in range(len(hand.pairs)):
        i, j = hand.pairs[n, 0], hand.pairs[n, 1]
        if not near[hand.shape_links[i] + 1, hand.shape_links[j] + 1]:
            continue
        if not may_be_near(middles, hand.shape_reaches, i, j, best):
            continue
        apart = pair_distance(hand, turned, middles, i, j, best, way, point)
        if apart < best:
            best = apart
            worst[0], worst[1] = i, j
    return best


@loop()
def of_object(
    hand: HandArrays, turned: Array, middles: Array, tree: SurfaceTree, needs: Array, worst: Indices
) -> float:  # fmt: skip
    """Return the least distance of shapes from a surface, beyond what each of them needs.

    Args:
        hand: The hand.
        turned: Axes of its shapes, (s, 3, 3).
        middles: Their middles, (s, 3).
        tree: The surface.
        needs: Least distance of each shape, (s,).
        worst: Filled with the shape that lacks most, (1,); -1 if none does.
    """
    best = np.inf
    worst[0] = -1
    low, high = tree.corners[0, 0].copy(), tree.corners[0, 0].copy()
    for j in range(3):
        low[j] = tree.middles[0, j] - tree.radii[0]
        high[j] = tree.middles[0, j] + tree.radii[0]
    for s in range(len(hand.shape_links)):
        radius = hand.shape_radii[s]
        apart = box_surface(
            hand.shape_sizes[s], turned[s], middles[s], needs[s] + radius, tree.corners,
            tree.middles, tree.radii, tree.links,
        ) - radius - needs[s]  # fmt: skip
        inner = True
        for j in range(3):
            inner = inner and low[j] < middles[s, j] < high[j]
        if apart >= 0.0 and inner and windings(middles[s], tree.corners) > INSIDE:
            apart = -tree.radii[0]
        if apart < min(best, 0.0):
            worst[0] = s
        best = min(best, apart)
    return best


@loop()
def of_table(
    hand: HandArrays, turned: Array, middles: Array, up: Array, height: float, worst: Indices
) -> float:  # fmt: skip
    """Return the least height of a hand's shapes over a plane.

    Args:
        hand: The hand.
        turned: Axes of its shapes, (s, 3, 3).
        middles: Their middles, (s, 3).
        up: Unit normal of the plane, (3,).
        height: The plane's height along it.
        worst: Filled with the lowest shape, (1,).
    """
    best = np.inf
    for s in range(len(hand.shape_links)):
        lowest = dotted(up, middles[s]) - height - hand.shape_radii[s]
        for k in range(3):
            lowest -= hand.shape_sizes[s, k] * abs(
                up[0] * turned[s, 0, k] + up[1] * turned[s, 1, k] + up[2] * turned[s, 2, k]
            )
        if lowest < best:
            best = lowest
            worst[0] = s
    return best
