"""Orders quadruples of faces by how promising they are, before any program is solved for them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.families.constructions import LEAST_RADIUS, Construction, FingerOrder
from grasp_core.planning.blocks import Prospects
from grasp_core.planning.candidates import LEAST_SPAN_ANGLE, NORMAL, TILTED, Candidates
from grasp_core.solvers.ties import graded
from grasp_core.values import FaceQuadruple, ForceCone, four


@dataclass(frozen=True, slots=True)
class ConeChoice:
    """Force cones for four faces, in the order of the faces."""

    cones: tuple[ForceCone, ForceCone, ForceCone, ForceCone]
    bound: float
    """Upper bound on the discs [object radii]; infinite for constructions without discs."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """One order of the fingers on four faces, with force cones to try."""

    order: FingerOrder
    choices: tuple[ConeChoice, ...]
    """Choices of cones, the larger bound first."""

    @property
    def bound(self) -> float:
        """Upper bound on the discs of all choices [object radii]."""
        return self.choices[0].bound


@dataclass(frozen=True, slots=True)
class Quadruple:
    """Four faces, with the attempts to make on them."""

    faces: FaceQuadruple
    attempts: tuple[Attempt, ...]

    @property
    def bound(self) -> float:
        """Upper bound on the discs of all attempts [object radii]."""
        return max(attempt.bound for attempt in self.attempts)


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """Quadruples with chosen force cones, the most promising first."""

    candidates: Candidates
    places: Indices
    """Indices into the candidates, (q,)."""
    bounds: Array
    """Bound of each choice of cones and finger order, (q, 2, orders) [object radii]; minus infinity
    where an attempt is not worth a program."""
    construction: Construction

    def __len__(self) -> int:
        return len(self.places)

    def first(self, count: int) -> "Ranking":
        """The first `count` quadruples, without the candidates of the others."""
        some = self.candidates.some(self.places[:count])
        return Ranking(some, np.arange(count), self.bounds[:count].copy(), self.construction)

    def quadruple(self, row: int, bounds: Array) -> Quadruple:
        """The quadruple in a row, with the given bounds, (2, orders).

        Choices of cones and finger orders with a bound of minus infinity are left out.
        """
        place = int(self.places[row])
        return Quadruple(
            faces=four(int(face) for face in self.candidates.faces[place]),
            attempts=tuple(
                Attempt(order, self._choices(place, bounds[:, column]))
                for column, order in enumerate(self.construction.orders)
                if bounds[:, column].max() > -np.inf
            ),
        )

    def _choices(self, place: int, bounds: Array) -> tuple[ConeChoice, ...]:
        return tuple(
            ConeChoice(self.candidates.cones(place, int(kind)), float(bounds[kind]))
            for kind in np.argsort(-graded(bounds), kind="stable")
            if bounds[kind] > -np.inf
        )


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """Quadruples whose cones are not chosen yet, the most promising first."""

    prospects: Prospects
    bounds: Array
    """Upper bounds on the discs, (q,) [object radii]; infinite for reguli, which have none."""
    construction: Construction

    def __len__(self) -> int:
        return len(self.bounds)

    def ranking(self, rows: slice) -> "Ranking":
        """Choose force cones for the quadruples in `rows`, and rank them."""
        return ranked(self.prospects.candidates(rows), self.construction)


def outlook(prospects: Prospects, construction: Construction, worth: float) -> Outlook:
    """Order quadruples by what their widest cones allow, dropping those not above `worth`.

    Args:
        prospects: Quadruples of faces.
        construction: The construction to be tried on them.
        worth: The merit that placements must exceed.
    """
    widest, bounds = prospects.widest, np.full(len(prospects), np.inf)
    promise = widest
    if construction.limits is not None:
        limits = prospects.cones.limits(prospects.faces, widest)[:, construction.limits]
        promise = bounds = np.minimum(limits.max(axis=1), prospects.rooms)
    usable = (widest > LEAST_SPAN_ANGLE) & (prospects.rooms > 0.0) & (bounds > worth)
    order = np.argsort(-graded(promise), kind="stable")
    order = order[usable[order]]
    return Outlook(prospects.some(order), bounds[order], construction)


def ranked(candidates: Candidates, construction: Construction) -> Ranking:
    """Order candidates by an upper bound on their radius; for reguli, by the width of the cones."""
    usable: NDArray[np.bool_] = candidates.half_angles > LEAST_SPAN_ANGLE
    usable &= candidates.rooms[:, None] > 0.0
    spans = usable[:, NORMAL].copy()
    if construction.limits is None:
        usable[:, TILTED] = False  # no region to gain: the free method finds such grasps
        bounds = np.full((*usable.shape, len(construction.orders)), np.inf)
        promise = candidates.half_angles[:, NORMAL]
    else:
        limits = candidates.limits[:, :, construction.limits]
        # an undefined limit bounds nothing
        bounds = np.where(np.isnan(limits), np.inf, limits)
        bounds = np.minimum(bounds, candidates.rooms[:, None, None])
        promise = None
    for column, order in enumerate(construction.orders):
        admitted = construction.admits(
            candidates.normals[spans][:, order], candidates.half_angles[spans, NORMAL]
        )
        bounds[spans, :, column] = np.where(admitted[:, None], bounds[spans, :, column], -np.inf)
    bounds = np.where(usable[:, :, None] & (bounds >= LEAST_RADIUS), bounds, -np.inf)
    best = bounds.max(axis=(1, 2), initial=-np.inf)
    promise = best if promise is None else promise
    order = np.argsort(-graded(promise), kind="stable")
    order = order[best[order] > -np.inf]
    return Ranking(candidates, order, bounds[order], construction)
