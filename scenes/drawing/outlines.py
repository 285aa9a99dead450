"""Finds the lines that outline a surface, and joins its flat parts.

Edges between parts that are nearly in one plane belong to how a curved surface is cut into parts,
not to its shape, so they are not drawn. Where such an edge lies between a part that faces the
viewer and one that does not, it is the outline of the surface from there, and is drawn.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices

SMOOTH_DEG = 20.0
"""Angle between the normals of two parts up to which their common edge is not drawn [deg]."""
MOST_EDGES = 1500
"""Largest number of edges drawn; of more, as scans have them, only the sharpest are drawn."""
SAME_POINT = 1e-6
"""Distance up to which two corners count as one, relative to the size of the surface."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Polygons of a closed surface, corners counter-clockwise as seen from outside."""

    corners: Array
    """Corners of all polygons, one polygon after the other, (n, 3) [m]."""
    names: Indices
    """Number of the point at each corner, (n,); polygons that meet share numbers."""
    owners: Indices
    """Polygon of each corner, (n,)."""
    normals: Array
    """Unit normals, outwards, (polygons, 3); zero for polygons without area."""

    @classmethod
    def of(cls, polygons: Sequence[Array]) -> "Surface":
        """Number the corners of polygons, and measure their normals."""
        corners = np.vstack(polygons)
        counts = np.array([len(polygon) for polygon in polygons])
        size = float(np.ptp(corners, axis=0).max())
        places = np.rint(corners / (SAME_POINT * size)).astype(np.int64)
        names = np.unique(places, axis=0, return_inverse=True)[1].reshape(-1)
        owners = np.repeat(np.arange(len(polygons)), counts)
        turned = np.cross(corners, corners[_followers(owners, counts)])
        starts = np.cumsum(counts) - counts
        return cls(corners, names, owners, _units(np.add.reduceat(turned, starts)))

    def following(self) -> Indices:
        """Return the place of the next corner of the same polygon for each corner, (n,)."""
        return _followers(self.owners, np.bincount(self.owners))

    def edges(self) -> tuple[Indices, Indices]:
        """Pair the edges of polygons that meet.

        Returns:
            Places of the first corners of edges in one polygon, and of the same edges, which run
            the other way, in another.
        """
        first, second = self.names, self.names[self.following()]
        count = int(self.names.max()) + 1
        ahead, back = first * count + second, second * count + first
        order = np.argsort(ahead)
        found = np.minimum(np.searchsorted(ahead, back, sorter=order), len(ahead) - 1)
        other = order[found]
        paired = (ahead[other] == back) & (first < second)
        return np.flatnonzero(paired), other[paired]

    def facing(self, camera: Array) -> Array:
        """Tell which polygons face a point, (polygons,)."""
        firsts = np.flatnonzero(np.diff(self.owners, prepend=-1))
        return np.einsum("ij,ij->i", self.normals, camera - self.corners[firsts]) > 0.0

    def segments(self, places: Indices) -> Array:
        """Return the edges that begin at corners, (k, 2, 3) [m]."""
        return np.stack([self.corners[places], self.corners[self.following()[places]]], axis=1)


def _followers(owners: Indices, counts: Indices) -> Indices:
    """Return the place of the next corner of the same polygon, (n,)."""
    places = np.arange(len(owners)) + 1
    ends = np.cumsum(counts)
    places[ends - 1] = ends - counts
    return places


def _units(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=1)
    return vectors / np.where(lengths > 0.0, lengths, np.inf)[:, None]


def _angles(surface: Surface, one: Indices, two: Indices) -> Array:
    """Measure the angles between the normals on both sides of edges, (k,) [rad]."""
    sides = surface.normals[surface.owners[one]], surface.normals[surface.owners[two]]
    return np.arccos(np.clip(np.einsum("ij,ij->i", *sides), -1.0, 1.0))


def feature_edges(polygons: Sequence[Array]) -> Array:
    """Find the edges at which a surface is bent, the sharpest first, (k, 2, 3) [m]."""
    surface = Surface.of(polygons)
    one, two = surface.edges()
    angles = _angles(surface, one, two)
    order = np.argsort(-angles, kind="stable")[:MOST_EDGES]
    return surface.segments(one[order[angles[order] > math.radians(SMOOTH_DEG)]])


def outline(surface: Surface, camera: Array) -> Array:
    """Find the smooth edges between polygons that face the camera and others, (k, 2, 3) [m]."""
    one, two = surface.edges()
    front = surface.facing(camera)
    between = front[surface.owners[one]] != front[surface.owners[two]]
    one, two = one[between], two[between]
    return surface.segments(one[_angles(surface, one, two) <= math.radians(SMOOTH_DEG)])


def joined(surface: Surface, chosen: Array) -> tuple[Array, ...]:
    """Join polygons of a surface that meet, and return the loops around them, each (k, 3) [m]."""
    following = surface.following()
    places = np.flatnonzero(chosen[surface.owners])
    first, second = surface.names[places], surface.names[following[places]]
    count = int(surface.names.max()) + 1
    alone = ~np.isin(second * count + first, first * count + second)
    ways = defaultdict[int, list[tuple[int, int]]](list)
    for start, end, place in zip(
        first[alone].tolist(), second[alone].tolist(), places[alone].tolist(), strict=True
    ):
        ways[start].append((end, place))
    return tuple(surface.corners[loop] for loop in _loops(ways))


def _loops(ways: dict[int, list[tuple[int, int]]]) -> list[list[int]]:
    """Follow edges from corner to corner until they close."""
    loops = list[list[int]]()
    for start in list(ways):
        while ways[start]:
            at, loop = start, list[int]()
            while ways.get(at):
                at, place = ways[at].pop()
                loop.append(place)
            loops.append(loop)
    return loops
