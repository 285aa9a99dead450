"""Chooses the twist that is best to ask at a node, and asks it, compiled.

The work of a search is nearly all in `look`: the support of every corner under every twist.
"""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.optimizing.best.searching.cuts_kernel import MOST_CORNERS, area, cut, extent
from grasp_core.optimizing.best.searching.nodes_kernel import (
    ALL,
    ASK,
    FINGERS,
    Search,
    answer_to,
    copy,
    note,
)

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
    t = answer_to(search, k)
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
        _cut_to(search, node + total - 1 - c, answering[c], k)
        if total > 1:
            stack.depths[node + total - 1 - c] += 1
    stack.top[0] = node + total
    work.changed[0] = answering[0] if total > 0 else ALL


@loop("numpy")
def _cut_to(search: Search, place: int, i: int, k: int) -> None:
    """Cut the polygons of a finger to where it answers a twist."""
    pieces, stack, rest = search.pieces, search.stack, np.empty((MOST_CORNERS, 2))
    t = answer_to(search, k)
    stack.fresh[place, i] = 0
    for p in range(len(pieces.normals)):
        count = stack.counts[place, i, p]
        if count > 0:
            at = search.pool.asked[p, :, k]
            kept = cut(stack.corners[place, i, p], count, at, pieces.friction, t, rest)
            stack.counts[place, i, p] = kept
            stack.corners[place, i, p, :kept] = rest[:kept]
