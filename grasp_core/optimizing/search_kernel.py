"""Refutes that contacts in given polygons reach a threshold, by asking who answers, compiled.

Solved: the search of `support_cuts`, depth first, from one node to the end of its subtree or to the
next moment at which the caller must decide something. The nodes of a search, and what was done at
each, are kept in arrays. At a node the twist is chosen that is best to ask; the work of a search is
nearly all in `look`: the support of every corner under every twist.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.arrays_kernel import copy
from grasp_core.compiled import loop
from grasp_core.optimizing.contact_places import CORNER_ROOM
from grasp_core.optimizing.replay_kernel import (
    BY_LINE,
    BY_PIECES,
    Nodes,
    Pieces,
    branch,
    cut,
    split,
    support,
)
from grasp_core.optimizing.twists_kernel import Demand, Pool, area, descend, extent, learn, multiple
from grasp_core.values import FINGERS

SPLICE = 64  # what a node does that is a part of its own
LEAST_EXTENT = 1e-7  # extent of a polygon, in object radii, below which it is not divided
SEVERAL = 2.0
"""Extent that counts for a finger with several pieces, larger than that of any piece."""
ALL = -1  # says that all fingers have changed
EXTENT_WEIGHT = 0.03
"""Weight of a polygon's squared extent beside its area, so that thin ones count."""
MOST_LEFT = 0.9
"""Share of a finger's polygons above which an answer among several makes no headway."""
SHRUNK = 0.97  # cost of a question with one answer, up to which it is asked
DONE, PAUSED, NO_ROOM, OWN_PART, CONTACTS_FOUND, UNDIVIDABLE = 0, 1, 2, 3, 4, 5
"""Why a run ends: nothing left, budget of nodes spent, no room in the tree, a node that is to be a
part of its own, contacts that may reach the threshold, a node too small to be divided."""
ASKED_ABOVE = 1.05
"""Cost of a question up to which it is asked rather than dividing a polygon, which costs 1.41. It
was measured: after a division more twists have a single answer."""
NODE_STEPS, MIDDLE_STEPS = 40, 120  # steps of descents for a node, and for its middle


class Tree(NamedTuple):
    """What was done at each node, children after their parents."""

    deeds: Indices  # what was done, (n,)
    asked: Indices  # place of the twist among `twists`, or of the line among `lines`, (n,)
    twists: Array  # twists that are named, (m, 6)
    lines: Array  # lines that divide polygons, or the first piece of the second half, (l, 3)
    sizes: Indices  # how many nodes, twists and lines there are, (3,)


class NodeRoom(NamedTuple):
    """Room for what is known about the node at work."""

    reach: Array  # largest support of each finger under each twist, (4, c)
    left: Array  # estimated share of each finger's polygons that answers, (4, c)
    low: Array  # least support on a piece, (c,)
    high: Array  # largest support on a piece, (c,)
    whole: Array  # weight of each finger's polygons, (4,)
    middle: Array  # contacts in the middle of a node that is not refuted, (4, 2)
    on: Indices  # their pieces, (4,)
    asked: Array  # the `slopes` of each piece under the twist at work, (p, 6)
    changed: Indices
    """The finger whose polygons have changed since the other fields were filled in, (1,)."""


class Search(NamedTuple):
    """All that a search works with."""

    pieces: Pieces
    stack: Nodes  # those above a node count that have several children
    pool: Pool
    tree: Tree
    work: NodeRoom
    t: float  # the multiple of the loads that no contacts are to resist
    demand: Demand
    spare: float  # how far below t times a twist's demand a support still counts as an answer


@loop("numpy")
def answer_to(search: Search, k: int) -> float:
    """Return the support from which on a contact answers a twist of the pool."""
    return search.t * search.pool.demands[k] - search.spare


@loop("numpy", once=True)
def is_full(stack: Nodes, tree: Tree) -> bool:
    """Return whether there is no room for what one more node may need."""
    return (
        tree.sizes[0] + 1 >= len(tree.deeds)
        or tree.sizes[1] + 1 >= len(tree.twists)
        or tree.sizes[2] + 1 >= len(tree.lines)
        or stack.top[0] + FINGERS >= len(stack.above)
    )


@loop("numpy")
def note(tree: Tree, deed: int, asked: int) -> None:
    """Add to the tree what is done at the next node."""
    place = tree.sizes[0]
    tree.deeds[place], tree.asked[place] = deed, asked
    tree.sizes[0] += 1


@loop("numpy")
def divide(search: Search) -> bool:
    """Replace the last node by two, in which its largest finger has one half; False if tiny."""
    stack, tree = search.stack, search.tree
    node = stack.top[0] - 1
    chosen, live, size = _largest(stack, node)
    if size < LEAST_EXTENT:
        return False
    line = tree.lines[tree.sizes[2]]
    line[:] = 0.0
    if live == 1:
        _bisect(stack, node, chosen, line)
    else:
        seen, place = 0, 0
        while 2 * (seen + 1) <= live:  # half of the pieces are before it
            seen += stack.counts[node, chosen, place] > 0
            place += 1
        line[0] = place
    deed = chosen + (BY_LINE if live == 1 else BY_PIECES)
    stack.above[node] += 1
    split(stack, deed, line)
    note(tree, deed, tree.sizes[2])
    tree.sizes[2] += 1
    search.work.changed[0] = chosen
    return True


@loop("numpy", once=True)
def _largest(stack: Nodes, node: int) -> tuple[int, int, float]:
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


@loop("numpy", once=True)
def _bisect(stack: Nodes, node: int, i: int, line: Array) -> None:
    """Fill in the line across the longest diagonal of a finger's polygon."""
    ends = np.empty(2, np.int64)
    for p in range(stack.counts.shape[2]):
        count, corners = stack.counts[node, i, p], stack.corners[node, i, p]
        if count > 0:
            extent(corners, count, ends)
            for j in range(2):
                one, two = corners[ends[0], j], corners[ends[1], j]
                line[j] = two - one
                line[2] += 0.5 * line[j] * (one + two)


@loop("numpy", once=True)
def look_again(search: Search, node: int) -> None:
    """Fill in what has changed about the fingers of a node since the last one."""
    stack, work, size = search.stack, search.work, search.pool.size[0]
    changed, twin = work.changed[0], -1
    for i in range(FINGERS):
        if changed not in (ALL, i):
            continue
        if stack.fresh[node, i] and twin >= 0:
            copy(work.reach[twin, :size], work.reach[i])
            copy(work.left[twin, :size], work.left[i])
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
    return area(corners, count) + EXTENT_WEIGHT * long * long


@loop("numpy")
def choose(search: Search, node: int) -> tuple[int, float]:
    """Return the twist that seems best to ask, and its cost: zero if nobody can answer."""
    best, least = 0, np.inf
    for k in range(search.pool.size[0]):
        cost = _estimated(search, node, k)
        if cost < least:
            best, least = k, cost
            if cost == 0.0:
                return k, 0.0
    return best, _measured(search, node, best)


@loop("numpy")
def _answering(search: Search, node: int, k: int) -> int:
    """Return who may answer a twist, one fresh finger for all, as the sum of 2**i over fingers."""
    found, twin = 0, False
    fresh, work, t = search.stack.fresh[node], search.work, answer_to(search, k)
    for i in range(FINGERS):
        if work.reach[i, k] >= t and not (fresh[i] and twin):
            twin = twin or fresh[i] > 0
            found |= 1 << i
    return found


@loop("numpy")
def _estimated(search: Search, node: int, k: int) -> float:
    """Return about what `_measured` does, without cutting."""
    cost, twin, stays, answers = 0.0, False, False, 0
    fresh, work, t = search.stack.fresh[node], search.work, answer_to(search, k)
    for i in range(FINGERS):  # as in `_answering`, which would take longer for the whole pool
        if work.reach[i, k] < t or (fresh[i] and twin):
            continue
        twin = twin or fresh[i] > 0
        stays = stays or work.left[i, k] > MOST_LEFT
        answers += 1
        cost += np.sqrt(work.left[i, k]) + 1e-9
    return cost + 1.0 if stays and answers > 1 else cost


@loop("numpy")
def _measured(search: Search, node: int, k: int) -> float:
    """Return the cost of asking a twist, by what is left; infinity where that is not worth it.

    The cost is the sum of the roots of the shares that are left: a half on either side costs 1.41.
    """
    pieces, stack, work, t = search.pieces, search.stack, search.work, answer_to(search, k)
    cost, answers, stays = 0.0, 0, False
    rest, ends = np.empty((CORNER_ROOM, 2)), np.empty(2, np.int64)
    answering = _answering(search, node, k)
    copy(search.pool.asked[:, :, k], work.asked)
    for i in range(FINGERS):
        if not (answering >> i) & 1:
            continue
        answers += 1
        left = 0.0
        for p in range(len(pieces.normals)):
            count = stack.counts[node, i, p]
            if count > 0:
                corners, at = stack.corners[node, i, p], work.asked[p]
                kept = cut(corners, count, at, pieces.friction, t, rest)
                left += _weight(rest, kept, ends)
        stays = stays or left > MOST_LEFT * work.whole[i]
        cost += np.sqrt(left / work.whole[i])
    if answers > 1:
        return cost + 1.0 if stays else cost
    return cost if cost <= SHRUNK else np.inf


@loop("numpy")
def ask(search: Search, node: int, k: int, now: int) -> None:
    """Replace the node by one for each finger that may answer, cut to where it does."""
    stack, pool, tree, work = search.stack, search.pool, search.tree, search.work
    answering = _answering(search, node, k)
    if pool.names[k] < 0:
        pool.names[k] = tree.sizes[1]
        copy(pool.twists[k], tree.twists[tree.sizes[1]])
        tree.sizes[1] += 1
    pool.used[k] = now
    note(tree, answering, pool.names[k])
    stack.above[node] += answering & (answering - 1) > 0  # with several answers
    copy(pool.asked[:, :, k], work.asked)
    branch(stack, answering, work.asked, search.pieces.friction, answer_to(search, k))
    work.changed[0] = ALL
    for i in range(FINGERS - 1, -1, -1):
        if (answering >> i) & 1:
            work.changed[0] = i  # the first answer is searched first


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
            return NO_ROOM
        if stack.above[node] >= part_depth:
            note(tree, SPLICE, 0)
            return OWN_PART
        if not _visit(search, node, tree.sizes[0]):
            return UNDIVIDABLE if search.work.on[0] < 0 else CONTACTS_FOUND
    return PAUSED


@loop("numpy", once=True)
def _visit(search: Search, node: int, now: int) -> bool:
    """Replace a node by children; False if its middle may reach t, or it is tiny (on[0] < 0)."""
    look_again(search, node)
    best, cost = choose(search, node)
    if cost > 0.0 and _is_single(search, node):
        near = _lowered(search, node, now)
        if near >= search.t and _middle_lowered(search, node, now) >= search.t:
            return False
        best, cost = choose(search, node)
    if cost <= ASKED_ABOVE:
        ask(search, node, best, now)
    elif not divide(search):
        search.work.on[0] = -1
        return False
    return True


@loop("numpy", once=True)
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


@loop("numpy", once=True)
def _lowered(search: Search, node: int, now: int) -> float:
    """Lower what all corners of a node resist, and return it."""
    work, stack, pieces = search.work, search.stack, search.pieces
    least, first = np.inf, 0
    for k in range(search.pool.size[0]):
        found = work.reach[0, k]
        for i in range(1, FINGERS):
            found = max(found, work.reach[i, k])
        found = multiple(found + search.spare, search.pool.demands[k])
        if found < least:
            least, first = found, k
    room = FINGERS * CORNER_ROOM
    points, on, m = np.empty((room, 3)), np.empty(room, np.int64), 0
    for i in range(FINGERS):
        p = work.on[i]
        count = stack.counts[node, i, p]
        work.middle[i] = 0.0
        for v in range(count):
            for d in range(2):
                work.middle[i, d] += stack.corners[node, i, p, v, d] / count
            _place(pieces, p, stack.corners[node, i, p, v], points[m])
            on[m] = p
            m += 1
    return _descended(search, node, points[:m], on, (first, least), NODE_STEPS, now)


@loop("numpy", once=True)
def _middle_lowered(search: Search, node: int, now: int) -> float:
    """Lower what contacts in a node's middle resist, and return it."""
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
    return _descended(search, node, points, on, (nearest, near), MIDDLE_STEPS, now)


@loop("numpy")
def _descended(
    search: Search, node: int, points: Array, on: Indices, first: tuple[int, float], steps: int,
    now: int,
) -> float:  # fmt: skip
    """Descend from the pool's best twist for contacts at points; learn what is better."""
    (k, least), pieces, demand, pool = first, search.pieces, search.demand, search.pool
    y = pool.twists[k].copy()
    found = descend(pieces, demand, points, on, y, steps, search.spare)
    if not found < least:
        return least
    place = learn(pool, pieces, demand, y, now)
    for i in range(FINGERS):
        look(search, node, i, place, place + 1)
    return found


@loop("numpy")
def _place(pieces: Pieces, p: int, at: Array, point: Array) -> None:
    origin, frame = pieces.origins[p], pieces.frames[p]
    for d in range(3):
        point[d] = origin[d] + frame[d, 0] * at[0] + frame[d, 1] * at[1]
