"""Ranked quadruples with tight bounds, best first, as far as they are asked for.

A ranking comes with bounds that cost next to nothing. They are tightened by small programs, some
dozens of quadruples at a time; a quadruple is handed out when its tight bound is no smaller than
the cheap bounds of all that have no other yet.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from heapq import heappop, heappush

import numpy as np

from grasp_core.arrays import Array
from grasp_core.constructions import Construction
from grasp_core.disc_bounds import DiscBounds
from grasp_core.ranking import SAME_PROMISE, Quadruple, Ranking
from grasp_core.values import FaceQuadruple

FIRST_CHUNK, LARGEST_CHUNK = 64, 2048
"""Quadruples whose bounds are tightened together."""


def promising(
    ranking: Ranking,
    discs: DiscBounds,
    least: Callable[[Construction], float],
    tally: Counter[str],
) -> Iterator[Quadruple]:
    """Quadruples that may be worth having, with tight bounds, best first.

    Args:
        ranking: Of one block of quadruples.
        discs: Of the object's faces.
        least: The radius above which discs of a construction are worth having at present.
        tally: Where to count attempts whose bound proves that they have none at all.
    """
    if ranking.construction.bounds is None:
        yield from (ranking.quadruple(row, ranking.bounds[row]) for row in range(len(ranking)))
        return
    best = ranking.bounds.max(axis=(1, 2), initial=-np.inf)
    waiting: list[tuple[float, FaceQuadruple, Quadruple]] = []
    start, size = 0, FIRST_CHUNK
    while start < len(ranking) and best[start] > (worth := least(ranking.construction)):
        end = min(start + size, len(ranking))
        bounds = _tightened(ranking, slice(start, end), discs, worth, tally)
        for row in np.flatnonzero(bounds.max(axis=(1, 2)) > -np.inf):
            one = ranking.quadruple(start + int(row), bounds[row])
            heappush(waiting, (-round(one.bound, SAME_PROMISE), one.faces, one))
        following = round(float(best[end]), SAME_PROMISE) if end < len(ranking) else -np.inf
        while waiting and -waiting[0][0] >= following:
            yield heappop(waiting)[2]
        start, size = end, min(2 * size, LARGEST_CHUNK)
    while waiting:
        yield heappop(waiting)[2]


def _tightened(
    ranking: Ranking, rows: slice, discs: DiscBounds, worth: float, tally: Counter[str]
) -> Array:
    """Tight bounds of some rows, minus infinity where they are not worth having."""
    construction, candidates = ranking.construction, ranking.candidates
    cheap = ranking.bounds[rows]
    row, kind, column = np.nonzero(cheap > worth)
    place = ranking.places[rows][row]
    order = np.array(construction.orders)[column]
    bounds = np.full(cheap.shape, -np.inf)
    bounds[row, kind, column] = discs.of(
        construction,
        np.take_along_axis(candidates.faces[place], order, axis=1),
        np.take_along_axis(candidates.axes[place, kind], order[:, :, None], axis=1),
        candidates.half_angles[place, kind],
        worth,
    )
    bounds = np.minimum(bounds, cheap)
    none = (cheap > worth).any(axis=1) & (bounds.max(axis=1) <= construction.least)
    tally["tried"] += int(none.sum())
    tally["infeasible"] += int(none.sum())
    tally["solved"] += int((cheap > worth).transpose(0, 2, 1)[none].sum())
    return np.where(bounds > worth, bounds, -np.inf)
