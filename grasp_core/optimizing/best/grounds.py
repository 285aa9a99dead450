"""Says where on an object's faces contacts may be: convex polygons clear of the edges.

A contact keeps a stated distance from the edges of its face, or half the radius of the largest disc
in the face where that is less. Faces that are not convex are cut into convex pieces afterwards, so
that contacts may be on the lines between these.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, Indices, frozen, frozen_indices, is_array, is_indices
from grasp_core.by_value import ByValue
from grasp_core.errors import InputError
from grasp_core.objects.face_pieces import FacePiece, inset_piece, pieces_by_face, unit_pieces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import clear_of_edges

ROOM = 24
"""Room for the corners of a polygon, that of the compiled cuts."""
MOST_AT_FIRST = 12
"""Largest number of corners of a piece before any cut; larger ones are divided."""
MOST_PIECES = 128
UNIT = 1e-9
"""Largest deviation of normals and frames from orthonormal."""
LARGEST = 2.0
"""Largest coordinate of a point, in object radii."""
HALF = 0.5
SEARCH_DIGITS = 11
"""Digits after the point that a search is given of polygons (see `support_cuts`)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Grounds(ByValue):
    """Convex polygons on which contacts may be, at unit size about the centre of mass."""

    faces: Indices
    """The face of each polygon, (p,)."""
    normals: Array
    """Inward unit normals, (p, 3)."""
    origins: Array
    """Points whose plane coordinates are zero, (p, 3)."""
    frames: Array
    """Orthonormal columns that span the planes, (p, 3, 2)."""
    corners: Array
    """Corners in plane coordinates, in order, zero where there are fewer, (p, 24, 2)."""
    counts: Indices
    """How many corners each has, (p,)."""

    def __post_init__(self) -> None:
        shapes = {"normals": (None, 3), "origins": (None, 3), "frames": (None, 3, 2),
                  "corners": (None, ROOM, 2)}  # fmt: skip
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen(getattr(self, name), shape, name))
        for name in ("faces", "counts"):
            object.__setattr__(self, name, frozen_indices(getattr(self, name), (None,), name))

    def sound(self) -> bool:
        """Return whether these are convex polygons in planes, at about unit size."""
        n = len(self.counts) if is_indices(self.counts, None) else 0
        if not (
            0 < n <= MOST_PIECES
            and is_indices(self.faces, n)
            and is_array(self.normals, n, 3)
            and is_array(self.origins, n, 3)
            and is_array(self.frames, n, 3, 2)
            and is_array(self.corners, n, ROOM, 2)
            and bool((self.counts >= 3).all() and (self.counts <= ROOM).all())  # noqa: PLR2004
        ):
            return False
        axes = np.concatenate([self.frames, self.normals[:, :, None]], axis=2)
        square = axes.transpose(0, 2, 1) @ axes
        sizes = max(float(np.abs(self.origins).max()), float(np.abs(self.corners).max()))
        upright = np.abs(square - np.eye(3)).max() <= UNIT and sizes <= LARGEST
        return bool(upright) and all(map(_is_convex, self.polygons()))

    def polygons(self) -> list[Array]:
        """Return the corners of each polygon in its plane, (k, 2) each."""
        return [rows[:count] for rows, count in zip(self.corners, self.counts, strict=True)]

    def places(self, piece: int, at: Array) -> Array:
        """Return points in space, (k, 3), of plane coordinates of a piece, (k, 2)."""
        return self.origins[piece] + at @ self.frames[piece].T


def grounds_of(body: Polyhedron, clearance: float) -> Grounds:
    """Return where contacts may be on an object.

    Takes `clearance` [m].
    """
    pieces: list[FacePiece] = []
    for face, rooms in enumerate(pieces_by_face(body)):
        if len(rooms) == 1:
            pieces.append(inset_piece(rooms[0], clearance / body.radius))
        elif rooms:
            depth = max(room.inradius for room in rooms) * body.radius
            margin = min(clearance, HALF * depth)
            alone = replace(body, faces=(body.faces[face],))
            for piece in unit_pieces(clear_of_edges(alone, margin)):
                pieces.append(replace(piece, face=face))
    return grounds_on(pieces)[0]


def grounds_on(pieces: Sequence[FacePiece]) -> tuple[Grounds, Indices]:
    """Return convex pieces as polygons of few corners, and the place of each one's piece, (p,)."""
    parts = [(k, part) for k, piece in enumerate(pieces) for part in _small(piece.corners)]
    if not 0 < len(parts) <= MOST_PIECES:
        raise InputError(
            f"expected an object whose faces have 1 to {MOST_PIECES} convex pieces with room for a "
            f"contact, got {len(parts)}; take an object with fewer faces"
        )
    corners = np.zeros((len(parts), ROOM, 2))
    for rows, (_, part) in zip(corners, parts, strict=True):
        rows[: len(part)] = part
    own = np.array([k for k, _ in parts])
    grounds = Grounds(
        faces=np.array([piece.face for piece in pieces])[own],
        normals=np.array([piece.normal for piece in pieces])[own],
        origins=np.array([piece.origin for piece in pieces])[own],
        frames=np.array([piece.frame for piece in pieces])[own],
        corners=corners,
        counts=np.array([len(part) for _, part in parts]),
    )
    return grounds, own


def _small(corners: Array) -> list[Array]:
    """Divide a convex polygon into ones of few corners, by chords."""
    if len(corners) <= MOST_AT_FIRST:
        return [corners]
    half = len(corners) // 2
    return [*_small(corners[: half + 1]), *_small(np.vstack([corners[half:], corners[:1]]))]


def _is_convex(corners: Array) -> bool:
    """Return whether a polygon turns one way at all corners, and once around in all."""
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    along = (edges * following).sum(axis=1)
    angles = np.arctan2(turns, along)
    one_way = (angles > -UNIT).all() or (angles < UNIT).all()
    return bool(one_way and abs(abs(float(angles.sum())) - 2.0 * np.pi) < UNIT)
