"""One method over the face quadruples of one object: what it finds, best first, and counts."""

import math
from bisect import insort
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations, product

import numpy as np

from grasp_core.certified import Certified, certify, named
from grasp_core.constructions import Construction, FingerOrder, point_region
from grasp_core.errors import SolverError
from grasp_core.face_pieces import FacePiece
from grasp_core.patch import Absence, Undecided, place_free
from grasp_core.placements import Placement
from grasp_core.plans import MethodCounts, Proof
from grasp_core.ranking import PiecesByFace, Quadruple, Ranking
from grasp_core.spanning import cones_positively_span
from grasp_core.values import (
    FINGERS,
    FaceQuadruple,
    ForceCone,
    four,
)

SAME_MERIT = 1e-5
"""Merits are compared to six digits, so that ties are broken by the faces and not by rounding."""
SAME_CONTACTS = 1e-6
"""Contacts closer than this, in object radii, are the same grasp found twice."""


@dataclass(slots=True, eq=False)
class Search:
    """What one method has found so far."""

    limit: int | None
    total: int
    """Quadruples to go through."""
    best: list[Certified] = field(default_factory=list[Certified])
    """At most `limit` grasps, best first."""
    tally: Counter[str] = field(default_factory=Counter[str])
    absences: dict[FaceQuadruple, tuple[Proof, ...]] = field(
        default_factory=dict[FaceQuadruple, tuple[Proof, ...]]
    )
    undecided: list[FaceQuadruple] = field(default_factory=list[FaceQuadruple])
    seconds: float = 0.0

    @property
    def counts(self) -> MethodCounts:
        """The tally as a frozen value."""
        return MethodCounts(**self.tally)

    @property
    def full(self) -> bool:
        """Whether another grasp would push one out."""
        return self.limit is not None and len(self.best) == self.limit

    def keep(self, found: Certified) -> None:
        """Count a grasp and sort it in."""
        self.tally["found"] += 1
        insort(self.best, found, key=_best_first)
        if self.limit is not None:
            del self.best[self.limit :]


def _best_first(found: Certified) -> tuple[float, FaceQuadruple]:
    """Largest merit first; ties are broken by the faces, not by rounding."""
    return -float(f"{found.placement.merit:.6g}"), found.faces


def search_construction(
    construction: Construction,
    pieces: PiecesByFace,
    friction: float,
    ranking: Ranking,
    search: Search,
) -> Iterator[list[Certified]]:
    """Go through ranked quadruples, yielding what each gave.

    With a limit the search ends when no bound reaches the worst grasp kept; a construction
    without bounds ends as soon as the limit is reached.
    """
    search.tally["pruned"] += ranking.dropped
    for done, quadruple in enumerate(ranking):
        if search.full and not _can_improve(construction, quadruple, search):
            search.tally["pruned"] += ranking.candidates_from(done)
            return
        tries = [
            _try_order(construction, pieces, friction, quadruple, order, search.tally)
            for order in quadruple.orders
        ]
        found = _without_duplicates([one for one in tries if one is not None], search.tally)
        for one in found:
            search.keep(one)
        yield found


def _can_improve(construction: Construction, quadruple: Quadruple, search: Search) -> bool:
    worst = search.best[-1].placement.merit
    return construction.bounds is not None and quadruple.bound >= worst * (1.0 - SAME_MERIT)


def _try_order(
    construction: Construction,
    pieces: PiecesByFace,
    friction: float,
    quadruple: Quadruple,
    order: FingerOrder,
    tally: Counter[str],
) -> Certified | None:
    faces = four(quadruple.faces[finger] for finger in order)
    choices = list(product(*(pieces[face] for face in faces)))
    tally.update({"tried": 1, "solved": len(choices)})
    placed = _best_placement(construction, quadruple, choices)
    if placed is None:
        tally["infeasible"] += 1
        return None
    chosen, placement = placed
    cones = _cones(chosen, quadruple.half_angle)
    family = construction.family
    certified = certify(
        named(family[0], faces), faces, family, chosen, cones, placement, friction,
        construction.region,
    )  # fmt: skip
    if certified is None or not cones_positively_span(
        [cone.axis for cone in cones], [quadruple.half_angle] * FINGERS
    ):
        tally["rejected"] += 1
        return None
    return certified


def _best_placement(
    construction: Construction, quadruple: Quadruple, choices: Sequence[tuple[FacePiece, ...]]
) -> tuple[tuple[FacePiece, ...], Placement] | None:
    """The best over all choices of one convex piece per face."""
    best = None
    least = -np.inf
    for chosen in choices:
        if construction.bounds is not None and min(piece.inradius for piece in chosen) < least:
            continue
        placed = construction.place(chosen, _cones(chosen, quadruple.half_angle), least)
        if isinstance(placed, Placement) and placed.merit > least:
            best, least = (chosen, placed), placed.merit
    return best


def _without_duplicates(found: list[Certified], tally: Counter[str]) -> list[Certified]:
    """Grasps of the same faces with different contacts, the best of each."""
    kept: list[Certified] = []
    for one in sorted(found, key=_best_first):
        here = one.placement.positions[np.argsort(one.faces)]
        if any(
            np.abs(here - other.placement.positions[np.argsort(other.faces)]).max() < SAME_CONTACTS
            for other in kept
        ):
            tally["duplicates"] += 1
        else:
            kept.append(one)
    return kept


def search_free(
    pieces: PiecesByFace, friction: float, theta: float, seed: int, cells: int, search: Search
) -> Iterator[list[Certified]]:
    """Go through all quadruples of faces, spanning or not, until a limit is reached."""
    for done, faces in enumerate(combinations(range(len(pieces)), FINGERS)):
        if search.full:
            search.tally["pruned"] += math.comb(len(pieces), FINGERS) - done
            return
        choices = list(product(*(pieces[face] for face in faces)))
        search.tally.update({"tried": 1, "solved": len(choices)})
        rng = np.random.default_rng([seed, *faces])
        answers = [
            (chosen, _placed_free(chosen, math.tan(theta), rng, cells)) for chosen in choices
        ]
        found = _free_grasp(faces, answers, friction, theta, search)
        if found is not None:
            search.keep(found)
        yield [found] if found else []


def _placed_free(
    chosen: tuple[FacePiece, ...], friction: float, rng: np.random.Generator, cells: int
) -> Placement | Absence | Undecided:
    try:
        return place_free(chosen, friction, rng=rng, cells=cells)
    except SolverError:
        return Undecided(1)


def _free_grasp(
    faces: FaceQuadruple,
    answers: Sequence[tuple[tuple[FacePiece, ...], Placement | Absence | Undecided]],
    friction: float,
    theta: float,
    search: Search,
) -> Certified | None:
    placed = [(chosen, found) for chosen, found in answers if isinstance(found, Placement)]
    proofs = [proof for _, proof in answers if isinstance(proof, Absence)]
    if not placed:
        if proofs and len(proofs) == len(answers):
            search.tally["infeasible"] += 1
            search.absences[faces] = tuple(proofs)
        else:
            search.tally["undecided"] += 1
            search.undecided.append(faces)
        return None
    chosen, placement = max(placed, key=lambda pair: pair[1].merit)
    certified = certify(
        named("f", faces), faces, "regulus", chosen, _cones(chosen, theta), placement, friction,
        point_region,
    )  # fmt: skip
    if certified is None:
        search.tally["rejected"] += 1
    return certified


def _cones(pieces: Sequence[FacePiece], half_angle: float) -> tuple[ForceCone, ...]:
    """The paper's force cones: about the normals."""
    return tuple(ForceCone(piece.normal, half_angle) for piece in pieces)
