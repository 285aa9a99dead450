"""Splits an object's faces into convex pieces, moved and scaled so that the object has size one.

All linear programs work on these pieces, so their tolerances mean the same for every object.

Faces are also shrunk before planning: by a margin along edges, or into two halves for two fingers.
Then the face counts twice, as two halves with a gap between them. It is cut once, across its
longest direction and in its middle. Grasps found on the halves hold for the face. If none are
found, nothing is proved, as other cuts were not tried.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, product
from typing import Annotated, TypeAlias

import numpy as np

from grasp_core.arrays import Amount, Array, Indices, Point, Shape, UnitVector
from grasp_core.declared import Declared, declared
from grasp_core.geometry.polygons import (
    FEWEST_CORNERS,
    MOST_CORNERS,
    SAME_CORNER,
    clip,
    convex_hull,
    convex_polygon,
    edge_rows,
    has_inscribed_radius,
    merge_into_convex_pieces,
    plane_frame,
)
from grasp_core.objects.booleans import inset_figure, triangulate
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.solvers.lp import LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import first_best, graded
from grasp_core.values import FINGERS

LEAST_INRADIUS = 1e-6
"""Least radius of the largest disc in a piece that can hold a contact (object size one)."""
SOUND = 1e-9
"""Largest disagreement of a piece's fields that counts as rounding, relative to a small piece."""

SAME_PLACE = 6
"""Digits to which distances are compared (object size one); the order of the pieces breaks ties."""
LARGEST_INSET = 0.5
"""Largest distance that a contact keeps from edges, in radii of the piece's largest disc."""


@declared
class FacePiece(Declared):
    """One convex piece of a face: the points origin + frame @ y for all y with E y <= b."""

    face: int  # index in the polyhedron of the face that the piece belongs to
    normal: UnitVector  # unit vector into the object, (3,)
    origin: Point  # the point of the plane whose plane coordinates are zero, (3,)
    frame: Annotated[Array, Shape(3, 2)]
    """Orthonormal columns spanning the plane, the first along an edge, (3, 2).

    The frame is tied to the object: the pyramids inscribed in force cones turn with it.
    """
    corners: Annotated[Array, Shape(None, 2)]
    """Corners in plane coordinates, (k, 2), counter-clockwise in `frame`. For a mirrored piece the
    frame is mirrored too."""
    E: Annotated[Array, Shape("k", 2, units=True)]  # outward edge normals, (k, 2)
    b: Annotated[Array, Shape("k")]
    """Distances of the edges from the origin of the plane coordinates: E y <= b inside, (k,)."""
    inradius: Amount  # radius of the largest disc in the piece
    spread: float = 0.0  # largest angle between the true surface and the plane [rad]
    depth: float = 0.0  # largest distance of the true surface from the plane

    def _is_consistent(self) -> bool:
        """Return whether the fields describe one polygon; spread and depth are not checked."""
        count, rows = len(self.corners), len(self.E)
        with np.errstate(all="ignore"):
            if not FEWEST_CORNERS <= min(count, rows) <= max(count, rows) <= MOST_CORNERS:
                return False
            axes = np.column_stack([self.frame, self.normal])
            return bool(np.abs(axes.T @ axes - np.eye(3)).max() <= SOUND) and self._is_polygon()

    def _is_polygon(self) -> bool:
        """Return whether `corners` and `inradius` fit the polygon {y : E y <= b}."""
        slack = SOUND * min(1.0, float(np.linalg.norm(np.ptp(self.corners, axis=0))))
        polygon = convex_polygon(self.corners, slack)
        if polygon is None:
            return False
        below = polygon.corners @ self.E.T - self.b
        bordered = (np.abs(below) <= slack) & (np.abs(np.roll(below, -1, axis=0)) <= slack)
        within = float(below.max()) <= slack and bool(bordered.any(axis=1).all())
        return within and has_inscribed_radius(polygon, self.inradius)

    def point(self, y: Array) -> Array:
        """Return the point in space, (3,), with plane coordinates `y`, (2,)."""
        return self.origin + self.frame @ y

    def places(self, corners: Array) -> Array:
        """Return the points in space, (c, 3), with plane coordinates `corners`, (c, 2)."""
        return self.origin + corners @ self.frame.T

    def in_plane(self, point: Array) -> Array:
        """Return the plane coordinates, (2,), of a point of the plane, (3,)."""
        return self.frame.T @ (point - self.origin)

    def inset(self, point: Array) -> float:
        """Return the distance of a point from the nearest edge line; negative outside the piece."""
        return float((self.b - self.E @ self.in_plane(point)).min())


@dataclass(frozen=True, slots=True, eq=False)
class FaceShape:
    """One face as convex pieces that are large enough for a contact, and as their hull."""

    pieces: tuple[FacePiece, ...]
    hull: FacePiece
    """Convex hull of the pieces: what is impossible on it is impossible on every piece."""
    facets: Array | None = None
    """Corners of the triangles over a curved patch, wound as the piece, (f, 3, 3); None for an
    exactly planar face."""


Shapes: TypeAlias = Sequence[FaceShape | None]
"""The shape of each face of an object; None for faces too narrow for a contact."""


def face_shapes(body: Polyhedron) -> tuple[FaceShape | None, ...]:
    """Split each face of an object into convex pieces; None for a face too small for a contact."""
    corners = (body.vertices - body.center_of_mass)[body.triangles[:, ::-1]] / body.radius
    return tuple(
        replace(shape_of(pieces), facets=corners[face.facets] if len(face.facets) else None)
        if pieces
        else None
        for face, pieces in zip(body.faces, pieces_by_face(body), strict=True)
    )


def shape_of(pieces: Sequence[FacePiece]) -> FaceShape:
    """Combine convex pieces of one plane and their convex hull into a `FaceShape`."""
    first = pieces[0]
    if len(pieces) == 1:
        return FaceShape((first,), first)
    points = np.vstack([piece.places(piece.corners) for piece in pieces])
    corners = convex_hull((points - first.origin) @ first.frame)
    E, b = edge_rows(corners)
    inradius = inscribed_radius(E, b)
    hull = replace(first, corners=corners, E=E, b=b, inradius=inradius)
    return FaceShape(tuple(pieces), hull)


def choices_near(
    shapes: Sequence[FaceShape], positions: Array, most: int
) -> list[tuple[FacePiece, ...]]:
    """List choices of one piece per face, those nearest to given points of the planes first."""
    ranked: list[list[FacePiece]] = []
    for shape, at in zip(shapes, positions, strict=True):
        apart = [graded(-piece.inset(at), SAME_PLACE) for piece in shape.pieces]
        order = sorted(range(len(apart)), key=apart.__getitem__)
        ranked.append([shape.pieces[place] for place in order[:most]])
    every = product(*(range(len(each)) for each in ranked))
    ranks = sorted(every, key=lambda rank: (sum(rank), rank))[:most]
    return [tuple(each[place] for each, place in zip(ranked, rank, strict=True)) for rank in ranks]


def deepest(pieces: Sequence[FacePiece], point: Array) -> FacePiece:
    """Return the piece of a face that a point is deepest in, the first of equal ones."""
    return pieces[first_best([piece.inset(point) for piece in pieces], SAME_CORNER)]


def inset_piece(piece: FacePiece, inset: float) -> FacePiece:
    """Cut off the part of a piece that is too near its edges."""
    away = min(inset, LARGEST_INSET * piece.inradius)
    b = piece.b - away
    corners = clip(piece.corners, piece.E, b)
    return replace(piece, corners=corners, b=b, inradius=piece.inradius - away)


def unit_pieces(body: Polyhedron) -> tuple[FacePiece, ...]:
    """List convex pieces with room for a contact, about the centre of mass, over the radius."""
    return tuple(chain.from_iterable(pieces_by_face(body)))


def pieces_by_face(body: Polyhedron) -> tuple[tuple[FacePiece, ...], ...]:
    """List the pieces of `unit_pieces` for each face."""
    found: list[tuple[FacePiece, ...]] = []
    for index, face in enumerate(body.faces):
        polygons = ((polygon - body.center_of_mass) / body.radius for polygon in face.pieces)
        pieces = (
            piece_of(index, face.normal, polygon, face.spread, face.depth / body.radius)
            for polygon in polygons
        )
        found.append(tuple(piece for piece in pieces if piece.inradius > LEAST_INRADIUS))
    return tuple(found)


def piece_of(
    face: int, normal: Array, polygon: Array, spread: float = 0.0, depth: float = 0.0
) -> FacePiece:
    """Make the `FacePiece` of a convex polygon (k, 3)."""
    edge = polygon[1] - polygon[0]
    along = np.asarray(edge / np.linalg.norm(edge), dtype=np.float64)
    frame = np.column_stack([along, np.cross(normal, along)])
    origin = polygon.mean(axis=0)
    corners = (polygon - origin) @ frame
    E, b = edge_rows(corners)
    return FacePiece(
        face, normal, origin, frame, corners, E, b, inscribed_radius(E, b), spread, depth
    )


def inscribed_radius(E: Array, b: Array) -> float:
    """Compute the radius of the largest disc in {y : E y <= b}."""
    rows = np.column_stack([E, np.ones(len(E))])
    best = maximize(LinearProgram(np.array([0.0, 0.0, 1.0]), rows, b))
    return max(best.value, 0.0) if isinstance(best, Optimum) else 0.0  # thin pieces round to -1e-13


LONGEST_SHARE = 1.0 - 1e-6
"""Share of the largest length from which two count as equal; the first of equal ones is taken."""


def with_halves(body: Polyhedron, apart: float) -> tuple[Polyhedron, tuple[int, ...]]:
    """Add halves of faces that are long enough for two contacts; also list each face's owner."""
    faces, owners = list(body.faces), list(range(len(body.faces)))
    for index, face in enumerate(body.faces):
        halves = _halves(face, apart)
        faces += halves
        owners += [index] * len(halves)
    return replace(body, faces=tuple(faces)), tuple(owners)


def shared_quadruples(owners: Sequence[int]) -> Indices:
    """List face quadruples with both halves of one face, or of two faces, (q, 4)."""
    whole = [index for index, owner in enumerate(owners) if index == owner]
    halves: dict[int, list[int]] = {}
    for index, owner in enumerate(owners):
        if index != owner:
            halves.setdefault(owner, []).append(index)
    found = [
        (*others, *pair)
        for owner, pair in halves.items()
        for others in combinations([index for index in whole if index != owner], 2)
    ]
    found += [(*one, *two) for one, two in combinations(halves.values(), 2)]
    return np.array(found, dtype=np.int64).reshape(-1, FINGERS)


def _halves(face: Face, apart: float) -> list[Face]:
    frame = plane_frame(face.normal)
    pieces = [(piece - face.centroid) @ frame for piece in face.pieces]
    if not pieces:
        return []
    # along the line between the two corners that are farthest apart
    border = (face.polygon - face.centroid) @ frame
    gaps = np.linalg.norm(border[:, None] - border[None], axis=2)
    i, j = np.argwhere(gaps >= LONGEST_SHARE * gaps.max())[0]
    along = (border[j] - border[i]) / gaps[i, j]
    heights = np.concatenate(pieces) @ along
    middle = 0.5 * float(heights.min() + heights.max())
    halves: list[Face] = []
    for side in (-1.0, 1.0):
        limit = np.array([side * middle - 0.5 * apart])
        parts = [clip(piece, side * along[None], limit) for piece in pieces]
        parts = [part for part in parts if len(part) > 2]  # noqa: PLR2004 - else not a polygon
        if parts:
            polygon, *pieces_here = (
                face.centroid + part @ frame.T for part in (convex_hull(np.vstack(parts)), *parts)
            )
            halves.append(replace(face, polygon=polygon, holes=(), pieces=tuple(pieces_here)))
    return halves if len(halves) == 2 else []  # noqa: PLR2004 - both or none


def clear_of_edges(body: Polyhedron, margin: float) -> Polyhedron:
    """Shrink an object's faces so that contacts keep a distance from all edges and holes."""
    faces: list[Face] = []
    for face in body.faces:
        frame, pieces = plane_frame(face.normal), list[Array]()
        loops = [(loop - face.centroid) @ frame for loop in (face.polygon, *face.holes)]
        for figure in inset_figure(loops, margin):
            convex = merge_into_convex_pieces(np.vstack(figure), triangulate(figure))
            pieces += [face.centroid + piece @ frame.T for piece in convex]
        faces.append(replace(face, pieces=tuple(pieces)))
    return replace(body, faces=tuple(faces))
