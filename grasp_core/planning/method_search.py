"""Searches one object's face quadruples with one construction, or by the free method.

A construction keeps its best grasps. Bounds are tightened only at the head of one queue. A grasp is
ranked by its disc radius: how far each contact may move while the grasp stays good. Four kinds of
items wait in the queue, each with an upper bound on that radius: blocks of quadruples not listed
yet, bounded by the largest discs in their faces; listed blocks, bounded by how wide their force
cones can be; quadruples with chosen cones, bounded by the corners of their faces; and single
quadruples, bounded by small linear programs. The item with the largest bound comes first: a block
is listed, cones are chosen for some dozens of quadruples, their bounds are tightened, or a
quadruple is yielded. So no quadruple can have larger discs than the bound of one yielded before it,
and few cones are tilted and few programs solved that were not needed to know this.

The free method places contacts on four faces without a fixed type of grasp, or proves that there
are none. Its grasps have no contact regions. But forces that balance strictly inside the friction
cones are good axes for tilted force cones, so the constructions are tried once more around them.
"""

import math
from bisect import bisect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from heapq import heapify, heappop, heappush
from itertools import chain, islice, product, takewhile
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.cones.spanning import each_cones_positively_span
from grasp_core.errors import SolverError
from grasp_core.families.absence_certificate import Absence
from grasp_core.families.free import RESTARTS, Undecided, close_patches, place_free
from grasp_core.families.placements import Attempts, Placement
from grasp_core.families.placing import (
    CONSTRUCTIONS,
    MIXED,
    MOST_CHOICES,
    Attempt,
    Construction,
    ContactPlacing,
    FourCones,
    chosen_shapes,
    on_true_surface,
    point_regions,
)
from grasp_core.names import Method
from grasp_core.objects.face_pieces import FacePiece, FaceShape, Shapes, choices_near
from grasp_core.objects.standard_order import Standard
from grasp_core.planning.certify import Candidate, Certified, certify_each, named
from grasp_core.planning.quadruples import (
    LEAST_SPAN_ANGLE,
    Blocks,
    ConedQuadruples,
    WideQuadruples,
    cones_around,
)
from grasp_core.planning.result import COMPLETE_PARTS, FAMILIES, MethodCounts, PlanRequest, Tally
from grasp_core.solvers.ties import coarse, graded
from grasp_core.stopping import never, until
from grasp_core.values import FaceQuadruple, ForceCone, four

SMALLEST_CHUNK, LARGEST_CHUNK = 32, 2048
SMALLEST_TILT = 512
"""Fewest quadruples whose cones are chosen together: smaller groups take hardly less time."""
BLOCK, TABLE, QUADRUPLE = range(3)
"""Kinds of items in the queue; of items with equal bounds the smaller kind comes first."""
TOGETHER = 32
"""Number of blocks of quadruples searched at once: a million take some hundred megabytes."""
MOST_ATTEMPTS = 512
BEATEN_SHARE = 1e-5
"""Share by which a grasp must beat the worst one kept: symmetric objects hold many equal ones."""
ONE_GRASP = 1e-6
"""Distance between contacts below which two grasps count as one, in object radii."""


SortKey: TypeAlias = tuple[float, FaceQuadruple, FaceQuadruple]
"""Minus the graded merit of a grasp, its faces in rising order, and its faces by finger."""


@dataclass(frozen=True, slots=True, order=True)
class Waiting:
    """One item of the search's queue; items are ordered by their keys alone."""

    key: tuple[float, int, tuple[int, ...]]
    """Minus the rounded upper bound; then the kind, and places or faces, which break ties."""
    expand: "Callable[[float, float], Iterator[Waiting]] | None" = field(compare=False)
    """Yields the items that replace this one, given the threshold and the next item's bound."""
    attempts: Callable[[], tuple[Attempt, ...]] = field(compare=False, default=tuple)
    """Lists the attempts on a single quadruple; empty for items that can be expanded."""

    @property
    def bound(self) -> float:
        """Return the upper bound on the disc radius of grasps in this item [object radii]."""
        return -self.key[0]


Expanded: TypeAlias = Iterator[Waiting]


def _unasked(_: Certified) -> str:
    raise AssertionError("parts of a search keep no grasps")


@dataclass(slots=True, eq=False)
class Gathered:
    """The proofs and counts of a search, or of a part of one."""

    tally: Tally = field(default_factory=Tally)
    absences: dict[FaceQuadruple, tuple[Absence, ...]] = field(
        default_factory=dict[FaceQuadruple, tuple[Absence, ...]]
    )
    undecided: dict[FaceQuadruple, float] = field(default_factory=dict[FaceQuadruple, float])


@dataclass(slots=True, eq=False)
class MethodSearch:
    """The grasps, proofs and counts that one method has gathered so far."""

    method: Method
    limit: int | None = None
    reached: Callable[[Certified], Certified | str] = _unasked
    """Function that returns a grasp with its fingers' ways out, or why they cannot reach it."""
    best: list[Certified] = field(default_factory=list[Certified])
    """At most `limit` grasps, best first."""
    _keys: list[SortKey] = field(default_factory=list[SortKey])
    """What the grasps of `best` are sorted by."""
    held: set[FaceQuadruple] = field(default_factory=set[FaceQuadruple])
    """Ascending faces on which a grasp was found, whether it was kept or not."""
    gathered: Gathered = field(default_factory=Gathered)
    unreached: dict[FaceQuadruple, str] = field(default_factory=dict[FaceQuadruple, str])
    seconds: float = 0.0

    @property
    def counts(self) -> MethodCounts:
        """Return the counts so far, with the quadruples that are still undecided."""
        tally, still = self.gathered.tally, len(self.gathered.undecided)
        return MethodCounts(**{**tally, "undecided": tally["undecided"] + still})

    @property
    def full(self) -> bool:
        """Return whether `limit` grasps are kept, so that another one would replace one."""
        return self.limit is not None and len(self.best) == self.limit

    def take(self, gathered: Gathered, seconds: float) -> None:
        """Add the proofs and counts of a part, and the time that another process took [s]."""
        self.gathered.tally.update(gathered.tally)
        self.gathered.absences.update(gathered.absences)
        self.gathered.undecided.update(gathered.undecided)
        self.seconds += seconds

    def keep_each(self, found: Sequence[Certified]) -> list[Certified]:
        """Count grasps on one quadruple, and keep and return the ones that fingers reach."""
        kept: list[Certified] = []
        for each in found:
            faces, one = four(sorted(each.faces)), self.reached(each)
            if isinstance(one, str):
                self.gathered.tally["unreachable"] += 1
                self.unreached[faces] = one
                continue
            if one.method != self.method:
                one = replace(one, method=self.method)
            self.gathered.tally["found"] += 1
            self.held.add(faces)
            key = best_first(one)
            place = bisect(self._keys, key)
            self._keys.insert(place, key)
            self.best.insert(place, one)
            if self.limit is not None:
                del self.best[self.limit :], self._keys[self.limit :]
            kept.append(one)
        return kept


def best_first(found: Certified) -> SortKey:
    """Return a sort key: largest merit first, equal merits by faces, then by finger order."""
    return -graded(found.placement.merit), four(sorted(found.faces)), found.faces


@dataclass(frozen=True, eq=False)
class FamilySearch:
    """A search over one object's face quadruples for the grasps of one construction."""

    construction: Construction
    shapes: Shapes
    friction: float
    kept: MethodSearch  # what is found and kept; grasps kept meanwhile raise the threshold
    stop: Callable[[], bool] = never
    """Whether to end the search with what was found by then."""

    @cached_property
    def _settling(self) -> ContactPlacing:
        return ContactPlacing(self.construction, self.shapes)

    @property
    def least(self) -> float:
        """The merit (disc radius) that a grasp must exceed now to enter the best ones."""
        full, best = self.kept.full, self.kept.best
        if full and (self.construction.limits is None or not best):
            return math.inf
        worst = best[-1].placement.merit if full else -math.inf
        return max(worst * (1.0 + BEATEN_SHARE), self.construction.least)

    def found_in(self, blocks: Blocks, places: range) -> Iterator[list[Certified]]:
        """Yield the grasps on each quadruple of some blocks, to be kept before the next ones."""
        tally, quadruples = self.kept.gathered.tally, self._in_order(blocks, places)
        while group := self._next_few(quadruples):
            least = self.least
            worth = [[each for each in attempts if each.bounds[0] > least] for attempts in group]
            found = iter(self.certified([*chain.from_iterable(worth)], least))
            for attempts in worth:
                here = [one for one in islice(found, len(attempts)) if one is not None]
                kept = _without_duplicates(here)
                tally["duplicates"] += len(here) - len(kept)
                yield kept

    def _next_few(self, quadruples: Iterator[tuple[Attempt, ...]]) -> list[tuple[Attempt, ...]]:
        """Take the next quadruples, as many as cannot raise the threshold before the last one."""
        left, limit = MOST_ATTEMPTS, self.kept.limit
        if limit is not None:
            left = min(left, limit - len(self.kept.best))
        group: list[tuple[Attempt, ...]] = []
        for attempts in quadruples:
            group.append(attempts)
            left -= len(attempts)
            if left <= 0:
                break
        return group

    def _in_order(self, blocks: Blocks, places: range) -> Iterator[tuple[Attempt, ...]]:
        """Yield the attempts on each quadruple: over many blocks with a limit, or one by one."""
        if self.construction.limits is not None:
            size = 1 if self.kept.limit is None else TOGETHER
            for start in range(0, len(places), size):
                some = places[start : start + size]
                if float(blocks.rooms[some].max()) > self.least:
                    yield from self.best_first(blocks, some)
            return
        worth = self.construction.least
        for place in places:
            if self.kept.full or self.stop():
                return
            wide, _ = blocks.make(place).ranked(self.construction, worth)
            yield from takewhile(lambda _: not self.kept.full, self._in_rows(wide, worth))

    def best_first(self, blocks: Blocks, places: range) -> Iterator[tuple[Attempt, ...]]:
        """Yield the attempts on each quadruple whose bound exceeds the threshold, best first."""
        queue = [
            Waiting(
                (-float(blocks.rooms[place]), BLOCK, (place,)),
                partial(self._made, blocks.make, place),
            )
            for place in places
        ]
        heapify(queue)
        # each turn takes rows from finite tables, at least one
        while queue and not self.stop():
            head = heappop(queue)
            worth = self.least  # it rises while grasps are found
            if head.bound <= worth:
                return
            if head.expand is None:
                yield head.attempts()
                continue
            for item in head.expand(worth, queue[0].bound if queue else worth):
                heappush(queue, item)

    def _in_rows(self, wide: WideQuadruples, worth: float) -> Iterator[tuple[Attempt, ...]]:
        """Yield the attempts on quadruples whose bound exceeds `worth`, in the table's order."""
        for start in range(0, len(wide), SMALLEST_CHUNK):
            if self.stop():
                return
            rows = slice(start, start + SMALLEST_CHUNK)
            coned, bounds = wide.coned(rows).ranked(self.construction)
            for item in self._tightened(coned, bounds, slice(0, len(coned)), worth):
                yield item.attempts()

    def _made(
        self, make: Callable[[int], WideQuadruples], place: int, worth: float, _: float
    ) -> Expanded:
        """List a block, and yield one item for it; expanding that chooses cones for some rows."""
        wide, bounds = make(place).ranked(self.construction, worth)

        def chosen(rows: slice, worth: float) -> Expanded:
            coned, bounds = wide.coned(rows).ranked(self.construction)
            closer = coarse(np.asarray(bounds.max(axis=(1, 2), initial=-np.inf)))
            count = int((closer > worth).sum())
            tighter = partial(self._tightened, coned.some(np.arange(count)), bounds[:count].copy())
            yield from _rows(tighter, closer[:count], (place, rows.start), 0, SMALLEST_CHUNK)

        yield from _rows(chosen, coarse(bounds), (place,), 0, SMALLEST_TILT)

    def _tightened(
        self, coned: ConedQuadruples, bounds: Array, rows: slice, worth: float
    ) -> Expanded:
        """Tighten the bounds of some quadruples and yield the ones still above the threshold."""
        construction, cheap = self.construction, bounds[rows]
        solved = cheap > worth
        row, kind, column = np.nonzero(solved)
        order, at = np.array(construction.orders)[column], rows.start + row
        tight = np.full(cheap.shape, -np.inf)
        attempts = Attempts(
            np.take_along_axis(coned.faces[at], order, axis=1),
            np.take_along_axis(coned.axes[at, kind], order[:, :, None], axis=1),
            coned.half_angles[at, kind],
        )
        tight[row, kind, column] = construction.bounds(self._settling.table, attempts, worth)
        # both are upper bounds: the smaller one holds
        tight = np.minimum(tight, cheap)
        # no discs even of the least radius: settled here, whatever was found elsewhere
        none = solved.any(axis=1) & (tight.max(axis=1) <= construction.least)
        choices, excluded = int(solved.transpose(0, 2, 1)[none].sum()), int(none.sum())
        tally = self.kept.gathered.tally
        tally.update(tried=excluded, infeasible=excluded, solved=choices)
        tight[tight <= worth] = -np.inf
        best = coarse(np.asarray(np.max(tight, axis=(1, 2)), dtype=np.float64))
        for each in np.flatnonzero(best > -np.inf).tolist():
            place = rows.start + each
            faces = tuple(coned.faces[place].tolist())
            make = partial(coned.attempts, place, construction, tight[each])
            yield Waiting((-float(best[each]), QUADRUPLE, faces), None, make)

    def certified(self, attempts: Sequence[Attempt], least: float) -> list[Certified | None]:
        """Construct and certify a grasp for each attempt; None where there is none."""
        ends, tally = self._settling.of(attempts, least), self.kept.gathered.tally
        tally["tried"] += len(attempts)
        tally["solved"] += sum(end.solved for end in ends)
        tally["undecided"] += sum(end.failed for end in ends)
        tally["infeasible"] += sum(not (end.settled or end.failed) for end in ends)
        family = self.construction.family
        candidates = [
            Candidate(named(family[0], attempt.faces), attempt.faces, family, *end.settled)
            for attempt, end in zip(attempts, ends, strict=True)
            if end.settled is not None
        ]
        certified = certify_each(candidates, self.friction)
        if candidates:
            axes = np.array([[cone.axis for cone in each.cones] for each in candidates])
            angles = np.array([[cone.half_angle for cone in each.cones] for each in candidates])
            spans = each_cones_positively_span(axes, angles).tolist()
            certified = [one if span else None for one, span in zip(certified, spans, strict=True)]
        tally["rejected"] += len(candidates) - sum(one is not None for one in certified)
        placed = iter(certified)
        return [None if end.settled is None else next(placed) for end in ends]


def _rows(
    refined: Callable[[slice, float], Expanded], best: Array, place: tuple[int, ...], start: int,
    least: int,
) -> Expanded:  # fmt: skip
    """Yield one item for a table's rows from `start` on; expanding it refines the next chunk."""

    def expand(worth: float, beyond: float) -> Expanded:
        larger = int(np.searchsorted(-best[start:], -beyond))
        stop = min(start + min(max(larger, least), LARGEST_CHUNK), len(best))
        yield from refined(slice(start, stop), worth)
        yield from _rows(refined, best, place, stop, least)

    if start < len(best):
        yield Waiting((-float(best[start]), TABLE, place), expand)


def _without_duplicates(found: list[Certified]) -> list[Certified]:
    """Drop each grasp whose contacts are those of a better one; all are on the same faces."""
    kept: list[Certified] = []
    for one in sorted(found, key=best_first):
        here = one.placement.positions[np.argsort(one.faces)]
        if all(
            np.abs(here - other.placement.positions[np.argsort(other.faces)]).max() >= ONE_GRASP
            for other in kept
        ):
            kept.append(one)
    return kept


FourPieces: TypeAlias = tuple[FacePiece, ...]
FreeAnswer: TypeAlias = tuple[FourPieces, Placement | Absence | Undecided]
"""Convex pieces of four faces, and what the free method says about them."""
PlacedPieces: TypeAlias = tuple[FourPieces, Placement]
"""Convex pieces of four faces, and contacts on them."""


def found_on(
    on: Standard, to_try: Sequence[FaceQuadruple], request: PlanRequest, gathered: Gathered,
    again: bool, stop: Callable[[], bool] = never,
) -> Iterator[Certified | None]:  # fmt: skip
    """Decide quadruples together, or `again` with more parts; yield the grasp on each, or None.

    If `stop` says so, those that are left are not tried.
    """
    if again:
        request = replace(request, max_face_parts=COMPLETE_PARTS)
    search = _FreeSearch(on, request, gathered, stop)
    known = {} if again else search.patches(to_try)
    placed = [search.placed_on(faces, known.get(faces)) for faces in until(stop, to_try)]
    if not again:
        gathered.tally["tried"] += len(placed)
    tilted = [each for each in placed if each] if search.upgrades else []
    choices = iter(cones_around(tilted, request.theta) if tilted else ())
    for faces, each in zip(to_try, placed, strict=False):  # fewer if stopped
        yield search.certified(faces, each, next(choices, ())) if each else None


@dataclass(frozen=True, eq=False)
class _FreeSearch:
    """The free method on the faces of one object, with what is asked of it and what it gathers."""

    on: Standard
    request: PlanRequest
    gathered: Gathered
    stop: Callable[[], bool]

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

    def placed_on(
        self, faces: FaceQuadruple, known: ClosureCertificate | None
    ) -> PlacedPieces | None:
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
    ) -> list[FreeAnswer]:
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
        answers: list[FreeAnswer] = []
        for pieces in choices_near(shapes, at, most):
            tally["solved"] += 1
            answers.append((pieces, self._place(pieces, rng, restarts=0)))
            if isinstance(answers[-1][1], Placement):
                return answers
            if self.stop():
                break
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
        self, faces: FaceQuadruple, shapes: Sequence[FaceShape], pieces: FourPieces,
        answer: Placement | Absence | Undecided,
    ) -> PlacedPieces | None:  # fmt: skip
        """Contacts on the triangles of curved patches; planes without a grasp prove nothing."""
        if isinstance(answer, Placement):
            cones = [ForceCone(piece.normal, 0.0) for piece in pieces]
            rng = self._rng(faces)

            def place(facets: FourPieces) -> Placement | None:
                found = self._place(facets, rng, restarts=0)
                return found if isinstance(found, Placement) else None

            settled = on_true_surface(shapes, pieces, cones, answer, point_regions(answer), place)
            if settled is not None:
                return settled
        self.gathered.undecided[faces] = 1.0
        return None

    def _rng(self, faces: FaceQuadruple) -> np.random.Generator:
        return np.random.default_rng([self.request.seed, *faces])

    def _friction(self, pieces: FourPieces) -> float:
        theta, spread = self.request.theta, max(piece.spread for piece in pieces)
        return math.tan(theta - spread if spread < theta else LEAST_SPAN_ANGLE)

    def _place(
        self, pieces: FourPieces, rng: np.random.Generator, restarts: int = RESTARTS,
        known: ClosureCertificate | None = None,
    ) -> Placement | Absence | Undecided:  # fmt: skip
        try:
            return place_free(
                pieces, self._friction(pieces), rng=rng, cells=self.request.max_face_parts,
                restarts=restarts, whole=known, stop=self.stop,
            )  # fmt: skip
        except SolverError:
            return Undecided(1.0)

    def certified(
        self, faces: FaceQuadruple, placed: PlacedPieces, choices: tuple[FourCones, ...]
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
    faces: FaceQuadruple,
    pieces: FourPieces,
    construction: Construction,
    cones: FourCones,
    friction: float,
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
