"""What kernels are given, as plain arrays; numba is not needed to fill them."""

from typing import NamedTuple

from grasp_core.arrays import Array, Indices


class FaceTable(NamedTuple):
    """Convex faces at unit size, in the letters of `FacePiece`."""

    normals: Array
    """(f, 3)"""
    origins: Array
    """(f, 3)"""
    frames: Array
    """(f, 3, 2)"""
    E: Array
    """(f, e, 2), as many rows of each face as it has edges."""
    b: Array
    """(f, e)"""
    edges: Indices
    """(f,)"""
    corners: Array
    """In space, (f, e, 3), as many of each face."""
    depths: Array
    """(f,)"""


class Attempts(NamedTuple):
    """Ordered faces with a force cone each."""

    faces: Indices
    """(a, 4)"""
    axes: Array
    """(a, 4, 3)"""
    half_angles: Array
    """(a,) [rad]"""


class Corners(NamedTuple):
    """Corners of faces."""

    points: Array
    """(f, c, 3), as many of each face as it has."""
    counts: Indices
    """(f,)"""


class RegulusTerms(NamedTuple):
    """What `regulus_grasps` counts as a regulus."""

    turns: Array
    """Cosines and sines of the directions in which a pyramid's facets lean, (m, 2)."""
    shares: Array
    """Where in its interval each slope's angle is tried, (s,)."""
    depth: float
    """Least height of the passing points over their faces, in object radii."""
    inset: float
    """Least distance of a contact from the edges of its face, likewise."""
    gap: float
    """Least distance at which a line passes the focus line, likewise."""
    tie: float
    """Merits that differ by no more are equal: the slopes tried first win."""
    enough: float
    """The merit above which no better slopes are looked for."""
