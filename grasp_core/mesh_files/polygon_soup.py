"""Turns the vertices and polygons of a mesh file into triangles: a fan around each first corner."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.refusals import broken, outside

CORNERS = 3
QUAD = 4
FOLDED = 1e-9
"""A fan's triangle is folded back if its projection is below minus this share of the polygon."""
FLATTEST = 0.5
"""Least area of a polygon projected along its normal, relative to the sum of its triangles."""


def _no_triangles() -> "array[int]":
    return array("q")


@dataclass(slots=True)
class Polygons:
    """Collects the polygons of a file as triangles, at 24 bytes each."""

    most: int
    """Largest number of triangles allowed."""
    first: int = 0
    """The number of the file's first vertex, 0 or 1, for messages."""
    triangles: "array[int]" = field(default_factory=_no_triangles)
    """Vertex numbers, three for each triangle, in one flat array."""
    large: list[tuple[str, Sequence[int]]] = field(default_factory=list[tuple[str, Sequence[int]]])
    """Polygons with four or more corners, each with its place in the file."""
    lowest: tuple[int, str] = (0, "")
    """The lowest vertex number below 0 so far, and its place in the file."""
    highest: tuple[int, str] = (-1, "")
    """The highest vertex number so far, and its place in the file."""

    def add(self, corners: Sequence[int], where: str) -> None:
        """Add a polygon, given by vertex numbers that count from 0."""
        if len(corners) < CORNERS:
            broken(where, f"a face needs at least three corners, got {len(corners)}")
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
        """Return the vertices (n, 3) and triangles (t, 3), after checking every corner."""
        for (corner, where), wrong in (
            (self.lowest, self.lowest[0] < 0),
            (self.highest, self.highest[0] >= len(points)),
        ):
            if wrong:
                outside(where, corner + self.first, len(points))
        self._check_fans(points)
        return points, np.array(self.triangles, dtype=np.int64).reshape(-1, 3)

    def _check_fans(self, points: Array) -> None:
        """Refuse the first polygon whose fan of triangles is ambiguous."""
        of_size: dict[int, list[int]] = {}  # polygons of as many corners are checked together
        for number, (_, corners) in enumerate(self.large):
            of_size.setdefault(len(corners), []).append(number)
        wrong = (
            number
            for alike in of_size.values()
            for number, ambiguous in zip(alike, self._ambiguous(alike, points), strict=True)
            if ambiguous
        )
        if (first := min(wrong, default=None)) is not None:
            where = self.large[first][0]
            message = (
                f"{where}: a face is dented or bent, so its shape is ambiguous; export triangles"
            )
            raise MeshError(MeshRefusal.POLYGON, message)

    def _ambiguous(self, numbers: list[int], points: Array) -> NDArray[np.bool_]:
        return _ambiguous_fans(points[np.array([self.large[number][1] for number in numbers])])


def points_of(coordinates: "array[float]") -> Array:
    """View a flat array of coordinates as vertices (n, 3), without a copy."""
    return np.frombuffer(coordinates, dtype=np.float64).reshape(-1, 3)


def too_many(triangles: int, most: int) -> None:
    """Refuse a file that has too many triangles."""
    message = f"the mesh has {triangles} or more triangles, the limit is {most}; simplify it"
    raise MeshError(MeshRefusal.TOO_MANY, message)


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
