"""Finds good contacts to begin with: random ones that many twists weigh well, moved uphill.

The quality of contacts is at most what each of many twists allows: their largest support over the
twist's demand. Random contacts are ordered by the least of these bounds; the first of them that are
in force closure are measured, and the best of these climb.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.polygons import edge_rows
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.optimizing.ascent import ContactFaces, climbs_for_weight
from grasp_core.optimizing.grounds import Grounds
from grasp_core.optimizing.search import Found, Searching
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.solvers.ties import largest_first, on_grid, surpassing
from grasp_core.values import FINGERS

POINTS = 3000
"""Random contacts."""
SETS = 40_000
"""Random sets of four of them."""
AT_ONCE = 4000
RATED, MOST_RATED = 200, 4000
"""Sets whose quality is measured, and how many more are looked at while few are in force closure,
as at low friction."""
ROUGH = 0.1
"""Gap of these qualities, by which sets are ordered."""
CLIMBED, ALIKE = 16, 3
"""Sets that climb, and how many of them on the same pieces: climbs from several starts on the same
pieces end in several local optima."""


def begin(searching: Searching, twists: Array, rng: np.random.Generator) -> Found | None:
    """Return good contacts, or None if no random ones are in force closure."""
    alike, climbs = Counter[tuple[int, ...]](), 0
    best: Found | None = None
    for on, at in _closed_sets(searching, twists, rng):
        key = tuple(sorted(on.tolist()))
        alike[key] += 1
        if alike[key] > ALIKE:
            continue
        found = climbed(searching, on, at)
        if best is None or found.quality.lower > surpassing(best.quality.lower):
            best = found
        climbs += 1
        if climbs == CLIMBED:
            break
    return best if best is not None and best.quality.lower > 0.0 else None


def _closed_sets(
    searching: Searching, twists: Array, rng: np.random.Generator
) -> list[tuple[Indices, Array]]:
    """Return random contacts in force closure, on (4,) at (4, 2), the most promising first."""
    grounds, measure = searching.grounds, searching.measure
    on = rng.integers(len(grounds.counts), size=POINTS)
    polygons = grounds.polygons()
    weights = [rng.dirichlet(np.ones(len(polygons[int(p)]))) for p in on]
    inside = [w @ polygons[int(p)] for w, p in zip(weights, on, strict=True)]
    at = on_grid(np.array(inside))
    supports = grounds.supports(on, at, searching.friction, twists)
    sets = np.sort(rng.integers(POINTS, size=(SETS, FINGERS)), axis=1)
    demands = measure.demands(twists)
    bounds = np.concatenate(
        [
            measure.multiples(supports[sets[k : k + AT_ONCE]].max(axis=1), demands).min(axis=1)
            for k in range(0, SETS, AT_ONCE)
        ]
    )
    closed: list[tuple[Indices, Array]] = []
    rated: list[float] = []
    for place, k in enumerate(np.argsort(-bounds, kind="stable")[:MOST_RATED]):
        if place >= RATED and len(closed) >= CLIMBED:
            break
        chosen = sets[k]
        wrenches = searching.wrenches(on[chosen], at[chosen])
        lower = wrench_set_quality(wrenches, ROUGH).lower
        if lower > 0.0:
            closed.append((on[chosen], at[chosen]))
            rated.append(lower)
    # the Ferrari-Canny quality says little about other loads: these keep the order of their bounds
    order = largest_first(rated) if measure.is_usual else range(len(closed))
    return [closed[k] for k in order]


def climbed(searching: Searching, on: Sequence[int] | Indices, at: Array) -> Found:
    """Move contacts uphill on their pieces."""
    pieces = tuple(piece_at(searching.grounds, int(p)) for p in on)
    limits = tuple(piece.b for piece in pieces)
    faces = ContactFaces(pieces, limits, searching.friction)

    def measured(y: Array) -> Found:
        return searching.measured(np.array(on), y)

    best = measured(at)
    if best.quality.lower <= 0.0:
        return best
    measure = searching.measure
    if measure.name == "weight":
        every = climbs_for_weight(faces, at)
    elif measure.name == "task":
        every = [faces.climbed_for_task(measure, at)]
    else:
        every = [faces.climbed(at)[0]]
    for moved in every:
        there = measured(moved)
        inside = all(
            float((piece.E @ y - piece.b).max()) <= 0.0
            for piece, y in zip(pieces, moved, strict=True)
        )
        if inside and there.quality.lower > surpassing(best.quality.lower):
            best = there
    return best


def piece_at(grounds: Grounds, place: int) -> FacePiece:
    """Return a polygon as a `FacePiece`."""
    corners = grounds.polygons()[place]
    E, b = edge_rows(corners)
    return FacePiece(
        face=int(grounds.faces[place]), normal=grounds.normals[place],
        origin=grounds.origins[place], frame=grounds.frames[place], corners=corners, E=E, b=b,
        inradius=0.0,
    )  # fmt: skip
