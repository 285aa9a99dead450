"""Says where on an object's faces contacts may be, and which of these places are alike.

A contact keeps a stated distance from the edges of its face, or half the radius of the largest disc
in the face where that is less. Faces that are not convex are cut into convex pieces afterwards, so
that contacts may be on the lines between these.

A symmetry of the object moves contacts to others, of which only one set has to be looked at.
Solved: first nodes of a search that hold at least one image of every four contacts.

Derivation. A symmetry that maps every piece of the faces to a piece, and the loads that count to
such loads, keeps the measure of contacts. All keep wrenches of unit length, and the weight.
Let pieces that symmetries map to each other form an orbit, with its first piece for all. Of the
orbits on which contacts are, take the first, k. A symmetry moves a contact of this orbit to the
orbit's first piece r_k; call it finger 0. The others are on pieces of the orbits from k on. The
symmetries that keep r_k move finger 0 on it; of its images, one is nearest to a point q of the
piece, so that

    |x - q| <= |x - h q|   for all symmetries h that keep r_k,                            (1)

which is a half-plane for each h.

Each map is exact up to `EXACT_MAP`, in pieces, normals and products of maps, which a check of all
maps and products shows. Two maps are applied at most, so that contacts are moved to within 1e-8 of
others that the proof is about, with normals as near: their measure differs by less than 1e-7 (1 +
mu). Loads of a task are mapped to within `EXACT_MAP` of the longest load L, so that answers a(y) =
t d(y), t L <= 8 (1 + mu), of unit twists are off by less than 2e-8 (1 + mu); those of the moved
contacts are off by 5e-8 (1 + mu). Half-planes (1) are moved outwards by `WIDENED` for the same
reason.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np

from grasp_core.arrays import Array, Indices, Shape
from grasp_core.compiled import compiled
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import convex_polygon
from grasp_core.objects.face_pieces import (
    LARGEST_INSET,
    FacePiece,
    clear_of_edges,
    inset_piece,
    pieces_by_face,
    unit_pieces,
)
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import symmetries
from grasp_core.quality.measures import FERRARI_CANNY, Measure
from grasp_core.values import FINGERS

CORNER_ROOM = 24  # room for the corners of a polygon, that of the compiled cuts
MOST_AT_FIRST = 12
"""Largest number of corners of a piece before any cut; larger ones are divided."""
MOST_POLYGONS = 128
UNIT_SHAPE = 1e-9
"""Largest deviation of normals and frames from orthonormal, and of polygons from convex ones."""
LARGEST_COORDINATE = 2.0  # largest coordinate of a point, in object radii
POLYGON_DIGITS = 11
"""Digits after the point that a search is given of polygons (see `support_cuts`)."""
EXACT_MAP = 1e-9
"""Largest distance between a piece's corner, or normal, as a map moves it, and another's."""
WIDENED = 1e-8
MOST_MAPS = 128
ALONE = np.eye(3)[None]  # the symmetry that every object has, (1, 3, 3)
OFF_MIRRORS = (0.37, 0.11)
"""Shares of the ways to a piece's first two corners at which its point q is, off all mirrors."""
REPLAY = "grasp_core.optimizing.replay_kernel"
TWISTS = "grasp_core.optimizing.twists_kernel"


@declared
class Grounds(Declared):
    """Convex polygons on which contacts may be, at unit size about the centre of mass."""

    faces: Annotated[Indices, Shape("p", whole=True)]  # the face of each polygon, (p,)
    normals: Annotated[Array, Shape("p", 3)]  # inward unit normals, (p, 3)
    origins: Annotated[Array, Shape("p", 3)]
    """Points whose plane coordinates are zero, (p, 3)."""
    frames: Annotated[Array, Shape("p", 3, 2)]
    """Orthonormal columns that span the planes, (p, 3, 2)."""
    corners: Annotated[Array, Shape("p", CORNER_ROOM, 2)]
    """Corners in plane coordinates, in order, zero where there are fewer, (p, 24, 2)."""
    counts: Annotated[Indices, Shape("p", whole=True, least=3, most=CORNER_ROOM)]
    """How many corners each has, (p,)."""

    def _is_consistent(self) -> bool:
        """Return whether these are convex polygons in planes, at about unit size."""
        if not 0 < len(self.counts) <= MOST_POLYGONS:
            return False
        axes = np.concatenate([self.frames, self.normals[:, :, None]], axis=2)
        square = axes.transpose(0, 2, 1) @ axes
        sizes = max(float(np.abs(self.origins).max()), float(np.abs(self.corners).max()))
        upright = np.abs(square - np.eye(3)).max() <= UNIT_SHAPE and sizes <= LARGEST_COORDINATE
        return bool(upright) and all(convex_polygon(each, UNIT_SHAPE) for each in self.polygons())

    def polygons(self) -> list[Array]:
        """Return the corners of each polygon in its plane, (k, 2) each."""
        return [rows[:count] for rows, count in zip(self.corners, self.counts, strict=True)]

    def places(self, on: int | Indices, at: Array) -> Array:
        """Return points in space, (k, 3), of plane coordinates, (k, 2), of one piece or of each."""
        return self.origins[on] + np.einsum("...ij,...j->...i", self.frames[on], at)

    def supports(self, on: Indices, at: Array, friction: float, twists: Array) -> Array:
        """Compute the supports of the cones of contacts at places under twists, (k, n)."""
        points, normals = self.places(on, at), self.normals[on]
        u = twists[None, :, :3] + np.cross(twists[None, :, 3:], points[:, None])
        along = np.einsum("mnj,mj->mn", u, normals)
        across = np.linalg.norm(u - along[:, :, None] * normals[:, None], axis=2)
        return along + friction * across


def grounds_of(body: Polyhedron, clearance: float) -> Grounds:
    """Return where contacts may be on an object."""
    pieces: list[FacePiece] = []
    for face, rooms in enumerate(pieces_by_face(body)):
        if len(rooms) == 1:
            pieces.append(inset_piece(rooms[0], clearance / body.radius))
        elif rooms:
            depth = max(room.inradius for room in rooms) * body.radius
            margin = min(clearance, LARGEST_INSET * depth)
            alone = replace(body, faces=(body.faces[face],))
            for piece in unit_pieces(clear_of_edges(alone, margin)):
                pieces.append(replace(piece, face=face))
    return grounds_on(pieces)[0]


def grounds_on(pieces: Sequence[FacePiece]) -> tuple[Grounds, Indices]:
    """Return convex pieces as polygons of few corners, and the place of each one's piece, (p,)."""
    parts = [(k, part) for k, piece in enumerate(pieces) for part in _small(piece.corners)]
    if not 0 < len(parts) <= MOST_POLYGONS:
        raise InputError(
            f"expected an object whose faces have 1 to {MOST_POLYGONS} convex pieces with room for "
            f"a contact, got {len(parts)}; take an object with fewer faces"
        )
    corners = np.zeros((len(parts), CORNER_ROOM, 2))
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


def exact_maps(body: Polyhedron, grounds: Grounds, measure: Measure = FERRARI_CANNY) -> Array:
    """Return symmetries that map pieces and loads exactly enough, (g, 3, 3); only 1 if no group."""
    found = symmetries(body)
    every = np.concatenate([ALONE, found.rotations[1:], found.reflections])
    every = every[measure.keeps(every, EXACT_MAP)]
    kept = np.array([each for each in every if _images(each[None], grounds)[0].min() >= 0])
    return kept if len(kept) <= MOST_MAPS and fitting(kept, grounds, measure) else ALONE


def fitting(maps: Array, grounds: Grounds, measure: Measure = FERRARI_CANNY) -> bool:
    """Return whether maps are orthogonal, form a group, and keep the pieces and the loads."""
    if len(maps) > MOST_MAPS or np.abs(maps[0] - np.eye(3)).max() > 0.0:
        return False
    square = maps @ maps.transpose(0, 2, 1) - np.eye(3)
    if np.abs(square).max() > EXACT_MAP or (_images(maps, grounds) < 0).any():
        return False
    if not measure.keeps(maps, EXACT_MAP).all():
        return False
    products = np.einsum("aij,bjk->abik", maps, maps)
    return all(
        np.abs(products[a][:, None] - maps[None]).max(axis=(2, 3)).min(axis=1).max() <= EXACT_MAP
        for a in range(len(maps))
    )


def _images(maps: Array, grounds: Grounds) -> Indices:
    """Return the piece that each map moves each piece to, -1 if none, (g, p)."""
    polygons = grounds.polygons()
    in_space = [grounds.places(p, polygon) for p, polygon in enumerate(polygons)]
    found = np.full((len(maps), len(in_space)), -1)
    turned = grounds.normals @ maps.transpose(0, 2, 1)
    apart = np.abs(turned[:, :, None] - grounds.normals[None, None]).max(axis=3)
    for g, p, q in np.argwhere(apart <= EXACT_MAP).tolist():
        if len(in_space[p]) == len(in_space[q]):
            corners = in_space[p] @ maps[g].T
            off = np.abs(corners[:, None] - in_space[q][None]).max(axis=2)
            nearest = off.argmin(axis=1)
            near = off[np.arange(len(corners)), nearest].max() <= EXACT_MAP
            if near and len(set(nearest.tolist())) == len(corners):
                found[g, p] = q
    return found


def first_nodes(
    grounds: Grounds, maps: Array, owners: Indices | None = None
) -> tuple[Array, Indices, Indices]:
    """Return the nodes from which a search starts, one for each orbit of pieces.

    Without symmetries there is one, in which every finger may be anywhere, or on its own pieces.
    Gives corners of polygons, (c, 4, p, 24, 2), how many, (c, 4, p), and who is fresh, (c, 4).
    """
    pieces = len(grounds.counts)
    if owners is not None:
        counts = np.where(owners == np.arange(FINGERS)[:, None], grounds.counts, 0)[None]
        corners = np.where((counts > 0)[..., None, None], grounds.corners, 0.0)
        return corners, counts.astype(np.int64), np.zeros((1, FINGERS), dtype=np.int64)
    if len(maps) == 1:
        corners = np.broadcast_to(grounds.corners, (1, FINGERS, pieces, CORNER_ROOM, 2)).copy()
        counts = np.broadcast_to(grounds.counts, (1, FINGERS, pieces)).copy()
        return corners, counts, np.ones((1, FINGERS), dtype=np.int64)
    images = _images(maps, grounds)
    # a symmetry's inverse is one as well, so that the images of a piece are its orbit
    leaders = images.min(axis=0)
    firsts = np.flatnonzero(leaders == np.arange(pieces))
    corners = np.zeros((len(firsts), FINGERS, pieces, CORNER_ROOM, 2))
    counts = np.zeros((len(firsts), FINGERS, pieces), dtype=np.int64)
    fresh = np.ones((len(firsts), FINGERS), dtype=np.int64)
    fresh[:, 0] = 0
    for case, first in enumerate(firsts):
        later = leaders >= first
        corners[case, 1:, later] = grounds.corners[later][:, None]
        counts[case, 1:, later] = grounds.counts[later][:, None]
        polygon, count = _nearest_part(grounds, maps[images[:, first] == first], int(first))
        corners[case, 0, first], counts[case, 0, first] = polygon, count
    return corners, counts, fresh


def _nearest_part(grounds: Grounds, keeping: Array, piece: int) -> tuple[Array, int]:
    """Cut a piece to the part nearer to a point of it than to the point's images, by (1)."""
    clip = compiled(REPLAY).clip
    polygon, count = grounds.corners[piece].copy(), int(grounds.counts[piece])
    middle = polygon[:count].mean(axis=0)
    aside = sum(share * (polygon[k] - middle) for k, share in enumerate(OFF_MIRRORS))
    q = grounds.places(piece, (middle + aside)[None])[0]
    for turn in keeping[1:]:
        # (1): 2 x.(hq - q) <= |hq|^2 - |q|^2 with x = o + F p
        away = turn @ q - q
        limit = 0.5 * (float((turn @ q) @ (turn @ q)) - float(q @ q))
        line = np.array([*(away @ grounds.frames[piece]), limit - away @ grounds.origins[piece]])
        line[2] += WIDENED * float(np.linalg.norm(away))
        count = clip(polygon, count, line, 1.0)
    return polygon, count
