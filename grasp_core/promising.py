"""Quadruples with tight bounds, best first over several blocks, as far as they are asked for.

Three kinds of things wait in one queue: blocks that nobody made yet, bounded by the room of their
faces; made ones, by the cheap bounds of their rankings; and single quadruples, by small programs.
What has the largest bound comes first: a block is made, the bounds of some dozens of quadruples are
tightened, or a quadruple is handed out. So none with larger discs can follow, and hardly a
program is solved that was not needed to know this.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from heapq import heapify, heappop, heappush
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.attempt_bounds import AttemptBounds
from grasp_core.constructions import Construction
from grasp_core.kernels.tables import Attempts
from grasp_core.ranking import SAME_PROMISE, Quadruple, Ranking

SMALLEST_CHUNK, LARGEST_CHUNK = 32, 2048
"""Quadruples whose bounds are tightened together."""


@dataclass(frozen=True, slots=True)
class Block:
    """Quadruples that are ranked when they are needed."""

    room: float
    """No disc is larger."""
    rank: Callable[[], Ranking]


@dataclass(frozen=True, slots=True, eq=False)
class _Rest:
    """What is left of a ranking from a row on."""

    ranking: Ranking
    best: Array
    """The cheap bounds of its quadruples, falling."""
    start: int

    def until(self, bound: float) -> int:
        """Where those end that are worth being tightened before what else has a bound."""
        larger = int(np.searchsorted(-self.best[self.start :], -bound))
        count = min(max(larger, SMALLEST_CHUNK), LARGEST_CHUNK)
        return min(self.start + count, len(self.best))


_Waiting: TypeAlias = tuple[float, int, tuple[int, ...], Block | _Rest | Callable[[], Quadruple]]
"""Minus the bound to so many digits, then what makes ties go by kind and by faces."""
BLOCK, REST, QUADRUPLE = range(3)


def promising(
    construction: Construction,
    blocks: Sequence[Block],
    discs: AttemptBounds,
    least: Callable[[Construction], float],
    tally: Counter[str],
) -> Iterator[Quadruple]:
    """Quadruples that may be worth having, with tight bounds, best first.

    Args:
        construction: With discs.
        blocks: Of all quadruples.
        discs: Of the object's faces.
        least: The radius above which discs are worth having at present.
        tally: Where to count attempts whose bound proves that they have none at all.
    """
    waiting: list[_Waiting] = [
        (-round(block.room, SAME_PROMISE), BLOCK, (place,), block)
        for place, block in enumerate(blocks)
    ]
    heapify(waiting)
    while waiting:
        bound, _, place, item = heappop(waiting)
        worth = least(construction)
        if -bound <= worth:
            return
        match item:
            case Block():
                item = _opened(item.rank(), worth)
                _put_back(waiting, item, place)
            case _Rest():
                end = item.until(-waiting[0][0] if waiting else worth)
                for one in _tightened(item.ranking, slice(item.start, end), discs, worth, tally):
                    heappush(waiting, one)
                _put_back(waiting, _Rest(item.ranking, item.best, end), place)
            case _:
                yield item()


def _opened(ranking: Ranking, worth: float) -> _Rest:
    """A ranking without what is not worth having: the rest of the block can be forgotten."""
    best = ranking.bounds.max(axis=(1, 2), initial=-np.inf)
    count = int((best > worth).sum())
    return _Rest(ranking.first(count), best[:count], 0)


def _put_back(waiting: list[_Waiting], rest: _Rest, place: tuple[int, ...]) -> None:
    if rest.start < len(rest.best):
        bound = round(float(rest.best[rest.start]), SAME_PROMISE)
        heappush(waiting, (-bound, REST, place, rest))


def in_rows(
    ranking: Ranking, discs: AttemptBounds, worth: float, tally: Counter[str]
) -> Iterator[Quadruple]:
    """The quadruples of a ranking that may be worth having, in its order.

    Args:
        ranking: Of one block.
        discs: Of the object's faces.
        worth: The merit above which grasps are worth having.
        tally: Where to count attempts whose bound proves that they have none.
    """
    for start in range(0, len(ranking), SMALLEST_CHUNK):
        rows = slice(start, min(start + SMALLEST_CHUNK, len(ranking)))
        for _, _, _, make in _tightened(ranking, rows, discs, worth, tally):
            yield make()


def _tightened(
    ranking: Ranking, rows: slice, discs: AttemptBounds, worth: float, tally: Counter[str]
) -> Iterator[tuple[float, int, tuple[int, ...], Callable[[], Quadruple]]]:
    """Some quadruples, those of them that are worth having, with tight bounds."""
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
    bounds[row, kind, column] = discs.of(construction, attempts, worth)
    bounds = np.minimum(bounds, cheap)
    solved = cheap > worth
    none = solved.any(axis=1) & (bounds.max(axis=1) <= construction.least)
    tally["tried"] += int(none.sum())
    tally["infeasible"] += int(none.sum())
    tally["solved"] += int(solved.transpose(0, 2, 1)[none].sum())
    bounds[bounds <= worth] = -np.inf
    best = np.asarray(np.max(bounds, axis=(1, 2)), dtype=np.float64).round(SAME_PROMISE)
    faces = candidates.faces[ranking.places[rows]].tolist()
    for each in np.flatnonzero(best > -np.inf).tolist():
        make = partial(ranking.quadruple, rows.start + each, bounds[each])
        yield -float(best[each]), QUADRUPLE, tuple(faces[each]), make
