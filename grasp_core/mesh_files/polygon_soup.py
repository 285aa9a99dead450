"""Turns vertices and polygons as a file lists them into triangles, if fans give the polygons."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.refusals import broken, outside

CORNERS = 3
QUAD = 4
FOLDED = 1e-9
"""A triangle of a fan counts as backwards beyond this share of its polygon."""
FLATTEST = 0.5
"""Least area of a polygon seen along its normal, relative to that of its triangles."""


def _no_triangles() -> "array[int]":
    return array("q")


@dataclass(slots=True)
class Polygons:
    """The polygons that were read so far, as triangles: 24 bytes for each of them."""

    most: int
    """Triangles that may be."""
    first: int = 0
    """The number that the file gives to its first vertex, for messages."""
    triangles: "array[int]" = field(default_factory=_no_triangles)
    """Three corners of each triangle."""
    large: list[tuple[str, Sequence[int]]] = field(default_factory=list[tuple[str, Sequence[int]]])
    """Polygons of four corners and more, with where they are written."""
    lowest: tuple[int, str] = (0, "")
    """The least corner below 0, and where it is written."""
    highest: tuple[int, str] = (-1, "")
    """The largest corner, and where it is written."""

    def add(self, corners: Sequence[int], where: str) -> None:
        """Add a polygon, by the numbers of its vertices from 0 on.

        Raises:
            MeshError: It has fewer than three corners, or there are too many triangles.
        """
        if len(corners) < CORNERS:
            broken(where, f"a face needs three corners, got {len(corners)}")
        triangles = len(self.triangles) // CORNERS + len(corners) - 2
        if triangles > self.most:
            too_many(triangles, self.most)
        if (least := min(corners)) < self.lowest[0]:
            self.lowest = least, where
        if (largest := max(corners)) > self.highest[0]:
            self.highest = largest, where
        first, *others = corners
        if len(corners) == QUAD:  # masses are summed in this order, and keep their last digits
            second, third, last = others
            self.triangles.extend((first, second, third, third, last, first))
        else:
            for second, third in pairwise(others):
                self.triangles.extend((first, second, third))
        if len(corners) > CORNERS:
            self.large.append((where, corners))

    def on(self, points: Array) -> tuple[Array, Indices]:
        """Vertices (n, 3), as given, and triangles (t, 3).

        Raises:
            MeshError: A corner names a missing vertex, or a fan folds back on its polygon.
        """
        for (corner, where), wrong in (
            (self.lowest, self.lowest[0] < 0),
            (self.highest, self.highest[0] >= len(points)),
        ):
            if wrong:
                outside(where, corner + self.first, len(points))
        for where, corners in self.large:
            _check_fan(points[list(corners)], where)
        return points, np.array(self.triangles, dtype=np.int64).reshape(-1, 3)


def points_of(coordinates: "array[float]") -> Array:
    """Vertices (n, 3) of coordinates one after another, which are not copied."""
    return np.frombuffer(coordinates, dtype=np.float64).reshape(-1, 3)


def too_many(triangles: int, most: int) -> None:
    """Refuse a file for its number of triangles.

    Raises:
        MeshError: Always.
    """
    message = f"{triangles} triangles or more, the limit is {most}; simplify the mesh"
    raise MeshError(MeshRefusal.TOO_MANY, message)


def _check_fan(corners: Array, where: str) -> None:
    """Refuse a polygon that is not the fan around its first corner."""
    with np.errstate(over="ignore", invalid="ignore"):  # sizes are judged later
        spokes = corners[1:] - corners[0]
        crosses = np.cross(spokes[:-1], spokes[1:])
        whole = crosses.sum(axis=0)
        areas, dots = np.linalg.norm(crosses, axis=1), (spokes[:-1] * spokes[1:]).sum(axis=1)
        folds = ((crosses @ whole) < -FOLDED * (whole @ whole)).any()
        winds = np.arctan2(areas, dots).sum() > 2.0 * np.pi + FOLDED
        flat = np.linalg.norm(whole) < FLATTEST * areas.sum()
    if folds or winds or flat:
        message = f"{where}: a face with a dent, which can be cut in several ways; export triangles"
        raise MeshError(MeshRefusal.POLYGON, message)
