"""Moves a hand until fingertips touch given planes and nothing else is touched, compiled.

Unknown are a move of the palm (translation, and turn about the contacts' middle) and the angles of
the joints that follow no other. Gauss and Newton's steps with Levenberg's damping make the sum of
squares of the residuals small; joints that stand at a limit and would go beyond are held there for
the step.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.hands.collisions_kernel import tip_surface
from grasp_core.hands.distances_kernel import into_frame
from grasp_core.hands.hand_arrays import HandArrays, Pose, Sums, SurfaceTree, Targets, Wanted
from grasp_core.hands.kinematics_kernel import moved, product, turn
from grasp_core.hands.pose_rows_kernel import MOVES, ON_SURFACE, place, residuals

SCALE_MOVE, SCALE_TURN = 1e6, 2.5e3
"""Squares of the millimetres by which one metre of a move, and one radian, moves a fingertip."""
LARGEST_MOVE, LARGEST_TURN = 0.02, 0.35
"""Largest step [m, rad]."""
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-7, 1e4
GROWTH, SHRINKING = 4.0, 0.3
STALLED, PATIENCE = 0.02, 4
"""A start is given up after so many steps in a row that make the cost smaller by less than this."""
BACK = 2.5e-4
"""How far the plane of a block is moved at once that overlaps the surface [m]."""
FREE = 1e-9
"""Sum of squares below which nothing overlaps [mm^2]."""


@loop()
def empty_pose(hand: HandArrays, contacts: int) -> Pose:
    """Return arrays for a pose, not filled in."""
    j, s = len(hand.axes), len(hand.shape_links)
    return Pose(
        np.empty((3, 3)), np.empty(3), np.empty(j), np.empty((j, 3, 3)), np.empty((j, 3)),
        np.empty((j, 3)), np.empty((s, 3, 3)), np.empty((s, 3)), np.empty((contacts, 3)),
        np.empty((contacts, 3)), np.empty((contacts, 3, 3)),
    )  # fmt: skip


@loop()
def empty_sums(hand: HandArrays, targets: Targets) -> Sums:
    """Return arrays for the sums, with the pivot in the contacts' middle."""
    n, pivot = MOVES + len(hand.axes), np.zeros(3)
    for k in range(len(targets.origins)):
        for j in range(3):
            pivot[j] += targets.origins[k, j] / len(targets.origins)
    return Sums(np.empty((n, n)), np.empty(n), np.zeros(n), pivot, np.empty(3))


@loop()
def _solved(H: Array, g: Array, step: Array) -> bool:
    """Solve H step = -g by Cholesky's factors, from and into the lower half of H."""
    n = len(g)
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= H[i, k] * H[j, k]
            if i > j:
                H[i, j] = total / H[j, j]
            elif total <= 0.0:
                return False
            else:
                H[i, i] = np.sqrt(total)
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
    return True


@loop()
def _step(
    hand: HandArrays, wanted: Wanted, pose: Pose, sums: Sums, damping: float, A: Array, step: Array
) -> bool:  # fmt: skip
    """Fill in the damped step from a pose, no longer than the largest; whether there is one."""
    n, g = len(step), sums.g.copy()
    A[:] = sums.H
    for i in range(n):
        A[i, i] += damping * (SCALE_MOVE if i < MOVES // 2 else SCALE_TURN)
        if i < MOVES:
            held = not wanted.palm_moves
        else:
            q, low, high = pose.q[i - MOVES], hand.ranges[i - MOVES, 0], hand.ranges[i - MOVES, 1]
            held = (q <= low and g[i] > 0.0) or (q >= high and g[i] < 0.0)
        if held:
            for j in range(n):
                A[max(i, j), min(i, j)] = 0.0
            A[i, i], g[i] = 1.0, 0.0
    if not _solved(A, g, step):
        return False
    longest = 1.0
    for i in range(n):
        longest = max(longest, abs(step[i]) / (LARGEST_MOVE if i < MOVES // 2 else LARGEST_TURN))
    for i in range(n):
        step[i] /= longest
    return True


@loop()
def _stepped(hand: HandArrays, pose: Pose, pivot: Array, step: Array, new: Pose) -> None:
    """Fill in palm and joints of the pose after a step, within ranges and as they are coupled."""
    axis, angle, about, arm = np.zeros(3), 0.0, np.empty((3, 3)), np.empty(3)
    for j in range(3):
        angle += step[3 + j] ** 2
    angle = np.sqrt(angle)
    if angle > 0.0:
        for j in range(3):
            axis[j] = step[3 + j] / angle
    turn(axis, angle, about)
    product(about, pose.palm, new.palm)
    for j in range(3):
        arm[j] = pose.origin[j] - pivot[j]
    moved(about, pivot, arm, new.origin)
    for j in range(3):
        new.origin[j] += step[j]
    for k in range(len(pose.q)):
        angle = pose.q[k] + step[MOVES + k]
        new.q[k] = min(max(angle, hand.ranges[k, 0]), hand.ranges[k, 1])
    for k in range(len(pose.q)):  # the angles of free joints stay as they are
        angle = hand.offsets[k] + hand.ratios[k] * new.q[hand.drivers[k]]
        new.q[k] = min(max(angle, hand.ranges[k, 0]), hand.ranges[k, 1])


@loop()
def settle(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, wanted: Wanted, pose: Pose, sums: Sums,
    most_steps: int, good: float,
) -> int:  # fmt: skip
    """Move a hand until it touches and overlaps no more; return the number of steps."""
    A, step, new = np.empty_like(sums.H), np.empty_like(sums.g), empty_pose(hand, len(pose.tips))
    tried = empty_sums(hand, targets)
    new.palm[:], new.origin[:], new.q[:] = pose.palm, pose.origin, pose.q
    damping, stalled, before, steps = FIRST_DAMPING, 0, np.inf, 0
    while True:
        residuals(hand, tree, targets, wanted, new, tried)
        after = tried.parts[1] + tried.parts[2]
        if after < before:
            pose.palm[:], pose.origin[:], pose.q[:] = new.palm, new.origin, new.q
            sums.H[:], sums.g[:], sums.parts[:] = tried.H, tried.g, tried.parts
            damping = max(damping * SHRINKING, LEAST_DAMPING)
            stalled = stalled + 1 if after > (1.0 - STALLED) * before else 0
            before = after
        else:
            damping *= GROWTH
            stalled += 1
        settled = sums.parts[0] <= good and sums.parts[2] <= FREE
        if settled or stalled >= PATIENCE or damping > MOST_DAMPING or steps == most_steps:
            return steps
        # damping grows until it outweighs the rest of the matrix, which then is definite
        while not _step(hand, wanted, pose, sums, damping, A, step):
            damping *= GROWTH
        _stepped(hand, pose, sums.pivot, step, new)
        steps += 1


@loop()
def lay(
    hand: HandArrays, tree: SurfaceTree, targets: Targets, pose: Pose, points: Array
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
        if distance <= ON_SURFACE:
            off = np.inf
            for j in range(3):
                targets.origins[k, j] -= BACK * targets.normals[k, j]
            continue
        if hand.tip_firsts[finger + 1] - hand.tip_firsts[finger] > 1:
            last = hand.starts[finger + 1] - 1
            into_frame(pose.R[last], pose.p[last], tip, targets.touching[k])
        off = max(off, abs(distance - hand.tip_roundings[finger]))
        ahead, square = 0.0, 0.0
        for j in range(3):
            square += (points[k, j] - tip[j]) ** 2
        length = np.sqrt(square)  # the distance of a block is only a bound on it
        for j in range(3):
            targets.normals[k, j] = (points[k, j] - tip[j]) / length
            ahead += (points[k, j] - targets.origins[k, j]) * targets.normals[k, j]
        for j in range(3):  # across the normal, the planned contact stays the one to be near
            targets.origins[k, j] += ahead * targets.normals[k, j]
    return float(off)
