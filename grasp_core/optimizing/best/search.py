"""Searches for a tree of cuts that refutes a quality, on all cores, the same tree on any number.

A level of the search refutes one threshold. Its tree is begun by one thread up to a depth; each
node left there is a part of its own, searched with its own twists. Parts are searched in waves of a
fixed number. After a wave its newest twists, part by part, join those that the next wave begins
with. So nothing depends on which thread does what, or when. Inside a level depth comes first: a
tree that refutes one threshold must visit all of its nodes in any order, and the best node first
means here the loosest threshold first (see `best_grasp`).
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.compiled import compiled
from grasp_core.optimizing.best.grounds import ROOM, Grounds
from grasp_core.quality.ferrari_canny import FerrariCanny, wrench_set_quality
from grasp_core.quality.measures import FERRARI_CANNY, Measure
from grasp_core.quality.resisted_loads import ResistedLoads, resisted_loads
from grasp_core.values import FINGERS

KERNEL = "grasp_core.optimizing.best.search_kernel"
NODES = "grasp_core.optimizing.best.nodes_kernel"
CUTS, TWISTS = "grasp_core.optimizing.best.cuts_kernel", "grasp_core.optimizing.best.twists_kernel"
POOL = 512
"""Twists that a search keeps."""
DEEP = 320
"""Nodes that may wait in one part."""
PART_DEPTH = 7
"""Nodes with several children above a node that becomes a part of its own."""
WAVE = 32
"""Parts that are searched from the same twists."""
KEPT = 384
"""Twists that a wave hands on at most."""
BUDGET = 2000
"""Nodes after which a thread looks whether it should stop: some tenths of a second."""
FIRST_ROOM = 4096
"""Nodes for which a part's tree has room at first; it is doubled when it is full."""
MUCH = 1.1
"""Ratio of qualities from which on contacts are a better start for other thresholds, where the
measure is not the usual one and the first contacts may be poor."""
EXACT_GAP = 1e-5
"""Gap between the bounds of the quality of contacts that may be better."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Contacts whose quality is known."""

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


@dataclass(slots=True, eq=False)
class Searching:
    """What levels of a search share: pieces, loads, twists, and whether to stop."""

    grounds: Grounds
    friction: float
    jobs: int
    stop: "Stop"
    measure: Measure = FERRARI_CANNY
    spare: float = 0.0
    """How far below threshold times demand a support still counts as an answer."""
    pool: Any = None
    nodes: int = 0
    """How many nodes were visited in all levels."""

    def __post_init__(self) -> None:
        self.pool = self.empty_pool()

    @property
    def pieces(self) -> Any:
        """Return the pieces as the kernels take them."""
        grounds = self.grounds
        return compiled(CUTS).Pieces(
            np.array(grounds.normals), np.array(grounds.origins), np.array(grounds.frames),
            float(self.friction),
        )  # fmt: skip

    @property
    def demand(self) -> Any:
        """Return the loads as the kernels take them."""
        kernel = compiled(TWISTS)
        kinds = {"ferrari-canny": kernel.USUAL, "weight": kernel.WEIGHT, "task": kernel.TASK}
        return kernel.Demand(int(kinds[self.measure.name]), np.array(self.measure.loads))

    def empty_pool(self) -> Any:
        """Return a pool without twists."""
        pieces = len(self.grounds.counts)
        return compiled(TWISTS).Pool(
            np.zeros((POOL, 6)), np.zeros(POOL), np.zeros((pieces, 6, POOL)),
            np.zeros(POOL, np.int64),
            np.full(POOL, -1), np.zeros(1, np.int64),
        )  # fmt: skip

    def learn(self, twists: Array, pool: Any = None, now: int = 0) -> None:
        """Add twists, (n, 6), to a pool, the common one by default."""
        pool = self.pool if pool is None else pool
        for y in twists:
            compiled(TWISTS).learn(pool, self.pieces, self.demand, np.array(y), now)

    def refute(
        self, nodes: tuple[Array, Indices, Indices], threshold: float, known: float,
        progress: Callable[[float], None],
    ) -> tuple[Steps | None, list[Found]]:  # fmt: skip
        """Try to refute that contacts of the first nodes reach a threshold.

        Args:
            nodes: What `first_nodes` returns.
            threshold: The quality.
            known: A quality that is attained.
            progress: Called with the share of the parts that are done.

        Returns:
            The tree, or None if it was stopped or contacts reach the threshold; contacts found that
            are better than known.
        """
        trunk = self._part(nodes)
        trunk.pool = _copied(self.pool)
        parts: list[Part] = []
        better: list[Found] = []
        for part in self._begun(trunk, threshold, known):
            parts.append(part)
        better += trunk.found
        self.nodes += int(trunk.tree.sizes[0])
        if not trunk.finished:
            return None, better
        with ThreadPoolExecutor(self.jobs) as threads:
            for start in range(0, len(parts), WAVE):
                wave = parts[start : start + WAVE]
                for part in wave:
                    part.pool = _copied(self.pool)
                self._together(threads, wave, threshold, known)
                self._hand_on(wave)
                self.nodes += sum(int(part.tree.sizes[0]) for part in wave)
                better += [found for part in wave for found in part.found]
                if not all(part.finished for part in wave):
                    return None, better
                progress(min(1.0, (start + WAVE) / len(parts)))
        return _joined(trunk, parts), better

    def _together(
        self, threads: ThreadPoolExecutor, wave: Sequence[Part], threshold: float, known: float
    ) -> None:
        """Search the parts of a wave; an interrupt stops all of them."""
        try:
            for ended in [threads.submit(self._search, part, threshold, known) for part in wave]:
                ended.result()
        except BaseException:
            self.stop.now()
            raise

    def _part(self, first: tuple[Array, Indices, Indices]) -> Part:
        nodes, pieces = compiled(NODES), len(self.grounds.counts)
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

    def _begun(self, trunk: Part, threshold: float, known: float) -> Iterator[Part]:
        """Search the beginning of a tree, and yield a part for each node that is left."""
        kernel = compiled(KERNEL)
        for why in self._runs(trunk, threshold, known, PART_DEPTH):
            if why == kernel.PART:
                node = int(trunk.stack.top[0]) - 1
                stack = trunk.stack
                yield self._part(
                    (
                        stack.corners[node : node + 1].copy(),
                        stack.counts[node : node + 1].copy(),
                        stack.fresh[node : node + 1].copy(),
                    )
                )
                stack.top[0] = node

    def _search(self, part: Part, threshold: float, known: float) -> None:
        for _ in self._runs(part, threshold, known, 10**9):
            pass
        part.stack = None  # the memory of a part that is done

    def _runs(self, part: Part, threshold: float, known: float, depth: int) -> Iterator[int]:
        """Run the kernel until a part is done, and yield why it pauses for the caller."""
        kernel, nodes, pieces = compiled(KERNEL), compiled(NODES), self.pieces
        work, demand = _room(), self.demand
        while not self.stop():
            search = nodes.Search(
                pieces, part.stack, part.pool, part.tree, work, threshold, demand, self.spare
            )
            why = kernel.run(search, BUDGET, depth)
            if why == kernel.DONE:
                part.finished = True
                return
            if why == kernel.LOST:
                return
            if why == kernel.FULL:
                _enlarge(part)
            elif why == kernel.FOUND and not self._is_refuted(part, work, threshold, known):
                return
            yield why

    def _is_refuted(self, part: Part, work: Any, threshold: float, known: float) -> bool:
        """Return whether contacts found are below the threshold; learn the twist that shows it."""
        found = self.measured(work.on, work.middle)
        if found.quality.lower > known:
            part.found.append(found)
            if not self.measure.is_usual and found.quality.lower > MUCH * known:
                return False
        if found.quality.upper >= threshold:
            return False
        self.learn(found.quality.direction[None], part.pool, int(part.tree.sizes[0]))
        return True

    def measured(self, on: Indices, at: Array) -> Found:
        """Bound the quality of contacts on pieces, (4,), at plane coordinates, (4, 2)."""
        points = np.array([self.grounds.places(p, y[None])[0] for p, y in zip(on, at, strict=True)])
        wrenches = WrenchSet.at(points, self.grounds.normals[on], np.full(FINGERS, self.friction))
        if self.measure.is_usual:
            quality = wrench_set_quality(wrenches, EXACT_GAP)
        else:
            quality = resisted_loads(wrenches, self.measure, EXACT_GAP)
        return Found(tuple(int(p) for p in on), np.array(at), quality)

    def _hand_on(self, wave: Sequence[Part]) -> None:
        """Add the newest twists of each part to those that the next wave begins with."""
        each = max(1, KEPT // len(wave))
        for part in wave:
            size = int(part.pool.size[0])
            newest = np.argsort(-part.pool.used[:size], kind="stable")[:each]
            old = {y.tobytes() for y in self.pool.twists}
            fresh = [y for y in part.pool.twists[newest] if y.tobytes() not in old]
            self.learn(np.array(fresh).reshape(-1, 6), now=part.tree.sizes[0])
            part.pool = None


def _copied(pool: Any) -> Any:
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


def _enlarge(part: Part) -> None:
    """Make room in a part's tree, and in its stack where that is full."""
    if int(part.stack.top[0]) + FINGERS >= len(part.stack.depths):
        part.stack = _doubled(part.stack)
    part.tree = _larger(part.tree)


def _doubled(stack: Any) -> Any:
    return type(stack)(
        *(np.concatenate([array, np.zeros_like(array)]) for array in stack[:4]), stack.top
    )


def _room() -> Any:
    return compiled(NODES).Work(
        np.zeros((FINGERS, POOL)), np.zeros((FINGERS, POOL)), np.zeros(POOL), np.zeros(POOL),
        np.zeros(FINGERS), np.zeros((FINGERS, 2)), np.zeros(FINGERS, np.int64),
        np.full(1, -1),
    )  # fmt: skip


def _joined(trunk: Part, parts: Sequence[Part]) -> Steps:
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


class Stop:
    """Tells threads to stop, after a time or when asked."""

    def __init__(self) -> None:
        self._event = threading.Event()

    def __call__(self) -> bool:
        """Return whether to stop."""
        return self._event.is_set()

    def now(self) -> None:
        """Stop."""
        self._event.set()
