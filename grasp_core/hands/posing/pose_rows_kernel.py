"""Sums the residuals of a pose: touching, being in regions, and overlaps, compiled.

Residuals are in millimetres. Each is the distance by which something is wrong, and its derivative
is taken along the line to the nearest point, by

    dx = dp + w x (x - c) + sum over the finger's joints of w_k x (x - p_k) dq_k           (1)

for a point x that a link carries, with the palm's move dp, its turn w about the pivot c. A joint
that follows another moves with it by (1) of `couplings`, so that its share is the driver's.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.hands.distances.boxes_kernel import corners_of
from grasp_core.hands.distances.collisions_kernel import (
    may_be_near,
    near_links,
    pair_distance,
    place_shapes,
)
from grasp_core.hands.distances.surface_kernel import nearest
from grasp_core.hands.kinematics_kernel import chains, moved
from grasp_core.hands.loop_values import HandArrays, Pose, Sums, SurfaceTree, Targets, Wanted

MOVES = 6
"""Unknowns of the palm."""
MM = 1e3
EQUAL = 3.0
"""Weight of touching."""
AT_TIP = 1e-6
"""Distance from the middle of a fingertip at which an end of a capsule is that of the tip [m]."""
ANYWHERE = 10.0
"""A distance that is longer than any between a hand and an object [m]."""
ON_SURFACE = 1e-9
"""Distance at which the way to the nearest point is no direction [m]."""


@loop()
def place(hand: HandArrays, targets: Targets, pose: Pose) -> None:
    """Fill in where the links, shapes and fingertips of a pose are."""
    chains(
        hand.positions, hand.rotations, hand.axes, hand.starts, pose.palm, pose.origin, pose.q,
        pose.R, pose.p, pose.W,
    )  # fmt: skip
    place_shapes(hand, pose.palm, pose.origin, pose.R, pose.p, pose.turned, pose.middles)
    for k in range(len(targets.fingers)):
        last = hand.starts[targets.fingers[k] + 1] - 1
        moved(pose.R[last], pose.p[last], hand.tip_centers[targets.fingers[k]], pose.tips[k])


@loop()
def _moves(  # noqa: C901, PLR0913, PLR0917 - a point and a direction
    hand: HandArrays, pose: Pose, sums: Sums, link: int, x: Array, along: Array, sign: float,
    with_palm: bool,
) -> None:  # fmt: skip
    """Add to the row the derivative of sign * along.x for a point x of a link, by (1)."""
    arm, way = np.empty(3), np.empty(3)
    if with_palm:
        for j in range(3):
            arm[j] = x[j] - sums.pivot[j]
            sums.row[j] += sign * along[j] * MM
        cross(arm, along, way)
        for j in range(3):
            sums.row[3 + j] += sign * way[j] * MM
    if link < 0:
        return
    first = 0
    for f in range(len(hand.starts) - 1):
        if hand.starts[f] <= link:
            first = hand.starts[f]
    for k in range(first, link + 1):
        for j in range(3):
            arm[j] = x[j] - pose.p[k, j]
        cross(pose.W[k], arm, way)
        sums.row[MOVES + hand.drivers[k]] += hand.ratios[k] * sign * dotted(way, along) * MM


@loop()
def _add(sums: Sums, residual: float) -> None:
    """Add the row with its residual [mm] to the sums, and clear it."""
    row = sums.row
    for i in range(len(row)):
        if row[i] != 0.0:
            sums.g[i] += row[i] * residual
            for j in range(i + 1):
                sums.H[i, j] += row[i] * row[j]
    row[:] = 0.0


@loop()
def _tip(  # noqa: PLR0913, PLR0917 - a fingertip, a direction and a residual
    hand: HandArrays, pose: Pose, sums: Sums, link: int, k: int, along: Array, weight: float,
    off: float,
) -> None:  # fmt: skip
    """Add a residual of a fingertip, whose derivative is along a direction."""
    sums.parts[1] += (weight * off * MM) ** 2
    _moves(hand, pose, sums, link, pose.tips[k], along, weight, True)
    _add(sums, weight * off * MM)


@loop()
def _touching(  # noqa: C901 - loops that are written out
    hand: HandArrays, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums
) -> None:
    """Add the residuals of fingertips: their planes, contacts and regions."""
    for k in range(len(targets.fingers)):
        finger = targets.fingers[k]
        link, normal = int(hand.starts[finger + 1] - 1), targets.normals[k]
        gap = float(hand.tip_radii[finger])
        for j in range(3):
            gap += (pose.tips[k, j] - targets.origins[k, j]) * normal[j]
        sums.parts[0] = max(sums.parts[0], abs(gap) * MM)
        _tip(hand, pose, sums, link, k, normal, EQUAL, gap)
        pinned = targets.pinned[k] > 0.0
        for side in range(2):
            tangent, off = targets.tangents[k, side], 0.0
            for j in range(3):
                off += (pose.tips[k, j] - targets.origins[k, j]) * tangent[j]
            if pinned:
                sums.parts[0] = max(sums.parts[0], abs(off) * MM)
            _tip(hand, pose, sums, link, k, tangent, EQUAL if pinned else wanted.pull, off)
    for e in range(len(targets.edge_contacts)):
        k, short = targets.edge_contacts[e], wanted.margin
        for j in range(3):
            short -= (pose.tips[k, j] - targets.edge_points[e, j]) * targets.edge_inward[e, j]
        if short > 0.0:
            sums.parts[0] = max(sums.parts[0], (short - wanted.margin) * MM)
            link = int(hand.starts[targets.fingers[k] + 1] - 1)
            _tip(hand, pose, sums, link, k, -targets.edge_inward[e], EQUAL, short)


@loop()
def _outward(center: Array, need: float, tree: SurfaceTree, along: Array) -> float:
    """Return the signed distance of a point from a surface, and fill in the way out.

    Args:
        center: The point, (3,).
        need: Distance above which some number above it is returned.
        tree: The surface.
        along: Filled with the unit vector along which the distance grows, (3,).
    """
    near, square = np.empty(3), 0.0
    for j in range(3):
        square += (center[j] - tree.middles[0, j]) ** 2
    if square > (tree.radii[0] + need) ** 2:
        return ANYWHERE
    t = nearest(center, need, tree.corners, tree.middles, tree.radii, tree.links, near)
    if t < 0:
        if square > tree.radii[0] * tree.radii[0]:
            return ANYWHERE
        # far from the surface: outside, or deep inside
        t = nearest(center, ANYWHERE, tree.corners, tree.middles, tree.radii, tree.links, near)
    away, square = 0.0, 0.0
    for j in range(3):
        along[j] = center[j] - near[j]
        away += along[j] * tree.normals[t, j]
        square += along[j] ** 2
    distance = np.sqrt(square) if away >= 0.0 else -np.sqrt(square)
    if abs(distance) > ON_SURFACE:
        for j in range(3):
            along[j] /= distance
    else:
        along[:] = tree.normals[t]
    return distance


@loop()
def _balls(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums,
) -> None:  # fmt: skip
    """Add the residuals of balls that are too near to the object or the table."""
    x, along = np.empty(3), np.empty(3)
    for b in range(len(hand.ball_links)):
        link = hand.ball_links[b]
        if link < 0:
            moved(pose.palm, pose.origin, hand.ball_centers[b], x)
        else:
            moved(pose.R[link], pose.p[link], hand.ball_centers[b], x)
        need = hand.ball_radii[b] + wanted.clear
        short = need - dotted(targets.up, x) + targets.height
        if short > 0.0:
            sums.parts[2] += (short * MM) ** 2
            _moves(hand, pose, sums, link, x, targets.up, -1.0, True)
            _add(sums, short * MM)
        short = need - _outward(x, need, tree, along)
        if short > 0.0:
            sums.parts[2] += (short * MM) ** 2
            _moves(hand, pose, sums, link, x, along, -1.0, True)
            _add(sums, short * MM)


@loop()
def _links(hand: HandArrays, wanted: Wanted, pose: Pose, sums: Sums) -> None:
    """Add the residuals of links that are too near to each other."""
    x, along = np.empty(3), np.empty(3)
    near = np.empty((len(hand.link_shapes), len(hand.link_shapes)), np.bool_)
    near_links(hand, pose.middles, wanted.apart, near)
    for n in range(len(hand.pairs)):
        a, b = hand.pairs[n, 0], hand.pairs[n, 1]
        if not near[hand.shape_links[a] + 1, hand.shape_links[b] + 1]:
            continue
        if not may_be_near(pose.middles, hand.shape_reaches, a, b, wanted.apart):
            continue
        short = wanted.apart - pair_distance(
            hand, pose.turned, pose.middles, a, b, wanted.apart, along, x
        )
        if short > 0.0:
            sums.parts[2] += (short * MM) ** 2
            _moves(hand, pose, sums, int(hand.shape_links[a]), x, along, 1.0, False)
            _moves(hand, pose, sums, int(hand.shape_links[b]), x, along, -1.0, False)
            _add(sums, short * MM)


@loop()
def _deepest(hand: HandArrays, targets: Targets, pose: Pose, k: int, s: int, x: Array) -> float:
    """Return how far a shape reaches behind the plane of a contact, and fill in its corner there.

    Ends of capsules that are the fingertip itself do not count.
    """
    corners, deepest = np.empty((8, 3)), -np.inf
    corners_of(hand.shape_sizes[s], pose.turned[s], pose.middles[s], corners)
    for c in range(len(corners)):
        square, height = 0.0, hand.shape_radii[s]
        for j in range(3):
            square += (corners[c, j] - pose.tips[k, j]) ** 2
            height += (corners[c, j] - targets.origins[k, j]) * targets.normals[k, j]
        if square > AT_TIP * AT_TIP and height > deepest:
            deepest = height
            x[:] = corners[c]
    return deepest


@loop()
def _last_links(hand: HandArrays, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums) -> None:
    """Add the residuals of last links: behind the planes that tips touch, and tips on the table."""
    x = np.empty(3)
    for k in range(len(targets.fingers)):
        last = int(hand.starts[targets.fingers[k] + 1] - 1)
        short = float(hand.tip_radii[targets.fingers[k]]) + wanted.clear + targets.height
        short -= dotted(targets.up, pose.tips[k])
        if short > 0.0:
            sums.parts[2] += (short * MM) ** 2
            _moves(hand, pose, sums, last, pose.tips[k], targets.up, -1.0, True)
            _add(sums, short * MM)
        for s in range(len(hand.shape_links)):
            if hand.shape_links[s] == last:
                short = _deepest(hand, targets, pose, k, s, x) + wanted.behind
                if short > 0.0:
                    sums.parts[2] += (short * MM) ** 2
                    _moves(hand, pose, sums, last, x, targets.normals[k], 1.0, True)
                    _add(sums, short * MM)


@loop()
def residuals(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums,
) -> None:  # fmt: skip
    """Sum all residuals of a pose, and their products with their derivatives."""
    place(hand, targets, pose)
    sums.parts[:] = 0.0
    sums.H[:] = 0.0
    sums.g[:] = 0.0
    _touching(hand, targets, wanted, pose, sums)
    if wanted.overlaps:
        _balls(hand, tree, targets, wanted, pose, sums)
        _links(hand, wanted, pose, sums)
        _last_links(hand, targets, wanted, pose, sums)
