"""Holds inputs and outputs of compiled code as plain arrays; filling them does not need numba."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.values import FINGERS

LEFT, NONE, PLACED = -1, 0, 1
"""Ends of an attempt: left to the methods that place one by one, proved to hold no discs as large
as asked for, or placed."""


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
    corners: Array  # corners in space, (f, e, 3); a face with fewer corners leaves rows unused
    depths: Array  # largest distance of the surface from each plane, (f,)


class Attempts(NamedTuple):
    """Many attempts, each with four faces in finger order and a force cone for each face."""

    faces: Indices  # indices of the faces, (a, 4)
    axes: Array  # unit cone axes, (a, 4, 3)
    half_angles: Array  # half-angle that the four cones of an attempt share, (a,) [rad]


class Corners(NamedTuple):
    """Corners of faces, in arrays as long as the largest number of corners."""

    points: Array  # corners in space, (f, c, 3); a face with fewer corners leaves rows unused
    counts: Indices  # number of corners of each face, (f,)


class RegulusTerms(NamedTuple):
    """Settings of `families.regulus`: slopes to try, and which lines count as a regulus."""

    turns: Array  # cosines and sines of the directions in which a pyramid's facets lean, (m, 2)
    shares: Array
    """Positions, as shares of each slope's interval of angles, at which slopes are tried, (s,)."""
    depth: float
    """Least height, over their faces, of the points where lines pass the focus line, in object
    radii."""
    inset: float  # least distance of a contact from the edges of its face, in object radii
    gap: float  # least distance at which a line passes the focus line, in object radii
    tie: float  # difference of merit that counts as none; of equal slopes, those tried first win
    enough: float  # merit above which no better slopes are sought


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
        corners=np.zeros((count, most, 3)),
        depths=np.zeros(count),
    )
    for place, piece in enumerate(pieces):
        if piece is None:
            continue
        edges = len(piece.E)
        table.normals[place], table.origins[place] = piece.normal, piece.origin
        table.frames[place], table.depths[place] = piece.frame, piece.depth
        table.edges[place] = edges
        table.corners[place, :edges] = piece.origin + piece.corners @ piece.frame.T
        table.E[place, :edges], table.b[place, :edges] = piece.E, piece.b
    return table


class Placed(NamedTuple):
    """Contacts of many attempts, with the letters of `Placement`."""

    ends: Indices  # how each attempt ended, (a,): `LEFT`, `NONE` or `PLACED`
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
    """Number of corners of each region, (a, 4); zero where it is left to `families.concurrent`."""
    radii: Array  # radii of the largest discs in the regions, (a, 4)


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
