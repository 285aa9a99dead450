"""Searches for a tree of cuts that refutes a threshold, on all cores, the same tree on any number.

A level of the search refutes one threshold. Its tree is begun by one thread up to a depth; each
node left there is a part of its own, searched with its own twists. A part is a subtree with the
memory that compiled code works in, which grows where it is full: a stack of nodes that wait, a tree
of nodes that were visited, and a pool of twists. A part that has visited many nodes leaves those
that wait to parts of their own, which begin with its twists. Parts are searched in waves of a fixed
number. After a wave its newest twists, part by part, join those that parts of the trunk begin with.
So nothing depends on which thread does what, or when; and numbers are on a grid, so that nothing
depends on last digits (see `support_cuts`). Inside a level depth comes first: a tree that refutes
one threshold must visit all of its nodes in any order, and the best node first means here the
loosest threshold first (see `best_grasp`).
"""

import math
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.compiled import compiled
from grasp_core.optimizing.contact_places import (
    ALONE,
    POLYGON_DIGITS,
    REPLAY,
    TWISTS,
    Grounds,
    first_nodes,
)
from grasp_core.optimizing.support_cuts import SEARCHED_BELOW, CutTree, Slack
from grasp_core.quality.ferrari_canny import FerrariCanny
from grasp_core.quality.measures import FERRARI_CANNY, Measure, ResistedLoads, measured_set
from grasp_core.solvers.ties import few_digits, first_best, on_grid
from grasp_core.stopping import Stop
from grasp_core.values import FINGERS

OpenNodes: TypeAlias = tuple[Array, Indices, Indices]
"""Where fingers may be at each of some nodes, as `first_nodes` returns them: corners (n, 4, p,
any, 2), how many count (n, 4, p), and which fingers are fresh (n, 4)."""
POOL = 512
"""Twists that a search keeps: asking is most of its work, and takes as long as there are twists."""
DEEP, FIRST_ROOM = 24, 256
"""Nodes that may wait in a part at first, and nodes for which its tree has room: most parts are
small, and clearing more memory took longer than searching them. Room is doubled where it is full.
"""
SEARCH_KERNEL = "grasp_core.optimizing.search_kernel"
PART_DEPTH = 7
"""Nodes with several children above a node that becomes a part of its own: a full tree has at least
128 such parts, four waves of them."""
PART_NODES = 4000
"""Nodes after which a part leaves those that wait to parts of their own: some parts have a
hundred times as many as most, and one thread would search them while others wait."""
MOST_DEPTH = 10**9
MOST_SEARCHED = 10**10
"""Nodes after which a search ends as undivided: a core visits about 1e4 in a second."""
WAVE = 32
"""Parts that are searched from the same twists: more threads would find nothing to do, and twists
that a part finds are of no use to the others of its wave."""
TWISTS_HANDED_ON = 384
"""Twists that a wave hands on at most: three quarters of a pool, so that as many of the old ones
stay."""
BUDGET = 2000
"""Nodes after which a thread looks whether it should stop: some tenths of a second."""
MUCH = 1.1
"""Ratio of qualities from which on contacts are a better start for other thresholds, where the
measure is not the usual one and the first contacts may be poor."""
OFF_POWERS = 1.4  # factor that keeps loads of round sizes away from powers of two
REFUTED_SHARE = 1.0 - 1e-6  # share of a threshold below which contacts count as refuted
EXACT_GAP = 1e-5
"""Gap between the bounds of the measure of contacts that may be better: a tenth of the smallest gap
that a search may be asked for."""
COUNT = 384
"""Random twists to begin with, as many as a wave hands on; a quarter of them is moved to where the
support of all polygons is smaller."""
FIRST_STEPS = 60  # steps of these descents: they settle within it
ROUNDED_UP = 1e-6
"""Share by which a threshold is rounded up at least, and less than three times as much."""


@dataclass(frozen=True, slots=True, eq=False)
class RatedContacts:
    """Contacts whose quality, or multiple of a task's loads, is known."""

    pieces: tuple[int, ...]  # the piece of each contact, (4,)
    at: Array  # plane coordinates, (4, 2)
    quality: FerrariCanny | ResistedLoads


@dataclass(slots=True, eq=False)
class Part:
    """A subtree and the state of its search."""

    path: tuple[int, ...]
    """For this part and each above it but the first, how many nodes were left before it."""
    stack: Any
    tree: Any
    pool: Any
    found: list[RatedContacts] = field(default_factory=list[RatedContacts])
    finished: bool = False
    left: list[OpenNodes] = field(default_factory=list[OpenNodes])
    """Nodes that are left to parts of their own, in the order of the tree."""


def leave(part: Part) -> None:
    """Leave a part's next node, alone, in as little memory as it takes: thousands may wait."""
    stack, place = part.stack, int(part.stack.top[0]) - 1
    counts = stack.counts[place : place + 1].copy()
    corners = stack.corners[place : place + 1, :, :, : counts.max()].copy()
    part.left.append((corners, counts, stack.fresh[place : place + 1].copy()))
    stack.top[0] = place


def part_from(path: tuple[int, ...], first: OpenNodes, pool: Any) -> Part:
    """Return a part that begins with nodes and the twists of a pool."""
    corners, counts, fresh = first
    stack = compiled(REPLAY).vacant(max(DEEP, len(corners) + FINGERS + 1), counts.shape[2])
    n = len(corners)
    # the last one is searched first
    stack.corners[:n, :, :, : corners.shape[3]] = corners[::-1]
    stack.counts[:n], stack.fresh[:n] = counts[::-1], fresh[::-1]
    stack.top[0] = n
    tree = compiled(SEARCH_KERNEL).Tree(
        np.zeros(FIRST_ROOM, np.int64), np.zeros(FIRST_ROOM, np.int64),
        np.zeros((FIRST_ROOM, 6)), np.zeros((FIRST_ROOM, 3)), np.zeros(3, np.int64),
    )  # fmt: skip
    # the same twists, all used before the tree begins, which has named none
    own = type(pool)(*(array.copy() for array in pool))
    own.names[:] = -1
    own.used[:] -= own.used.max() + 1
    return Part(path, stack, tree, own)


def enlarge(part: Part) -> None:
    """Make room in what is full of a part's stack and tree; few twists serve many nodes."""
    stack, tree = part.stack, part.tree
    if int(stack.top[0]) + FINGERS >= len(stack.above):
        part.stack = compiled(REPLAY).doubled(stack)
    arrays = [
        np.concatenate([array, np.zeros_like(array)]) if tree.sizes[k] + 1 >= len(array) else array
        for array, k in zip(tree[:4], (0, 0, 1, 2), strict=True)
    ]
    part.tree = type(tree)(*arrays, tree.sizes)


def joined(parts: Sequence[Part]) -> dict[str, Any]:
    """Put the trees of parts into one, as arrays of a `CutTree`: a child's in its place."""
    splice, lines_from = int(compiled(SEARCH_KERNEL).SPLICE), int(compiled(REPLAY).BY_PIECES)
    sizes = np.array([part.tree.sizes for part in parts], dtype=np.int64)
    starts = np.cumsum(sizes, axis=0) - sizes
    runs = list[tuple[tuple[int, ...], Indices, Indices]]()
    for part, (nodes, _, _), (_, twists, lines) in zip(parts, sizes, starts, strict=True):
        deeds = np.asarray(part.tree.deeds[:nodes], dtype=np.int64)
        asked = np.array(part.tree.asked[:nodes], dtype=np.int64)
        asked += np.where(deeds < lines_from, int(twists), int(lines))
        # paths of a part's runs begin with its own, and so come right after the run of nodes above
        # the place that is left for it
        ends = np.flatnonzero(deeds == splice)
        for k, (one, two) in enumerate(zip([0, *ends + 1], [*ends, nodes], strict=True)):
            runs.append(((*part.path, k), deeds[one:two], asked[one:two]))
    runs.sort(key=lambda run: run[0])
    return {
        "deeds": np.concatenate([deeds for _, deeds, _ in runs]),
        "asked": np.concatenate([asked for _, _, asked in runs]),
        "twists": np.concatenate([each.tree.twists[: each.tree.sizes[1]] for each in parts]),
        "lines": np.concatenate([each.tree.lines[: each.tree.sizes[2]] for each in parts]),
    }


class Searching:
    """A bound that falls from level to level, with what refutes all above, and twists to ask."""

    def __init__(
        self, grounds: Grounds, friction: float, jobs: int, stop: Stop,
        measure: Measure = FERRARI_CANNY, maps: Array = ALONE, owners: Indices | None = None,
    ) -> None:  # fmt: skip
        self.grounds, self.friction, self.jobs, self.stop = grounds, friction, jobs, stop
        self.measure, self.maps, self.owners = measure, maps, owners
        self.nodes = 0  # how many were visited in all levels
        self.first = first_nodes(grounds, maps, owners)
        # searches leave more than proofs, for a replay with other roundings
        self.searched = Slack.of(friction, len(maps), measure, SEARCHED_BELOW)
        kernel = compiled(TWISTS)
        each = (grounds.normals, grounds.origins, grounds.frames)
        numbers = (on_grid(every, POLYGON_DIGITS) for every in each)
        self.pieces = compiled(REPLAY).Pieces(*numbers, float(friction))
        kinds = {
            "ferrari-canny": kernel.QUALITY_DEMAND,
            "weight": kernel.WEIGHT_DEMAND,
            "task": kernel.TASK_DEMAND,
        }
        scale = math.ldexp(1.0, math.frexp(OFF_POWERS * measure.size)[1])
        loads = scale * on_grid(measure.loads / scale, POLYGON_DIGITS)
        self.demand = kernel.Demand(int(kinds[measure.name]), loads)
        self.pool = kernel.Pool(
            np.zeros((POOL, 6)), np.zeros(POOL), np.zeros((len(grounds.counts), 6, POOL)),
            np.zeros(POOL, np.int64), np.full(POOL, -1), np.zeros(1, np.int64),
        )  # fmt: skip

    def begin(self, rng: np.random.Generator) -> Array:
        """Learn unit twists, (n, 6), that polygons resist little; the best one proves a bound."""
        grounds, loads = self.grounds, self.measure.loads
        on, at = np.repeat(np.arange(len(grounds.counts)), grounds.counts), grounds.polygons()
        corners = on_grid(grounds.places(on, np.vstack(at)), POLYGON_DIGITS)
        # a task's loads themselves, the other way, ask for most
        found = np.vstack([-loads, rng.normal(size=(COUNT, 6))])
        found = on_grid(found / np.linalg.norm(found, axis=1, keepdims=True))
        for y in found[: len(loads) + COUNT // 4]:
            compiled(TWISTS).descend(self.pieces, self.demand, corners, on, y, FIRST_STEPS, 0.0)
        self.learn(found)
        twists = np.array(self.pool.twists[: len(found)])
        reached = grounds.supports(on, np.vstack(at), self.friction, twists).max(axis=0)
        supports = np.maximum(reached, 0.0) + self.searched.lowered
        thresholds = self.measure.multiples(supports, self.measure.demands(twists))
        thresholds += self.searched.raised
        best = first_best(-thresholds)
        threshold = few_digits((1.0 + 2.0 * ROUNDED_UP) * thresholds[best], ROUNDED_UP)
        none = np.zeros(len(self.first[0]), np.int64)
        self.proof = CutTree(
            grounds, self.friction, self.maps, threshold, none, none, twists[best : best + 1],
            np.empty((0, 3)), self.measure, self.owners,
        )  # fmt: skip
        return twists

    def learn(self, twists: Array, pool: Any = None, now: int = 0) -> None:
        """Add twists, (n, 6), to a pool, the common one by default."""
        pool = self.pool if pool is None else pool
        for y in twists:
            compiled(TWISTS).learn(pool, self.pieces, self.demand, np.array(y), now)

    def refute(self, bound: float, known: float = math.inf) -> tuple[bool, list[RatedContacts]]:
        """Try to lower the bound; return whether that came about, and contacts above the known."""
        threshold = bound - self.searched.raised
        corners, counts, fresh = self.first
        trunk = part_from((), (on_grid(corners, POLYGON_DIGITS), counts, fresh), self.pool)
        self._search(trunk, threshold, known, PART_DEPTH)
        wave, parts, better = [trunk], [trunk], list[RatedContacts]()
        # nodes that wait, with their paths and the pools that they begin with
        waiting = deque[tuple[tuple[int, ...], OpenNodes, Any]]()
        with ThreadPoolExecutor(self.jobs) as threads:
            while True:
                self.nodes += sum(int(part.tree.sizes[0]) for part in wave)
                better += [found for part in wave for found in part.found]
                # a wave ends, as each of its parts leaves all that waits after `PART_NODES`
                if self.nodes > MOST_SEARCHED or not all(part.finished for part in wave):
                    return False, better
                for part in wave:
                    pool = self.pool if part is trunk else part.pool
                    waiting += [((*part.path, k), node, pool) for k, node in enumerate(part.left)]
                    part.left, part.pool = [], None
                if not waiting:
                    refuted, steps = bound - self.proof.slack.raised, joined(parts)
                    self.proof = replace(self.proof, threshold=refuted, **steps)
                    return True, better
                some = range(min(WAVE, len(waiting)))
                wave = [part_from(*waiting.popleft()) for _ in some]
                search = partial(self._search, threshold=threshold, known=known, depth=MOST_DEPTH)
                try:
                    list(threads.map(search, wave))
                except BaseException:
                    self.stop.now()
                    raise
                self._hand_on(wave)
                parts += wave

    def _search(self, part: Part, threshold: float, known: float, depth: int) -> None:
        """Search a part; nodes at a depth are left, and all that wait after `PART_NODES`."""
        kernel, found_at = compiled(SEARCH_KERNEL), -1
        work = kernel.NodeRoom(
            np.zeros((FINGERS, POOL)), np.zeros((FINGERS, POOL)), np.zeros(POOL), np.zeros(POOL),
            np.zeros(FINGERS), np.zeros((FINGERS, 2)), np.zeros(FINGERS, np.int64),
            np.zeros((len(self.grounds.counts), 6)), np.full(1, -1),
        )  # fmt: skip
        while not self.stop():
            search = kernel.Search(
                self.pieces, part.stack, part.pool, part.tree, work, threshold, self.demand,
                self.searched.lowered,
            )  # fmt: skip
            before = int(part.tree.sizes[0])
            why = kernel.run(search, BUDGET, depth if before < PART_NODES else -1)
            self.stop.spend(int(part.tree.sizes[0]) - before)
            if why in {kernel.DONE, kernel.UNDIVIDABLE}:
                part.finished = why == kernel.DONE
                break
            if why == kernel.NO_ROOM:
                enlarge(part)
            elif why == kernel.OWN_PART:
                leave(part)
            elif why == kernel.CONTACTS_FOUND:
                if not self._is_refuted(part, work, threshold, known):
                    break
                size = int(part.tree.sizes[0])
                # found again: the twist refutes the contacts by less than rounding
                if size == found_at and not kernel.divide(search):
                    break
                found_at = size
        part.stack = None  # the memory of a part that is done

    def _is_refuted(self, part: Part, work: Any, threshold: float, known: float) -> bool:
        found = self.measured(work.on, work.middle)
        if found.quality.lower > known:
            part.found.append(found)
            if not self.measure.is_usual and found.quality.lower > MUCH * known:
                return False
        if found.quality.upper >= REFUTED_SHARE * threshold:
            return False
        now = int(part.tree.sizes[0])
        self.learn(on_grid(found.quality.direction[None]), part.pool, now)
        return True

    def measured(self, on: Indices, at: Array) -> RatedContacts:
        """Bound the measure of contacts on pieces, (4,), at plane coordinates, (4, 2)."""
        quality = measured_set(self.wrenches(on, at), self.measure, EXACT_GAP)
        return RatedContacts(tuple(int(p) for p in on), np.array(at), quality)

    def wrenches(self, on: Indices, at: Array) -> WrenchSet:
        """Return the wrenches of contacts on pieces, (4,), at plane coordinates, on a grid."""
        friction = np.full(FINGERS, self.friction)
        return WrenchSet.at(
            self.grounds.places(on, at), self.grounds.normals[on], friction
        ).on_grid()

    def _hand_on(self, wave: Sequence[Part]) -> None:
        """Add the newest twists of each part to those that the next wave begins with."""
        each = max(1, TWISTS_HANDED_ON // len(wave))
        for part in wave:
            size = int(part.pool.size[0])
            newest = np.argsort(-part.pool.used[:size], kind="stable")[:each]
            old = {y.tobytes() for y in self.pool.twists}
            fresh = [y for y in part.pool.twists[newest] if y.tobytes() not in old]
            self.learn(np.array(fresh).reshape(-1, 6), now=part.tree.sizes[0])
