"""Places contacts for many attempts of one construction, with the regions of the fingers.

Compiled code solves the programs of the concurrent and the pencil construction and checks its
answers by their residuals; what it does not prove is left to the construction itself, one attempt
at a time. Of several choices of cones and pieces the contacts with the largest discs count.

The paper's three constructions have one interface here, `Construction`, which the planner uses.

Contacts on curved patches move from the planes of the patches to the true surface.

Solved: given a placement on the planes of patches, a placement with the same force cones on the
triangles of the surface over the contacts, each within the region of its finger.

Why they move. The planes were planned with friction cones that fit inside the cones of every
triangle over them, and with contacts anywhere within `depth` of the planes. So a concurrent grasp's
contacts on the surface can aim at the planned focus. Otherwise the construction is run again on the
triangles. Either way the contacts are on the surface, and are certified with the true normals.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns
from grasp_core.declared import trusted
from grasp_core.errors import SolverError
from grasp_core.families.concurrent import (
    BEFORE,
    BEHIND,
    MIXED_SIDES,
    cone_footprint,
    place_concurrent,
    place_on_mixed_sides,
)
from grasp_core.families.pencil import place_pencil
from grasp_core.families.placements import (
    LEAST_RADIUS,
    LEFT,
    PAIRINGS,
    PLACED,
    Attempts,
    FaceTable,
    FingerOrder,
    Footprints,
    NoPlacement,
    Placed,
    Placement,
    balanced_forces,
    face_table,
    room_for,
)
from grasp_core.families.regulus import nearly_symmetric, place_regulus
from grasp_core.geometry.polygons import circle, clip, edge_rows, tidy
from grasp_core.objects.face_pieces import (
    FacePiece,
    FaceShape,
    Shapes,
    choices_near,
    inscribed_radius,
    piece_of,
)
from grasp_core.solvers.ties import graded, surpassing
from grasp_core.values import (
    FINGERS,
    ContactRegion,
    FaceQuadruple,
    Family,
    ForceCone,
    RegionKind,
    four,
)

Region: TypeAlias = Callable[[FacePiece, ForceCone, Placement, int], ContactRegion]

AS_LISTED: tuple[FingerOrder, ...] = ((0, 1, 2, 3),)
DISC_CORNERS = 64
"""Number of points that are listed on the border of a disc."""


@dataclass(frozen=True, slots=True)
class Construction:
    """The construction of one family, with the functions that the planner needs for it."""

    family: Family
    orders: tuple[FingerOrder, ...]
    """Orders of the fingers on the same faces that give different grasps."""
    place: Callable[[Sequence[FacePiece], Sequence[ForceCone], float], Placement | NoPlacement]
    """Function that places contacts, given pieces, force cones and the least merit that counts."""
    limits: slice | None
    """Columns of `disc_limits`, one per finger order; None where no disc is claimed."""
    admits: Callable[[Array, Array], NDArray[np.bool_]] | None
    """Function that returns for which quadruples a program may be feasible, (q,), from normals in
    finger order, (q, 4, 3), and half-angles, (q,) [rad]; None for all."""
    region: Region  # function that makes the region of one finger, in the pieces' units

    @property
    def least(self) -> float:
        """Return the merit that a placement must exceed to count."""
        return LEAST_RADIUS if self.limits else -math.inf


def _cone_region(
    piece: FacePiece, cone: ForceCone, placed: Placement, finger: int
) -> ContactRegion:
    polygon = cone_footprint(piece, cone, placed.foci[0], placed.positions[finger])
    E, b = edge_rows((polygon - piece.origin) @ piece.frame)
    return ContactRegion("cone", polygon, inscribed_radius(E, b))


def _disc_region(piece: FacePiece, _: ForceCone, placed: Placement, finger: int) -> ContactRegion:
    ring = circle(DISC_CORNERS) @ piece.frame.T
    radius = float(placed.radii[finger])
    return ContactRegion("disc", placed.positions[finger] + radius * ring, radius)


def regions_of(
    region: Region, pieces: Sequence[FacePiece], cones: Sequence[ForceCone], placed: Placement
) -> tuple[ContactRegion, ...]:
    """Make the regions of all fingers, in the pieces' units."""
    return tuple(
        region(piece, cone, placed, finger)
        for finger, (piece, cone) in enumerate(zip(pieces, cones, strict=True))
    )


def point_region(_: FacePiece, __: ForceCone, placed: Placement, finger: int) -> ContactRegion:
    """Make a region of one point, the contact itself."""
    return ContactRegion("point", placed.positions[finger][None], 0.0)


CONSTRUCTIONS: dict[Family, Construction] = {
    "concurrent": Construction(
        "concurrent", AS_LISTED, place_concurrent, slice(0, 1), None, _cone_region
    ),
    "pencil": Construction("pencil", PAIRINGS, place_pencil, slice(1, 4), None, _disc_region),
    "regulus": Construction(
        "regulus", PAIRINGS, lambda pieces, cones, _: place_regulus(pieces, cones), None,
        nearly_symmetric, point_region,
    ),
}  # fmt: skip
MIXED = replace(CONSTRUCTIONS["concurrent"], place=place_on_mixed_sides)
"""Construction of concurrent grasps with the focus before some fingers and behind the others."""


Ask: TypeAlias = tuple[FaceQuadruple, Sequence[ForceCone], float]
"""One attempt: faces in finger order, a force cone on each, and the least radius that counts."""
MOST_CHOICES = 8
"""Most choices of pieces tried on faces that are not convex; the free method multiplies it by
`max_face_parts`."""

LEAST_FACET = 1e-5
"""Least radius of the largest disc in a part of a triangle (object size one); smaller parts are
left out."""
ON_EDGE = 1e-12
"""Distance outside an edge, in lengths and volumes of an object of size one, at which a line still
meets both triangles beside the edge: a thousand rounding errors. The first of them that is large
enough counts."""

Cones: TypeAlias = tuple[ForceCone, ForceCone, ForceCone, ForceCone]
Settled: TypeAlias = tuple[tuple[FacePiece, ...], Cones, Placement, tuple[ContactRegion, ...]]
"""Convex pieces of four faces, force cones, contacts, and the regions of the fingers."""
Planned: TypeAlias = tuple[
    tuple[FacePiece, ...], Cones, Placement, tuple[ContactRegion, ...] | None
]
"""A settled placement whose regions may be None: the construction then chooses them."""


class Known(NamedTuple):
    """What compiled code says about one attempt: contacts with regions, or that there are none."""

    placement: Placement | None
    regions: tuple[ContactRegion, ...] | None
    """Regions of the fingers, in the pieces' units; None where they are left to the construction.
    """


@dataclass(frozen=True, eq=False)
class ManyPlacements:
    """Places contacts on convex pieces, one for each face of an object."""

    pieces: Sequence[FacePiece | None]  # the piece of each face; None for faces without room

    def of(self, construction: Construction, asked: Sequence[Ask]) -> list[Known | None]:
        """Place contacts for each attempt; None where that is left to the construction itself."""
        if construction.limits is None or not asked:
            return [None] * len(asked)
        attempts = Attempts(
            np.array([faces for faces, _, _ in asked], dtype=np.int64),
            np.array([[cone.axis for cone in cones] for _, cones, _ in asked]),
            np.array([cones[0].half_angle for _, cones, _ in asked]),
        )
        least = np.array([each for _, _, each in asked])
        placed = room_for(len(asked))
        if construction.family == "pencil":
            kernel = compiled("grasp_core.families.pencil_kernel")
            kernel.place(self._table, attempts, LEAST_RADIUS, least, placed)
            regions = self._discs(attempts, placed)
        else:
            turns = np.array(facet_turns(PYRAMID_SIDES))
            sides = MIXED_SIDES if construction is MIXED else (BEFORE, BEHIND)
            kernel = compiled("grasp_core.families.concurrent_kernel")
            kernel.place(self._table, attempts, turns, np.array(sides), least, placed)
            regions = self._footprints(attempts, turns, placed)
        alike = [len({cone.half_angle for cone in cones}) == 1 for _, cones, _ in asked]
        return [
            None if end == LEFT or not same else Known(_placement(placed, place, construction), on)
            for place, (end, same, on) in enumerate(
                zip(placed.ends.tolist(), alike, regions, strict=True)
            )
        ]

    def _discs(self, attempts: Attempts, placed: Placed) -> list[tuple[ContactRegion, ...] | None]:
        rings = placed.positions[:, :, None] + (
            placed.radii[:, :, None, None] * self._rings[attempts.faces]
        )
        counts = np.full(placed.radii.shape, DISC_CORNERS)
        return _regions("disc", Footprints(rings, counts, placed.radii), placed.ends)

    def _footprints(
        self, attempts: Attempts, turns: Array, placed: Placed
    ) -> list[tuple[ContactRegion, ...] | None]:
        most = self._table.E.shape[1] + len(turns) + 1
        shape = placed.radii.shape
        cut = Footprints(
            np.zeros((*shape, most, 3)), np.zeros(shape, dtype=np.int64), np.zeros(shape)
        )
        kernel = compiled("grasp_core.families.concurrent_kernel")
        kernel.footprints(self._table, attempts, turns, placed, cut)
        return _regions("cone", cut, placed.ends)

    @cached_property
    def _table(self) -> FaceTable:
        return face_table(self.pieces)

    @cached_property
    def _rings(self) -> Array:
        """Border points of a disc of radius one on each face, about its centre, (f, n, 3)."""
        return np.array([circle(DISC_CORNERS) @ frame.T for frame in self._table.frames])


def _placement(placed: Placed, place: int, construction: Construction) -> Placement | None:
    if placed.ends[place] != PLACED:
        return None
    foci = 2 if construction.family == "pencil" else 1
    return Placement(
        placed.positions[place], placed.forces[place], placed.foci[place, :foci],
        placed.radii[place], float(placed.merits[place]),
    )  # fmt: skip


def _regions(
    kind: RegionKind, cut: Footprints, ends: Indices
) -> list[tuple[ContactRegion, ...] | None]:
    """Make the regions of each attempt; None where a polygon has no corners."""
    cut.polygons.setflags(write=False)
    found: list[tuple[ContactRegion, ...] | None] = [None] * len(ends)
    counts, radii = cut.counts.tolist(), cut.radii.tolist()
    for place in np.flatnonzero((ends == PLACED) & (cut.counts.min(axis=1) > 0)).tolist():
        found[place] = four(
            trusted(
                ContactRegion,
                kind=kind,
                polygon=cut.polygons[place, finger, : counts[place][finger]],
                inscribed_radius=radii[place][finger],
            )
            for finger in range(FINGERS)
        )
    return found


@dataclass(frozen=True, slots=True)
class Attempt:
    """One order of the fingers on four faces, with the force cones to try in a construction."""

    faces: FaceQuadruple  # the face that each finger touches
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
    planned: Planned | None = None  # the best contacts so far, on the planes of the faces
    settled: Settled | None = None  # contacts on the true surface; None where there are none
    solved: int = 0  # number of choices of pieces for which contacts were sought
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


def on_true_surface(
    shapes: Sequence[FaceShape],
    pieces: tuple[FacePiece, ...],
    cones: Sequence[ForceCone],
    planned: Placement,
    regions: Sequence[ContactRegion],
    place: Callable[[tuple[FacePiece, ...]], Placement | None],
) -> tuple[tuple[FacePiece, ...], Placement] | None:
    """Move a placement to the true surface; None if no contacts there hold the same grasp."""
    if all(shape.facets is None for shape in shapes):
        return pieces, planned
    along = [np.array([piece.normal for piece in pieces]), np.array([c.axis for c in cones])]
    for directions in along:
        given = zip(shapes, pieces, planned.positions, directions, regions, strict=True)
        chosen = tuple(facet for each in given if (facet := _facet(*each)) is not None)
        if len(chosen) < len(pieces):
            continue
        found = _aimed(chosen, cones, planned, directions) or place(chosen)
        if found is not None:
            return chosen, replace(found, radii=planned.radii, merit=planned.merit)
    return None


def _aimed(
    facets: Sequence[FacePiece], cones: Sequence[ForceCone], planned: Placement, directions: Array
) -> Placement | None:
    """Aim from contacts above or below the planned ones at the planned focus; None on failure."""
    if len(planned.foci) != 1:
        return None
    heights = [
        float(facet.normal @ (facet.origin - at)) / float(facet.normal @ along)
        for facet, at, along in zip(facets, planned.positions, directions, strict=True)
    ]
    positions = planned.positions + np.array(heights)[:, None] * directions
    ways = planned.foci[0] - positions
    axes = np.array([cone.axis for cone in cones])
    inward = np.einsum("ki,ki->k", ways, axes)
    cosines = np.abs(inward) / np.linalg.norm(ways, axis=1)
    if (cosines < np.cos([cone.half_angle for cone in cones])).any() or not all(
        facet.inset(at) >= -ON_EDGE for facet, at in zip(facets, positions, strict=True)
    ):
        return None
    forces = balanced_forces(facets, np.sign(inward)[:, None] * ways)
    return replace(planned, positions=positions, forces=forces)


def _facet(
    shape: FaceShape, piece: FacePiece, at: Array, along: Array, region: ContactRegion
) -> FacePiece | None:
    """Cut the surface triangle on the line through a point to a region, or return None."""
    if shape.facets is None:
        return piece
    parts = (_part(piece, triangle, region) for triangle in _hit(shape.facets, at, along))
    return next((part for part in parts if part is not None), None)


def _part(piece: FacePiece, triangle: Array, region: ContactRegion) -> FacePiece | None:
    """Return the part of a triangle that is over a region; None if it is too small."""
    cross = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    facet = piece_of(piece.face, cross / np.linalg.norm(cross), triangle)
    claimed = (region.polygon - piece.origin) @ piece.frame
    E, b = edge_rows(claimed) if len(claimed) > 1 else (piece.E, piece.b)
    rows = E @ piece.frame.T
    inside = clip(facet.corners, rows @ facet.frame, b - rows @ (facet.origin - piece.origin))
    inside = tidy(inside)
    if len(inside) < 3:  # noqa: PLR2004 - not a polygon
        return None
    part = piece_of(piece.face, facet.normal, facet.origin + inside @ facet.frame.T)
    return part if part.inradius > LEAST_FACET else None


def _hit(triangles: Array, point: Array, along: Array) -> Array:
    """Return the triangles that a line meets, those nearest to a given point first, (k, 3, 3)."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    sides = np.cross(edges, point - triangles) @ along
    normals = np.cross(edges[:, 0], edges[:, 1])
    met = np.flatnonzero((sides >= -ON_EDGE).all(axis=1) & (normals @ along > 0.0))
    heights: Array = ((triangles[met, 0] - point) * normals[met]).sum(axis=1)
    heights = heights / (normals[met] @ along)
    nearest_first = sorted(range(len(met)), key=graded(np.abs(heights)).__getitem__)
    return triangles[met[nearest_first]]
