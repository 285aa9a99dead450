"""Holds placements, the results of constructions, and the tables that compiled code works on.

A placement is contacts with the forces that hold them. Lengths are in the pieces' units, where the
object has size one.

Inputs and outputs of compiled code are plain arrays; filling them does not need numba.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.values import FINGERS

FingerOrder: TypeAlias = tuple[int, int, int, int]
PAIRINGS: tuple[FingerOrder, ...] = ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2))
"""The three ways to group four faces into the pairs (first, second) and (third, fourth)."""
LEAST_RADIUS = 1e-3
"""Least radius, relative to the object's, of a disc that counts as a region to stand in; foci of a
pencil that are closer than this count as one point."""
RADIUS_GIVEN_UP = 1e-6
"""Share of the smallest radius that the second program may give up. With less, its optima would
form slivers, in which rounding moves the nearest point a thousand times as far."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Four contacts, one on each piece, and the forces that hold them."""

    positions: Array  # contact points, (4, 3)
    forces: Array  # balanced forces along the witness lines, normal parts summing to one, (4, 3)
    foci: Array
    """Points where lines of force meet, (k, 3): one for a concurrent grasp, two for a pencil; for a
    regulus the points midway between the two lines of each pair, or none."""
    radii: Array
    """Radius of the independent disc around each contact, (4,); zeros where no disc is claimed."""
    merit: float  # the quantity that the construction maximised, such as the smallest disc radius
    planned: Array | None = None
    """Forces for which the contacts were chosen, (4, 3); None if they are those of `forces`."""


NOT_DECIDED, NOTHING_HELD, CONTACTS_PLACED = -1, 0, 1
"""Ends of an attempt: neither solved nor refuted, proved to hold nothing as good as asked for, or
placed."""


class FaceTable(NamedTuple):
    """Convex faces at unit size, with the letters of `FacePiece`."""

    normals: Array  # inward unit normals, (f, 3)
    origins: Array  # origins of the plane coordinates, (f, 3)
    frames: Array  # frames of the plane coordinates, (f, 3, 2)
    E: Array
    """Unit outward edge normals, rows of E y <= b inside the faces, (f, e, 2); a face with fewer
    edges leaves rows unused."""
    b: Array  # limits of the rows E y <= b, (f, e)
    edges: Indices  # number of edges of each face, (f,)
    flat: Array
    """Corners in plane coordinates, (f, e, 2); a face with fewer corners leaves rows unused."""
    depths: Array  # largest distance of the surface from each plane, (f,)


class Attempts(NamedTuple):
    """Many attempts, each with four faces in finger order and a force cone for each face."""

    faces: Indices  # indices of the faces, (a, 4)
    axes: Array  # unit cone axes, (a, 4, 3)
    half_angles: Array  # half-angle that the four cones of an attempt share, (a,) [rad]


class Fingers(NamedTuple):
    """The faces and cones of one attempt, in finger order, with the letters of both tables."""

    normals: Array
    origins: Array
    frames: Array
    E: Array
    b: Array
    edges: Indices
    depths: Array
    axes: Array
    half_angle: float


class FaceCorners(NamedTuple):
    """Corners of faces, in arrays as long as the largest number of corners."""

    points: Array  # corners in space, (f, c, 3); a face with fewer corners leaves rows unused
    counts: Indices  # number of corners of each face, (f,)


def face_table(pieces: Sequence[FacePiece | None]) -> FaceTable:
    """Make a table with one row per piece; rows of faces too small for a contact stay zero."""
    count, most = len(pieces), max((len(piece.E) for piece in pieces if piece), default=0)
    table = FaceTable(
        normals=np.zeros((count, 3)),
        origins=np.zeros((count, 3)),
        frames=np.zeros((count, 3, 2)),
        E=np.zeros((count, most, 2)),
        b=np.zeros((count, most)),
        edges=np.zeros(count, dtype=np.int64),
        flat=np.zeros((count, most, 2)),
        depths=np.zeros(count),
    )
    for place, piece in enumerate(pieces):
        if piece is None:
            continue
        edges = len(piece.E)
        table.normals[place], table.origins[place] = piece.normal, piece.origin
        table.frames[place], table.depths[place] = piece.frame, piece.depth
        table.edges[place], table.flat[place, :edges] = edges, piece.corners
        table.E[place, :edges], table.b[place, :edges] = piece.E, piece.b
    return table


class Placed(NamedTuple):
    """Contacts of many attempts, with the letters of `Placement`."""

    ends: (
        Indices  # how each attempt ended, (a,): `NOT_DECIDED`, `NOTHING_HELD` or `CONTACTS_PLACED`
    )
    positions: Array  # contact points, (a, 4, 3)
    forces: Array  # balanced forces whose normal parts sum to one, (a, 4, 3)
    foci: Array  # foci, (a, 2, 3); concurrent grasps use the first only
    radii: Array  # radii of the discs, (a, 4)
    merits: Array  # the smallest radius that was maximised, (a,)


class Footprints(NamedTuple):
    """Regions of concurrent grasps for many attempts."""

    polygons: Array
    """Corners in space, (a, 4, c, 3); a region with fewer corners leaves rows unused."""
    counts: Indices
    """Number of corners of each region, (a, 4)."""
    radii: Array
    """Radii of the largest discs in the regions, (a, 4); not finite where they are left."""


def room_for(count: int) -> Placed:
    """Return placements of a number of attempts, all zero."""
    return Placed(
        np.zeros(count, dtype=np.int64),
        np.zeros((count, FINGERS, 3)),
        np.zeros((count, FINGERS, 3)),
        np.zeros((count, 2, 3)),
        np.zeros((count, FINGERS)),
        np.zeros(count),
    )
