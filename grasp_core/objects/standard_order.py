"""The order of faces and the handedness in which an object is planned, whatever its file's.

Solved: an order of the faces, a first corner of each border and a handedness that depend on the
shape alone, so that the planner sees the same object when it is turned or mirrored, or when its
vertices and faces are listed in another order.

Method. A flag is a face with one of its corners, of the object or of its mirror image. It spans a
frame: the face's normal, the direction from the face's centre to the corner, and what is across
both. In that frame each face has an area, a centre and a normal, and their list, sorted, is
what the object looks like from there. The flag from which the list is the first of all in
lexicographic order is taken, and the object is listed in its order. Numbers are compared by the
cells they lie in (see `ties`). Flags with the same list are symmetries of the object, so it
makes no difference to its shape which of them counts: the first in the order of the file does.

Only flags on the rarest kind of face, at its rarest kind of corner, are compared.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.booleans import triangulate
from grasp_core.objects.face import Face
from grasp_core.objects.planar_faces import FlatnessLimits, convex_pieces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import graded

FLIP = np.array([1.0, 1.0, -1.0])
"""The mirror image: z changes its sign, which is exact."""
CELL_DIGITS = 6
"""Lengths (object size one) and cosines that are equal to so many digits are the same."""
SHORTEST = 1e-3
"""From a face's centre to a corner that gives a direction, in object radii."""

Cells: TypeAlias = tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Standard:
    """An object as it is planned."""

    body: Polyhedron
    """With its faces in standard order, perhaps mirrored."""
    faces: tuple[int, ...]
    """Which face of the object as given each of them is."""
    mirrored: bool


def standard(body: Polyhedron) -> Standard:
    """The object in standard order and handedness."""
    images = (body, mirror_image(body))
    views = ((image, _frame(image, *flag)) for image in images for flag in _rarest_flags(image))
    first = min(((_looks(image, frame), image, frame) for image, frame in views), default=None,
                key=lambda view: view[0])  # fmt: skip
    if first is None:
        return Standard(body, tuple(range(len(body.faces))), mirrored=False)
    _, image, frame = first
    order: list[int] = np.lexsort(_cells(image, frame).T[::-1]).tolist()
    slack = FlatnessLimits().distance * float(np.ptp(body.vertices, axis=0).max())
    faces = tuple(_relisted(image.faces[face], image, frame, slack) for face in order)
    return Standard(replace(image, faces=faces), tuple(order), mirrored=image is not body)


def mirror_image(body: Polyhedron) -> Polyhedron:
    """The object behind a mirror; its faces keep their numbers."""
    return replace(
        body,
        vertices=body.vertices * FLIP,
        triangles=body.triangles[:, ::-1],
        faces=tuple(_mirrored(face) for face in body.faces),
        center_of_mass=body.center_of_mass * FLIP,
        inertia=body.inertia * np.outer(FLIP, FLIP),
    )


def _mirrored(face: Face) -> Face:
    return replace(
        face,
        normal=face.normal * FLIP,
        centroid=face.centroid * FLIP,
        polygon=(face.polygon * FLIP)[::-1],
        holes=tuple((hole * FLIP)[::-1] for hole in face.holes),
        pieces=tuple((piece * FLIP)[::-1] for piece in face.pieces),
    )


def _rarest_flags(body: Polyhedron) -> Iterator[tuple[int, int]]:
    """Face and corner of each flag that is compared, in the order of the file."""
    kinds = [_kind_of_face(body, face) for face in body.faces]
    rarest = _rarest([kind for kind in kinds if kind])
    flags = [
        (place, corner)
        for place, kind in enumerate(kinds)
        if kind and kind == rarest
        for corner in range(len(body.faces[place].polygon))
    ]
    corners = [_kind_of_corner(body, *flag) for flag in flags]
    rarest = _rarest([kind for kind in corners if kind])
    return (flag for flag, kind in zip(flags, corners, strict=True) if kind and kind == rarest)


def _rarest(kinds: Sequence[Cells]) -> Cells:
    """The kind that occurs least often, of these the first in order."""
    return min(((count, kind) for kind, count in Counter(kinds).items()), default=(0, ()))[1]


def _kind_of_face(body: Polyhedron, face: Face) -> Cells:
    away = (face.centroid - body.center_of_mass) / body.radius
    numbers = face.area / body.radius**2, float(face.normal @ away), float(np.linalg.norm(away))
    return _graded(numbers)


def _kind_of_corner(body: Polyhedron, face: int, corner: int) -> Cells:
    """How far a corner is from the face's centre and the object's; nothing without a direction."""
    at = body.faces[face].polygon[corner]
    middles = body.faces[face].centroid, body.center_of_mass
    lengths = [float(np.linalg.norm(at - middle)) / body.radius for middle in middles]
    return _graded(lengths) if lengths[0] > SHORTEST else ()


def _graded(numbers: Sequence[float]) -> Cells:
    return tuple(graded(np.array(numbers), CELL_DIGITS).tolist())


def _frame(body: Polyhedron, face: int, corner: int) -> Array:
    """Orthonormal columns: towards the corner, across, and the normal, (3, 3)."""
    toward = body.faces[face].polygon[corner] - body.faces[face].centroid
    normal = body.faces[face].normal
    toward = toward - normal * float(normal @ toward)
    toward = toward / np.linalg.norm(toward)
    across = np.cross(normal, toward)
    return np.asarray(np.column_stack([toward, across, normal]), dtype=np.float64)


def _looks(body: Polyhedron, frame: Array) -> tuple[Cells, ...]:
    """What all faces look like in a frame, in lexicographic order."""
    cells = _cells(body, frame)
    return tuple(map(tuple, cells[np.lexsort(cells.T[::-1])].tolist()))


def _cells(body: Polyhedron, frame: Array) -> Array:
    """Area, centre and normal of each face in a frame, by cells, (f, 7)."""
    areas = np.array([face.area for face in body.faces]) / body.radius**2
    centers = np.array([face.centroid for face in body.faces]) - body.center_of_mass
    seen = [areas[:, None], centers @ frame / body.radius, body.normals @ frame]
    return graded(np.asarray(np.hstack(seen), dtype=np.float64), CELL_DIGITS)


def _relisted(face: Face, body: Polyhedron, frame: Array, slack: float) -> Face:
    """A face whose borders begin with their first corner in a frame, in new convex pieces."""
    polygon, *holes = (_begun(loop, body, frame) for loop in (face.polygon, *face.holes))
    holes = sorted(holes, key=lambda hole: tuple(_corner_cells(hole[:1], body, frame)[0]))
    if len(face.pieces) == 1 and not holes:
        return replace(face, polygon=polygon, pieces=(_begun(face.pieces[0], body, frame),))
    along = polygon[1] - polygon[0]
    along = along / np.linalg.norm(along)
    plane = np.column_stack([along, np.cross(face.normal, along)])
    loops = [(loop - polygon[0]) @ plane for loop in (polygon, *holes)]
    pieces = [polygon[0] + piece @ plane.T for piece in convex_pieces(loops, triangulate, slack)]
    return replace(face, polygon=polygon, holes=tuple(holes), pieces=tuple(pieces))


def _begun(loop: Array, body: Polyhedron, frame: Array) -> Array:
    """A closed border from its first corner on."""
    cells = _corner_cells(loop, body, frame)
    return np.roll(loop, -int(np.lexsort(cells.T[::-1])[0]), axis=0)


def _corner_cells(corners: Array, body: Polyhedron, frame: Array) -> Array:
    return graded((corners - body.center_of_mass) / body.radius @ frame, CELL_DIGITS)
