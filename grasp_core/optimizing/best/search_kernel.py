"""Refutes that contacts in given polygons reach a quality, by asking who answers, compiled.

Solved: the search of `support_cuts`, depth first, from one node to the end of its subtree or to the
next moment at which the caller must decide something.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.optimizing.best.cuts_kernel import (
    MOST_CORNERS,
    Pieces,
    area,
    cut,
    extent,
)
from grasp_core.optimizing.best.cuts_kernel import clip as clipped
from grasp_core.optimizing.best.twists_kernel import TWIST, Pool, descend, learn

FINGERS = 4
DONE, PAUSED, FULL, PART, FOUND, LOST = 0, 1, 2, 3, 4, 5
"""Why a run ends: nothing left, budget of nodes spent, no room in the tree, a node that is to be a
part of its own, contacts that may reach the quality, a node too small to be divided."""
ASK, BY_PIECES, BY_LINE, SPLICE = 0, 16, 32, 64
"""What a node does, added to fingers: a set of fingers for questions, else one finger."""
TRIALS = 6
"""Twists whose cuts are measured before one of them is asked."""
THIN = 0.03
"""Weight of a polygon's squared extent beside its area, so that thin ones count."""
ASKED_ABOVE = 1.3
"""Cost of a question up to which it is asked rather than dividing a polygon, which costs 1.41."""
MOST_LEFT = 0.9
"""Share of a finger's polygons above which an answer among several makes no headway."""
SHRUNK = 0.97
"""Cost of a question with one answer, up to which it is asked."""
STEPS, CLOSE_STEPS = 40, 120
"""Steps of descents for a node, and for its middle."""
LEAST = 1e-7
"""Extent of a polygon, in object radii, below which it is not divided."""
SEVERAL = 2.0
"""Extent that counts for a finger with several pieces, larger than that of any piece."""


class Stack(NamedTuple):
    """Nodes that wait, the next one last: where each finger may be."""

    corners: Array
    """Corners of what is left of each piece, for each node and finger, (d, 4, p, MOST_CORNERS,
    2)."""
    counts: Indices
    """How many corners each has, (d, 4, p)."""
    fresh: Indices
    """Whether a finger may still be exchanged with the other fresh ones, (d, 4)."""
    depths: Indices
    """How many nodes above each have several children, (d,)."""
    top: Indices
    """How many nodes wait, (1,)."""


class Tree(NamedTuple):
    """What was done at each node, children after their parents."""

    deeds: Indices
    """What was done, (n,)."""
    asked: Indices
    """Place of the twist among `twists`, or of the line among `lines`, (n,)."""
    twists: Array
    """Twists that are named, (m, 6)."""
    lines: Array
    """Lines that divide polygons, or the first piece of the second half, (l, 3)."""
    sizes: Indices
    """How many nodes, twists and lines there are, (3,)."""


class Work(NamedTuple):
    """Room for what is known about the node at work."""

    reach: Array
    """Largest support of each finger under each twist, (4, c)."""
    left: Array
    """Estimated share of each finger's polygons that answers, (4, c)."""
    low: Array
    """Least support on a piece, (c,)."""
    high: Array
    """Largest support on a piece, (c,)."""
    whole: Array
    """Weight of each finger's polygons, (4,)."""
    middle: Array
    """Contacts in the middle of a node that is not refuted, (4, 2)."""
    on: Indices
    """Their pieces, (4,)."""


@loop("numpy", beside=True)
def run(
    pieces: Pieces, stack: Stack, pool: Pool, tree: Tree, work: Work, t: float, budget: int,
    part_depth: int,
) -> int:  # fmt: skip
    """Search until one of the reasons to end occurs.

    Args:
        pieces: The pieces.
        stack: Nodes to refute; changed.
        pool: Twists; changed.
        tree: What was done so far; changed.
        work: Room.
        t: The quality that no contacts are to reach.
        budget: How many nodes to visit at most.
        part_depth: Nodes at this depth become parts of their own.
    """
    ranked, costs = np.empty(TRIALS, np.int64), np.empty(TRIALS)
    for _ in range(budget):
        if stack.top[0] == 0:
            return DONE
        node = stack.top[0] - 1
        if _is_full(stack, tree):
            return FULL
        if stack.depths[node] >= part_depth:
            _note(tree, SPLICE, 0)
            return PART
        now = tree.sizes[0]
        for i in range(FINGERS):
            _look(pieces, stack, node, i, pool, 0, pool.size[0], work, t)
        best, cost = _choose(stack, node, pool, pieces, work, t, ranked, costs)
        if cost > 0.0:
            refuter, found = _improve(pieces, stack, node, pool, work, t, now)
            if found < 0:
                return FOUND
            if refuter:
                best, cost = _choose(stack, node, pool, pieces, work, t, ranked, costs)
        if best >= 0 and cost <= ASKED_ABOVE:
            _ask(pieces, stack, node, pool, tree, work, t, best, now)
        elif not _divide(stack, node, tree):
            return LOST
    return PAUSED


@loop("numpy")
def _is_full(stack: Stack, tree: Tree) -> bool:
    return (
        tree.sizes[0] + 1 >= len(tree.deeds)
        or tree.sizes[1] + 1 >= len(tree.twists)
        or tree.sizes[2] + 1 >= len(tree.lines)
        or stack.top[0] + FINGERS >= len(stack.depths)
    )


@loop("numpy")
def _note(tree: Tree, deed: int, asked: int) -> None:
    place = tree.sizes[0]
    tree.deeds[place], tree.asked[place] = deed, asked
    tree.sizes[0] += 1


@loop("numpy")
def _look(
    pieces: Pieces, stack: Stack, node: int, i: int, pool: Pool, first: int, last: int, work: Work,
    t: float,
) -> None:  # fmt: skip
    """Fill in how far finger i reaches under some twists, and how much of it is left by each."""
    mu, ends = pieces.friction, np.empty(2, np.int64)
    reach, left = work.reach[i], work.left[i]
    low, high = work.low, work.high
    for k in range(first, last):
        reach[k], left[k] = -np.inf, 0.0
    whole = 0.0
    for p in range(len(pieces.normals)):
        count = stack.counts[node, i, p]
        if count == 0:
            continue
        corners, at = stack.corners[node, i, p], pool.asked[p]
        for v in range(count):
            a, b = corners[v, 0], corners[v, 1]
            for k in range(first, last):
                one, two = at[3, k] - at[5, k] * b, at[4, k] + at[5, k] * a
                s = at[0, k] + at[1, k] * a + at[2, k] * b + mu * np.sqrt(one * one + two * two)
                low[k] = s if v == 0 else min(low[k], s)
                high[k] = s if v == 0 else max(high[k], s)
        weight = _weight(corners, count, ends)
        whole += weight
        for k in range(first, last):
            share = min(max((high[k] - t) / (high[k] - low[k] + 1e-12), 0.0), 1.0)
            left[k] += weight * share * share * (3.0 - 2.0 * share)
            reach[k] = max(reach[k], high[k])
    for k in range(first, last):
        left[k] /= whole
    work.whole[i] = whole


@loop("numpy")
def _weight(corners: Array, count: int, ends: Indices) -> float:
    long = extent(corners, count, ends)
    return area(corners, count) + THIN * long * long


@loop("numpy")
def _choose(
    stack: Stack, node: int, pool: Pool, pieces: Pieces, work: Work, t: float, ranked: Indices,
    costs: Array,
) -> tuple[int, float]:  # fmt: skip
    """Return the twist that is best to ask, and its cost: zero if nobody can answer."""
    count = 0
    for k in range(pool.size[0]):
        cost, twin, stays, answers = 0.0, False, False, 0
        for i in range(FINGERS):
            if work.reach[i, k] < t or (stack.fresh[node, i] and twin):
                continue
            twin = twin or stack.fresh[node, i] > 0
            stays = stays or work.left[i, k] > MOST_LEFT
            answers += 1
            cost += np.sqrt(work.left[i, k]) + 1e-9
        if stays and answers > 1:
            cost += 1.0
        if cost == 0.0:
            return k, 0.0
        if count < TRIALS or cost < costs[count - 1]:
            place = min(count, TRIALS - 1)
            while place > 0 and costs[place - 1] > cost:
                ranked[place], costs[place] = ranked[place - 1], costs[place - 1]
                place -= 1
            ranked[place], costs[place] = k, cost
            count = min(count + 1, TRIALS)
    best, least = -1, np.inf
    for trial in range(count):
        if trial > 0 and costs[trial] > 1.5 * least:
            break
        cost, answers = _measured(stack, node, pool, pieces, work, t, ranked[trial])
        if (answers > 1 or cost <= SHRUNK) and cost < least:
            best, least = ranked[trial], cost
    return best, least


@loop("numpy")
def _measured(
    stack: Stack, node: int, pool: Pool, pieces: Pieces, work: Work, t: float, k: int
) -> tuple[float, int]:
    """Return the cost of asking a twist, by what is left, and how many fingers may answer."""
    cost, answers, twin, stays = 0.0, 0, False, False
    rest, ends = np.empty((MOST_CORNERS, 2)), np.empty(2, np.int64)
    for i in range(FINGERS):
        if work.reach[i, k] < t or (stack.fresh[node, i] and twin):
            continue
        twin = twin or stack.fresh[node, i] > 0
        answers += 1
        left = 0.0
        for p in range(len(pieces.normals)):
            count = stack.counts[node, i, p]
            if count > 0:
                at = pool.asked[p, :, k]
                kept = cut(stack.corners[node, i, p], count, at, pieces.friction, t, rest)
                left += _weight(rest, kept, ends)
        stays = stays or left > MOST_LEFT * work.whole[i]
        cost += np.sqrt(left / work.whole[i])
    return (cost + 1.0 if stays and answers > 1 else cost), answers


@loop("numpy")
def _ask(
    pieces: Pieces, stack: Stack, node: int, pool: Pool, tree: Tree, work: Work, t: float, k: int,
    now: int,
) -> None:  # fmt: skip
    """Replace the node by one for each finger that may answer, cut to where it does."""
    answering, twin, deed = np.zeros(FINGERS, np.int64), False, ASK
    total = 0
    for i in range(FINGERS):
        if work.reach[i, k] < t or (stack.fresh[node, i] and twin):
            continue
        twin = twin or stack.fresh[node, i] > 0
        answering[total] = i
        total += 1
        deed += 1 << i
    if pool.names[k] < 0:
        pool.names[k] = tree.sizes[1]
        tree.twists[tree.sizes[1]] = pool.twists[k]
        tree.sizes[1] += 1
    pool.used[k] = now
    _note(tree, deed, pool.names[k])
    # the first answer is searched first, so that it comes last; the node's own place is for the
    # last answer, as the others are copied from it
    for c in range(total - 1):
        place = node + total - 1 - c
        _copy(stack, node, place)
    rest = np.empty((MOST_CORNERS, 2))
    for c in range(total):
        place, i = node + total - 1 - c, answering[c]
        stack.fresh[place, i] = 0
        if total > 1:
            stack.depths[place] += 1
        for p in range(len(pieces.normals)):
            count = stack.counts[place, i, p]
            if count > 0:
                at = pool.asked[p, :, k]
                kept = cut(stack.corners[place, i, p], count, at, pieces.friction, t, rest)
                stack.counts[place, i, p] = kept
                stack.corners[place, i, p, :kept] = rest[:kept]
    stack.top[0] = node + total


@loop("numpy")
def _copy(stack: Stack, source: int, place: int) -> None:
    stack.counts[place] = stack.counts[source]
    stack.fresh[place] = stack.fresh[source]
    stack.depths[place] = stack.depths[source]
    for i in range(FINGERS):
        for p in range(stack.counts.shape[2]):
            count = stack.counts[source, i, p]
            stack.corners[place, i, p, :count] = stack.corners[source, i, p, :count]


@loop("numpy")
def _divide(stack: Stack, node: int, tree: Tree) -> bool:
    """Replace the node by two, in which its largest finger has one half; False if it is tiny."""
    largest, chosen, several = 0.0, -1, 0
    ends, line = np.empty(2, np.int64), np.zeros(3)
    for i in range(FINGERS):
        live, long = 0, 0.0
        for p in range(stack.counts.shape[2]):
            if stack.counts[node, i, p] > 0:
                live += 1
                long = extent(stack.corners[node, i, p], stack.counts[node, i, p], ends)
        size = long if live == 1 else SEVERAL + live
        if size > largest:
            largest, chosen, several = size, i, live
    if largest < LEAST:
        return False
    other = node + 1
    _copy(stack, node, other)
    for place in (node, other):
        stack.fresh[place, chosen] = 0
        stack.depths[place] += 1
    stack.top[0] = other + 1
    deed = BY_LINE if several == 1 else BY_PIECES
    seen, rest = 0, np.empty((MOST_CORNERS, 2))
    for p in range(stack.counts.shape[2]):
        count = stack.counts[node, chosen, p]
        if count == 0:
            continue
        if several > 1:
            seen += 1
            if 2 * seen <= several:
                stack.counts[node, chosen, p] = 0
                line[0] = p + 1.0
            else:
                stack.counts[other, chosen, p] = 0
            continue
        corners = stack.corners[other, chosen, p]
        extent(corners, count, ends)
        one, two = corners[ends[0]], corners[ends[1]]
        for j in range(2):
            line[j] = two[j] - one[j]
        line[2] = 0.0
        for j in range(2):
            line[2] += 0.5 * line[j] * (one[j] + two[j])
        kept = clipped(stack.corners[node, chosen, p], count, line, -1.0, rest)
        stack.counts[node, chosen, p] = kept
        stack.corners[node, chosen, p, :kept] = rest[:kept]
        kept = clipped(stack.corners[other, chosen, p], count, line, 1.0, rest)
        stack.counts[other, chosen, p] = kept
        stack.corners[other, chosen, p, :kept] = rest[:kept]
    tree.lines[tree.sizes[2]] = line
    _note(tree, deed + chosen, tree.sizes[2])
    tree.sizes[2] += 1
    return True


@loop("numpy")
def _improve(
    pieces: Pieces, stack: Stack, node: int, pool: Pool, work: Work, t: float, now: int
) -> tuple[bool, int]:
    """Find new twists for a node; return whether there are any, and -1 if its middle may reach t.

    One descent lowers the support of all corners, another that of contacts in the middle.
    """
    least, first, near, nearest = np.inf, 0, np.inf, 0
    single = True
    for i in range(FINGERS):
        live = 0
        for p in range(len(pieces.normals)):
            if stack.counts[node, i, p] > 0:
                live, work.on[i] = live + 1, p
        single = single and live == 1
    size = pool.size[0]
    for k in range(size):
        found = max(
            max(work.reach[0, k], work.reach[1, k]), max(work.reach[2, k], work.reach[3, k])
        )
        if found < least:
            least, first = found, k
    if not single:
        return False, 0
    points, on = np.empty((FINGERS * MOST_CORNERS, 3)), np.empty(FINGERS * MOST_CORNERS, np.int64)
    m = 0
    for i in range(FINGERS):
        p = work.on[i]
        count = stack.counts[node, i, p]
        work.middle[i] = 0.0
        for v in range(count):
            for j in range(2):
                work.middle[i, j] += stack.corners[node, i, p, v, j] / count
            _place(pieces, p, stack.corners[node, i, p, v], points[m])
            on[m] = p
            m += 1
    y = pool.twists[first].copy()
    found = descend(pieces, points, on, m, y, STEPS)
    new = False
    if found < least:
        place = learn(pool, pieces, y, now)
        for i in range(FINGERS):
            _look(pieces, stack, node, i, pool, place, place + 1, work, t)
        new = True
        if found < t:
            return True, 0
    for i in range(FINGERS):
        work.low[i] = 0.0
        _place(pieces, work.on[i], work.middle[i], points[i])
        on[i] = work.on[i]
    for k in range(pool.size[0]):
        found = -np.inf
        for i in range(FINGERS):
            at, a, b = pool.asked[on[i]], work.middle[i, 0], work.middle[i, 1]
            one, two = at[3, k] - at[5, k] * b, at[4, k] + at[5, k] * a
            s = at[0, k] + at[1, k] * a + at[2, k] * b
            found = max(found, s + pieces.friction * np.sqrt(one * one + two * two))
        if found < near:
            near, nearest = found, k
    y = pool.twists[nearest].copy()
    found = descend(pieces, points, on, FINGERS, y, CLOSE_STEPS)
    if found < near:
        place = learn(pool, pieces, y, now)
        for i in range(FINGERS):
            _look(pieces, stack, node, i, pool, place, place + 1, work, t)
        new = True
    return new, (-1 if min(found, near) >= t else 0)


@loop("numpy")
def _place(pieces: Pieces, p: int, at: Array, point: Array) -> None:
    for j in range(3):
        point[j] = (
            pieces.origins[p, j] + pieces.frames[p, j, 0] * at[0] + pieces.frames[p, j, 1] * at[1]
        )
