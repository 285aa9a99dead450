"""Replays a tree of cuts, divisions and refutations, compiled, as a check of the search.

Solved: the check that `support_cuts` derives. At a node each finger may be in some convex polygons,
one on each piece. Nodes that wait are a stack. The last one makes way for its children: one for
each finger that may answer a twist, or two where a finger's polygon, or its pieces, are divided.

The search takes from here what a tree does to nodes. The replay is independent of it where that
says what contacts answer: here supports are computed in space, from the definition, and edges are
followed by halving. From which support on a contact answers a twist is given.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.arrays_kernel import copy, longer
from grasp_core.compiled import loop
from grasp_core.optimizing.grounds import ROOM
from grasp_core.values import FINGERS

BY_PIECES, BY_LINE = 16, 32
"""What a node does, added to a finger: it divides its pieces, or its polygon. Below these numbers
are questions, the sums of 2**i over the fingers i that may answer."""
HALVINGS = 40  # halvings of an edge towards the point in which it begins to answer
AT_FIRST, DEEPEST = 16, 4096
"""Number of nodes for which there is room at first, and the largest number that may wait."""


class Pieces(NamedTuple):
    """The convex pieces of faces on which contacts lie, at unit size."""

    normals: Array  # inward unit normals, (p, 3)
    origins: Array  # points whose plane coordinates are zero, (p, 3)
    frames: Array  # orthonormal columns spanning the planes, (p, 3, 2)
    friction: float


class Nodes(NamedTuple):
    """Nodes that wait, the next one last: where each finger may be."""

    corners: Array  # corners of what is left of each piece, by node and finger, (d, 4, p, ROOM, 2)
    counts: Indices  # how many corners each has, (d, 4, p)
    fresh: Indices  # whether a finger may still be exchanged with the other fresh ones, (d, 4)
    above: Indices  # how many nodes above each count, (d,)
    top: Indices  # how many nodes wait, (1,)


@loop("numpy")
def vacant(deep: int, pieces: int) -> Nodes:
    """Make room for nodes of which none waits."""
    return Nodes(
        np.zeros((deep, FINGERS, pieces, ROOM, 2)), np.zeros((deep, FINGERS, pieces), np.int64),
        np.zeros((deep, FINGERS), np.int64), np.zeros(deep, np.int64), np.zeros(1, np.int64),
    )  # fmt: skip


@loop("numpy")
def doubled(nodes: Nodes) -> Nodes:
    """Return the same nodes with room for twice as many."""
    room = 2 * len(nodes.corners)
    return Nodes(
        longer(nodes.corners, room), longer(nodes.counts, room), longer(nodes.fresh, room),
        longer(nodes.above, room), nodes.top,
    )  # fmt: skip


@loop("numpy")
def _copy(nodes: Nodes, source: int, place: int) -> None:
    corners, counts = nodes.corners, nodes.counts  # once: in loops that would take longer
    copy(counts[source], counts[place])
    copy(nodes.fresh[source], nodes.fresh[place])
    nodes.above[place] = nodes.above[source]
    for i in range(FINGERS):
        for p in range(counts.shape[2]):
            count = counts[source, i, p]
            copy(corners[source, i, p, :count], corners[place, i, p])


@loop("numpy")
def branch(nodes: Nodes, deed: int) -> None:
    """Replace the last node by one for each finger that may answer, the first finger's last.

    Their polygons are still to be cut to where they answer.
    """
    node = nodes.top[0] - 1
    place = node
    for i in range(FINGERS):
        place += (deed >> i) & 1
    nodes.top[0] = place
    for other in range(node + 1, place):
        _copy(nodes, node, other)
    for i in range(FINGERS):
        if (deed >> i) & 1:
            place -= 1
            nodes.fresh[place, i] = 0


@loop("numpy")
def split(nodes: Nodes, deed: int, line: Array) -> None:
    """Replace the last node by two, in which a finger is before a line, or piece, or behind it.

    The first of them is the last.
    """
    node, i = nodes.top[0] - 1, deed % BY_PIECES
    _copy(nodes, node, node + 1)
    nodes.top[0] = node + 2
    nodes.fresh[node, i] = nodes.fresh[node + 1, i] = 0
    for p in range(nodes.counts.shape[2]):
        count = nodes.counts[node, i, p]
        if count > 0 and deed >= BY_LINE:
            for place, side in ((node + 1, 1.0), (node, -1.0)):
                nodes.counts[place, i, p] = clip(nodes.corners[place, i, p], count, line, side)
        else:
            nodes.counts[node if p < line[0] else node + 1, i, p] = 0


@loop("numpy")
def clip(corners: Array, count: int, line: Array, side: float) -> int:
    """Cut a polygon to side * (line0 a + line1 b - line2) <= 0; return how many corners it has."""
    heights, crossings, out = np.empty(ROOM), np.empty((ROOM, 2)), np.empty((ROOM, 2))
    for k in range(count):
        heights[k] = -side * (line[0] * corners[k, 0] + line[1] * corners[k, 1] - line[2])
    for k in range(count):
        after = (k + 1) % count
        if (heights[k] >= 0.0) != (heights[after] >= 0.0):
            share = heights[k] / (heights[k] - heights[after])
            for d in range(2):
                along = corners[after, d] - corners[k, d]
                crossings[k, d] = corners[k, d] + share * along
    kept = outline(corners, count, heights, 0.0, crossings, out)
    copy(out[:kept], corners)
    return kept


@loop("numpy")
def outline(
    corners: Array, count: int, heights: Array, t: float, crossings: Array, out: Array
) -> int:
    """Fill in the corners whose heights reach t and, in between, crossings of the edges.

    Gives how many corners these are; if there is no room for them, the polygon stays whole.
    """
    kept = 0
    for k in range(count):
        reached = heights[k] >= t
        crossed = reached != (heights[(k + 1) % count] >= t)
        if kept + reached + crossed > ROOM:
            copy(corners[:count], out)
            return count
        if reached:
            out[kept, 0], out[kept, 1] = corners[k, 0], corners[k, 1]
            kept += 1
        if crossed:
            out[kept, 0], out[kept, 1] = crossings[k, 0], crossings[k, 1]
            kept += 1
    return kept


@loop("numpy", beside=True)
def replay(  # noqa: PLR0913, PLR0917 - the arrays of a tree
    pieces: Pieces, first: Array, first_counts: Indices, first_fresh: Indices,
    deeds: Indices, asked: Indices, twists: Array, answers: Array, lines: Array, most_cuts: int,
) -> bool:  # fmt: skip
    """Return whether the deeds refute, from each first node on, that contacts answer all twists.

    An answer to the twist k is a support of at least answers[k].
    """
    nodes, place = vacant(AT_FIRST, len(pieces.normals)), 0
    for case in range(len(first)):
        copy(first[case], nodes.corners[0])
        copy(first_counts[case], nodes.counts[0])
        copy(first_fresh[case], nodes.fresh[0])
        nodes.above[0], nodes.top[0] = 0, 1
        while nodes.top[0] > 0:
            node = nodes.top[0] - 1
            if place >= len(deeds) or nodes.above[node] >= most_cuts:
                return False
            if nodes.top[0] + FINGERS >= len(nodes.above):
                if len(nodes.above) >= DEEPEST:
                    return False
                nodes = doubled(nodes)
            nodes.above[node] += 1
            deed, at = deeds[place], asked[place]
            place += 1
            if 0 <= deed < BY_PIECES and 0 <= at < len(twists):
                if not _answered(pieces, nodes, deed, twists[at], float(answers[at])):
                    return False
            elif _is_division(nodes, deed) and 0 <= at < len(lines):
                split(nodes, deed, lines[at])
            else:
                return False
    return place == len(deeds)


@loop("numpy", once=True)
def _is_division(nodes: Nodes, deed: int) -> bool:
    """Return whether a deed divides a finger's pieces, or its polygon where it is on one piece."""
    if BY_PIECES <= deed < BY_PIECES + FINGERS:
        return True
    if not BY_LINE <= deed < BY_LINE + FINGERS:
        return False
    return (nodes.counts[nodes.top[0] - 1, deed - BY_LINE] > 0).sum() <= 1


@loop("numpy", once=True)
def _answered(pieces: Pieces, nodes: Nodes, deed: int, y: Array, t: float) -> bool:
    """Put one node for each named finger in the last node's place; return False if it is wrong."""
    corners, counts = nodes.corners, nodes.counts
    if _do_others(pieces, nodes, deed, y, t):
        return False
    branch(nodes, deed)
    place = nodes.top[0]
    for i in range(FINGERS):
        if (deed >> i) & 1:
            place -= 1
            for p in range(counts.shape[2]):
                if counts[place, i, p] > 0:
                    kept = _cut(pieces, p, corners[place, i, p], counts[place, i, p], y, t)
                    counts[place, i, p] = kept
    return True


@loop("numpy", once=True)
def _do_others(pieces: Pieces, nodes: Nodes, deed: int, y: Array, t: float) -> bool:
    """Return whether a finger of the last node may answer for which no named one stands."""
    corners, counts, fresh = nodes.corners, nodes.counts, nodes.fresh
    node, twin = nodes.top[0] - 1, False
    for i in range(FINGERS):
        if counts[node, i].sum() == 0:
            return False  # a finger has nowhere to be
        if (deed >> i) & 1:
            twin = twin or fresh[node, i] > 0
    for i in range(FINGERS):
        if (deed >> i) & 1 or (twin and fresh[node, i]):
            continue
        for p in range(counts.shape[2]):
            for v in range(counts[node, i, p]):
                a, b = corners[node, i, p, v, 0], corners[node, i, p, v, 1]
                if _support(pieces, p, a, b, y) >= t:
                    return True
    return False


@loop("numpy")
def _support(pieces: Pieces, p: int, a: float, b: float, y: Array) -> float:
    """Return the support of the cone of a contact, from the definition."""
    F, n, o = pieces.frames[p], pieces.normals[p], pieces.origins[p]
    x0 = o[0] + F[0, 0] * a + F[0, 1] * b
    x1 = o[1] + F[1, 0] * a + F[1, 1] * b
    x2 = o[2] + F[2, 0] * a + F[2, 1] * b
    u0 = y[0] + y[4] * x2 - y[5] * x1
    u1 = y[1] + y[5] * x0 - y[3] * x2
    u2 = y[2] + y[3] * x1 - y[4] * x0
    along = F[0, 0] * u0 + F[1, 0] * u1 + F[2, 0] * u2
    across = F[0, 1] * u0 + F[1, 1] * u1 + F[2, 1] * u2
    slide = pieces.friction * np.sqrt(along * along + across * across)
    return n[0] * u0 + n[1] * u1 + n[2] * u2 + slide


@loop("numpy", once=True)
def _cut(pieces: Pieces, p: int, corners: Array, count: int, y: Array, t: float) -> int:
    """Cut a polygon to where a contact answers, in its place; return how many corners are left."""
    heights, reached = np.empty(ROOM), 0
    for k in range(count):
        heights[k] = _support(pieces, p, corners[k, 0], corners[k, 1], y)
        reached += heights[k] >= t
    if not 0 < reached < count:
        return reached
    crossings, out = np.empty((ROOM, 2)), np.empty((ROOM, 2))
    for k in range(count):
        after = (k + 1) % count
        if (heights[k] >= t) and not heights[after] >= t:
            _follow(pieces, p, corners[after], corners[k], y, t, crossings[k])
        elif (heights[after] >= t) and not heights[k] >= t:
            _follow(pieces, p, corners[k], corners[after], y, t, crossings[k])
    kept = outline(corners, count, heights, t, crossings, out)
    copy(out[:kept], corners)
    return kept


@loop("numpy")
def _follow(
    pieces: Pieces, p: int, low: Array, high: Array, y: Array, t: float, out: Array
) -> None:
    """Fill in a point of the edge at which s < t, as near as doubles tell to where s = t."""
    near, far = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        a, b = low[0] + middle * (high[0] - low[0]), low[1] + middle * (high[1] - low[1])
        if _support(pieces, p, a, b, y) < t:
            near = middle
        else:
            far = middle
    for j in range(2):
        out[j] = low[j] + near * (high[j] - low[j])
