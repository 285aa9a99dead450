"""Refutes that contacts in given polygons reach a threshold, by asking who answers, compiled.

Solved: the search of `support_cuts`, depth first, from one node to the end of its subtree or to the
next moment at which the caller must decide something.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.optimizing.best.searching.asking_kernel import (
    ask,
    choose,
    look,
    look_again,
    with_new,
)
from grasp_core.optimizing.best.searching.cuts_kernel import MOST_CORNERS, Pieces
from grasp_core.optimizing.best.searching.nodes_kernel import (
    ALL,
    FINGERS,
    SPLICE,
    Search,
    divide,
    is_full,
    note,
)
from grasp_core.optimizing.best.searching.twists_kernel import descend, learn, multiple

DONE, PAUSED, FULL, PART, FOUND, LOST = 0, 1, 2, 3, 4, 5
"""Why a run ends: nothing left, budget of nodes spent, no room in the tree, a node that is to be a
part of its own, contacts that may reach the threshold, a node too small to be divided."""
ASKED_ABOVE = 1.05
"""Cost of a question up to which it is asked rather than dividing a polygon, which costs 1.41. It
was measured: after a division more twists have a single answer."""
STEPS, CLOSE_STEPS = 40, 120
"""Steps of descents for a node, and for its middle."""


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
    """Replace a node by its children; False if its middle may reach the threshold, or it is tiny.

    Where it is tiny, the first of `work.on` is negative.
    """
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
    """Lower what all corners of a node resist; return the new twist or -1, and if that refutes.

    Supports count with what is spared of an answer, as in `answer_to`.
    """
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
            for j in range(2):
                work.middle[i, j] += stack.corners[node, i, p, v, j] / count
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
            at, a, b = pool.asked[on[i]], work.middle[i, 0], work.middle[i, 1]
            one, two = at[3, k] - at[5, k] * b, at[4, k] + at[5, k] * a
            s = at[0, k] + at[1, k] * a + at[2, k] * b
            found = max(found, s + pieces.friction * np.sqrt(one * one + two * two))
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
    for j in range(3):
        point[j] = (
            pieces.origins[p, j] + pieces.frames[p, j, 0] * at[0] + pieces.frames[p, j, 1] * at[1]
        )
