"""Best-first search over face quadruples, tightening bounds only at the head of one queue.

Four kinds of items wait in the queue: blocks not made yet, bounded by the room of their faces; made
blocks, bounded by how wide their cones can be; quadruples with chosen cones, bounded by their
corners; and single quadruples, bounded by small programs. The item with the largest bound comes
first: a block is made, cones are chosen for some dozens of quadruples, their bounds are tightened,
or a quadruple is handed out. So no later quadruple has larger discs than one handed out, and few
cones are tilted and few programs solved that were not needed to know this.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from heapq import heapify, heappop, heappush
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.disc_bounds.program_bounds import AttemptBounds
from grasp_core.families.constructions import Construction
from grasp_core.families.kernel_tables import Attempts
from grasp_core.planning.blocks import Prospects
from grasp_core.planning.ranking import Outlook, Quadruple, Ranking, outlook
from grasp_core.solvers.ties import coarse

SMALLEST_CHUNK, LARGEST_CHUNK = 32, 2048
"""Fewest and most quadruples whose bounds are tightened together."""
SMALLEST_TILT = 512
"""Fewest quadruples whose cones are chosen together: smaller groups take hardly less time."""


@dataclass(frozen=True, slots=True)
class Block:
    """A group of quadruples that is listed only when it is needed."""

    room: float
    """Upper bound on its discs; equal rooms are equal numbers (see `ties.coarse`)."""
    make: Callable[[], Prospects]


@dataclass(frozen=True, slots=True, eq=False)
class _Rest:
    """The rows of a list of quadruples that still wait, from `start` on."""

    listed: Outlook | Ranking
    best: Array
    """Falling bounds of the quadruples, nearly equal ones made equal (see `ties.coarse`)."""
    start: int

    def until(self, bound: float) -> slice:
        """Rows to look at more closely next: the ones with bounds above the rest of the queue."""
        larger = int(np.searchsorted(-self.best[self.start :], -bound))
        least = SMALLEST_TILT if isinstance(self.listed, Outlook) else SMALLEST_CHUNK
        count = min(max(larger, least), LARGEST_CHUNK)
        return slice(self.start, min(self.start + count, len(self.best)))


_Waiting: TypeAlias = tuple[float, int, tuple[int, ...], Block | _Rest | Callable[[], Quadruple]]
"""Minus the coarse bound, then kind and faces, which break ties; then the item itself."""
BLOCK, REST, QUADRUPLE = range(3)


def promising(
    construction: Construction,
    blocks: Sequence[Block],
    bounded: AttemptBounds,
    least: Callable[[Construction], float],
    tally: Counter[str],
) -> Iterator[Quadruple]:
    """Yield quadruples with tight bounds above the threshold, best first.

    Args:
        construction: A construction with discs; `in_rows` is for constructions without.
        blocks: Blocks of all quadruples.
        bounded: Bounds attempts on the object's faces by small programs.
        least: Returns the radius that discs must exceed at present.
        tally: Counts quadruples whose bounds prove that they have no discs at all.
    """
    waiting: list[_Waiting] = [
        (-block.room, BLOCK, (place,), block) for place, block in enumerate(blocks)
    ]
    heapify(waiting)
    while waiting:
        bound, _, place, item = heappop(waiting)
        # the threshold rises while grasps are found: read it anew
        worth = least(construction)
        if -bound <= worth:
            return
        match item:
            case Block():
                listed = outlook(item.make(), construction, worth)
                _put_back(waiting, _Rest(listed, coarse(listed.bounds), 0), place)
            case _Rest():
                rows = item.until(-waiting[0][0] if waiting else worth)
                if isinstance(item.listed, Outlook):
                    _put_back(waiting, _closer(item.listed, rows, worth), (*place, rows.start))
                else:
                    for one in _tightened(item.listed, rows, bounded, worth, tally):
                        heappush(waiting, one)
                _put_back(waiting, _Rest(item.listed, item.best, rows.stop), place)
            case _:
                yield item()


def _closer(listed: Outlook, rows: slice, worth: float) -> _Rest:
    """Choose cones for some quadruples and drop the ones whose bounds are not above `worth`."""
    ranking = listed.ranking(rows)
    bounds: Array = np.max(ranking.bounds, axis=(1, 2), initial=-np.inf)
    best = coarse(bounds)
    count = int((best > worth).sum())
    return _Rest(ranking.first(count), best[:count], 0)


def _put_back(waiting: list[_Waiting], rest: _Rest, place: tuple[int, ...]) -> None:
    if rest.start < len(rest.best):
        bound = float(rest.best[rest.start])
        heappush(waiting, (-bound, REST, place, rest))


def in_rows(
    listed: Outlook, bounded: AttemptBounds, worth: float, tally: Counter[str]
) -> Iterator[Quadruple]:
    """Yield quadruples with bounds above the threshold, in the order of the list.

    Args:
        listed: The quadruples of one block.
        bounded: Bounds attempts on the object's faces by small programs.
        worth: The merit that grasps must exceed.
        tally: Counts quadruples whose bounds prove that they have no grasp.
    """
    for start in range(0, len(listed), SMALLEST_CHUNK):
        ranking = listed.ranking(slice(start, start + SMALLEST_CHUNK))
        every = slice(0, len(ranking))
        for _, _, _, make in _tightened(ranking, every, bounded, worth, tally):
            yield make()


def _tightened(
    ranking: Ranking, rows: slice, bounded: AttemptBounds, worth: float, tally: Counter[str]
) -> Iterator[tuple[float, int, tuple[int, ...], Callable[[], Quadruple]]]:
    """Tighten the bounds of some quadruples and yield the ones still above the threshold."""
    construction, candidates = ranking.construction, ranking.candidates
    cheap = ranking.bounds[rows]
    row, kind, column = np.nonzero(cheap > worth)
    place = ranking.places[rows][row]
    order = np.array(construction.orders)[column]
    bounds = np.full(cheap.shape, -np.inf)
    attempts = Attempts(
        np.take_along_axis(candidates.faces[place], order, axis=1),
        np.take_along_axis(candidates.axes[place, kind], order[:, :, None], axis=1),
        candidates.half_angles[place, kind],
    )
    bounds[row, kind, column] = bounded.of(construction, attempts, worth)
    # both are upper bounds: the smaller one holds
    bounds = np.minimum(bounds, cheap)
    solved = cheap > worth
    # no discs even of the least radius: settled here, whatever was found elsewhere
    none = solved.any(axis=1) & (bounds.max(axis=1) <= construction.least)
    tally["tried"] += int(none.sum())
    tally["infeasible"] += int(none.sum())
    tally["solved"] += int(solved.transpose(0, 2, 1)[none].sum())
    bounds[bounds <= worth] = -np.inf
    best = coarse(np.asarray(np.max(bounds, axis=(1, 2)), dtype=np.float64))
    faces = candidates.faces[ranking.places[rows]].tolist()
    for each in np.flatnonzero(best > -np.inf).tolist():
        make = partial(ranking.quadruple, rows.start + each, bounds[each])
        yield -float(best[each]), QUADRUPLE, tuple(faces[each]), make
