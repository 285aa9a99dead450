"""Puts faces and handedness of an object into an order that does not depend on its file.

Solved: an order of the faces, a first corner of each border and a handedness that depend on the
shape alone, so that the planner sees the same object when it is turned or mirrored, or when its
vertices and faces are listed in another order.

Method. A flag is a face with one of its corners, of the object or of its mirror image. It spans a
frame: the face's normal, the direction from the face's centre to the corner, and the direction
across both. In that frame each face has an area, a centre and a normal; their sorted list is what
the object looks like from there. The flag whose list comes first in lexicographic order is taken,
and the object is listed in its order. Numbers are compared by the cells they lie in (see `ties`).
Flags with the same list are symmetries of the object, so it makes no difference to its shape which
of them counts: the first in the order of the file does.

Only flags on the rarest kind of face, at its rarest kind of corner, are compared.

Faces are also shrunk here before planning: into two halves for two fingers, or by a margin along
edges. For two fingers on one face, the face counts twice, as two halves with a gap between them. It
is cut once, across its longest direction and in its middle. Grasps found on the halves hold for the
face. If none are found, nothing is proved, as other cuts were not tried.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.polygons import clip, convex_hull, merge_into_convex_pieces, plane_frame
from grasp_core.objects.booleans import inset_figure, triangulate
from grasp_core.objects.face_pieces import Shapes, face_shapes
from grasp_core.objects.planar_faces import convex_pieces, planar_slack
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.solvers.ties import graded
from grasp_core.values import FINGERS

FLIP = np.array([1.0, 1.0, -1.0])
"""Signs of the coordinates in the mirror image: only z changes its sign, which is exact."""
CELL_DIGITS = 6
"""Digits to which lengths (object size one) and cosines are compared."""
SHORTEST = 1e-3
"""Least distance of a corner from its face's centre at which their connecting line gives a
direction, in object radii."""

Cells: TypeAlias = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Standard:
    """An object in standard order, and the numbers that its faces have on the given object."""

    body: Polyhedron
    """The object with its faces in standard order; it may be the mirror image. Halves of faces,
    for two fingers on one face, come after all whole faces."""
    faces: tuple[int, ...]  # for each whole face of `body`, its number on the object as given
    mirrored: bool
    owners: tuple[int, ...]  # for each face of `body`, the whole face that it is or is a half of

    @cached_property
    def shapes(self) -> Shapes:
        """The shape of each face of `body`."""
        return face_shapes(self.body)

    @cached_property
    def shared(self) -> Indices:
        """Quadruples with both halves of one face, or of two faces, (s, 4)."""
        return shared_quadruples(self.owners)

    @property
    def quadruples(self) -> int:
        """Number of quadruples of whole faces, and of those with both halves of a face."""
        return math.comb(len(self.faces), FINGERS) + len(self.shared)


def standard(body: Polyhedron) -> Standard:
    """Put an object into standard order and handedness, which depend on its shape alone."""
    images = (body, mirror_image(body))
    views = ((image, flag_frame(image, *flag)) for image in images for flag in _rarest_flags(image))
    first = min(((_looks(image, frame), image, frame) for image, frame in views), default=None,
                key=lambda view: view[0])  # fmt: skip
    if first is None:
        faces = tuple(range(len(body.faces)))
        return Standard(body, faces, mirrored=False, owners=faces)
    _, image, frame = first
    order: list[int] = np.lexsort(_cells(image, frame).T[::-1]).tolist()
    extent = float(np.ptp(body.vertices, axis=0).max())
    slack = planar_slack(extent, body.surface.flatness_m)
    faces = tuple(_relisted(image.faces[face], image, frame, slack) for face in order)
    owners, body_in_order = tuple(range(len(faces))), replace(image, faces=faces)
    return Standard(body_in_order, tuple(order), mirrored=image is not body, owners=owners)


def mirror_image(body: Polyhedron) -> Polyhedron:
    """Make the mirror image of an object; its faces keep their numbers."""
    faces = tuple(
        replace(
            face,
            normal=face.normal * FLIP,
            centroid=face.centroid * FLIP,
            polygon=(face.polygon * FLIP)[::-1],
            holes=tuple((hole * FLIP)[::-1] for hole in face.holes),
            pieces=tuple((piece * FLIP)[::-1] for piece in face.pieces),
        )
        for face in body.faces
    )
    return replace(
        body,
        vertices=body.vertices * FLIP,
        triangles=body.triangles[:, ::-1],
        faces=faces,
        center_of_mass=body.center_of_mass * FLIP,
        inertia=body.inertia * np.outer(FLIP, FLIP),
    )


def flag_traits(body: Polyhedron) -> tuple[Array, list[Array]]:
    """Describe flags by numbers that no rotation or reflection changes, at object radius one.

    Gives each face's area, its plane's height over the centre of mass and the distance of its
    centre from there, (f, 3); and for each face the distances of its corners from its centre and
    from the centre of mass, (k, 2).
    """
    centers = np.array([face.centroid for face in body.faces]).reshape(-1, 3)
    away = (centers - body.center_of_mass) / body.radius
    areas = np.array([face.area for face in body.faces]) / body.radius**2
    heights = np.einsum("fi,fi->f", body.normals, away)
    faces = np.column_stack([areas, heights, np.linalg.norm(away, axis=1)])
    corners = [
        np.linalg.norm(face.polygon[:, None] - [face.centroid, body.center_of_mass], axis=2)
        for face in body.faces
    ]
    return faces, [lengths / body.radius for lengths in corners]


def _rarest_flags(body: Polyhedron) -> Iterator[tuple[int, int]]:
    """Yield the flags (face, corner) that may define the standard order, in the file's order."""
    faces, corners = flag_traits(body)
    kinds = _graded(faces)
    rarest = _rarest(kinds)
    flags = [
        (face, corner, cells)
        for face in (place for place, kind in enumerate(kinds) if kind == rarest)
        for corner, cells in enumerate(_graded(corners[face]))
        if corners[face][corner, 0] > SHORTEST
    ]
    rarest = _rarest([cells for *_, cells in flags])
    return ((face, corner) for face, corner, cells in flags if cells == rarest)


def _rarest(kinds: Sequence[Cells]) -> Cells:
    """Return the kind that occurs least often; of equally rare kinds, the first in order."""
    return min(((count, kind) for kind, count in Counter(kinds).items()), default=(0, ()))[1]


def _graded(rows: Array) -> list[Cells]:
    return list(map(tuple, graded(rows, CELL_DIGITS).tolist()))


def flag_frame(body: Polyhedron, face: int, corner: int) -> Array:
    """Build orthonormal columns of a flag: towards the corner, across, and along the normal."""
    toward = body.faces[face].polygon[corner] - body.faces[face].centroid
    normal = body.faces[face].normal
    toward = toward - normal * float(normal @ toward)
    toward = toward / np.linalg.norm(toward)
    across = np.cross(normal, toward)
    return np.asarray(np.column_stack([toward, across, normal]), dtype=np.float64)


def _looks(body: Polyhedron, frame: Array) -> tuple[Cells, ...]:
    """Sort the rows of `_cells` for all faces in a frame in lexicographic order."""
    return tuple(sorted(map(tuple, _cells(body, frame).tolist())))


def _cells(body: Polyhedron, frame: Array) -> Array:
    """Describe each face in a frame by its area, centre and normal, rounded to cells, (f, 7)."""
    areas = np.array([face.area for face in body.faces]) / body.radius**2
    centers = np.array([face.centroid for face in body.faces]) - body.center_of_mass
    seen = [areas[:, None], centers @ frame / body.radius, body.normals @ frame]
    return graded(np.asarray(np.hstack(seen), dtype=np.float64), CELL_DIGITS)


def _relisted(face: Face, body: Polyhedron, frame: Array, slack: float) -> Face:
    """Make a face anew: borders begin at their first corner in a frame, and pieces are new."""
    polygon, *holes = (_begun(loop, body, frame) for loop in (face.polygon, *face.holes))
    holes = sorted(holes, key=lambda hole: tuple(_corner_cells(hole[:1], body, frame)[0]))
    if len(face.pieces) == 1 and not holes:
        return replace(face, polygon=polygon, pieces=(_begun(face.pieces[0], body, frame),))
    along = polygon[1] - polygon[0]
    along = along / np.linalg.norm(along)
    plane = np.column_stack([along, np.cross(face.normal, along)])
    loops = [(loop - polygon[0]) @ plane for loop in (polygon, *holes)]
    pieces = [polygon[0] + piece @ plane.T for piece in convex_pieces(loops, slack)]
    return replace(face, polygon=polygon, holes=tuple(holes), pieces=tuple(pieces))


def _begun(loop: Array, body: Polyhedron, frame: Array) -> Array:
    """Rotate a closed border so that it begins with its first corner in a frame, (k, 3)."""
    cells = _corner_cells(loop, body, frame)
    return np.roll(loop, -int(np.lexsort(cells.T[::-1])[0]), axis=0)


def _corner_cells(corners: Array, body: Polyhedron, frame: Array) -> Array:
    return graded((corners - body.center_of_mass) / body.radius @ frame, CELL_DIGITS)


SAME_LENGTH = 1.0 - 1e-6
"""Share of the largest length from which two lengths count as equal. The first of equal ones is
taken, so that rounding decides nothing."""


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
    i, j = np.argwhere(gaps >= SAME_LENGTH * gaps.max())[0]
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
