"""Collects the polygons of a mesh file, and turns each into a fan around its first corner.

A polygon that its fan does not cover exactly, because it is dented or bent, is refused.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal

CORNERS, QUAD = 3, 4
FOLDED = 1e-9
"""A fan's triangle is folded back if its projection is below minus this share of the polygon."""
FLATTEST = 0.5
"""Least area of a polygon projected along its normal, relative to the sum of its triangles."""


def too_many(triangles: int, most: int) -> NoReturn:
    """Refuse a file that has too many triangles."""
    message = f"the mesh has {triangles} or more triangles, the limit is {most}; simplify it"
    raise MeshError(MeshRefusal.TOO_MANY, message)


def check_corners(corners: Indices, vertices: int) -> None:
    """Refuse corners of triangles that are no numbers of vertices."""
    low, high = int(corners.min(initial=0)), int(corners.max(initial=-1))
    if low < 0 or high >= vertices:
        message = (
            f"a triangle names vertex {low if low < 0 else high}, counted from 0, but the file has "
            f"{vertices} vertices; export it again"
        )
        raise MeshError(MeshRefusal.INDEX, message)


@dataclass(slots=True)
class Polygons:
    """The polygons of a file, by vertex numbers that count from 0, at 8 bytes a corner."""

    most: int  # largest number of triangles allowed
    triangles: int = 0  # number of triangles in the fans of the polygons so far
    corners: "array[int]" = field(default_factory=lambda: array("q"))
    sizes: "array[int]" = field(default_factory=lambda: array("q"))
    """Number of corners of each polygon."""

    def add(self, corners: Sequence[int]) -> None:
        """Add one polygon."""
        if len(corners) < CORNERS:
            raise ValueError(f"a face needs at least three corners, got {len(corners)}")
        self.triangles += len(corners) - 2
        if self.triangles > self.most:
            too_many(self.triangles, self.most)
        self.corners.extend(corners)
        self.sizes.append(len(corners))

    def fans(self, points: Array) -> Indices:
        """Return the triangles of all polygons in their order, (t, 3)."""
        flat, sizes = np.array(self.corners), np.array(self.sizes)
        check_corners(flat, len(points))
        first, before = np.cumsum(sizes) - sizes, np.cumsum(sizes - 2) - (sizes - 2)
        triangles = np.empty((self.triangles, CORNERS), dtype=np.int64)
        for size in np.unique(sizes):
            alike = sizes == size
            corners = flat[first[alike, None] + np.arange(size)]
            if size > CORNERS and _ambiguous_fans(points[corners]).any():
                message = "a face is dented or bent, so its shape is ambiguous; export triangles"
                raise MeshError(MeshRefusal.POLYGON, message)
            rows = np.stack(
                np.broadcast_arrays(corners[:, :1], corners[:, 1:-1], corners[:, 2:]), 2
            )
            if size == QUAD:  # masses are summed in this order, and keep their last digits
                rows[:, 1] = np.roll(rows[:, 1], -1, axis=1)
            triangles[before[alike, None] + np.arange(size - 2)] = rows
        return triangles


def _ambiguous_fans(corners: Array) -> NDArray[np.bool_]:
    """Return which polygons (n, k, 3) overlap their fan around the first corner, or lie outside."""
    with np.errstate(over="ignore", invalid="ignore"):  # sizes are judged later
        spokes = corners[:, 1:] - corners[:, :1]
        crosses = np.cross(spokes[:, :-1], spokes[:, 1:])
        whole = crosses.sum(axis=1)
        areas = np.linalg.norm(crosses, axis=2)
        dots = (spokes[:, :-1] * spokes[:, 1:]).sum(axis=2)
        along = np.einsum("nij,nj->ni", crosses, whole)
        length = np.linalg.norm(whole, axis=1)
        folds = (along < -FOLDED * length[:, None] ** 2).any(axis=1)
        winds = np.arctan2(areas, dots).sum(axis=1) > 2.0 * np.pi + FOLDED
        flat = length < FLATTEST * areas.sum(axis=1)
    return folds | winds | flat
