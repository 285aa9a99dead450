"""Searches the face quadruples on which no construction found a grasp, by the free method.

The free method places contacts on four faces without a fixed type of grasp, or proves that there
are none. Its grasps have no contact regions. But forces that balance strictly inside the friction
cones are good axes for tilted force cones, so the constructions are tried once more around them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import TypeAlias

import numpy as np

from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.errors import SolverError
from grasp_core.families.free import RESTARTS, Absence, Undecided, close_patches, place_free
from grasp_core.families.placements import Placement
from grasp_core.families.placing import (
    CONSTRUCTIONS,
    MIXED,
    MOST_CHOICES,
    Attempt,
    Cones,
    Construction,
    chosen_shapes,
    on_true_surface,
    point_regions,
)
from grasp_core.objects.face_pieces import FacePiece, FaceShape, choices_near
from grasp_core.objects.standard_order import Standard
from grasp_core.planning.certify import Candidate, Certified, certify_each, named
from grasp_core.planning.family_search import FamilySearch, Gathered, MethodSearch, best_first
from grasp_core.planning.quadruples import LEAST_SPAN_ANGLE, cones_around
from grasp_core.planning.result import COMPLETE_PARTS, FAMILIES, PlanRequest
from grasp_core.values import FaceQuadruple, ForceCone, four

Pieces: TypeAlias = tuple[FacePiece, ...]
Answer: TypeAlias = tuple[Pieces, Placement | Absence | Undecided]
"""Convex pieces of four faces, and what the free method says about them."""
Placed: TypeAlias = tuple[Pieces, Placement]
"""Convex pieces of four faces, and contacts on them."""


def found_on(
    on: Standard, to_try: Sequence[FaceQuadruple], request: PlanRequest, gathered: Gathered,
    again: bool,
) -> Iterator[Certified | None]:  # fmt: skip
    """Decide quadruples together, or `again` with more parts; yield the grasp on each, or None."""
    if again:
        request = replace(request, max_face_parts=COMPLETE_PARTS)
    else:
        gathered.tally["tried"] += len(to_try)
    search = _FreeSearch(on, request, gathered)
    known = {} if again else search.patches(to_try)
    placed = [search.placed_on(faces, known.get(faces)) for faces in to_try]
    tilted = [each for each in placed if each] if search.upgrades else []
    choices = iter(cones_around(tilted, request.theta) if tilted else ())
    for faces, each in zip(to_try, placed, strict=True):
        yield search.certified(faces, each, next(choices, ())) if each else None


@dataclass(frozen=True, eq=False)
class _FreeSearch:
    """The free method on the faces of one object, with what is asked of it and what it gathers."""

    on: Standard
    request: PlanRequest
    gathered: Gathered

    @cached_property
    def upgrades(self) -> list[Construction]:
        """Constructions to try with force cones around the forces of each free grasp."""
        if self.request.cones != "tilted":
            return []
        asked = [CONSTRUCTIONS[family] for family in FAMILIES if family in self.request.families]
        discs = [each for each in asked if each.limits]
        return discs + [MIXED for each in discs if each.family == MIXED.family]

    def patches(
        self, quadruples: Sequence[FaceQuadruple]
    ) -> dict[FaceQuadruple, ClosureCertificate | None]:
        """Decide closure at all corners of hulls of faces, where that is known at once."""
        hulls = {
            faces: tuple(shape.hull for shape in chosen_shapes(self.on.shapes, faces))
            for faces in quadruples
        }
        frictions = {faces: self._friction(pieces) for faces, pieces in hulls.items()}
        found: dict[FaceQuadruple, ClosureCertificate | None] = {}
        for friction in sorted(set(frictions.values())):
            alike = [faces for faces in quadruples if frictions[faces] == friction]
            known = close_patches([hulls[faces] for faces in alike], friction)
            found.update(zip(alike, known, strict=True))
        return found

    def placed_on(self, faces: FaceQuadruple, known: ClosureCertificate | None) -> Placed | None:
        """Find contacts on four faces, or record why there are none; `known` is of their hulls."""
        on, gathered = self.on, self.gathered
        chosen = chosen_shapes(on.shapes, faces)
        answers = self._answers(faces, chosen, known)
        pieces, last = answers[-1]
        if any(shape.facets is not None for shape in chosen):
            return self._on_triangles(faces, chosen, pieces, last)
        if isinstance(last, Placement):
            return pieces, last
        if any(on.owners[face] != face for face in faces):
            # choices of halves gave none: whole faces may be proved to hold none
            whole = four(on.owners[face] for face in faces)
            hulls = tuple(shape.hull for shape in chosen_shapes(on.shapes, whole))
            gathered.tally["solved"] += 1
            answer = self._place(hulls, self._rng(faces), restarts=0)
            answers = [(hulls, answer if isinstance(answer, Absence) else Undecided(1.0))]
        proofs = tuple(proof for _, proof in answers if isinstance(proof, Absence))
        if len(proofs) == len(answers):
            gathered.tally["infeasible"] += 1
            gathered.absences[faces] = proofs
        else:
            gathered.undecided[faces] = max(
                answer.open_share for _, answer in answers if isinstance(answer, Undecided)
            )
        return None

    def _answers(
        self, faces: FaceQuadruple, shapes: Sequence[FaceShape], known: ClosureCertificate | None
    ) -> list[Answer]:
        """Collect answers for the convex pieces of four faces; a placement can only be the last.

        Together the answers decide the faces, unless one is `Undecided`. The convex hulls come
        first: if they hold no grasp, no pieces do. Choices of one piece per face follow until one
        holds a grasp, and last the most likely choice with more effort.
        """
        rng, tally = self._rng(faces), self.gathered.tally
        hulls = tuple(shape.hull for shape in shapes)
        tally["solved"] += 1
        whole = self._place(hulls, rng, known=known)
        if isinstance(whole, Absence) or all(len(shape.pieces) == 1 for shape in shapes):
            return [(hulls, whole)]
        placed = isinstance(whole, Placement)
        at = whole.positions if placed else np.array([hull.origin for hull in hulls])
        most = MOST_CHOICES * self.request.max_face_parts
        answers: list[Answer] = []
        for pieces in choices_near(shapes, at, most):
            tally["solved"] += 1
            answers.append((pieces, self._place(pieces, rng, restarts=0)))
            if isinstance(answers[-1][1], Placement):
                return answers
        if isinstance(answers[0][1], Undecided):
            pieces, _ = answers.pop(0)
            answers.append((pieces, self._place(pieces, rng)))
            if isinstance(answers[-1][1], Placement):
                return answers
        # more choices than were tried: the rest stays undecided
        if math.prod(len(shape.pieces) for shape in shapes) > most:
            answers.append((hulls, Undecided(1.0)))
        return answers

    def _on_triangles(
        self, faces: FaceQuadruple, shapes: Sequence[FaceShape], pieces: Pieces,
        answer: Placement | Absence | Undecided,
    ) -> Placed | None:  # fmt: skip
        """Contacts on the triangles of curved patches; planes without a grasp prove nothing."""
        if isinstance(answer, Placement):
            cones = [ForceCone(piece.normal, 0.0) for piece in pieces]
            rng = self._rng(faces)

            def place(facets: Pieces) -> Placement | None:
                found = self._place(facets, rng, restarts=0)
                return found if isinstance(found, Placement) else None

            settled = on_true_surface(shapes, pieces, cones, answer, point_regions(answer), place)
            if settled is not None:
                return settled
        self.gathered.undecided[faces] = 1.0
        return None

    def _rng(self, faces: FaceQuadruple) -> np.random.Generator:
        return np.random.default_rng([self.request.seed, *faces])

    def _friction(self, pieces: Pieces) -> float:
        theta, spread = self.request.theta, max(piece.spread for piece in pieces)
        return math.tan(theta - spread if spread < theta else LEAST_SPAN_ANGLE)

    def _place(
        self, pieces: Pieces, rng: np.random.Generator, restarts: int = RESTARTS,
        known: ClosureCertificate | None = None,
    ) -> Placement | Absence | Undecided:  # fmt: skip
        try:
            return place_free(
                pieces, self._friction(pieces), rng=rng, cells=self.request.max_face_parts,
                restarts=restarts, whole=known,
            )  # fmt: skip
        except SolverError:
            return Undecided(1.0)

    def certified(
        self, faces: FaceQuadruple, placed: Placed, choices: tuple[Cones, ...]
    ) -> Certified | None:
        """Certify contacts, with regions if a construction offers them around these forces."""
        request, (pieces, placement) = self.request, placed
        for construction, cones in product(self.upgrades, choices):
            if better := _upgraded(faces, pieces, construction, cones, request.friction):
                return better
        cones = four(ForceCone(piece.normal, request.theta) for piece in pieces)
        candidate = Candidate(
            named("f", faces), faces, "regulus", pieces, cones, placement, point_regions(placement)
        )
        (certified,) = certify_each([candidate], request.friction)
        if certified is None:
            self.gathered.tally["rejected"] += 1
        return certified


def _upgraded(
    faces: FaceQuadruple, pieces: Pieces, construction: Construction, cones: Cones, friction: float
) -> Certified | None:
    shapes: list[FaceShape | None] = [None] * (max(faces) + 1)
    for face, piece in zip(faces, pieces, strict=True):
        shapes[face] = FaceShape((piece,), piece)
    attempts = [
        Attempt(
            four(faces[finger] for finger in order),
            (four(cones[finger] for finger in order),),
            (math.inf,),
        )
        for order in construction.orders
    ]
    search = FamilySearch(construction, shapes, friction, MethodSearch(construction.family))
    found = search.certified(attempts, construction.least)
    return min((one for one in found if one), key=best_first, default=None)
