"""Holds the nodes of searches and of replays, and does to them what a tree says, compiled.

At a node each finger may be in some convex polygons, one on each piece (see `support_cuts`). Nodes
that wait are a stack. The last one makes way for its children: one for each finger that may answer
a twist, or two where a finger's polygon, or its pieces, are divided. `search_kernel` chooses what
is done, and `replay_kernel` checks it; where contacts answer each of them computes in its own way.
"""

from typing import Any, NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.optimizing.grounds import ROOM
from grasp_core.values import FINGERS

BY_PIECES, BY_LINE = 16, 32
"""What a node does, added to a finger: it divides its pieces, or its polygon. Below these numbers
are questions, the sums of 2**i over the fingers i that may answer."""


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
    fresh: Indices
    """Whether a finger may still be exchanged with the other fresh ones, (d, 4)."""
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
    return Nodes(
        _longer(nodes.corners), _longer(nodes.counts), _longer(nodes.fresh), _longer(nodes.above),
        nodes.top,
    )  # fmt: skip


@loop("numpy")
def _longer(old: Any) -> Any:
    new = np.zeros((2 * len(old), *old.shape[1:]), old.dtype)
    new[: len(old)] = old
    return new


@loop("numpy")
def _copy(nodes: Nodes, source: int, place: int) -> None:
    nodes.counts[place] = nodes.counts[source]
    nodes.fresh[place] = nodes.fresh[source]
    nodes.above[place] = nodes.above[source]
    for i in range(FINGERS):
        for p in range(nodes.counts.shape[2]):
            count = nodes.counts[source, i, p]
            nodes.corners[place, i, p, :count] = nodes.corners[source, i, p, :count]


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
            crossings[k] = corners[k] + share * (corners[after] - corners[k])
    kept = outline(corners, count, heights, 0.0, crossings, out)
    corners[:kept] = out[:kept]
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
            out[:count] = corners[:count]
            return count
        if reached:
            out[kept, 0], out[kept, 1] = corners[k, 0], corners[k, 1]
            kept += 1
        if crossed:
            out[kept, 0], out[kept, 1] = crossings[k, 0], crossings[k, 1]
            kept += 1
    return kept
