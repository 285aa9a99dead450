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

Symmetries. Solved: all orthogonal matrices Q for which x -> c + Q (x - c), with the centre of mass
c, maps the object's vertices and its faces to themselves, each to within a small share of the
object's radius.

A symmetry takes one chosen flag to a flag at the same distances, and the two frames say which
rotation, and which reflection, does it. Every candidate is then tried on all vertices and faces.
The chosen flag is on a face that few others resemble, so that candidates are few. Numbers are
compared by their distance, never by their digits.

Two grasps are copies of each other if a symmetry maps contacts, force cones, lines of force and
foci of one to those of the other, whatever the order of their fingers.
"""

import importlib
import itertools
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices, Shape
from grasp_core.declared import Declared, declared
from grasp_core.objects.face_pieces import Shapes, face_shapes, shared_quadruples
from grasp_core.objects.planar_faces import convex_pieces, planar_slack
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.solvers.ties import graded
from grasp_core.values import FINGERS, Grasp

FLIP = np.array([1.0, 1.0, -1.0])
"""Signs of the coordinates in the mirror image: only z changes its sign, which is exact."""
CELL_DIGITS = 6
"""Digits to which lengths (object size one) and cosines are compared."""
LEAST_DIRECTION = 1e-3
"""Least distance of a corner from its face's centre that gives a direction [object radii]."""

GridCells: TypeAlias = tuple[float, ...]


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
    seen = ((_cells(image, frame), image, frame) for image, frame in views)
    first = min(seen, default=None, key=lambda view: sorted(view[0].tolist()))
    if first is None:
        faces = tuple(range(len(body.faces)))
        return Standard(body, faces, mirrored=False, owners=faces)
    cells, image, frame = first
    order: list[int] = np.lexsort(cells.T[::-1]).tolist()
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
        if corners[face][corner, 0] > LEAST_DIRECTION
    ]
    rarest = _rarest([cells for *_, cells in flags])
    return ((face, corner) for face, corner, cells in flags if cells == rarest)


def _rarest(kinds: Sequence[GridCells]) -> GridCells:
    """Return the kind that occurs least often; of equally rare kinds, the first in order."""
    return min(((count, kind) for kind, count in Counter(kinds).items()), default=(0, ()))[1]


def _graded(rows: Array) -> list[GridCells]:
    return list(map(tuple, graded(rows, CELL_DIGITS).tolist()))


def flag_frame(body: Polyhedron, face: int, corner: int) -> Array:
    """Build orthonormal columns of a flag: towards the corner, across, and along the normal."""
    toward = body.faces[face].polygon[corner] - body.faces[face].centroid
    normal = body.faces[face].normal
    toward = toward - normal * float(normal @ toward)
    toward = toward / np.linalg.norm(toward)
    across = np.cross(normal, toward)
    return np.asarray(np.column_stack([toward, across, normal]), dtype=np.float64)


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


SAME_BODY = 1e-4
"""Largest distance between a vertex or a face's centre, as a symmetry maps it, and the nearest one
of the object, in object radii: files that keep five digits stay within it."""
SAME_GRASP = 1e-3
"""Largest distance between contacts or foci of two copies, in object radii, and between directions
of their normals and force cones: a picture of this object shows no smaller one."""
FAR_FOCUS = 4.0
"""Distance from which foci are compared by direction, to the same share of it [object radii]."""
MOST_SYMMETRIC_FACES = 200
"""Largest number of faces of objects whose symmetries are looked for, as for exact planning."""
TREE_FROM = 300
"""Number of vertices above which a search tree finds the nearest ones: comparing each with each
takes a hundred megabytes at two thousand, for every candidate."""
ORDERS = np.array(list(itertools.permutations(range(FINGERS))))
"""Ways to match the fingers of two grasps, (24, 4)."""


@declared
class Symmetries(Declared):
    """The orthogonal matrices that map an object to itself about its centre of mass."""

    rotations: Annotated[Array, Shape(None, 3, 3)]
    """Rotations, the identity first, (r, 3, 3)."""
    reflections: Annotated[Array, Shape(None, 3, 3)]
    """Matrices with determinant -1: reflections, and reflections that also rotate, (m, 3, 3)."""


@dataclass(frozen=True, slots=True)
class Copies:
    """Places, in a list, of grasps that symmetries of the object map to one another."""

    first: int  # place of the grasp that stands for all of them, the first in the list
    rotated: tuple[int, ...] = ()
    """Places of the grasps that a rotation of the object maps the first to."""
    mirrored: tuple[int, ...] = ()
    """Places of the grasps that only a reflection of the object maps the first to."""

    @property
    def places(self) -> tuple[int, ...]:
        """Return the places of all these grasps in ascending order."""
        return tuple(sorted((self.first, *self.rotated, *self.mirrored)))


def symmetries(body: Polyhedron) -> Symmetries:
    """Find rotations and reflections of an object; of a curved or finely cut one, the identity."""
    alone = Symmetries(np.eye(3)[None], np.empty((0, 3, 3)))
    if body.patches is not None or len(body.faces) > MOST_SYMMETRIC_FACES:
        return alone
    flags = _flags(body)
    if not flags:
        return alone
    turns = [each @ flags[0].T for each in flags]
    mirrors = [each @ np.diag([1.0, -1.0, 1.0]) @ flags[0].T for each in flags]
    # vertices (v, 3), and centres and normals of faces (f, 6), which symmetries keep
    vertices = (body.vertices - body.center_of_mass) / body.radius
    centres = np.array([face.centroid for face in body.faces]) - body.center_of_mass
    faces = np.hstack([centres / body.radius, body.normals])

    def is_kept(turn: Array) -> bool:
        turned = np.hstack([faces[:, :3] @ turn.T, faces[:, 3:] @ turn.T])
        return _is_matched(vertices @ turn.T, vertices) and _is_matched(turned, faces)

    rotations, reflections = (
        np.reshape([turn for turn in candidates if is_kept(turn)], (-1, 3, 3))
        for candidates in (turns, mirrors)
    )
    return Symmetries(rotations, reflections)


def copies_of(body: Polyhedron, grasps: Sequence[Grasp]) -> tuple[Copies, ...]:
    """Sort grasps into classes of copies of the first grasp of each class, in their order."""
    found = symmetries(body)
    classes: list[Copies] = []
    traits = [_Traits.of(body, grasp) for grasp in grasps]
    for place, trait in enumerate(traits):
        for number, known in enumerate(classes):
            if not trait.resembles(traits[known.first]):
                continue
            if trait.is_image(traits[known.first], found.rotations):
                classes[number] = Copies(known.first, (*known.rotated, place), known.mirrored)
                break
            if trait.is_image(traits[known.first], found.reflections):
                classes[number] = Copies(known.first, known.rotated, (*known.mirrored, place))
                break
        else:
            classes.append(Copies(place))
    return tuple(classes)


@dataclass(frozen=True, slots=True, eq=False)
class _Traits:
    """What must be the same in two copies, about the centre of mass and over the object's radius.

    Rows of `vectors` are, for each finger, its contact, normal, cone's axis, witness force's
    direction, direction of approach, and focus, which all turn with the object.
    """

    family: str
    vectors: Array  # vectors of each finger, (4, v, 3)
    lengths: Array
    """Distances between contacts, and half-angles of cones, in ascending order, (10,)."""

    @classmethod
    def of(cls, body: Polyhedron, grasp: Grasp) -> "_Traits":
        places = (grasp.positions - body.center_of_mass) / body.radius
        ways = grasp.normals if grasp.approach_directions is None else grasp.approach_directions
        axes = np.array([cone.axis for cone in grasp.force_cones])
        foci = (grasp.focus_points - body.center_of_mass) / body.radius
        each = [_near(np.repeat(foci, FINGERS // len(foci), axis=0)) if len(foci) else 0.0 * places]
        apart = np.linalg.norm(places[:, None] - places[None], axis=2)[np.triu_indices(FINGERS, 1)]
        halves = [cone.half_angle for cone in grasp.force_cones]
        return cls(
            grasp.family,
            np.stack([places, grasp.normals, axes, grasp.witness.directions, ways, *each], axis=1),
            np.concatenate([np.sort(apart), np.sort(halves)]),
        )

    def resembles(self, other: "_Traits") -> bool:
        """Return whether the lengths, which no symmetry changes, leave it possible."""
        return self.family == other.family and bool(
            (np.abs(self.lengths - other.lengths) <= 2.0 * SAME_GRASP).all()
        )

    def is_image(self, other: "_Traits", maps: Array) -> bool:
        """Return whether one of the matrices `maps`, (n, 3, 3), makes this from another grasp."""
        images = np.einsum("nij,kvj->nkvi", maps, other.vectors)
        off = np.linalg.norm(images[:, :, None] - self.vectors[None, None], axis=4).max(axis=3)
        matched = off[:, np.arange(FINGERS), ORDERS].max(axis=2)
        return bool((matched <= SAME_GRASP).any())


def _near(points: Array) -> Array:
    """Move points beyond `FAR_FOCUS` to that distance: farther ones count by their direction."""
    lengths = np.linalg.norm(points, axis=1, keepdims=True)
    return points * np.minimum(1.0, FAR_FOCUS / np.maximum(lengths, FAR_FOCUS))


def _flags(body: Polyhedron) -> list[Array]:
    """Return the frames of flags that may be images of the first one, which comes first."""
    kinds, corners = flag_traits(body)
    kinds[:, 0] = np.sqrt(kinds[:, 0])  # areas as lengths
    alike = np.abs(kinds[:, None] - kinds[None]).max(axis=2) <= SAME_BODY
    chosen = int(alike.sum(axis=1).argmin())
    flags = [
        (face, corner, lengths)
        for face in (chosen, *(face for face in np.flatnonzero(alike[chosen]) if face != chosen))
        for corner, lengths in enumerate(corners[face])
        if lengths[0] > LEAST_DIRECTION
    ]
    return [
        flag_frame(body, int(face), corner)
        for face, corner, lengths in flags
        if math.dist(lengths, flags[0][2]) <= 2.0 * SAME_BODY
    ]


def _is_matched(images: Array, rows: Array) -> bool:
    """Return whether images (n, d) are each near a row (n, d), no two of them near the same."""
    if len(rows) > TREE_FROM:
        spatial: Any = importlib.import_module("scipy.spatial")
        apart, nearest = spatial.KDTree(rows).query(images, p=np.inf)
    else:
        gaps = np.abs(images[:, None] - rows[None]).max(axis=2)
        nearest = gaps.argmin(axis=1)
        apart = gaps[np.arange(len(rows)), nearest]
    return bool((apart <= SAME_BODY).all()) and len(set(nearest.tolist())) == len(rows)
