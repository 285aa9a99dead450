"""Parts of a search: subtrees with the memory that compiled code works in, and how they are joined.

A part has a stack of nodes that wait, a tree of nodes that were visited, and a pool of twists. Its
memory grows where it is full.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.optimizing.best.grounds import ROOM
from grasp_core.quality.ferrari_canny import FerrariCanny
from grasp_core.quality.measures import ResistedLoads
from grasp_core.values import FINGERS

Nodes: TypeAlias = tuple[Array, Indices, Indices]
"""Where fingers may be at each of some nodes, as `first_nodes` returns them: corners (n, 4, p,
any, 2), how many count (n, 4, p), and which fingers are fresh (n, 4)."""
NODES = "grasp_core.optimizing.best.searching.nodes_kernel"
POOL = 512
"""Twists that a search keeps: asking is most of its work, and takes as long as there are twists."""
DEEP, FIRST_ROOM = 24, 256
"""Nodes that may wait in a part at first, and nodes for which its tree has room: most parts are
small, and clearing more memory took longer than searching them. Room is doubled where it is full.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Contacts whose quality, or multiple of a task's loads, is known."""

    pieces: tuple[int, ...]
    """The piece of each contact, (4,)."""
    at: Array
    """Plane coordinates, (4, 2)."""
    quality: FerrariCanny | ResistedLoads

    def __post_init__(self) -> None:
        self.at.setflags(write=False)


@dataclass(slots=True, eq=False)
class Part:
    """A subtree and the state of its search."""

    stack: Any
    tree: Any
    pool: Any
    found: list[Found] = field(default_factory=list[Found])
    finished: bool = False
    left: list[Nodes] = field(default_factory=list[Nodes])
    """Nodes that are left to parts of their own, in the order of the tree."""
    parts: list["Part"] = field(default_factory=list["Part"])
    """These parts, in the same order."""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The nodes of a tree as `CutTree` lists them."""

    deeds: Indices
    asked: Indices
    twists: Array
    lines: Array


def leave(part: Part) -> None:
    """Leave a part's next node, alone, in as little memory as it takes: thousands may wait."""
    stack, place = part.stack, int(part.stack.top[0]) - 1
    counts = stack.counts[place : place + 1].copy()
    corners = stack.corners[place : place + 1, :, :, : counts.max()].copy()
    part.left.append((corners, counts, stack.fresh[place : place + 1].copy()))
    stack.top[0] = place


def part_from(first: Nodes, pool: Any) -> Part:
    """Return a part that begins with nodes and the twists of a pool."""
    nodes = compiled(NODES)
    corners, counts, fresh = first
    deep, pieces = max(DEEP, len(corners) + FINGERS + 1), counts.shape[2]
    stack = nodes.Stack(
        np.zeros((deep, FINGERS, pieces, ROOM, 2)),
        np.zeros((deep, FINGERS, pieces), np.int64),
        np.zeros((deep, FINGERS), np.int64), np.zeros(deep, np.int64), np.zeros(1, np.int64),
    )  # fmt: skip
    n = len(corners)
    # the last one is searched first
    stack.corners[:n, :, :, : corners.shape[3]] = corners[::-1]
    stack.counts[:n], stack.fresh[:n] = counts[::-1], fresh[::-1]
    stack.top[0] = n
    tree = nodes.Tree(
        np.zeros(FIRST_ROOM, np.int64), np.zeros(FIRST_ROOM, np.int64),
        np.zeros((FIRST_ROOM, 6)), np.zeros((FIRST_ROOM, 3)), np.zeros(3, np.int64),
    )  # fmt: skip
    return Part(stack, tree, _copied(pool))


def _copied(pool: Any) -> Any:
    """Return a pool with the same twists, all used before a tree begins, which has named none."""
    copies = type(pool)(*(array.copy() for array in pool))
    copies.names[:] = -1
    copies.used[:] -= copies.used.max() + 1
    return copies


def enlarge(part: Part) -> None:
    """Make room in what is full of a part's stack and tree; few twists serve many nodes."""
    stack, tree = part.stack, part.tree
    if int(stack.top[0]) + FINGERS >= len(stack.depths):
        part.stack = type(stack)(*map(_doubled, stack[:4]), stack.top)
    sizes = [int(tree.sizes[k]) for k in (0, 0, 1, 2)]
    arrays = [
        _doubled(array) if size + 1 >= len(array) else array
        for array, size in zip(tree[:4], sizes, strict=True)
    ]
    part.tree = type(tree)(*arrays, tree.sizes)


def _doubled(array: Any) -> Any:
    return np.concatenate([array, np.zeros_like(array)])


def room() -> Any:
    """Return the memory in which a node is looked at."""
    return compiled(NODES).Work(
        np.zeros((FINGERS, POOL)), np.zeros((FINGERS, POOL)), np.zeros(POOL), np.zeros(POOL),
        np.zeros(FINGERS), np.zeros((FINGERS, 2)), np.zeros(FINGERS, np.int64),
        np.full(1, -1),
    )  # fmt: skip


def joined(trunk: Part, parts: Sequence[Part]) -> Steps:
    """Put the trees of parts into their places in the trunk's tree, and in each other's."""
    nodes = compiled(NODES)
    every = [trunk, *parts]
    sizes = np.array([part.tree.sizes for part in every], dtype=np.int64)
    starts = np.cumsum(sizes, axis=0) - sizes
    asked: dict[int, Indices] = {}
    for part, (n, _, _), (_, twists, lines) in zip(every, sizes, starts, strict=True):
        shifts = np.where(part.tree.deeds[:n] < int(nodes.BY_PIECES), int(twists), int(lines))
        asked[id(part)] = np.asarray(part.tree.asked[:n], dtype=np.int64) + shifts
    rows = list(_in_order(trunk, int(nodes.SPLICE)))
    return Steps(
        np.concatenate([part.tree.deeds[some] for part, some in rows]),
        np.concatenate([asked[id(part)][some] for part, some in rows]),
        np.concatenate([part.tree.twists[:m] for part, m in zip(every, sizes[:, 1], strict=True)]),
        np.concatenate([part.tree.lines[:m] for part, m in zip(every, sizes[:, 2], strict=True)]),
    )


def _in_order(trunk: Part, splice: int) -> Iterator[tuple[Part, slice]]:
    """Yield the nodes of parts in the order of the whole tree: children's trees in their places."""
    path = [(trunk, 0, 0)]
    while path:
        part, start, child = path.pop()
        deeds = part.tree.deeds[: part.tree.sizes[0]]
        if child == len(part.parts):
            yield part, slice(start, len(deeds))
            continue
        hole = start + int(np.argmax(deeds[start:] == splice))
        yield part, slice(start, hole)
        path += [(part, hole + 1, child + 1), (part.parts[child], 0, 0)]
