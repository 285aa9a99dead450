"""Replays a tree of cuts, divisions and refutations, compiled, as a check of the search.

Solved: the check that `support_cuts` derives. At a node each finger may be in some convex polygons,
one on each piece. Nodes that wait are a stack. The last one makes way for its children: one for
each finger that may answer a twist, or two where a finger's polygon, or its pieces, are divided.

The search takes from here what a tree does to nodes, and the cuts: the hull, from outside, of
{x in K : s(x) >= t} for a convex polygon K of a face and the support s of the contact's cone. From
which support on a contact answers a twist is given.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.arrays_kernel import copy, longer
from grasp_core.compiled import loop
from grasp_core.optimizing.contact_places import CORNER_ROOM
from grasp_core.values import FINGERS

BY_PIECES, BY_LINE = 16, 32
"""What a node does, added to a finger: it divides its pieces, or its polygon. Below these numbers
are questions, the sums of 2**i over the fingers i that may answer."""
SLOPE_NUMBERS = 6  # numbers that say how a contact of a piece answers a twist, see `slopes`
MOVED_BACK = 2.0**-52  # share of an edge by which a point that answers is moved back at first
AT_FIRST, MOST_WAITING = 16, 4096
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
        np.zeros((deep, FINGERS, pieces, CORNER_ROOM, 2)),
        np.zeros((deep, FINGERS, pieces), np.int64),
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
def branch(nodes: Nodes, deed: int, asked: Array, friction: float, t: float) -> None:
    """Replace the last node by one for each finger that may answer, the first finger's last.

    Polygons are cut to where that finger answers; what is asked of each piece are its `slopes`.
    """
    node, rest = nodes.top[0] - 1, np.empty((CORNER_ROOM, 2))
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
            for p in range(len(asked)):
                count, corners = nodes.counts[place, i, p], nodes.corners[place, i, p]
                if count > 0:
                    kept = cut(corners, count, asked[p], friction, t, rest)
                    nodes.counts[place, i, p] = kept
                    copy(rest[:kept], corners)


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
    heights, crossings, out = (
        np.empty(CORNER_ROOM),
        np.empty((CORNER_ROOM, 2)),
        np.empty((CORNER_ROOM, 2)),
    )
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
        if kept + reached + crossed > CORNER_ROOM:
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
    answered = np.empty((len(pieces.normals), SLOPE_NUMBERS))
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
                if len(nodes.above) >= MOST_WAITING:
                    return False
                nodes = doubled(nodes)
            nodes.above[node] += 1
            deed, at = deeds[place], asked[place]
            place += 1
            if 0 <= deed < BY_PIECES and 0 <= at < len(twists):
                for p in range(len(answered)):
                    slopes(pieces, p, twists[at], answered[p])
                t = float(answers[at])
                if _do_others(nodes, deed, answered, pieces.friction, t):
                    return False
                branch(nodes, deed, answered, pieces.friction, t)
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
def _do_others(nodes: Nodes, deed: int, asked: Array, friction: float, t: float) -> bool:
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
        for p in range(len(asked)):
            for v in range(counts[node, i, p]):
                a, b = corners[node, i, p, v, 0], corners[node, i, p, v, 1]
                if support(asked[p], a, b, friction) >= t:
                    return True
    return False


@loop("numpy")
def slopes(pieces: Pieces, piece: int, y: Array, out: Array) -> None:
    """Fill in the numbers that give the support at any point (a, b) of a piece, (6,).

    The support is out0 + out1 a + out2 b + mu |(out3 - out5 b, out4 + out5 a)|: normal velocity of
    the contact, and its velocity along the face, which is that of a turning plane.
    """
    n, o, F = pieces.normals[piece], pieces.origins[piece], pieces.frames[piece]
    u0 = y[0] + y[4] * o[2] - y[5] * o[1]
    u1 = y[1] + y[5] * o[0] - y[3] * o[2]
    u2 = y[2] + y[3] * o[1] - y[4] * o[0]
    out[0] = n[0] * u0 + n[1] * u1 + n[2] * u2
    out[3] = F[0, 0] * u0 + F[1, 0] * u1 + F[2, 0] * u2
    out[4] = F[0, 1] * u0 + F[1, 1] * u1 + F[2, 1] * u2
    for j in range(2):
        w0 = y[4] * F[2, j] - y[5] * F[1, j]
        w1 = y[5] * F[0, j] - y[3] * F[2, j]
        w2 = y[3] * F[1, j] - y[4] * F[0, j]
        out[1 + j] = n[0] * w0 + n[1] * w1 + n[2] * w2
        if j == 0:
            out[5] = F[0, 1] * w0 + F[1, 1] * w1 + F[2, 1] * w2


@loop("numpy")
def support(at: Array, a: float, b: float, friction: float) -> float:
    """Return the support of the cone of a contact at the point (a, b), by its `slopes`."""
    one, two = at[3] - at[5] * b, at[4] + at[5] * a
    return at[0] + at[1] * a + at[2] * b + friction * np.sqrt(one * one + two * two)


@loop("numpy")
def cut(corners: Array, count: int, at: Array, friction: float, t: float, out: Array) -> int:
    """Fill in what is left of a polygon where the support reaches t; return how many corners."""
    heights, reached = np.empty(CORNER_ROOM), 0
    for k in range(count):
        heights[k] = support(at, corners[k, 0], corners[k, 1], friction)
        reached += heights[k] >= t
    if reached == 0:
        return 0
    crossings = np.empty((CORNER_ROOM, 2))
    for k in range(count):
        after = (k + 1) % count
        if (heights[k] >= t) != (heights[after] >= t):
            low, high = (after, k) if heights[k] >= t else (k, after)
            _cross(corners[low], corners[high], at, friction, t, crossings[k])
    return outline(corners, count, heights, t, crossings, out)


@loop("numpy", once=True)
def _cross(low: Array, high: Array, at: Array, friction: float, t: float, out: Array) -> None:
    """Fill in a point of an edge at which s < t, as near as doubles tell to where s = t.

    The point at the share x of the way from low to high has s = t - c + b x + mu |u + x v|, with u
    and v in the plane, so that s = t where (mu |u + x v|)^2 = (c - b x)^2. As s < t for x = 0, the
    least positive root is sought.
    """
    da, db = high[0] - low[0], high[1] - low[1]
    u0, u1, v0, v1 = at[3] - at[5] * low[1], at[4] + at[5] * low[0], -at[5] * db, at[5] * da
    c, b = t - (at[0] + at[1] * low[0] + at[2] * low[1]), at[1] * da + at[2] * db
    square = friction * friction
    constant = square * (u0 * u0 + u1 * u1) - c * c
    half = square * (u0 * v0 + u1 * v1) + c * b
    leading = square * (v0 * v0 + v1 * v1) - b * b
    share = min(-constant / (half + np.sqrt(max(half * half - leading * constant, 0.0))), 1.0)
    back = MOVED_BACK
    while share > 0.0 and support(at, low[0] + share * da, low[1] + share * db, friction) >= t:
        share, back = share - back, 2.0 * back
    share = share if share > 0.0 else 0.0  # also where there is no number
    out[0], out[1] = low[0] + share * da, low[1] + share * db
