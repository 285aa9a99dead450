"""Best-first search over face quadruples, tightening bounds only at the head of one queue.

A grasp is ranked by its disc radius: how far each contact may move while the grasp stays good. Four
kinds of items wait in the queue, each with an upper bound on that radius: blocks of quadruples not
listed yet, bounded by the largest discs in their faces; listed blocks, bounded by how wide their
force cones can be; quadruples with chosen cones, bounded by the corners of their faces; and single
quadruples, bounded by small linear programs. The item with the largest bound comes first: a block
is listed, cones are chosen for some dozens of quadruples, their bounds are tightened, or a
quadruple is yielded. So no quadruple can have larger discs than the bound of one yielded before it,
and few cones are tilted and few programs solved that were not needed to know this.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from heapq import heapify, heappop, heappush
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.families.constructions import Construction
from grasp_core.families.disc_bounds import AttemptBounds
from grasp_core.families.kernel_tables import Attempts
from grasp_core.families.placing import Attempt
from grasp_core.planning.blocks import Blocks
from grasp_core.planning.quadruples import ConedQuadruples, WideQuadruples
from grasp_core.planning.result import Tally
from grasp_core.solvers.ties import coarse

SMALLEST_CHUNK, LARGEST_CHUNK = 32, 2048
"""Fewest and most quadruples whose bounds are tightened together."""
SMALLEST_TILT = 512
"""Fewest quadruples whose cones are chosen together: smaller groups take hardly less time."""
BLOCK, TABLE, QUADRUPLE = range(3)
"""Kinds of items in the queue; of items with equal bounds the smaller kind comes first."""


@dataclass(frozen=True, slots=True, order=True)
class Waiting:
    """One item of the search's queue; items are ordered by their keys alone."""

    key: tuple[float, int, tuple[int, ...]]
    """Minus the rounded upper bound; then the kind, and places or faces, which break ties."""
    expand: "Callable[[float, float], Iterator[Waiting]] | None" = field(compare=False)
    """Yields the items that replace this one, given the threshold and the next item's bound."""
    attempts: Callable[[], tuple[Attempt, ...]] = field(compare=False, default=tuple)
    """Lists the attempts on a single quadruple; empty for items that can be expanded."""

    @property
    def bound(self) -> float:
        """Return the upper bound on the disc radius of grasps in this item [object radii]."""
        return -self.key[0]


Expanded: TypeAlias = Iterator[Waiting]


@dataclass(frozen=True, slots=True, eq=False)
class BestFirst:
    """A search over one object's face quadruples for the largest discs of one construction."""

    construction: Construction
    bounded: AttemptBounds
    """Bounds the disc radii of attempts on the object's faces by small linear programs."""
    tally: Tally
    """Counts quadruples whose bounds prove that they have no grasp at all."""

    def over(
        self, blocks: Blocks, places: range, least: Callable[[Construction], float]
    ) -> Iterator[tuple[Attempt, ...]]:
        """Yield the attempts on each quadruple whose bound exceeds the threshold, best first."""
        rooms, make = blocks
        queue = [
            Waiting((-float(rooms[place]), BLOCK, (place,)), partial(self._made, make, place))
            for place in places
        ]
        heapify(queue)
        while queue:  # each turn takes rows from finite tables, at least one
            head = heappop(queue)
            # the threshold rises while grasps are found: read it anew
            worth = least(self.construction)
            if head.bound <= worth:
                return
            if head.expand is None:
                yield head.attempts()
                continue
            for item in head.expand(worth, queue[0].bound if queue else worth):
                heappush(queue, item)

    def in_rows(self, wide: WideQuadruples, worth: float) -> Iterator[tuple[Attempt, ...]]:
        """Yield the attempts on quadruples whose bound exceeds `worth`, in the table's order."""
        for start in range(0, len(wide), SMALLEST_CHUNK):
            rows = slice(start, start + SMALLEST_CHUNK)
            coned, bounds = wide.coned(rows).ranked(self.construction)
            for item in self._tightened(coned, bounds, slice(0, len(coned)), worth):
                yield item.attempts()

    def _made(
        self, make: Callable[[int], WideQuadruples], place: int, worth: float, _: float
    ) -> Expanded:
        wide, bounds = make(place).ranked(self.construction, worth)
        yield from self._wide_rows(wide, coarse(bounds), (place,), 0)

    def _wide_rows(
        self, wide: WideQuadruples, best: Array, place: tuple[int, ...], start: int
    ) -> Expanded:
        """Yield one item for the rows from `start` on; expanding it chooses cones for some."""

        def expand(worth: float, beyond: float) -> Expanded:
            rows = _until(best, start, beyond, SMALLEST_TILT)
            coned, bounds = wide.coned(rows).ranked(self.construction)
            closer = coarse(np.asarray(bounds.max(axis=(1, 2), initial=-np.inf)))
            count = int((closer > worth).sum())
            coned, at = coned.some(np.arange(count)), (*place, rows.start)
            yield from self._coned_rows(coned, bounds[:count].copy(), closer[:count], at, 0)
            yield from self._wide_rows(wide, best, place, rows.stop)

        if start < len(best):
            yield Waiting((-float(best[start]), TABLE, place), expand)

    def _coned_rows(
        self, coned: ConedQuadruples, bounds: Array, best: Array, place: tuple[int, ...], start: int
    ) -> Expanded:
        """Yield one item for the rows from `start` on; expanding it tightens some bounds."""

        def expand(worth: float, beyond: float) -> Expanded:
            rows = _until(best, start, beyond, SMALLEST_CHUNK)
            yield from self._tightened(coned, bounds, rows, worth)
            yield from self._coned_rows(coned, bounds, best, place, rows.stop)

        if start < len(best):
            yield Waiting((-float(best[start]), TABLE, place), expand)

    def _tightened(
        self, coned: ConedQuadruples, bounds: Array, rows: slice, worth: float
    ) -> Expanded:
        """Tighten the bounds of some quadruples and yield the ones still above the threshold."""
        construction, cheap = self.construction, bounds[rows]
        solved = cheap > worth
        row, kind, column = np.nonzero(solved)
        order, at = np.array(construction.orders)[column], rows.start + row
        tight = np.full(cheap.shape, -np.inf)
        attempts = Attempts(
            np.take_along_axis(coned.faces[at], order, axis=1),
            np.take_along_axis(coned.axes[at, kind], order[:, :, None], axis=1),
            coned.half_angles[at, kind],
        )
        tight[row, kind, column] = self.bounded.of(construction, attempts, worth)
        # both are upper bounds: the smaller one holds
        tight = np.minimum(tight, cheap)
        # no discs even of the least radius: settled here, whatever was found elsewhere
        none = solved.any(axis=1) & (tight.max(axis=1) <= construction.least)
        choices = int(solved.transpose(0, 2, 1)[none].sum())
        self.tally.exclude(int(none.sum()), choices)
        tight[tight <= worth] = -np.inf
        best = coarse(np.asarray(np.max(tight, axis=(1, 2)), dtype=np.float64))
        for each in np.flatnonzero(best > -np.inf).tolist():
            place = rows.start + each
            faces = tuple(coned.faces[place].tolist())
            make = partial(coned.attempts, place, construction, tight[each])
            yield Waiting((-float(best[each]), QUADRUPLE, faces), None, make)


def _until(best: Array, start: int, beyond: float, least: int) -> slice:
    """Return the next rows to refine: those with bounds above `beyond`, within a chunk's size."""
    larger = int(np.searchsorted(-best[start:], -beyond))
    count = min(max(larger, least), LARGEST_CHUNK)
    return slice(start, min(start + count, len(best)))
