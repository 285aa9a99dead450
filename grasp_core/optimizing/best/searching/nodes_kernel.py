"""Holds the nodes of a search and the tree of what was done at each, for compiled loops."""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.optimizing.best.searching.cuts_kernel import MOST_CORNERS, Pieces, clip, extent
from grasp_core.optimizing.best.searching.twists_kernel import Demand, Pool

FINGERS = 4
ASK, BY_PIECES, BY_LINE, SPLICE = 0, 16, 32, 64
"""What a node does, added to fingers: a set of fingers for questions, else one finger."""
LEAST = 1e-7
"""Extent of a polygon, in object radii, below which it is not divided."""
SEVERAL = 2.0
"""Extent that counts for a finger with several pieces, larger than that of any piece."""
ALL = -1
"""Says that all fingers have changed."""


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
    changed: Indices
    """The finger whose polygons have changed since the other fields were filled in, (1,)."""


class Search(NamedTuple):
    """All that a search works with."""

    pieces: Pieces
    stack: Stack
    pool: Pool
    tree: Tree
    work: Work
    t: float
    """The multiple of the loads that no contacts are to resist."""
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
