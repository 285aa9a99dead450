"""Searches one object's face quadruples with one construction, keeping its best grasps."""

import math
from bisect import insort
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import takewhile
from typing import TypeAlias

import numpy as np

from grasp_core.cones.spanning import cones_positively_span
from grasp_core.disc_bounds.program_bounds import AttemptBounds
from grasp_core.errors import SolverError
from grasp_core.families.constructions import Construction, regions_of
from grasp_core.families.free import Absence
from grasp_core.families.placements import Placement
from grasp_core.families.true_surface import on_true_surface
from grasp_core.objects.face_pieces import FacePiece, FaceShape, Shapes, choices_near
from grasp_core.planning.best_first import BestFirst
from grasp_core.planning.blocks import Blocks
from grasp_core.planning.certify import Certified, certify, named
from grasp_core.planning.quadruples import Attempt, Cones
from grasp_core.planning.reach import Reach
from grasp_core.planning.result import MethodCounts, Tally
from grasp_core.solvers.ties import graded, surpassing
from grasp_core.values import ContactRegion, FaceQuadruple, Method, four

Found: TypeAlias = tuple[tuple[FacePiece, ...], Cones, Placement]
"""Convex pieces of four faces, their force cones, and the contacts placed on them."""

MOST_CHOICES = 8
"""Most choices of pieces tried on faces that are not convex; the free method multiplies it by
`max_face_parts`."""
TOGETHER = 32
"""Number of blocks of quadruples searched at once: a million take some hundred megabytes."""
SAME_MERIT = 1e-5
"""Share by which a new grasp must beat the worst one kept: symmetric objects hold thousands of
equal grasps."""
SAME_CONTACTS = 1e-6
"""Distance between contacts below which two grasps count as one, in object radii."""


@dataclass(slots=True, eq=False)
class MethodSearch:
    """The grasps, proofs and counts that one method has gathered so far."""

    method: Method
    limit: int | None
    reach: Callable[[Certified], Reach]
    """Function that returns how fingers reach the contacts of a grasp, or why they cannot."""
    best: list[Certified] = field(default_factory=list[Certified])
    """At most `limit` grasps, best first."""
    held: set[FaceQuadruple] = field(default_factory=set[FaceQuadruple])
    """Ascending faces on which a grasp was found, whether it was kept or not."""
    tally: Tally = field(default_factory=Tally)
    absences: dict[FaceQuadruple, tuple[Absence, ...]] = field(
        default_factory=dict[FaceQuadruple, tuple[Absence, ...]]
    )
    undecided: dict[FaceQuadruple, float] = field(default_factory=dict[FaceQuadruple, float])
    unreached: dict[FaceQuadruple, str] = field(default_factory=dict[FaceQuadruple, str])
    seconds: float = 0.0

    @property
    def counts(self) -> MethodCounts:
        """Return the counts so far, with the quadruples that are still undecided."""
        counts = self.tally.counts
        return replace(counts, undecided=counts.undecided + len(self.undecided))

    @property
    def full(self) -> bool:
        """Return whether `limit` grasps are kept, so that another one would replace one."""
        return self.limit is not None and len(self.best) == self.limit

    def least(self, construction: Construction) -> float:
        """Return the merit (disc radius) that a grasp must exceed to enter the best ones."""
        if self.full and (construction.limits is None or not self.best):
            return math.inf
        worst = self.best[-1].placement.merit if self.full else -math.inf
        return max(worst * (1.0 + SAME_MERIT), construction.least)

    def may_gain(self, construction: Construction, room: float) -> bool:
        """Return whether a grasp with discs of radius `room` could enter the best ones."""
        return room > self.least(construction)

    def keep(self, found: Certified) -> list[Certified]:
        """Count a grasp and keep it if fingers reach it; return it in a list, or an empty list."""
        faces = four(sorted(found.faces))
        way = self.reach(found)
        if way.reason:
            self.tally.count("unreachable")
            self.unreached[faces] = way.reason
            return []
        found = replace(found, method=self.method, ways_out=way.directions)
        self.tally.count("found")
        self.held.add(faces)
        insort(self.best, found, key=best_first)
        if self.limit is not None:
            del self.best[self.limit :]
        return [found]


def best_first(found: Certified) -> tuple[float, FaceQuadruple, FaceQuadruple]:
    """Return a sort key: largest merit first, equal merits by faces, then by finger order."""
    return -graded(found.placement.merit), four(sorted(found.faces)), found.faces


def search_construction(
    construction: Construction,
    shapes: Shapes,
    friction: float,
    blocks: Blocks,
    search: MethodSearch,
) -> Iterator[list[Certified]]:
    """Try a construction on blocks of quadruples; yield the grasps kept from each quadruple.

    With a limit the search ends when no upper bound exceeds the worst grasp kept. A construction
    without bounds ends as soon as the limit is reached.
    """
    for attempts in _in_order(construction, AttemptBounds(shapes), blocks, search):
        found: list[Certified] = []
        for attempt in attempts:
            # grasps kept meanwhile may have raised the threshold
            if not search.may_gain(construction, attempt.bounds[0]):
                continue
            on_faces = chosen_shapes(shapes, attempt.faces)
            one, tally = tried(
                construction, attempt, on_faces, friction, search.least(construction)
            )
            search.tally.add(tally)
            found += [one] if one else []
        kept = _without_duplicates(found)
        search.tally.count("duplicates", len(found) - len(kept))
        yield [one for each in kept for one in search.keep(each)]


def _in_order(
    construction: Construction, bounded: AttemptBounds, blocks: Blocks, search: MethodSearch
) -> Iterator[tuple[Attempt, ...]]:
    """Yield the attempts on each quadruple: over many blocks with a limit, else block by block."""
    best_first = BestFirst(construction, bounded, search.tally)
    rooms, make = blocks
    places = range(len(rooms))
    if construction.limits is not None:
        size = 1 if search.limit is None else TOGETHER
        for start in places[::size]:
            some = places[start : start + size]
            if search.may_gain(construction, float(rooms[some].max())):
                yield from best_first.over(blocks, some, search.least)
        return
    for place in places:
        if search.full:
            return
        wide, _ = make(place).ranked(construction, construction.least)
        some = best_first.in_rows(wide, construction.least)
        yield from takewhile(lambda _: not search.full, some)


def chosen_shapes(shapes: Shapes, faces: FaceQuadruple) -> tuple[FaceShape, ...]:
    """Return the shapes of the faces that have room for a contact, in finger order."""
    return tuple(shape for face in faces if (shape := shapes[face]) is not None)


def tried(
    construction: Construction,
    attempt: Attempt,
    shapes: Sequence[FaceShape],
    friction: float,
    least: float,
) -> tuple[Certified | None, Tally]:
    """Try to construct and certify a grasp on four faces in one order of the fingers.

    Args:
        construction: The construction to try.
        attempt: Which of the faces each finger touches, and with which force cones.
        shapes: Shapes of these faces, in finger order.
        friction: Coulomb coefficient at every contact.
        least: The merit that a placement must exceed.

    Returns:
        The certified grasp, or None, and what to count.
    """
    tally, family = Tally(), construction.family
    tally.count("tried")
    try:
        settled = _settled(construction, shapes, attempt, tally, least)
    except SolverError:
        tally.count("undecided")
        return None, tally
    if settled is None:
        tally.count("infeasible")
        return None, tally
    chosen, cones, placement, regions = settled
    name = named(family[0], attempt.faces)
    found = certify(name, attempt.faces, family, chosen, cones, placement, friction, regions)
    if found is None or not cones_positively_span(
        [cone.axis for cone in cones], [cone.half_angle for cone in cones]
    ):
        tally.count("rejected")
        return None, tally
    return found, tally


def _settled(
    construction: Construction,
    shapes: Sequence[FaceShape],
    attempt: Attempt,
    tally: Tally,
    least: float,
) -> tuple[tuple[FacePiece, ...], Cones, Placement, tuple[ContactRegion, ...]] | None:
    """Place contacts with the best choice of cones, add regions, move them to the true surface."""
    placed = None
    for cones, bound in zip(attempt.cones, attempt.bounds, strict=True):
        # choices come with falling bounds: the later ones cannot be better either
        if bound <= least:
            break
        if found := _best_placement(construction, cones, shapes, least, tally):
            placed, least = found, surpassing(found[2].merit)
    if placed is None:
        return None
    chosen, cones, planned = placed
    regions = regions_of(construction.region, chosen, cones, planned)
    found = on_true_surface(
        shapes, chosen, cones, planned, regions, partial(_placed_on, construction, cones)
    )
    return None if found is None else (found[0], cones, found[1], regions)


def _placed_on(
    construction: Construction, cones: Cones, pieces: tuple[FacePiece, ...]
) -> Placement | None:
    """Place contacts on convex pieces, with discs however small; None if it is impossible."""
    placed = construction.place(pieces, cones, 0.0 if construction.limits else -math.inf)
    return placed if isinstance(placed, Placement) else None


def _best_placement(
    construction: Construction,
    cones: Cones,
    shapes: Sequence[FaceShape],
    least: float,
    tally: Tally,
) -> Found | None:
    """Place contacts on the best choice of one convex piece per face; None unless above `least`.

    Where faces have several pieces, their hulls are tried first: a grasp that the hulls do not hold
    no piece holds, and the contacts on the hulls show which pieces are likely to be best.
    """
    hulls = tuple(shape.hull for shape in shapes)
    tally.count("solved")
    whole = construction.place(hulls, cones, least)
    if not (isinstance(whole, Placement) and whole.merit > least):
        return None
    if all(len(shape.pieces) == 1 for shape in shapes):
        return hulls, cones, whole
    best = None
    for chosen in choices_near(shapes, whole.positions, MOST_CHOICES):
        tally.count("solved")
        if construction.limits is not None and min(piece.inradius for piece in chosen) < least:
            continue
        placed = construction.place(chosen, cones, least)
        if isinstance(placed, Placement) and placed.merit > least:
            best, least = (chosen, cones, placed), surpassing(placed.merit)
    return best


def _without_duplicates(found: list[Certified]) -> list[Certified]:
    """Drop each grasp whose contacts are those of a better one; all are on the same faces."""
    kept: list[Certified] = []
    for one in sorted(found, key=best_first):
        here = one.placement.positions[np.argsort(one.faces)]
        if all(
            np.abs(here - other.placement.positions[np.argsort(other.faces)]).max() >= SAME_CONTACTS
            for other in kept
        ):
            kept.append(one)
    return kept
