"""Replays a tree of cuts, divisions and refutations, compiled; it shares no code with the search.

Solved: the check that `support_cuts` derives. Supports are computed in space, from the definition,
and edges are followed by halving. From which support on a contact answers a twist is given.
"""

from typing import Any, NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop

FINGERS, ROOM = 4, 24
BY_PIECES, BY_LINE, LAST = 16, 32, 36
HALVINGS = 40
"""Halvings of an edge towards the point in which it begins to answer."""
DEEPEST = 4096
"""Largest number of nodes that wait at one time."""


class Planes(NamedTuple):
    """The planes of the pieces."""

    normals: Array  # inward unit normals, (p, 3)
    origins: Array  # points whose plane coordinates are zero, (p, 3)
    frames: Array  # orthonormal columns, (p, 3, 2)
    friction: float


@loop("numpy", beside=True)
def replay(  # noqa: PLR0913, PLR0917 - the arrays of a tree
    planes: Planes, first: Array, first_counts: Indices, first_fresh: Indices,
    deeds: Indices, asked: Indices, twists: Array, answers: Array, lines: Array, most_cuts: int,
) -> bool:  # fmt: skip
    """Return whether the deeds refute, from each first node on, that contacts answer all twists.

    An answer to the twist k is a support of at least answers[k].
    """
    pieces, place = len(planes.normals), 0
    deep = 16
    corners = np.zeros((deep, FINGERS, pieces, ROOM, 2))
    counts = np.zeros((deep, FINGERS, pieces), np.int64)
    fresh, cuts = np.zeros((deep, FINGERS), np.int64), np.zeros(deep, np.int64)
    for case in range(len(first)):
        corners[0], counts[0], fresh[0], cuts[0] = (
            first[case], first_counts[case], first_fresh[case], 0,
        )  # fmt: skip
        top = 1
        while top > 0:
            if place >= len(deeds):
                return False
            deed, at = deeds[place], asked[place]
            place += 1
            if top + FINGERS >= deep:
                if deep >= DEEPEST:
                    return False
                corners, counts = _doubled(corners), _doubled(counts)
                fresh, cuts, deep = _doubled(fresh), _doubled(cuts), 2 * deep
            cuts[top - 1] += 1
            if cuts[top - 1] > most_cuts:
                return False
            if 0 <= deed < BY_PIECES and 0 <= at < len(twists):
                y, t = twists[at], float(answers[at])
                added = _answered(planes, corners, counts, fresh, top - 1, deed, y, t)
            elif BY_PIECES <= deed < BY_PIECES + FINGERS and 0 <= at < len(lines):
                added = _sorted(corners, counts, fresh, top - 1, deed - BY_PIECES, lines[at, 0])
            elif BY_LINE <= deed < LAST and 0 <= at < len(lines):
                added = _divided(corners, counts, fresh, top - 1, deed - BY_LINE, lines[at])
            else:
                return False
            if added < 0:
                return False
            for k in range(1, added):
                cuts[top - 1 + k] = cuts[top - 1]
            top += added - 1
    return place == len(deeds)


@loop("numpy")
def _doubled(old: Any) -> Any:
    new = np.zeros((2 * len(old), *old.shape[1:]), old.dtype)
    new[: len(old)] = old
    return new


@loop("numpy")
def _support(planes: Planes, p: int, a: float, b: float, y: Array) -> float:
    """Return the support of the cone of a contact, from the definition."""
    F, n, o = planes.frames[p], planes.normals[p], planes.origins[p]
    x0 = o[0] + F[0, 0] * a + F[0, 1] * b
    x1 = o[1] + F[1, 0] * a + F[1, 1] * b
    x2 = o[2] + F[2, 0] * a + F[2, 1] * b
    u0 = y[0] + y[4] * x2 - y[5] * x1
    u1 = y[1] + y[5] * x0 - y[3] * x2
    u2 = y[2] + y[3] * x1 - y[4] * x0
    along = F[0, 0] * u0 + F[1, 0] * u1 + F[2, 0] * u2
    across = F[0, 1] * u0 + F[1, 1] * u1 + F[2, 1] * u2
    slide = planes.friction * np.sqrt(along * along + across * across)
    return n[0] * u0 + n[1] * u1 + n[2] * u2 + slide


@loop("numpy")
def _copy(corners: Array, counts: Indices, fresh: Indices, source: int, place: int) -> None:
    fresh[place], counts[place] = fresh[source], counts[source]
    for i in range(FINGERS):
        for p in range(counts.shape[2]):
            count = counts[source, i, p]
            corners[place, i, p, :count] = corners[source, i, p, :count]


@loop("numpy")
def _answered(  # noqa: C901, PLR0912 - the arrays of nodes
    planes: Planes, corners: Array, counts: Indices, fresh: Indices, node: int, deed: int, y: Array,
    t: float,
) -> int:  # fmt: skip
    """Put one node for each named finger in a node's place; return how many, -1 if it is wrong."""
    named, twin = 0, False
    for i in range(FINGERS):
        if (deed >> i) & 1:
            named += 1
            twin = twin or fresh[node, i] > 0
    if not _is_empty(counts, node):
        for i in range(FINGERS):
            if (deed >> i) & 1 or (twin and fresh[node, i]):
                continue
            for p in range(counts.shape[2]):
                for v in range(counts[node, i, p]):
                    a, b = corners[node, i, p, v, 0], corners[node, i, p, v, 1]
                    if _support(planes, p, a, b, y) >= t:
                        return -1
    for k in range(1, named):
        _copy(corners, counts, fresh, node, node + k)
    place = node + named
    for i in range(FINGERS):
        if (deed >> i) & 1:
            place -= 1
            fresh[place, i] = 0
            for p in range(counts.shape[2]):
                if counts[place, i, p] > 0:
                    kept = _cut(planes, p, corners[place, i, p], counts[place, i, p], y, t)
                    counts[place, i, p] = kept
    return named


@loop("numpy")
def _is_empty(counts: Indices, node: int) -> bool:
    """Return whether some finger of a node has nowhere to be."""
    full = 0
    for i in range(FINGERS):
        full += counts[node, i].sum() > 0
    return full < FINGERS


@loop("numpy")
def _cut(planes: Planes, p: int, corners: Array, count: int, y: Array, t: float) -> int:
    """Cut a polygon to where a contact answers, in its place; return how many corners are left."""
    heights, out, kept = np.empty(ROOM), np.empty((ROOM, 2)), 0
    for k in range(count):
        heights[k] = _support(planes, p, corners[k, 0], corners[k, 1], y)
    for k in range(count):
        here, there = corners[k], corners[(k + 1) % count]
        if heights[k] >= t:
            if kept == ROOM:
                return count
            out[kept] = here
            kept += 1
        if (heights[k] >= t) != (heights[(k + 1) % count] >= t):
            if kept == ROOM:
                return count
            if heights[k] >= t:
                _follow(planes, p, there, here, y, t, out[kept])
            else:
                _follow(planes, p, here, there, y, t, out[kept])
            kept += 1
    corners[:kept] = out[:kept]
    return kept


@loop("numpy")
def _follow(
    planes: Planes, p: int, low: Array, high: Array, y: Array, t: float, out: Array
) -> None:
    """Fill in a point of the edge at which s < t, as near as doubles tell to where s = t."""
    near, far = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        a, b = low[0] + middle * (high[0] - low[0]), low[1] + middle * (high[1] - low[1])
        if _support(planes, p, a, b, y) < t:
            near = middle
        else:
            far = middle
    out[0] = low[0] + near * (high[0] - low[0])
    out[1] = low[1] + near * (high[1] - low[1])


@loop("numpy")
def _sorted(
    corners: Array, counts: Indices, fresh: Indices, node: int, i: int, first: float
) -> int:
    """Divide a finger's pieces into those below a number, replayed first, and the others."""
    _copy(corners, counts, fresh, node, node + 1)
    fresh[node, i] = fresh[node + 1, i] = 0
    for p in range(counts.shape[2]):
        if p < first:
            counts[node, i, p] = 0
        else:
            counts[node + 1, i, p] = 0
    return 2


@loop("numpy")
def _divided(
    corners: Array, counts: Indices, fresh: Indices, node: int, i: int, line: Array
) -> int:
    """Divide a finger's polygon by a line; -1 if it is on several pieces."""
    several = 0
    for p in range(counts.shape[2]):
        several += counts[node, i, p] > 0
    if several > 1:
        return -1
    _copy(corners, counts, fresh, node, node + 1)
    fresh[node, i] = fresh[node + 1, i] = 0
    for p in range(counts.shape[2]):
        if counts[node, i, p] > 0:
            count = counts[node, i, p]
            counts[node + 1, i, p] = _halved(corners[node + 1, i, p], count, line, -1.0)
            counts[node, i, p] = _halved(corners[node, i, p], count, line, 1.0)
    return 2


@loop("numpy")
def _halved(corners: Array, count: int, line: Array, side: float) -> int:
    """Cut a polygon, in its place, to where side * (a x + b y - c) >= 0."""
    out, kept = np.empty((ROOM, 2)), 0
    for k in range(count):
        here, there = corners[k], corners[(k + 1) % count]
        one = side * (line[0] * here[0] + line[1] * here[1] - line[2])
        two = side * (line[0] * there[0] + line[1] * there[1] - line[2])
        if kept + 2 > ROOM:
            return count
        if one >= 0.0:
            out[kept] = here
            kept += 1
        if (one >= 0.0) != (two >= 0.0):
            share = one / (one - two)
            out[kept] = here + share * (there - here)
            kept += 1
    corners[:kept] = out[:kept]
    return kept
