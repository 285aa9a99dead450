"""Refutes that contacts in given polygons reach a threshold, by asking who answers, compiled.

Solved: the search of `support_cuts`, depth first, from one node to the end of its subtree or to the
next moment at which the caller must decide something. The nodes of a search, and what was done at
each, are kept in arrays. At a node the twist is chosen that is best to ask; the work of a search is
nearly all in `look`: the support of every corner under every twist.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.optimizing.twists_kernel import (
    MOST_CORNERS,
    Demand,
    Pieces,
    Pool,
    area,
    clip,
    cut,
    descend,
    extent,
    learn,
    multiple,
    support,
)

FINGERS = 4
ASK, BY_PIECES, BY_LINE, SPLICE = 0, 16, 32, 64
"""What a node does, added to fingers: a set of fingers for questions, else one finger."""
LEAST = 1e-7
"""Extent of a polygon, in object radii, below which it is not divided."""
SEVERAL = 2.0
"""Extent that counts for a finger with several pieces, larger than that of any piece."""
ALL = -1
"""Says that all fingers have changed."""
TRIALS = 6
"""Twists whose cuts are measured before one of them is asked."""
THIN = 0.03
"""Weight of a polygon's squared extent beside its area, so that thin ones count."""
MOST_LEFT = 0.9
"""Share of a finger's polygons above which an answer among several makes no headway."""
SHRUNK = 0.97
"""Cost of a question with one answer, up to which it is asked."""
BESIDE = 1.5
"""Estimated cost, over the least cost measured, up to which a question is measured."""
DONE, PAUSED, FULL, PART, FOUND, LOST = 0, 1, 2, 3, 4, 5
"""Why a run ends: nothing left, budget of nodes spent, no room in the tree, a node that is to be a
part of its own, contacts that may reach the threshold, a node too small to be divided."""
ASKED_ABOVE = 1.05
"""Cost of a question up to which it is asked rather than dividing a polygon, which costs 1.41. It
was measured: after a division more twists have a single answer."""
STEPS, CLOSE_STEPS = 40, 120
"""Steps of descents for a node, and for its middle."""


class Stack(NamedTuple):
    """Nodes that wait, the next one last: where each finger may be."""

    corners: Array
    """Corners of what is left of each piece, for each node and finger, (d, 4, p, MOST_CORNERS,
    2)."""
    counts: Indices  # how many corners each has, (d, 4, p)
    fresh: Indices
    """Whether a finger may still be exchanged with the other fresh ones, (d, 4)."""
    depths: Indices  # how many nodes above each have several children, (d,)
    top: Indices  # how many nodes wait, (1,)


class Tree(NamedTuple):
    """What was done at each node, children after their parents."""

    deeds: Indices  # what was done, (n,)
    asked: Indices
    """Place of the twist among `twists`, or of the line among `lines`, (n,)."""
    twists: Array  # twists that are named, (m, 6)
    lines: Array
    """Lines that divide polygons, or the first piece of the second half, (l, 3)."""
    sizes: Indices  # how many nodes, twists and lines there are, (3,)


class Work(NamedTuple):
    """Room for what is known about the node at work."""

    reach: Array  # largest support of each finger under each twist, (4, c)
    left: Array  # estimated share of each finger's polygons that answers, (4, c)
    low: Array  # least support on a piece, (c,)
    high: Array  # largest support on a piece, (c,)
    whole: Array  # weight of each finger's polygons, (4,)
    middle: Array  # contacts in the middle of a node that is not refuted, (4, 2)
    on: Indices  # their pieces, (4,)
    changed: Indices
    """The finger whose polygons have changed since the other fields were filled in, (1,)."""


class Search(NamedTuple):
    """All that a search works with."""

    pieces: Pieces
    stack: Stack
    pool: Pool
    tree: Tree
    work: Work
    t: float  # the multiple of the loads that no contacts are to resist
    demand: Demand
    spare: float
    """How far below t times a twist's demand a support still counts as an answer."""


@loop("numpy")
def answer_to(search: Search, k: int) -> float:
    """Return the support from which on a contact answers a twist of the pool."""
    return search.t * search.pool.demands[k] - search.spare


@loop("numpy")
def is_full(stack: Stack, tree: Tree) -> bool:
    """Return whether there is no room for what one more node may need."""
    return (
        tree.sizes[0] + 1 >= len(tree.deeds)
        or tree.sizes[1] + 1 >= len(tree.twists)
        or tree.sizes[2] + 1 >= len(tree.lines)
        or stack.top[0] + FINGERS >= len(stack.depths)
    )


@loop("numpy")
def note(tree: Tree, deed: int, asked: int) -> None:
    """Add to the tree what is done at the next node."""
    place = tree.sizes[0]
    tree.deeds[place], tree.asked[place] = deed, asked
    tree.sizes[0] += 1


@loop("numpy")
def copy(stack: Stack, source: int, place: int) -> None:
    """Copy a waiting node to another place of the stack."""
    stack.counts[place] = stack.counts[source]
    stack.fresh[place] = stack.fresh[source]
    stack.depths[place] = stack.depths[source]
    for i in range(FINGERS):
        for p in range(stack.counts.shape[2]):
            count = stack.counts[source, i, p]
            stack.corners[place, i, p, :count] = stack.corners[source, i, p, :count]


@loop("numpy")
def divide(search: Search, node: int) -> bool:
    """Replace the node by two, in which its largest finger has one half; False if it is tiny."""
    stack, tree = search.stack, search.tree
    chosen, live, size = _largest(stack, node)
    if size < LEAST:
        return False
    other = node + 1
    copy(stack, node, other)
    for place in (node, other):
        stack.fresh[place, chosen] = 0
        stack.depths[place] += 1
    stack.top[0] = other + 1
    line = tree.lines[tree.sizes[2]]
    line[:] = 0.0
    if live == 1:
        _halve(stack, node, chosen, line)
    else:
        _sort(stack, node, chosen, live, line)
    note(tree, (BY_LINE if live == 1 else BY_PIECES) + chosen, tree.sizes[2])
    tree.sizes[2] += 1
    search.work.changed[0] = chosen
    return True


@loop("numpy")
def _largest(stack: Stack, node: int) -> tuple[int, int, float]:
    """Return the finger that has most room, on how many pieces it is, and how large they are."""
    largest, chosen, several, ends = 0.0, 0, 1, np.empty(2, np.int64)
    for i in range(FINGERS):
        live, long = 0, 0.0
        for p in range(stack.counts.shape[2]):
            if stack.counts[node, i, p] > 0:
                live += 1
                long = extent(stack.corners[node, i, p], stack.counts[node, i, p], ends)
        size = long if live == 1 else SEVERAL + live
        if size > largest:
            largest, chosen, several = size, i, live
    return chosen, several, largest


@loop("numpy")
def _sort(stack: Stack, node: int, i: int, live: int, line: Array) -> None:
    """Leave one half of a finger's pieces to a node, and those of lower numbers to the next."""
    seen = 0
    for p in range(stack.counts.shape[2]):
        if stack.counts[node, i, p] == 0:
            continue
        seen += 1
        if 2 * seen <= live:
            stack.counts[node, i, p] = 0
            line[0] = p + 1.0
        else:
            stack.counts[node + 1, i, p] = 0


@loop("numpy")
def _halve(stack: Stack, node: int, i: int, line: Array) -> None:
    """Divide a finger's polygon across its longest diagonal, between a node and the next."""
    rest, ends = np.empty((MOST_CORNERS, 2)), np.empty(2, np.int64)
    for p in range(stack.counts.shape[2]):
        count = stack.counts[node, i, p]
        if count == 0:
            continue
        corners = stack.corners[node, i, p]
        extent(corners, count, ends)
        one, two = corners[ends[0]], corners[ends[1]]
        for j in range(2):
            line[j] = two[j] - one[j]
            line[2] += 0.5 * line[j] * (one[j] + two[j])
        for place, side in ((node + 1, 1.0), (node, -1.0)):
            kept = clip(stack.corners[place, i, p], count, line, side, rest)
            stack.counts[place, i, p] = kept
            stack.corners[place, i, p, :kept] = rest[:kept]


@loop("numpy")
def look_again(search: Search, node: int) -> None:
    """Fill in what has changed about the fingers of a node since the last one."""
    stack, work, size = search.stack, search.work, search.pool.size[0]
    changed, twin = work.changed[0], -1
    for i in range(FINGERS):
        if changed not in (ALL, i):
            continue
        if stack.fresh[node, i] and twin >= 0:
            work.reach[i, :size] = work.reach[twin, :size]
            work.left[i, :size] = work.left[twin, :size]
            work.whole[i] = work.whole[twin]
            continue
        look(search, node, i, 0, size)
        twin = i if stack.fresh[node, i] else twin
    work.changed[0] = ALL


@loop("numpy")
def look(search: Search, node: int, i: int, first: int, last: int) -> None:
    """Fill in how far finger i reaches under some twists, and how much of it is left by each."""
    pieces, stack, pool, work = search.pieces, search.stack, search.pool, search.work
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
            above = high[k] - answer_to(search, k)
            share = min(max(above / (high[k] - low[k] + 1e-12), 0.0), 1.0)
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
def choose(search: Search, node: int) -> tuple[int, float]:
    """Return the twist that is best to ask, and its cost: zero if nobody can answer."""
    ranked, costs, count = np.empty(TRIALS, np.int64), np.empty(TRIALS), 0
    for k in range(search.pool.size[0]):
        cost = _estimated(search, node, k)
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
        if trial > 0 and costs[trial] > BESIDE * least:
            break
        cost, answers = _measured(search, node, ranked[trial])
        if (answers > 1 or cost <= SHRUNK) and cost < least:
            best, least = ranked[trial], cost
    return best, least


@loop("numpy")
def with_new(search: Search, node: int, best: int, cost: float, k: int) -> tuple[int, float]:
    """Return the better of the best question and a twist that is new to the pool, if k is one."""
    if k < 0:
        return best, cost
    if k == best:  # it has taken the place of the best
        return choose(search, node)
    if _estimated(search, node, k) == 0.0:
        return k, 0.0
    found, answers = _measured(search, node, k)
    if (answers > 1 or found <= SHRUNK) and found < cost:
        return k, found
    return best, cost


@loop("numpy")
def _estimated(search: Search, node: int, k: int) -> float:
    """Return about what `_measured` does, without cutting."""
    cost, twin, stays, answers = 0.0, False, False, 0
    fresh, work, t = search.stack.fresh[node], search.work, answer_to(search, k)
    for i in range(FINGERS):
        if work.reach[i, k] < t or (fresh[i] and twin):
            continue
        twin = twin or fresh[i] > 0
        stays = stays or work.left[i, k] > MOST_LEFT
        answers += 1
        cost += np.sqrt(work.left[i, k]) + 1e-9
    return cost + 1.0 if stays and answers > 1 else cost


@loop("numpy")
def _measured(search: Search, node: int, k: int) -> tuple[float, int]:
    """Return the cost of asking a twist, by what is left, and how many fingers may answer.

    The cost is the sum of the roots of the shares that are left: a half on either side costs 1.41.
    """
    pieces, stack, work, t = search.pieces, search.stack, search.work, answer_to(search, k)
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
                at = search.pool.asked[p, :, k]
                kept = cut(stack.corners[node, i, p], count, at, pieces.friction, t, rest)
                left += _weight(rest, kept, ends)
        stays = stays or left > MOST_LEFT * work.whole[i]
        cost += np.sqrt(left / work.whole[i])
    return (cost + 1.0 if stays and answers > 1 else cost), answers


@loop("numpy")
def ask(search: Search, node: int, k: int, now: int) -> None:
    """Replace the node by one for each finger that may answer, cut to where it does."""
    stack, pool, tree, work = search.stack, search.pool, search.tree, search.work
    answering, twin, deed, total = np.zeros(FINGERS, np.int64), False, ASK, 0
    pieces, t, rest = search.pieces, answer_to(search, k), np.empty((MOST_CORNERS, 2))
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
    note(tree, deed, pool.names[k])
    # the first answer is searched first, so that it comes last; the node's own place is for the
    # last answer, as the others are copied from it
    for c in range(total - 1):
        copy(stack, node, node + total - 1 - c)
    for c in range(total):
        place, i = node + total - 1 - c, answering[c]
        stack.fresh[place, i] = 0
        stack.depths[place] += total > 1
        for p in range(len(pieces.normals)):
            count = stack.counts[place, i, p]
            if count > 0:
                at, corners = pool.asked[p, :, k], stack.corners[place, i, p]
                kept = cut(corners, count, at, pieces.friction, t, rest)
                stack.counts[place, i, p] = kept
                corners[:kept] = rest[:kept]
    stack.top[0] = node + total
    work.changed[0] = answering[0] if total > 0 else ALL


@loop("numpy", beside=True)
def run(search: Search, budget: int, part_depth: int) -> int:
    """Search until one of the reasons to end occurs, and return it."""
    stack, tree = search.stack, search.tree
    search.work.changed[0] = ALL
    for _ in range(budget):
        if stack.top[0] == 0:
            return DONE
        node = stack.top[0] - 1
        if is_full(stack, tree):
            return FULL
        if stack.depths[node] >= part_depth:
            note(tree, SPLICE, 0)
            return PART
        if not _visit(search, node, tree.sizes[0]):
            return LOST if search.work.on[0] < 0 else FOUND
    return PAUSED


@loop("numpy")
def _visit(search: Search, node: int, now: int) -> bool:
    """Replace a node by children; False if its middle may reach t, or it is tiny (on[0] < 0)."""
    look_again(search, node)
    best, cost = choose(search, node)
    if cost > 0.0 and _is_single(search, node):
        place, refuted = _lowered(search, node, now)
        best, cost = with_new(search, node, best, cost, place)
        if not refuted:
            near, place = _middle_lowered(search, node, now)
            if near >= search.t:
                return False
            best, cost = with_new(search, node, best, cost, place)
    if best >= 0 and cost <= ASKED_ABOVE:
        ask(search, node, best, now)
    elif not divide(search, node):
        search.work.on[0] = -1
        return False
    return True


@loop("numpy")
def _is_single(search: Search, node: int) -> bool:
    """Return whether each finger is on one piece, and fill in on which."""
    for i in range(FINGERS):
        live = 0
        for p in range(len(search.pieces.normals)):
            if search.stack.counts[node, i, p] > 0:
                live, search.work.on[i] = live + 1, p
        if live != 1:
            return False
    return True


@loop("numpy")
def _lowered(search: Search, node: int, now: int) -> tuple[int, bool]:
    """Lower what all corners of a node resist; return the new twist or -1, and if that refutes."""
    work, stack, pieces = search.work, search.stack, search.pieces
    least, first = np.inf, 0
    for k in range(search.pool.size[0]):
        found = work.reach[0, k]
        for i in range(1, FINGERS):
            found = max(found, work.reach[i, k])
        found = multiple(found + search.spare, search.pool.demands[k])
        if found < least:
            least, first = found, k
    room = FINGERS * MOST_CORNERS
    points, on, m = np.empty((room, 3)), np.empty(room, np.int64), 0
    for i in range(FINGERS):
        p = work.on[i]
        count = stack.counts[node, i, p]
        work.middle[i] = 0.0
        for v in range(count):
            work.middle[i] += stack.corners[node, i, p, v] / count
            _place(pieces, p, stack.corners[node, i, p, v], points[m])
            on[m] = p
            m += 1
    y = search.pool.twists[first].copy()
    found = descend(pieces, search.demand, points, on, m, y, STEPS, search.spare)
    place = _learned(search, node, y, now) if found < least else -1
    return place, min(found, least) < search.t


@loop("numpy")
def _middle_lowered(search: Search, node: int, now: int) -> tuple[float, int]:
    """Lower what contacts in a node's middle resist; return it, and the new twist or -1."""
    pieces, pool, work = search.pieces, search.pool, search.work
    near, nearest = np.inf, 0
    points, on = np.empty((FINGERS, 3)), work.on
    for i in range(FINGERS):
        _place(pieces, on[i], work.middle[i], points[i])
    for k in range(pool.size[0]):
        found = -np.inf
        for i in range(FINGERS):
            at, (a, b) = pool.asked[on[i], :, k], work.middle[i]
            found = max(found, support(at, a, b, pieces.friction))
        found = multiple(found + search.spare, pool.demands[k])
        if found < near:
            near, nearest = found, k
    y = pool.twists[nearest].copy()
    found = descend(pieces, search.demand, points, on, FINGERS, y, CLOSE_STEPS, search.spare)
    place = _learned(search, node, y, now) if found < near else -1
    return min(found, near), place


@loop("numpy")
def _learned(search: Search, node: int, y: Array, now: int) -> int:
    """Learn a twist, and return its place in the pool."""
    place = learn(search.pool, search.pieces, search.demand, y, now)
    for i in range(FINGERS):
        look(search, node, i, place, place + 1)
    return place


@loop("numpy")
def _place(pieces: Pieces, p: int, at: Array, point: Array) -> None:
    frame = pieces.frames[p]
    point[:] = pieces.origins[p] + frame[:, 0] * at[0] + frame[:, 1] * at[1]
