"""Finds rotations and reflections that map an object to itself, and the grasps they map to others.

Solved: all orthogonal matrices Q for which x -> c + Q (x - c), with the centre of mass c, maps the
object's vertices and its faces to themselves, each to within a small share of the object's radius.

Method. A flag is a face with one of its corners, and spans a frame: towards the corner, across, and
along the normal. A symmetry takes one chosen flag to a flag at the same distances, and the two
frames say which rotation, and which reflection, does it. Every candidate is then tried on all
vertices and faces. The chosen flag is on a face that few others resemble, so that candidates are
few. Numbers are compared by their distance, never by their digits.

Two grasps are copies of each other if a symmetry maps contacts, force cones, lines of force and
foci of one to those of the other, whatever the order of their fingers.
"""

import importlib
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from grasp_core.arrays import Array, Shape
from grasp_core.declared import Declared
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import SHORTEST, flag_frame, flag_traits
from grasp_core.values import FINGERS, Grasp

SAME_BODY = 1e-4
"""Largest distance between a vertex or a face's centre, as a symmetry maps it, and the nearest one
of the object, in object radii: files that keep five digits stay within it."""
SAME_GRASP = 1e-3
"""Largest distance between contacts or foci of two copies, in object radii, and between directions
of their normals and force cones: a picture of this object shows no smaller one."""
FAR = 4.0
"""Distance in object radii from which foci are compared by their direction, with the same share of
their distance."""
MOST_FACES = 200
"""Largest number of faces of objects whose symmetries are looked for, as for exact planning."""
CROWDED = 300
"""Number of vertices above which a search tree finds the nearest ones: comparing each with each
takes a hundred megabytes at two thousand, for every candidate."""
ORDERS = np.array(list(itertools.permutations(range(FINGERS))))
"""Ways to match the fingers of two grasps, (24, 4)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Symmetries(Declared):
    """The orthogonal matrices that map an object to itself about its centre of mass."""

    rotations: Annotated[Array, Shape(None, 3, 3)]
    """Rotations, the identity first, (r, 3, 3)."""
    reflections: Annotated[Array, Shape(None, 3, 3)]
    """Matrices with determinant -1: reflections, and reflections that also rotate, (m, 3, 3)."""


@dataclass(frozen=True, slots=True)
class Copies:
    """Places, in a list, of grasps that symmetries of the object map to one another."""

    first: int
    """Place of the grasp that stands for all of them, the first in the list."""
    rotated: tuple[int, ...] = ()
    """Places of the grasps that a rotation of the object maps the first to."""
    mirrored: tuple[int, ...] = ()
    """Places of the grasps that only a reflection of the object maps the first to."""

    @property
    def places(self) -> tuple[int, ...]:
        """Return the places of all these grasps in ascending order."""
        return tuple(sorted((self.first, *self.rotated, *self.mirrored)))


def symmetries(body: Polyhedron) -> Symmetries:
    """Find the rotations and reflections that map an object to itself.

    A curved object, or one with more than `MOST_FACES` faces, gets the identity alone.
    """
    alone = Symmetries(np.eye(3)[None], np.empty((0, 3, 3)))
    if body.patches is not None or len(body.faces) > MOST_FACES:
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
    """Sort grasps of an object into classes of copies, in the order of each class's first grasp.

    Every grasp is compared with the first grasps of the classes before it, so that each is within
    the tolerance of the grasp that stands for it.
    """
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
    """Move points beyond `FAR` to that distance: farther ones count by their direction."""
    lengths = np.linalg.norm(points, axis=1, keepdims=True)
    return points * np.minimum(1.0, FAR / np.maximum(lengths, FAR))


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
        if lengths[0] > SHORTEST
    ]
    return [
        flag_frame(body, int(face), corner)
        for face, corner, lengths in flags
        if math.dist(lengths, flags[0][2]) <= 2.0 * SAME_BODY
    ]


def _is_matched(images: Array, rows: Array) -> bool:
    """Return whether images (n, d) are each near a row (n, d), no two of them near the same."""
    if len(rows) > CROWDED:
        spatial: Any = importlib.import_module("scipy.spatial")
        apart, nearest = spatial.KDTree(rows).query(images, p=np.inf)
    else:
        gaps = np.abs(images[:, None] - rows[None]).max(axis=2)
        nearest = gaps.argmin(axis=1)
        apart = gaps[np.arange(len(rows)), nearest]
    return bool((apart <= SAME_BODY).all()) and len(set(nearest.tolist())) == len(rows)
