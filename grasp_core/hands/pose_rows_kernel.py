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
from grasp_core.hands.collisions_kernel import (
    core_in,
    is_block,
    may_be_near,
    near_links,
    pair_distance,
    place_shapes,
)
from grasp_core.hands.distances_kernel import nearest
from grasp_core.hands.hand_arrays import HandArrays, Pose, Sums, SurfaceTree, Targets, Wanted
from grasp_core.hands.kinematics_kernel import chains, moved

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
        point = targets.touching[k].copy()
        front = _ahead(hand, pose.R[last], targets, k, point, pose.rolls[k])
        moved(pose.R[last], pose.p[last], hand.tip_corners[front], pose.fronts[k])
        moved(pose.R[last], pose.p[last], point, pose.tips[k])


@loop()
def _ahead(
    hand: HandArrays, R: Array, targets: Targets, k: int, point: Array, roll: Array
) -> int:  # fmt: skip
    """Return the corner of a contact's tip that reaches farthest, and fill in the point that does.

    The corner of a block that is farthest along the normal n jumps as the block turns. For the
    point p, corners c count with weights w that fall by the factor e for each height s below
    the farthest, so that it moves steadily: by M dv for a small turn dv of the block, beside what
    the turn moves a point of the block, with

        M = sum of w (c - p) ((c - p) x n)' / s.                                           (2)
    """
    finger, n, way, arm = targets.fingers[k], targets.normals[k], np.empty(3), np.empty(3)
    first, count = hand.tip_firsts[finger], hand.tip_firsts[finger + 1] - hand.tip_firsts[finger]
    heights = np.empty(count)
    roll[:] = 0.0
    for j in range(3):
        way[j] = R[0, j] * n[0] + R[1, j] * n[1] + R[2, j] * n[2]
    for c in range(count):
        heights[c] = dotted(way, hand.tip_corners[first + c])
    front = int(np.argmax(heights))
    if count == 1:
        point[:] = hand.tip_corners[first]
    if not np.isnan(point[0]):
        return int(first + front)
    weights = np.exp((heights - heights[front]) / targets.soft)
    weights /= weights.sum()
    for j in range(3):
        point[j] = (weights * hand.tip_corners[first : first + count, j]).sum()
    for c in range(count):
        for i in range(3):
            arm[i] = dotted(R[i], hand.tip_corners[first + c]) - dotted(R[i], point)
        cross(arm, n, way)
        for i in range(3):
            for j in range(3):
                roll[i, j] += weights[c] * arm[i] * way[j] / targets.soft
    return int(first + front)


@loop()
def _moves(
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
def _tip(
    hand: HandArrays, pose: Pose, sums: Sums, link: int, k: int, along: Array, weight: float,
    off: float,
) -> None:  # fmt: skip
    """Add a residual of a fingertip, whose derivative is along a direction."""
    sums.parts[1] += (weight * off * MM) ** 2
    _moves(hand, pose, sums, link, pose.tips[k], along, weight, True)
    turn, first = np.zeros(3), 0
    for j in range(3):
        for i in range(3):
            turn[j] += along[i] * pose.rolls[k, i, j]
        sums.row[3 + j] += weight * turn[j] * MM
    for f in range(len(hand.starts) - 1):
        if hand.starts[f] <= link:
            first = hand.starts[f]
    for a in range(first, link + 1):
        turned = hand.ratios[a] * weight * dotted(pose.W[a], turn) * MM
        sums.row[MOVES + hand.drivers[a]] += turned
    _add(sums, weight * off * MM)


@loop()
def _touching(hand: HandArrays, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums) -> None:
    """Add the residuals of fingertips: their planes, contacts and regions."""
    for k in range(len(targets.fingers)):
        finger = targets.fingers[k]
        link, normal = int(hand.starts[finger + 1] - 1), targets.normals[k]
        gap = float(hand.tip_roundings[finger])
        for j in range(3):
            gap += (pose.fronts[k, j] - targets.origins[k, j]) * normal[j]
        sums.parts[0] = max(sums.parts[0], abs(gap) * MM)
        sums.parts[1] += (EQUAL * gap * MM) ** 2
        _moves(hand, pose, sums, link, pose.fronts[k], normal, EQUAL, True)
        _add(sums, EQUAL * gap * MM)
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
    """Return the signed distance of a point from a surface, and fill in the way out."""
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
def _keep_off(
    hand: HandArrays, pose: Pose, sums: Sums, link: int, x: Array, along: Array, sign: float,
    short: float,
) -> None:  # fmt: skip
    """Add the residual of a point that must move by `short` against sign * along."""
    sums.parts[2] += (short * MM) ** 2
    _moves(hand, pose, sums, link, x, along, sign, True)
    _add(sums, short * MM)


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
            _keep_off(hand, pose, sums, link, x, targets.up, -1.0, short)
        short = need - _outward(x, need, tree, along)
        if short > 0.0:
            _keep_off(hand, pose, sums, link, x, along, -1.0, short)


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
def _farthest(
    hand: HandArrays, pose: Pose, s: int, origin: Array, way: Array, left_out: Array, x: Array
) -> float:  # fmt: skip
    """Return how far a shape reaches beyond a plane, and fill in its corner there."""
    (corners, rounding), farthest = core_in(hand, pose.turned[s], pose.middles[s], s), -np.inf
    for c in range(len(corners)):
        square, height = 0.0, rounding
        for j in range(3):
            square += (corners[c, j] - left_out[j]) ** 2
            height += (corners[c, j] - origin[j]) * way[j]
        if square > AT_TIP * AT_TIP and height > farthest:
            farthest = height
            x[:] = corners[c]
    return farthest


@loop()
def _last_links(hand: HandArrays, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums) -> None:
    """Add residuals of last links behind their tips' planes, and of tips over the table."""
    x, down, zero = np.empty(3), -targets.up, np.zeros(3)
    for k in range(len(targets.fingers)):
        finger = targets.fingers[k]
        last = int(hand.starts[finger + 1] - 1)
        if hand.tip_firsts[finger + 1] - hand.tip_firsts[finger] == 1:
            short = float(hand.tip_radii[finger]) + wanted.clear + targets.height
            short -= dotted(targets.up, pose.tips[k])
            if short > 0.0:
                _keep_off(hand, pose, sums, last, pose.tips[k], targets.up, -1.0, short)
        for s in range(len(hand.shape_links)):
            if hand.shape_links[s] != last:
                continue
            if not is_block(hand, s):
                way, tip = targets.normals[k], pose.tips[k]
                short = _farthest(hand, pose, s, targets.origins[k], way, tip, x) + wanted.behind
                if short > 0.0:
                    _keep_off(hand, pose, sums, last, x, way, 1.0, short)
            elif targets.height > -np.inf:
                short = _farthest(hand, pose, s, zero, down, pose.tips[k], x)
                short += wanted.clear + targets.height
                if short > 0.0:
                    _keep_off(hand, pose, sums, last, x, down, 1.0, short)


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
