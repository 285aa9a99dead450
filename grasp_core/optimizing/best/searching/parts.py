"""Parts of a search: subtrees with the memory that compiled code works in, and how they are joined.

A part has a stack of nodes that wait, a tree of nodes that were visited, and a pool of twists. Its
memory grows where it is full.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.optimizing.best.grounds import ROOM
from grasp_core.quality.ferrari_canny import FerrariCanny
from grasp_core.quality.resisted_loads import ResistedLoads
from grasp_core.values import FINGERS

NODES = "grasp_core.optimizing.best.searching.nodes_kernel"
POOL = 512
"""Twists that a search keeps: asking is most of its work, and takes as long as there are twists."""
DEEP = 320
"""Nodes that may wait in one part at first; room is doubled where it is full."""
FIRST_ROOM = 4096
"""Nodes for which a part's tree has room at first; it is doubled when it is full."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The nodes of a tree as `CutTree` lists them."""

    deeds: Indices
    asked: Indices
    twists: Array
    lines: Array


def part_from(first: tuple[Array, Indices, Indices], pieces: int) -> Part:
    """Return a part that begins with nodes, as `first_nodes` returns them, on so many pieces."""
    nodes = compiled(NODES)
    corners, counts, fresh = first
    deep = max(DEEP, len(corners) + FINGERS + 1)
    stack = nodes.Stack(
        np.zeros((deep, FINGERS, pieces, ROOM, 2)),
        np.zeros((deep, FINGERS, pieces), np.int64),
        np.zeros((deep, FINGERS), np.int64), np.zeros(deep, np.int64), np.zeros(1, np.int64),
    )  # fmt: skip
    n = len(corners)
    # the last one is searched first
    stack.corners[:n], stack.counts[:n], stack.fresh[:n] = (
        corners[::-1], counts[::-1], fresh[::-1],
    )  # fmt: skip
    stack.top[0] = n
    return Part(stack, _empty_tree(FIRST_ROOM), None)


def copied(pool: Any) -> Any:
    """Return a pool with the same twists, of which no tree has named any."""
    copies = type(pool)(*(array.copy() for array in pool))
    copies.names[:] = -1
    copies.used[:] = 0
    return copies


def _empty_tree(room: int) -> Any:
    return compiled(NODES).Tree(
        np.zeros(room, np.int64), np.zeros(room, np.int64), np.zeros((room, 6)),
        np.zeros((room, 3)), np.zeros(3, np.int64),
    )  # fmt: skip


def _larger(tree: Any) -> Any:
    new = _empty_tree(2 * len(tree.deeds))
    for old, room in zip(tree[:4], new[:4], strict=True):
        room[: len(old)] = old
    new.sizes[:] = tree.sizes
    return new


def enlarge(part: Part) -> None:
    """Make room in a part's tree, and in its stack where that is full."""
    if int(part.stack.top[0]) + FINGERS >= len(part.stack.depths):
        part.stack = _doubled(part.stack)
    part.tree = _larger(part.tree)


def _doubled(stack: Any) -> Any:
    return type(stack)(
        *(np.concatenate([array, np.zeros_like(array)]) for array in stack[:4]), stack.top
    )


def room() -> Any:
    """Return the memory in which a node is looked at."""
    return compiled(NODES).Work(
        np.zeros((FINGERS, POOL)), np.zeros((FINGERS, POOL)), np.zeros(POOL), np.zeros(POOL),
        np.zeros(FINGERS), np.zeros((FINGERS, 2)), np.zeros(FINGERS, np.int64),
        np.full(1, -1),
    )  # fmt: skip


def joined(trunk: Part, parts: Sequence[Part]) -> Steps:
    """Put the trees of parts into their places in the trunk's tree."""
    nodes = compiled(NODES)
    trees = [trunk.tree, *(part.tree for part in parts)]
    sizes = np.array([tree.sizes for tree in trees], dtype=np.int64)
    starts = np.cumsum(sizes, axis=0) - sizes
    each: list[tuple[Indices, Indices]] = []
    for tree, (n, _, _), (_, twists, lines) in zip(trees, sizes, starts, strict=True):
        deeds: Indices = tree.deeds[:n]
        shifts = np.where(deeds < int(nodes.BY_PIECES), int(twists), int(lines))
        asked: Indices = np.asarray(tree.asked[:n], dtype=np.int64) + shifts
        each.append((deeds, asked))
    deeds, asked = each[0]
    rows: list[tuple[Indices, Indices]] = []
    start = 0
    for hole, part in zip(np.flatnonzero(deeds == nodes.SPLICE).tolist(), each[1:], strict=True):
        rows += [(deeds[start:hole], asked[start:hole]), part]
        start = hole + 1
    rows.append((deeds[start:], asked[start:]))
    return Steps(
        np.concatenate([one for one, _ in rows]),
        np.concatenate([two for _, two in rows]),
        np.concatenate([tree.twists[:m] for tree, m in zip(trees, sizes[:, 1], strict=True)]),
        np.concatenate([tree.lines[:m] for tree, m in zip(trees, sizes[:, 2], strict=True)]),
    )
