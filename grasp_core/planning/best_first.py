"""Quadruples with tight bounds, best first over several blocks, as far as they are asked for.

Four kinds of things wait in one queue: blocks that nobody made yet, bounded by the room of their
faces; made ones, by how wide their cones can be; some quadruples with their cones, by their
corners; and single quadruples, by small programs. What has the largest bound comes first: a block
is made, cones are chosen for some dozens of quadruples, their bounds are tightened, or a quadruple
is handed out. So none with larger discs can follow, and hardly a cone is tilted and hardly a
program solved that was not needed to know this.
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
"""Quadruples whose bounds are tightened together."""
SMALLEST_TILT = 512
"""Quadruples whose cones are chosen together: fewer take hardly less time."""


@dataclass(frozen=True, slots=True)
class Block:
    """Quadruples that are listed when they are needed."""

    room: float
    """No disc is larger; equal rooms are equal numbers (see `ties.coarse`)."""
    make: Callable[[], Prospects]


@dataclass(frozen=True, slots=True, eq=False)
class _Rest:
    """What is left of a list of quadruples from a row on."""

    listed: Outlook | Ranking
    best: Array
    """The bounds of its quadruples, falling, those alike made equal (see `ties.coarse`)."""
    start: int

    def until(self, bound: float) -> slice:
        """Those that are worth a closer look before what else has a bound."""
        larger = int(np.searchsorted(-self.best[self.start :], -bound))
        least = SMALLEST_TILT if isinstance(self.listed, Outlook) else SMALLEST_CHUNK
        count = min(max(larger, least), LARGEST_CHUNK)
        return slice(self.start, min(self.start + count, len(self.best)))


_Waiting: TypeAlias = tuple[float, int, tuple[int, ...], Block | _Rest | Callable[[], Quadruple]]
"""Minus the coarse bound, then what makes ties go by kind and by faces."""
BLOCK, REST, QUADRUPLE = range(3)


def promising(
    construction: Construction,
    blocks: Sequence[Block],
    bounded: AttemptBounds,
    least: Callable[[Construction], float],
    tally: Counter[str],
) -> Iterator[Quadruple]:
    """Quadruples that may be worth having, with tight bounds, best first.

    Args:
        construction: With discs; others are gone through by `in_rows`.
        blocks: Of all quadruples.
        bounded: What attempts on the object's faces can offer.
        least: The radius above which discs are worth having at present.
        tally: Where to count attempts whose bound proves that they have none at all.
    """
    waiting: list[_Waiting] = [
        (-block.room, BLOCK, (place,), block) for place, block in enumerate(blocks)
    ]
    heapify(waiting)
    while waiting:
        bound, _, place, item = heappop(waiting)
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
    """Some quadruples with their cones, without what is not worth having: that is forgotten."""
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
    """Quadruples that may be worth having, some after others as they are listed.

    Args:
        listed: Of one block.
        bounded: What attempts on the object's faces can offer.
        worth: The merit above which grasps are worth having.
        tally: Where to count attempts whose bound proves that they have none.
    """
    for start in range(0, len(listed), SMALLEST_CHUNK):
        ranking = listed.ranking(slice(start, start + SMALLEST_CHUNK))
        every = slice(0, len(ranking))
        for _, _, _, make in _tightened(ranking, every, bounded, worth, tally):
            yield make()


def _tightened(
    ranking: Ranking, rows: slice, bounded: AttemptBounds, worth: float, tally: Counter[str]
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
    bounds[row, kind, column] = bounded.of(construction, attempts, worth)
    bounds = np.minimum(bounds, cheap)
    solved = cheap > worth
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
