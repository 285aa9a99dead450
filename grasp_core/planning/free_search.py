"""Runs the free method over the face quadruples of one object that no construction holds.

Grasps of the free method have no regions. But forces that balance strictly inside the friction
cones are good axes for tilted force cones, so the constructions are tried once more around them.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import islice, product
from typing import TypeAlias

import numpy as np

from grasp_core.cones.tilting import toward, widened
from grasp_core.errors import SolverError
from grasp_core.families.constructions import Construction, point_region, regions_of
from grasp_core.families.free import RESTARTS, Absence, Undecided, place_free
from grasp_core.families.placements import Placement
from grasp_core.families.true_surface import on_true_surface
from grasp_core.objects.face_pieces import FacePiece, FaceShape, Shapes, choices_near
from grasp_core.planning.candidates import BELOW_SPAN_ANGLE, LEAST_SPAN_ANGLE, usable_half_angles
from grasp_core.planning.certify import Certified, certify, named
from grasp_core.planning.family_search import (
    MOST_CHOICES,
    Case,
    Search,
    best_first,
    chosen_shapes,
    tried,
)
from grasp_core.planning.ranking import Attempt, ConeChoice
from grasp_core.values import FINGERS, FaceQuadruple, ForceCone, four

BATCH = 64
"""Number of quadruples whose force cones are sought together."""

Pieces: TypeAlias = tuple[FacePiece, ...]
Answer: TypeAlias = tuple[Pieces, Placement | Absence | Undecided]
"""Convex pieces of four faces, and what the free method says about them."""


@dataclass(frozen=True, slots=True)
class FreeRequest:
    """Settings of the free method."""

    friction: float
    theta: float
    """Half-angle of the friction cones to plan with [rad]."""
    seed: int
    cells: int
    """Most parts into which the faces of one quadruple may be cut."""
    upgrades: Sequence[Construction]
    """Constructions to try with force cones around the forces of each free grasp."""
    owners: Sequence[int]
    """For each face index, the whole face it is or is a half of."""


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """Contacts on one choice of pieces of four faces."""

    faces: FaceQuadruple
    pieces: Pieces
    placement: Placement

    @property
    def normals(self) -> list[np.ndarray]:
        """Inward unit normals of the four pieces, four arrays (3,)."""
        return [piece.normal for piece in self.pieces]


def search_free(
    shapes: Shapes,
    quadruples: Iterator[FaceQuadruple],
    request: FreeRequest,
    search: Search,
    held: AbstractSet[FaceQuadruple],
) -> Iterator[list[Certified]]:
    """Go through the quadruples that no family holds, until the limit is reached."""
    while batch := list(islice(quadruples, BATCH)):
        if search.full:
            return
        placed = [_decide(shapes, faces, request, search, held) for faces in batch]
        choices = iter(_cone_choices([each for each in placed if each], request))
        for each in placed:
            found = _certified(each, next(choices), request, search) if each else None
            yield search.keep(found) if found else []


def search_undecided(
    shapes: Shapes, request: FreeRequest, search: Search
) -> Iterator[list[Certified]]:
    """Go once more, with more cells, through the quadruples that were left undecided."""
    for faces in tuple(search.undecided):
        del search.undecided[faces]
        # they were counted the first time, and are counted again below
        search.tally["undecided"] -= 1
        search.tally["tried"] -= 1
        placed = _decide(shapes, faces, request, search, frozenset())
        found = None
        if placed is not None:
            (choices,) = _cone_choices([placed], request)
            found = _certified(placed, choices, request, search)
        yield search.keep(found) if found else []


def _decide(
    shapes: Shapes,
    faces: FaceQuadruple,
    request: FreeRequest,
    search: Search,
    held: AbstractSet[FaceQuadruple],
) -> _Placed | None:
    """Find contacts on four faces; if there are none, record the proof or that it is undecided."""
    chosen = chosen_shapes(shapes, faces)
    if faces in held or len(chosen) < FINGERS:
        return None
    search.tally["tried"] += 1
    answers = _answers(faces, chosen, request, search)
    pieces, last = answers[-1]
    if any(shape.facets is not None for shape in chosen):
        return _on_triangles(faces, chosen, pieces, last, request, search)
    if isinstance(last, Placement):
        return _Placed(faces, pieces, last)
    if any(request.owners[face] != face for face in faces):
        answers = [_whole(shapes, faces, request, search)]
    proofs = tuple(proof for _, proof in answers if isinstance(proof, Absence))
    if len(proofs) == len(answers):
        search.tally["infeasible"] += 1
        search.absences[faces] = proofs
    else:
        search.tally["undecided"] += 1
        search.undecided[faces] = max(
            answer.open_share for _, answer in answers if isinstance(answer, Undecided)
        )
    return None


def _whole(shapes: Shapes, faces: FaceQuadruple, request: FreeRequest, search: Search) -> Answer:
    """Ask whether whole faces hold no grasp, where choices of their halves gave none."""
    whole = four(request.owners[face] for face in faces)
    hulls = tuple(shape.hull for shape in chosen_shapes(shapes, whole))
    search.tally["solved"] += 1
    answer = _place(hulls, request, np.random.default_rng([request.seed, *faces]), restarts=0)
    return hulls, answer if isinstance(answer, Absence) else Undecided(1, 1.0)


def _answers(
    faces: FaceQuadruple, shapes: Sequence[FaceShape], request: FreeRequest, search: Search
) -> list[Answer]:
    """Answers that together decide four faces unless one is undecided; a placement comes last.

    The hulls come first: if they hold no grasp, no pieces do. Choices of pieces follow until one
    holds a grasp, and last the most likely choice with more effort.
    """
    rng = np.random.default_rng([request.seed, *faces])
    hulls = tuple(shape.hull for shape in shapes)
    search.tally["solved"] += 1
    whole = _place(hulls, request, rng)
    if isinstance(whole, Absence) or all(len(shape.pieces) == 1 for shape in shapes):
        return [(hulls, whole)]
    at = whole.positions if isinstance(whole, Placement) else np.array([h.origin for h in hulls])
    most = MOST_CHOICES * request.cells
    answers: list[Answer] = []
    for pieces in choices_near(shapes, at, most):
        search.tally["solved"] += 1
        answers.append((pieces, _place(pieces, request, rng, restarts=0)))
        if isinstance(answers[-1][1], Placement):
            return answers
    if isinstance(answers[0][1], Undecided):
        pieces, _ = answers.pop(0)
        answers.append((pieces, _place(pieces, request, rng)))
        if isinstance(answers[-1][1], Placement):
            return answers
    # more choices than were tried: the rest stays undecided
    if math.prod(len(shape.pieces) for shape in shapes) > most:
        answers.append((hulls, Undecided(1, 1.0)))
    return answers


def _on_triangles(
    faces: FaceQuadruple,
    shapes: Sequence[FaceShape],
    pieces: Pieces,
    answer: Placement | Absence | Undecided,
    request: FreeRequest,
    search: Search,
) -> _Placed | None:
    """Contacts on the triangles of curved patches; planes without a grasp prove nothing here."""
    if isinstance(answer, Placement):
        cones = [ForceCone(piece.normal, 0.0) for piece in pieces]
        points = regions_of(point_region, pieces, cones, answer)
        rng = np.random.default_rng([request.seed, *faces])

        def place(facets: Pieces) -> Placement | None:
            found = _place(facets, request, rng, restarts=0)
            return found if isinstance(found, Placement) else None

        settled = on_true_surface(shapes, pieces, cones, answer, points, place)
        if settled is not None:
            return _Placed(faces, *settled)
    search.tally["undecided"] += 1
    search.undecided[faces] = 1.0
    return None


def _place(
    pieces: Pieces, request: FreeRequest, rng: np.random.Generator, restarts: int = RESTARTS
) -> Placement | Absence | Undecided:
    spread = max(piece.spread for piece in pieces)
    theta = request.theta - spread if spread < request.theta else LEAST_SPAN_ANGLE
    try:
        return place_free(pieces, math.tan(theta), rng=rng, cells=request.cells, restarts=restarts)
    except SolverError:
        return Undecided(1, 1.0)


def _cone_choices(placed: Sequence[_Placed], request: FreeRequest) -> list[tuple[ConeChoice, ...]]:
    """Tilted force cones: towards the faces' or the object's middle, or around the forces."""
    if not (placed and request.upgrades):
        return [()] * len(placed)
    normals = np.array([each.normals for each in placed])
    spreads = np.array([[piece.spread for piece in each.pieces] for each in placed])
    thetas = usable_half_angles(request.theta, spreads)
    middles = np.array(
        [[piece.point(piece.corners.mean(axis=0)) for piece in each.pieces] for each in placed]
    )
    placements = [each.placement for each in placed]
    forces = np.array([p.forces if p.planned is None else p.planned for p in placements])
    kinds = (
        toward(middles.mean(axis=1), middles, normals, thetas),
        toward(np.zeros((len(placed), 3)), middles, normals, thetas),
        widened(forces, normals, thetas),
    )
    return [
        tuple(
            ConeChoice(four(ForceCone(axis, angle) for axis in kind.axes[place]), math.inf)
            for kind in kinds
            if (angle := BELOW_SPAN_ANGLE * float(kind.half_angles[place])) > LEAST_SPAN_ANGLE
        )
        for place in range(len(placed))
    ]


def _certified(
    placed: _Placed, choices: tuple[ConeChoice, ...], request: FreeRequest, search: Search
) -> Certified | None:
    """Certify contacts, with regions if a construction offers them around these forces."""
    for construction, choice in product(request.upgrades, choices):
        if better := _upgraded(placed, construction, choice, request.friction):
            return better
    cones = four(ForceCone(piece.normal, request.theta) for piece in placed.pieces)
    certified = certify(
        named("f", placed.faces), placed.faces, "regulus", placed.pieces, cones, placed.placement,
        request.friction, regions_of(point_region, placed.pieces, cones, placed.placement),
    )  # fmt: skip
    if certified is None:
        search.tally["rejected"] += 1
    return certified


def _upgraded(
    placed: _Placed, construction: Construction, choice: ConeChoice, friction: float
) -> Certified | None:
    """The best grasp that a construction offers on the same pieces, or None."""
    shapes = [FaceShape((piece,), piece) for piece in placed.pieces]
    attempts = [Attempt(order, (choice,)) for order in construction.orders]
    case = Case(construction, placed.faces, shapes, friction)
    tries = [tried(case, attempt, construction.least, Counter[str]()) for attempt in attempts]
    return min((one for one in tries if one is not None), key=best_first, default=None)
