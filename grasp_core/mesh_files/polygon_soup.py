"""Turns vertices and polygons as a file lists them into triangles, if fans give the polygons."""

from collections.abc import Sequence
from dataclasses import dataclass, field

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


@dataclass(slots=True)
class Surface:
    """The vertices and triangles read so far."""

    most: int
    """Largest number of triangles."""
    points: list[Sequence[float]] = field(default_factory=list[Sequence[float]])
    triangles: list[tuple[int, int, int]] = field(default_factory=list[tuple[int, int, int]])
    polygons: list[tuple[str, Sequence[int]]] = field(
        default_factory=list[tuple[str, Sequence[int]]]
    )
    """Polygons of four corners and more, each with its place in the file."""

    def add(self, corners: Sequence[int], where: str) -> None:
        """Add a polygon, by the numbers of its vertices from 0 on.

        Raises:
            MeshError: It has fewer than three corners, or there are too many triangles.
        """
        if len(corners) < CORNERS:
            broken(where, f"a face needs three corners, got {len(corners)}")
        if len(self.triangles) + len(corners) - 2 > self.most:
            too_many(len(self.triangles) + len(corners) - 2, self.most)
        first, second, *others = corners
        if len(corners) == QUAD:  # in the order of trimesh, as readings are compared by corners
            third, last = others
            self.triangles += [(first, second, third), (third, last, first)]
        else:
            for third in others:
                self.triangles.append((first, second, third))
                second = third
        if len(corners) > CORNERS:
            self.polygons.append((where, corners))

    def arrays(self) -> tuple[Array, Indices]:
        """Vertices (n, 3) and triangles (t, 3).

        Raises:
            MeshError: A corner names a missing vertex, or a fan folds back on its polygon.
        """
        points = np.array(self.points, dtype=np.float64).reshape(-1, 3)
        triangles = np.array(self.triangles, dtype=np.int64).reshape(-1, 3)
        check_corners(triangles, len(points))
        for where, corners in self.polygons:
            _check_fan(points[list(corners)], where)
        return points, triangles


def too_many(triangles: int, most: int) -> None:
    """Refuse a file for its number of triangles.

    Raises:
        MeshError: Always.
    """
    message = f"{triangles} triangles or more, the limit is {most}; simplify the mesh"
    raise MeshError(MeshRefusal.TOO_MANY, message)


def check_corners(triangles: Indices, vertices: int) -> None:
    """Refuse triangles that name missing vertices.

    Raises:
        MeshError: A triangle names a missing vertex.
    """
    wrong = np.flatnonzero(((triangles < 0) | (triangles >= vertices)).any(axis=1))
    if wrong.size:
        row = triangles[wrong[0]]
        corner = int(row[(row < 0) | (row >= vertices)][0])
        outside(f"triangle {wrong[0]}", corner, vertices)


def _check_fan(corners: Array, where: str) -> None:
    """Refuse a polygon that is not the fan around its first corner."""
    spokes = corners[1:] - corners[0]
    crosses = np.cross(spokes[:-1], spokes[1:])
    whole = crosses.sum(axis=0)
    areas, dots = np.linalg.norm(crosses, axis=1), (spokes[:-1] * spokes[1:]).sum(axis=1)
    folds = ((crosses @ whole) < -FOLDED * (whole @ whole)).any()
    winds = np.arctan2(areas, dots).sum() > 2.0 * np.pi + FOLDED
    if folds or winds or np.linalg.norm(whole) < FLATTEST * areas.sum():
        message = f"{where}: a face with a dent, which can be cut in several ways; export triangles"
        raise MeshError(MeshRefusal.POLYGON, message)
