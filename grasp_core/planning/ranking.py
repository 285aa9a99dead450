"""In which order quadruples of faces are worth a program, the most promising first."""

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
    """No disc can be larger, relative to the object's radius; infinite without discs."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """One order of the fingers on four faces, with force cones to try."""

    order: FingerOrder
    choices: tuple[ConeChoice, ...]
    """The larger bound first."""

    @property
    def bound(self) -> float:
        """No disc of any choice can be larger."""
        return self.choices[0].bound


@dataclass(frozen=True, slots=True)
class Quadruple:
    """Four faces to try."""

    faces: FaceQuadruple
    attempts: tuple[Attempt, ...]

    @property
    def bound(self) -> float:
        """No disc of any attempt can be larger."""
        return max(attempt.bound for attempt in self.attempts)


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """Quadruples with force cones, most promising first."""

    candidates: Candidates
    places: Indices
    """Which of the candidates, (q,)."""
    bounds: Array
    """Of each choice of cones and finger order, minus infinity where it is not worth a program,
    (q, 2, orders)."""
    construction: Construction

    def __len__(self) -> int:
        return len(self.places)

    def first(self, count: int) -> "Ranking":
        """The most promising ones alone, without the candidates of the others."""
        some = self.candidates.some(self.places[:count])
        return Ranking(some, np.arange(count), self.bounds[:count].copy(), self.construction)

    def quadruple(self, row: int, bounds: Array) -> Quadruple:
        """One of the quadruples with other bounds, (2, orders).

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
    """Quadruples whose cones are not chosen yet, most promising first."""

    prospects: Prospects
    bounds: Array
    """No disc is larger, in object radii, (q,); infinite for reguli."""
    construction: Construction

    def __len__(self) -> int:
        return len(self.bounds)

    def ranking(self, rows: slice) -> "Ranking":
        """Some of them with their cones."""
        return ranked(self.prospects.candidates(rows), self.construction)


def outlook(prospects: Prospects, construction: Construction, worth: float) -> Outlook:
    """In the order of what the widest cones allow; only what may be worth having.

    Args:
        prospects: Quadruples of faces.
        construction: What is to be built on them.
        worth: The merit above which placements are worth having.
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
    """In the order of an upper bound on the radius; for reguli, widest force cones first."""
    usable: NDArray[np.bool_] = candidates.half_angles > LEAST_SPAN_ANGLE
    usable &= candidates.rooms[:, None] > 0.0
    spans = usable[:, NORMAL].copy()
    if construction.limits is None:
        usable[:, TILTED] = False  # no region to gain: the free method finds such grasps
        bounds = np.full((*usable.shape, len(construction.orders)), np.inf)
        promise = candidates.half_angles[:, NORMAL]
    else:
        limits = candidates.limits[:, :, construction.limits]
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
