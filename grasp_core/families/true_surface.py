"""Moves contacts on curved patches from the planes of the patches to the true surface.

Solved: given a placement on the planes of patches, a placement with the same force cones on the
triangles of the surface over the contacts, each within the region of its finger.

Why it exists. The planes were planned with friction cones that fit inside the cones of every
triangle over them, and with contacts anywhere within `depth` of the planes. So a concurrent grasp's
contacts on the surface can aim at the planned focus. Otherwise the construction is run again on the
triangles. Either way the contacts are on the surface, and are certified with the true normals.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.families.placements import Placement, balanced_forces
from grasp_core.geometry.polygons import clip, edge_rows, tidy
from grasp_core.objects.face_pieces import FacePiece, FaceShape, piece_of
from grasp_core.solvers.ties import graded
from grasp_core.values import ContactRegion, ForceCone

LEAST_FACET = 1e-5
"""Least radius of the largest disc in a part of a triangle (object size one); smaller parts are
left out."""
ON_EDGE = 1e-12
"""Distance outside an edge, in lengths and volumes of an object of size one, at which a line still
meets both triangles beside the edge: a thousand rounding errors. The first of them that is large
enough counts."""

OnFacets = Callable[[tuple[FacePiece, ...]], Placement | None]


def on_true_surface(
    shapes: Sequence[FaceShape],
    pieces: tuple[FacePiece, ...],
    cones: Sequence[ForceCone],
    planned: Placement,
    regions: Sequence[ContactRegion],
    place: OnFacets,
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
