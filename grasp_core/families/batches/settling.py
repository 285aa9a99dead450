"""Settles where the contacts of many attempts go: with which force cones, and on which pieces.

An attempt may have several choices of force cones, and its faces several convex pieces each. The
contacts with the largest discs count, moved to the true surface where faces are curved.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeAlias

from grasp_core.errors import SolverError
from grasp_core.families.batches.placing import Ask, Known, ManyPlacements
from grasp_core.families.constructions import Construction, regions_of
from grasp_core.families.placements import Placement
from grasp_core.families.true_surface import on_true_surface
from grasp_core.objects.face_pieces import FacePiece, FaceShape, Shapes, choices_near
from grasp_core.solvers.ties import surpassing
from grasp_core.values import ContactRegion, FaceQuadruple, ForceCone, four

MOST_CHOICES = 8
"""Most choices of pieces tried on faces that are not convex; the free method multiplies it by
`max_face_parts`."""

Cones: TypeAlias = tuple[ForceCone, ForceCone, ForceCone, ForceCone]
Planned: TypeAlias = tuple[
    tuple[FacePiece, ...], Cones, Placement, tuple[ContactRegion, ...] | None
]
"""Convex pieces of four faces, their force cones, the contacts placed on them, and the regions of
the fingers where they are known."""
Settled: TypeAlias = tuple[tuple[FacePiece, ...], Cones, Placement, tuple[ContactRegion, ...]]
"""Pieces of the true surface, force cones, contacts, and the regions of the fingers."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """One order of the fingers on four faces, with the force cones to try in a construction."""

    faces: FaceQuadruple
    """The face that each finger touches."""
    cones: tuple[Cones, ...]
    """Choices of force cones in finger order, the choice with the largest bound first."""
    bounds: tuple[float, ...]
    """Upper bound on the discs of each choice [object radii]; infinite for constructions without
    discs."""


@dataclass(slots=True, eq=False)
class End:
    """How one attempt ends."""

    least: float
    """The merit to exceed: that of the best contacts so far, at first what was asked for."""
    planned: Planned | None = None
    """The best contacts so far, on the planes of the faces."""
    settled: Settled | None = None
    """Contacts on the true surface; None where there are none."""
    solved: int = 0
    """Number of choices of pieces for which contacts were sought."""
    failed: bool = False
    """Whether a program was neither solved nor proved infeasible: nothing is known then."""


@dataclass(frozen=True, eq=False)
class Settling:
    """Places the contacts of one construction on the faces of one object."""

    construction: Construction
    shapes: Shapes

    def of(self, attempts: Sequence[Attempt], least: float) -> list[End]:
        """Place contacts for each attempt, with regions, on the true surface."""
        ends = [End(least) for _ in attempts]
        going = list(zip(attempts, ends, strict=True))
        for choice in range(max((len(each.cones) for each in attempts), default=0)):
            # choices come with falling bounds: the later ones cannot be better either
            going = [
                (attempt, end)
                for attempt, end in going
                if choice < len(attempt.cones) and attempt.bounds[choice] > end.least
            ]
            asked: list[Ask] = [
                (attempt.faces, attempt.cones[choice], end.least) for attempt, end in going
            ]
            known = self._many.of(self.construction, asked)
            for ask, (_, end), each in zip(asked, going, known, strict=True):
                self._place(ask, each, end)
            going = [(attempt, end) for attempt, end in going if not end.failed]
        for attempt, end in zip(attempts, ends, strict=True):
            self._settle(attempt, end)
        return ends

    def _place(self, ask: Ask, known: Known | None, end: End) -> None:
        """Enter the contacts of one choice of cones if they are better than those before."""
        try:
            found = self._best_placement(ask, known, end)
        except SolverError:
            end.failed = True
            return
        if found:
            end.planned, end.least = found, surpassing(found[2].merit)

    def _settle(self, attempt: Attempt, end: End) -> None:
        """Enter the contacts of an attempt, moved to the true surface."""
        if end.planned is None or end.failed:
            return
        chosen, cones, placement, known = end.planned
        regions = known or regions_of(self.construction.region, chosen, cones, placement)
        shapes = chosen_shapes(self.shapes, attempt.faces)
        if all(shape.facets is None for shape in shapes):
            end.settled = chosen, cones, placement, regions
            return
        place = partial(_placed_on, self.construction, cones)
        try:
            found = on_true_surface(shapes, chosen, cones, placement, regions, place)
        except SolverError:
            end.failed = True
            return
        end.settled = None if found is None else (found[0], cones, found[1], regions)

    def _best_placement(self, ask: Ask, known: Known | None, end: End) -> Planned | None:
        """Place contacts on the best choice of one convex piece per face; None unless above least.

        Where faces have several pieces, their hulls are tried first: a grasp that the hulls do not
        hold no piece holds, and the contacts on the hulls show which pieces are likely to be best.
        """
        construction, (faces, given, least) = self.construction, ask
        cones, shapes = four(given), chosen_shapes(self.shapes, faces)
        hulls = tuple(shape.hull for shape in shapes)
        end.solved += 1
        whole = construction.place(hulls, cones, least) if known is None else known.placement
        if not (isinstance(whole, Placement) and whole.merit > least):
            return None
        if all(len(shape.pieces) == 1 for shape in shapes):
            return hulls, cones, whole, None if known is None else known.regions
        best = None
        for chosen in choices_near(shapes, whole.positions, MOST_CHOICES):
            end.solved += 1
            if construction.limits is not None and min(piece.inradius for piece in chosen) < least:
                continue
            placed = construction.place(chosen, cones, least)
            if isinstance(placed, Placement) and placed.merit > least:
                best, least = (chosen, cones, placed, None), surpassing(placed.merit)
        return best

    @cached_property
    def _many(self) -> ManyPlacements:
        return ManyPlacements([shape.hull if shape else None for shape in self.shapes])


def chosen_shapes(shapes: Shapes, faces: FaceQuadruple) -> tuple[FaceShape, ...]:
    """Return the shapes of the faces that have room for a contact, in finger order."""
    return tuple(shape for face in faces if (shape := shapes[face]) is not None)


def _placed_on(
    construction: Construction, cones: Cones, pieces: tuple[FacePiece, ...]
) -> Placement | None:
    """Place contacts on convex pieces, with discs however small; None if it is impossible."""
    placed = construction.place(pieces, cones, 0.0 if construction.limits else -math.inf)
    return placed if isinstance(placed, Placement) else None
