"""Moves a hand until fingertips touch given planes and nothing else is touched, compiled.

Residuals are in millimetres: touching, being in regions, and overlaps. Each is the distance by
which something is wrong, and its derivative is taken along the line to the nearest point, by

    dx = dp + w x (x - c) + sum over the finger's joints of w_k x (x - p_k) dq_k           (1)

for a point x that a link carries, with the palm's move dp, its turn w about the pivot c, the
contacts' middle. A joint that follows another moves with it by (2) of `hand`, so that its
share is the driver's.

Gauss and Newton's steps with Levenberg's damping make the sum of squares small. Unknown are the
move and turn of the palm and the angles of the joints that follow no other; joints that stand at a
limit and would go beyond are held there for the step.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.geometry.vectors_kernel import cross, dotted
from grasp_core.hands.collisions_kernel import (
    core_in,
    is_block,
    may_be_near,
    moved,
    near_links,
    pair_distance,
    place_links,
    place_shapes,
    product,
    tip_surface,
    turn,
)
from grasp_core.hands.distances_kernel import into_frame, nearest, squared
from grasp_core.hands.hand_arrays import Gaps, HandArrays, HandPose, Sums, SurfaceTree, Targets

PALM_MOVE, LARGEST_TURN = 0.02, 0.35  # largest step [m, rad]
DAMPING = 30.0
"""Added to the squares of the millimetres by which a metre, or a radian, moves what is wrong."""
STALLED, MOST_STALLED = 0.02, 4
"""A start is given up after so many steps in a row that make the cost smaller by less than this."""
BACK = 2.5e-4
"""How far the plane of a block is moved at once that overlaps the surface [m]."""
NO_OVERLAP = 1e-9  # sum of squares below which nothing overlaps [mm^2]
OF_PALM = 6  # unknowns of the palm
OFF_PART, TOUCH_PART, OVERLAP_PART = 0, 1, 2  # places of what `Sums.parts` holds
MM = 1e3
EQUAL = 3.0  # weight of touching
AT_TIP = 1e-6
"""Distance from the middle of a fingertip at which an end of a capsule is that of the tip [m]."""
ANYWHERE = 10.0  # a distance that is longer than any between a hand and an object [m]
NO_DIRECTION = 1e-9  # distance at which the way to the nearest point is no direction [m]


@loop()
def place(hand: HandArrays, targets: Targets, pose: HandPose) -> None:
    """Fill in where the links, shapes and fingertips of a pose are."""
    place_links(hand, pose.palm, pose.origin, pose.q, pose.R, pose.p, pose.W)
    place_shapes(hand, pose.palm, pose.origin, pose.R, pose.p, pose.turned, pose.middles)
    for k in range(len(targets.fingers)):
        last = hand.starts[targets.fingers[k] + 1] - 1
        point = targets.touching[k].copy()
        front = _ahead(hand, pose.R[last], targets, k, point, pose.rolls[k])
        moved(pose.R[last], pose.p[last], hand.tip_corners[front], pose.fronts[k])
        moved(pose.R[last], pose.p[last], point, pose.tips[k])


@loop(once=True)
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
        copy(hand.tip_corners[first], point)
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
    hand: HandArrays, pose: HandPose, sums: Sums, link: int, x: Array, along: Array, sign: float,
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
    for k in range(hand.link_firsts[link], link + 1):
        for j in range(3):
            arm[j] = x[j] - pose.p[k, j]
        cross(pose.W[k], arm, way)
        sums.row[OF_PALM + hand.drivers[k]] += hand.ratios[k] * sign * dotted(way, along) * MM


@loop()
def _add(sums: Sums, part: int, residual: float) -> None:
    """Add the row with its residual [mm] to the sums, and its square to a part; clear the row."""
    row = sums.row
    sums.parts[part] += residual**2
    for i in range(len(row)):
        if row[i] != 0.0:
            sums.g[i] += row[i] * residual
            for j in range(i + 1):
                sums.H[i, j] += row[i] * row[j]
    row[:] = 0.0


@loop()
def _tip(
    hand: HandArrays, pose: HandPose, sums: Sums, link: int, k: int, along: Array, weight: float,
    off: float,
) -> None:  # fmt: skip
    """Add a residual of a fingertip, whose derivative is along a direction."""
    _moves(hand, pose, sums, link, pose.tips[k], along, weight, True)
    rolled = np.zeros(3)
    for j in range(3):
        for i in range(3):
            rolled[j] += along[i] * pose.rolls[k, i, j]
        sums.row[3 + j] += weight * rolled[j] * MM
    for a in range(hand.link_firsts[link], link + 1):
        turned = hand.ratios[a] * weight * dotted(pose.W[a], rolled) * MM
        sums.row[OF_PALM + hand.drivers[a]] += turned
    _add(sums, TOUCH_PART, weight * off * MM)


@loop(once=True)
def _touching(hand: HandArrays, targets: Targets, wanted: Gaps, pose: HandPose, sums: Sums) -> None:
    """Add the residuals of fingertips: their planes, contacts and regions."""
    for k in range(len(targets.fingers)):
        finger = targets.fingers[k]
        link, normal = int(hand.starts[finger + 1] - 1), targets.normals[k]
        gap = float(hand.tip_roundings[finger])
        for j in range(3):
            gap += (pose.fronts[k, j] - targets.origins[k, j]) * normal[j]
        sums.parts[OFF_PART] = max(sums.parts[OFF_PART], abs(gap) * MM)
        _moves(hand, pose, sums, link, pose.fronts[k], normal, EQUAL, True)
        _add(sums, TOUCH_PART, EQUAL * gap * MM)
        pinned = targets.pinned[k] > 0.0
        for side in range(2):
            tangent, off = targets.tangents[k, side], 0.0
            for j in range(3):
                off += (pose.tips[k, j] - targets.origins[k, j]) * tangent[j]
            if pinned:
                sums.parts[OFF_PART] = max(sums.parts[OFF_PART], abs(off) * MM)
            _tip(hand, pose, sums, link, k, tangent, EQUAL if pinned else wanted.pull, off)
    for e in range(len(targets.edge_contacts)):
        k, short = targets.edge_contacts[e], wanted.margin
        for j in range(3):
            short -= (pose.tips[k, j] - targets.edge_points[e, j]) * targets.edge_inward[e, j]
        if short > 0.0:
            sums.parts[OFF_PART] = max(sums.parts[OFF_PART], (short - wanted.margin) * MM)
            link = int(hand.starts[targets.fingers[k] + 1] - 1)
            _tip(hand, pose, sums, link, k, -targets.edge_inward[e], EQUAL, short)


@loop(once=True)
def _outward(center: Array, need: float, tree: SurfaceTree, along: Array) -> float:
    """Return the signed distance of a point from a surface, and fill in the way out."""
    near, square = np.empty(3), squared(center, tree.middles[0])
    if square > (tree.radii[0] + need) ** 2:
        return ANYWHERE
    t = nearest(center, need, tree, near)
    if t < 0:
        if square > tree.radii[0] * tree.radii[0]:
            return ANYWHERE
        # far from the surface: outside, or deep inside
        t = nearest(center, ANYWHERE, tree, near)
    for j in range(3):
        along[j] = center[j] - near[j]
    distance = np.sqrt(dotted(along, along))
    if dotted(along, tree.normals[t]) < 0.0:
        distance = -distance
    if abs(distance) > NO_DIRECTION:
        for j in range(3):
            along[j] /= distance
    else:
        copy(tree.normals[t], along)
    return distance


@loop()
def _keep_off(
    hand: HandArrays, pose: HandPose, sums: Sums, link: int, x: Array, along: Array, sign: float,
    short: float,
) -> None:  # fmt: skip
    """Add the residual of a point that must move by `short` against sign * along."""
    _moves(hand, pose, sums, link, x, along, sign, True)
    _add(sums, OVERLAP_PART, short * MM)


@loop(once=True)
def _balls(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, wanted: Gaps, pose: HandPose, sums: Sums,
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


@loop(once=True)
def _links(hand: HandArrays, wanted: Gaps, pose: HandPose, sums: Sums) -> None:
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
            _moves(hand, pose, sums, int(hand.shape_links[a]), x, along, 1.0, False)
            _moves(hand, pose, sums, int(hand.shape_links[b]), x, along, -1.0, False)
            _add(sums, OVERLAP_PART, short * MM)


@loop()
def _farthest(
    hand: HandArrays, pose: HandPose, s: int, origin: Array, way: Array, left_out: Array, x: Array
) -> float:  # fmt: skip
    """Return how far a shape reaches beyond a plane, and fill in its corner there."""
    (corners, rounding), farthest = core_in(hand, pose.turned[s], pose.middles[s], s), -np.inf
    for c in range(len(corners)):
        height = rounding
        for j in range(3):
            height += (corners[c, j] - origin[j]) * way[j]
        if squared(corners[c], left_out) > AT_TIP * AT_TIP and height > farthest:
            farthest = height
            copy(corners[c], x)
    return farthest


@loop(once=True)
def _last_links(
    hand: HandArrays, targets: Targets, wanted: Gaps, pose: HandPose, sums: Sums
) -> None:
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


@loop(once=True)
def residuals(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, wanted: Gaps, pose: HandPose, sums: Sums,
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


@loop()
def empty_pose(hand: HandArrays, contacts: int) -> HandPose:
    """Return arrays for a pose, not filled in."""
    j, s = len(hand.axes), len(hand.shape_links)
    return HandPose(
        np.empty((3, 3)), np.empty(3), np.empty(j), np.empty((j, 3, 3)), np.empty((j, 3)),
        np.empty((j, 3)), np.empty((s, 3, 3)), np.empty((s, 3)), np.empty((contacts, 3)),
        np.empty((contacts, 3)), np.empty((contacts, 3, 3)),
    )  # fmt: skip


@loop()
def empty_sums(hand: HandArrays, targets: Targets) -> Sums:
    """Return arrays for the sums, with the pivot in the contacts' middle."""
    n, pivot = OF_PALM + len(hand.axes), np.zeros(3)
    for k in range(len(targets.origins)):
        for j in range(3):
            pivot[j] += targets.origins[k, j] / len(targets.origins)
    return Sums(np.empty((n, n)), np.empty(n), np.zeros(n), pivot, np.empty(3))


@loop(once=True)
def _solve(H: Array, g: Array, step: Array) -> None:
    """Solve H step = -g by Cholesky's factors, from and into the lower half of H."""
    n = len(g)
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= H[i, k] * H[j, k]
            H[i, j] = total / H[j, j] if i > j else np.sqrt(total)
    for i in range(n):
        total = -g[i]
        for k in range(i):
            total -= H[i, k] * step[k]
        step[i] = total / H[i, i]
    for i in range(n - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, n):
            total -= H[k, i] * step[k]
        step[i] = total / H[i, i]


@loop(once=True)
def _fill_step(hand: HandArrays, wanted: Gaps, pose: HandPose, sums: Sums, step: Array) -> None:
    """Fill in the damped step from a pose, no longer than the largest; uses the sums up."""
    n, H, g = len(step), sums.H, sums.g
    for i in range(n):
        H[i, i] += DAMPING
        if i < OF_PALM:
            held = not wanted.palm_moves
        else:
            q, (low, high) = pose.q[i - OF_PALM], hand.ranges[i - OF_PALM]
            held = (q <= low and g[i] > 0.0) or (q >= high and g[i] < 0.0)
        if held:
            for j in range(n):
                H[max(i, j), min(i, j)] = 0.0
            H[i, i], g[i] = 1.0, 0.0
    _solve(H, g, step)
    longest = 1.0
    for i in range(n):
        longest = max(longest, abs(step[i]) / (PALM_MOVE if i < OF_PALM // 2 else LARGEST_TURN))
    for i in range(n):
        step[i] /= longest


@loop(once=True)
def _take(hand: HandArrays, pose: HandPose, pivot: Array, step: Array) -> None:
    """Take a step with palm and joints, within ranges and as they are coupled."""
    about, turned = np.empty((3, 3)), step[3:OF_PALM]
    angle = np.sqrt(dotted(turned, turned))
    turn(turned / angle if angle > 0.0 else np.zeros(3), angle, about)
    product(about, pose.palm.copy(), pose.palm)
    moved(about, pivot, pose.origin - pivot, pose.origin)
    for j in range(3):
        pose.origin[j] += step[j]
    for k in range(len(pose.q)):
        angle = pose.q[k] + step[OF_PALM + k]
        pose.q[k] = min(max(angle, hand.ranges[k, 0]), hand.ranges[k, 1])
    for k in range(len(pose.q)):  # the angles of free joints stay as they are
        angle = hand.offsets[k] + hand.ratios[k] * pose.q[hand.drivers[k]]
        pose.q[k] = min(max(angle, hand.ranges[k, 0]), hand.ranges[k, 1])


@loop()
def settle(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, wanted: Gaps, pose: HandPose, sums: Sums,
    most_steps: int, good: float,
) -> None:  # fmt: skip
    """Move a hand until it touches and overlaps no more, or is given up.

    A step that makes the sum of squares larger is taken like any other: where such steps were
    refused, searches took more than twice as many starts.
    """
    step, stalled, least = np.empty_like(sums.g), 0, np.inf
    for taken in range(most_steps + 1):
        residuals(hand, tree, targets, wanted, pose, sums)
        cost = sums.parts[TOUCH_PART] + sums.parts[OVERLAP_PART]
        stalled = stalled + 1 if cost > (1.0 - STALLED) * least else 0
        least = min(least, cost)
        settled = sums.parts[OFF_PART] <= good and sums.parts[OVERLAP_PART] <= NO_OVERLAP
        if settled or stalled >= MOST_STALLED or taken == most_steps:
            return
        _fill_step(hand, wanted, pose, sums, step)
        _take(hand, pose, sums.pivot, step)


@loop()
def lay(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, pose: HandPose, points: Array
) -> float:  # fmt: skip
    """Lay the planes that fingertips touch on the surface itself.

    The plane of a fingertip is moved to the nearest point of the surface, and turned across the
    line to it from the tip's nearest point, which is to touch it. The plane of a block whose hull
    overlaps the surface is moved back.

    Takes `points` (k, 3) [m]. Gives the largest distance of a fingertip from touching the surface
    [m].
    """
    place(hand, targets, pose)
    off = 0.0
    for k in range(len(targets.fingers)):
        finger, tip = targets.fingers[k], pose.tips[k]
        distance = tip_surface(hand, pose.turned, pose.middles, tree, finger, tip, points[k])
        targets.touching[k] = np.nan
        if distance <= NO_DIRECTION:
            off = np.inf
            for j in range(3):
                targets.origins[k, j] -= BACK * targets.normals[k, j]
            continue
        if hand.tip_firsts[finger + 1] - hand.tip_firsts[finger] > 1:
            last = hand.starts[finger + 1] - 1
            into_frame(pose.R[last], pose.p[last], tip, targets.touching[k])
        off = max(off, abs(distance - hand.tip_roundings[finger]))
        length, ahead = np.sqrt(squared(points[k], tip)), 0.0  # a block's distance is but a bound
        for j in range(3):
            targets.normals[k, j] = (points[k, j] - tip[j]) / length
            ahead += (points[k, j] - targets.origins[k, j]) * targets.normals[k, j]
        for j in range(3):  # across the normal, the planned contact stays the one to be near
            targets.origins[k, j] += ahead * targets.normals[k, j]
    return float(off)
