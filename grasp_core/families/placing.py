"""Places contacts for many attempts of one construction, with the regions of the fingers.

The paper's three constructions have one interface here, `Construction`, which the planner uses.
Compiled code solves their programs and checks its answers by their residuals; an attempt whose
answers fail the check is undecided. Of several choices of cones and pieces the best contacts count.

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
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.cones.pyramids import PYRAMID_SIDES
from grasp_core.declared import trusted
from grasp_core.errors import SolverError
from grasp_core.families.placements import (
    LEAST_RADIUS,
    NOT_DECIDED,
    NOTHING_HELD,
    PAIRINGS,
    Attempts,
    FaceTable,
    FingerOrder,
    Footprints,
    Placed,
    Placement,
    face_table,
    room_for,
)
from grasp_core.geometry.polygons import circle, clip, edge_rows, tidy
from grasp_core.objects.face_pieces import (
    FacePiece,
    FaceShape,
    Shapes,
    choices_near,
    inscribed_radius,
    piece_of,
)
from grasp_core.solvers.lp import LP_RESIDUAL
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

PLACING_KERNEL = "grasp_core.families.placing_kernel"
DISCS = "grasp_core.families.discs_kernel"
REGULUS_KERNEL = "grasp_core.families.regulus_kernel"
AS_LISTED: tuple[FingerOrder, ...] = ((0, 1, 2, 3),)
ALL_BEFORE, ALL_BEHIND = np.ones(FINGERS), -np.ones(FINGERS)
MIXED_SIDES = np.array([s for s in product((1.0, -1.0), repeat=FINGERS) if abs(sum(s)) < FINGERS])
"""Patterns of a concurrent grasp: sides on which fingers have the focus, see `concurrent_kernel`.
"""
CELL_A, CELL_B = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])
"""Patterns of a pencil: signs of k u in the foci of the fingers, see `pencil_kernel`."""
DISC_CORNERS = 64
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

FourCones: TypeAlias = tuple[ForceCone, ForceCone, ForceCone, ForceCone]
FingerRegions: TypeAlias = tuple[ContactRegion, ...]
"""The regions of the fingers, in the pieces' units."""
Planned: TypeAlias = tuple[tuple[FacePiece, ...], FourCones, Placement]
"""Convex pieces of four faces, force cones and contacts."""
Settled: TypeAlias = tuple[tuple[FacePiece, ...], FourCones, Placement, FingerRegions]


@dataclass(frozen=True, slots=True)
class Construction:
    """The construction of one family, with what the planner needs for it."""

    family: Family
    region: RegionKind  # the kind of region that each finger gets
    orders: tuple[FingerOrder, ...]
    """Orders of the fingers on the same faces that give different grasps."""
    patterns: Array | None = None
    """Signs of the fingers in the programs of discs, (p, 4); None where no disc is claimed."""
    limits: slice | None = None
    """Columns of `disc_limits`, one per finger order; None where no disc is claimed."""
    admits: Callable[[Array, Array], NDArray[np.bool_]] | None = None
    """Function that returns for which quadruples a program may be feasible, (q,), from normals in
    finger order, (q, 4, 3), and half-angles, (q,) [rad]; None for all."""

    @property
    def least(self) -> float:
        """Return the merit that a placement must exceed to count."""
        return LEAST_RADIUS if self.limits else -math.inf

    def placed(self, table: FaceTable, attempts: Attempts, least: Array) -> Placed:
        """Place contacts for each attempt, with merits of at least `least`, (a,)."""
        placed = room_for(len(least))
        if self.patterns is None:
            compiled(REGULUS_KERNEL).place(table, attempts, placed)
        else:
            pencil = self.family == "pencil"
            compiled(PLACING_KERNEL).place(pencil, table, attempts, self.patterns, least, placed)
        return placed

    def bounds(self, table: FaceTable, attempts: Attempts, least: float) -> Array:
        """Bound the merits of many attempts from above, (a,); above `least` tightly.

        Of discs this is the value of their first program. Where faces have several pieces, hulls
        stand for them: they offer no less than any piece. For reguli the bounds are infinite or,
        where no slopes are feasible, minus infinity.
        """
        attempts = Attempts._make(map(np.ascontiguousarray, attempts))
        bounds = np.empty(len(attempts.faces))
        if self.patterns is None:
            compiled(REGULUS_KERNEL).regulus_bounds(table, attempts, bounds)
        else:
            pencil = self.family == "pencil"
            compiled(PLACING_KERNEL).bounds(pencil, table, attempts, self.patterns, least, bounds)
        # a proved bound may be off by what the check of multipliers allows
        return bounds + LP_RESIDUAL

    def one_of(self, placed: Placed, a: int) -> Placement | None:
        """Return what was placed for one attempt, or None if there is nothing as good as asked."""
        if placed.ends[a] == NOT_DECIDED:
            raise SolverError("a program was neither solved nor proved infeasible")
        if placed.ends[a] == NOTHING_HELD:
            return None
        foci = placed.foci[a, : 1 if self.family == "concurrent" else 2]
        merit = float(placed.merits[a])
        return Placement(placed.positions[a], placed.forces[a], foci, placed.radii[a], merit)

    def place(
        self, pieces: Sequence[FacePiece], cones: Sequence[ForceCone], least: float = -math.inf
    ) -> Placement | None:
        """Place contacts on four pieces; None if there are none with the least merit."""
        attempts = attempts_of([(AS_LISTED[0], cones)])
        return self.one_of(self.placed(face_table(pieces), attempts, np.array([least])), 0)


def nearly_symmetric(axes: Array, half_angles: Array) -> NDArray[np.bool_]:
    """Return whether both pairs of each quadruple leave their slopes a choice, (q,)."""
    found = np.empty(len(axes), dtype=np.bool_)
    kernel = compiled(REGULUS_KERNEL)
    kernel.nearly_symmetric(np.ascontiguousarray(axes), np.ascontiguousarray(half_angles), found)
    return found


CONSTRUCTIONS: dict[Family, Construction] = {
    "concurrent": Construction(
        "concurrent", "cone", AS_LISTED, np.array([ALL_BEFORE, ALL_BEHIND]), slice(0, 1)
    ),
    "pencil": Construction("pencil", "disc", PAIRINGS, np.array([CELL_A, CELL_B]), slice(1, 4)),
    "regulus": Construction("regulus", "point", PAIRINGS, admits=nearly_symmetric),
}
MIXED = replace(CONSTRUCTIONS["concurrent"], patterns=MIXED_SIDES)
"""Construction of concurrent grasps with the focus before some fingers and behind the others. This
is for faces on which nothing else was found; on convex objects it hardly ever finds anything."""


def attempts_of(asked: Sequence[tuple[FaceQuadruple, Sequence[ForceCone]]]) -> Attempts:
    """List attempts, at least one; of cones with different half-angles the least one holds."""
    return Attempts(
        np.array([faces for faces, _ in asked], dtype=np.int64),
        np.array([[cone.axis for cone in cones] for _, cones in asked]),
        np.array([min(cone.half_angle for cone in cones) for _, cones in asked]),
    )


def point_regions(placement: Placement) -> FingerRegions:
    """Make regions of one point each, the contacts themselves."""
    return tuple(ContactRegion("point", at[None], 0.0) for at in placement.positions)


def regions_of(kind: RegionKind, planned: Sequence[Planned]) -> list[FingerRegions]:
    """Make the regions of the fingers for many placements."""
    if kind == "point" or not planned:
        return [point_regions(placement) for _, _, placement in planned]
    pieces = list({id(piece): piece for chosen, _, _ in planned for piece in chosen}.values())
    places = {id(piece): place for place, piece in enumerate(pieces)}
    attempts = attempts_of(
        [(four(places[id(piece)] for piece in chosen), cones) for chosen, cones, _ in planned]
    )
    positions = np.array([placement.positions for _, _, placement in planned])
    if kind == "disc":
        frames = np.array([piece.frame for piece in pieces])[attempts.faces]
        radii = np.array([placement.radii for _, _, placement in planned])
        rings = radii[..., None, None] * np.einsum("nt,afjt->afnj", circle(DISC_CORNERS), frames)
        cut = Footprints(positions[:, :, None] + rings, np.full(radii.shape, DISC_CORNERS), radii)
    else:
        foci = np.array([placement.foci[0] for _, _, placement in planned])
        cut = _footprints(pieces, attempts, foci, positions)
    cut.polygons.setflags(write=False)
    return [
        four(
            trusted(
                ContactRegion, kind=kind, polygon=polygon[:count], inscribed_radius=float(radius)
            )
            for polygon, count, radius in zip(*each, strict=True)
        )
        for each in zip(*cut, strict=True)
    ]


def _footprints(
    pieces: Sequence[FacePiece], attempts: Attempts, foci: Array, positions: Array
) -> Footprints:
    table, shape = face_table(pieces), attempts.faces.shape
    most = table.E.shape[1] + PYRAMID_SIDES + 1
    cut = Footprints(np.zeros((*shape, most, 3)), np.zeros(shape, np.int64), np.zeros(shape))
    kernel = compiled("grasp_core.families.concurrent_kernel")
    kernel.footprints(table, attempts, foci, positions, cut)
    for a, finger in np.argwhere(~np.isfinite(cut.radii)).tolist():
        piece, count = pieces[int(attempts.faces[a, finger])], cut.counts[a, finger]
        flat = (cut.polygons[a, finger, :count] - piece.origin) @ piece.frame
        cut.radii[a, finger] = inscribed_radius(*edge_rows(flat))
    return cut


@dataclass(frozen=True, slots=True)
class Attempt:
    """One order of the fingers on four faces, with the force cones to try in a construction."""

    faces: FaceQuadruple  # the face that each finger touches
    cones: tuple[FourCones, ...]
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
class ContactPlacing:
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
            self._place([(attempt.faces, attempt.cones[choice], end) for attempt, end in going])
            going = [(attempt, end) for attempt, end in going if not end.failed]
        self._settle(
            [
                (chosen_shapes(self.shapes, attempt.faces), end, end.planned)
                for attempt, end in zip(attempts, ends, strict=True)
                if end.planned is not None and not end.failed
            ]
        )
        return ends

    def _place(self, asked: Sequence[tuple[FaceQuadruple, FourCones, End]]) -> None:
        """Enter the contacts of one choice of cones where they are better than those before."""
        if not asked:
            return
        attempts = attempts_of([(faces, cones) for faces, cones, _ in asked])
        least = np.array([end.least for _, _, end in asked])
        placed = self.construction.placed(self.table, attempts, least)
        for a, (faces, cones, end) in enumerate(asked):
            try:
                end.solved += 1
                found = self._best(faces, cones, self.construction.one_of(placed, a), end)
            except SolverError:
                end.failed = True
                continue
            if found:
                end.planned, end.least = found, surpassing(found[2].merit)

    def _best(
        self, faces: FaceQuadruple, cones: FourCones, whole: Placement | None, end: End
    ) -> Planned | None:
        """Place contacts on the best choice of one convex piece per face; None unless above least.

        Where faces have several pieces, their hulls are tried first: a grasp that the hulls do not
        hold no piece holds, and the contacts on the hulls show which pieces are likely to be best.
        """
        construction, least = self.construction, end.least
        shapes = chosen_shapes(self.shapes, faces)
        if whole is None or not whole.merit > least:
            return None
        if all(len(shape.pieces) == 1 for shape in shapes):
            return tuple(shape.hull for shape in shapes), cones, whole
        best = None
        for chosen in choices_near(shapes, whole.positions, MOST_CHOICES):
            end.solved += 1
            if construction.limits is not None and min(piece.inradius for piece in chosen) < least:
                continue
            placed = construction.place(chosen, cones, least)
            if placed is not None and placed.merit > least:
                best, least = (chosen, cones, placed), surpassing(placed.merit)
        return best

    def _settle(self, done: Sequence[tuple[tuple[FaceShape, ...], End, Planned]]) -> None:
        """Enter the contacts on the true surface, with their regions."""
        construction = self.construction
        every = regions_of(construction.region, [planned for _, _, planned in done])
        least = 0.0 if construction.limits else -math.inf  # discs however small
        for (shapes, end, (chosen, cones, placement)), regions in zip(done, every, strict=True):
            place = partial(construction.place, cones=cones, least=least)
            try:
                found = on_true_surface(shapes, chosen, cones, placement, regions, place)
            except SolverError:
                end.failed = True
                continue
            end.settled = None if found is None else (found[0], cones, found[1], regions)

    @cached_property
    def table(self) -> FaceTable:
        """The convex hulls of all faces."""
        return face_table([shape.hull if shape else None for shape in self.shapes])


def chosen_shapes(shapes: Shapes, faces: FaceQuadruple) -> tuple[FaceShape, ...]:
    """Return the shapes of the faces that have room for a contact, in finger order."""
    return tuple(shape for face in faces if (shape := shapes[face]) is not None)


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
    normals, forces = np.array([facet.normal for facet in facets]), np.empty_like(ways)
    compiled(DISCS).balance(np.sign(inward)[:, None] * ways, normals, forces)
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
