"""Makes hulls, extrusions, unions and differences of meshes; only this module uses manifold3d."""

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import signed_area
from grasp_core.objects.surface import Mesh
from grasp_core.solvers.ties import graded, largest_first

GRID_DIGITS = 9
"""Digits to which corners are rounded before triangulation, for figures of size one."""
GRID = 4e-8
"""Extra inset of figures of size one, because manifold3d rounds coordinates to 1e-8."""


class Solid(Mesh):
    """A closed triangle mesh, wound counter-clockwise seen from outside."""

    def __add__(self, other: "Solid") -> "Solid":
        return _solid(_manifold(self) + _manifold(other))

    def __sub__(self, other: "Solid") -> "Solid":
        """Return the part of this solid that is outside of the other."""
        return _solid(_manifold(self) - _manifold(other))

    def moved(self, offset: ArrayLike) -> "Solid":
        """Return this solid moved by an offset, (3,) [m]."""
        return Solid(self.vertices + np.asarray(offset, dtype=np.float64), self.triangles)


def hull(points: ArrayLike) -> Solid:
    """Make the convex hull of points, (n, 3) [m]."""
    return _solid(_kernel().Manifold.hull_points(np.asarray(points, dtype=np.float64)))


def extrusion(outline: ArrayLike, height: float, holes: Sequence[ArrayLike] = ()) -> Solid:
    """Extrude a plane figure (k, 2) from z = 0 to z = height, with straight holes [m]."""
    loops = [np.asarray(loop, dtype=np.float64) for loop in (outline, *holes)]
    kernel = _kernel()
    figure = kernel.CrossSection(loops, kernel.FillRule.EvenOdd)
    return _solid(kernel.Manifold.extrude(figure, height))


def triangulate(loops: Sequence[Array]) -> Indices:
    """Triangulate a plane figure with holes; indices count all corners in order, (t, 3).

    Corners are first rounded to a grid, on which corners of regular figures are exactly on one line
    or circle, so that rounding does not choose between triangulations.
    """
    size = float(np.ptp(np.vstack(loops), axis=0).max())
    on_grid = [graded(loop / size, GRID_DIGITS) for loop in loops]
    return np.asarray(_kernel().triangulate(on_grid), dtype=np.int64)


def inset_figure(loops: Sequence[Array], margin: float) -> list[list[Array]]:
    """Cut off everything nearer than a margin to the border of a plane figure of loops (k, 2).

    At corners that turn inwards a little more is cut off, so that the remaining parts have few
    corners. Gives outer border and holes of each part; nothing if the figure is too narrow.
    """
    kernel = _kernel()
    size = float(np.ptp(np.vstack(loops), axis=0).max())
    figure = kernel.CrossSection([loop / size for loop in loops], kernel.FillRule.EvenOdd)
    inset = figure.offset(-(margin / size + GRID), kernel.JoinType.Miter)
    parts = [[np.asarray(loop) * size for loop in part.to_polygons()] for part in inset.decompose()]
    return [
        [part[place] for place in largest_first([signed_area(loop) for loop in part])]
        for part in parts
        if part
    ]


def intersection_volume(one: Mesh, two: Mesh) -> float:
    """Compute the volume that two solids share [m^3]."""
    return float((_manifold(one) ^ _manifold(two)).volume())


def gap_between(one: Mesh, two: Mesh, most: float) -> float:
    """Compute the distance between two solids, or `most` if they are farther apart [m]."""
    return float(_manifold(one).min_gap(_manifold(two), most))


def union(solids: Sequence[Mesh], numbers: Sequence[Indices]) -> tuple[Solid, Indices]:
    """Unite solids whose triangles are numbered; parts of triangles keep their numbers, (t,)."""
    kernel = _kernel()
    parts = list(map(_manifold, solids, numbers))
    body = kernel.Manifold.batch_boolean(parts, kernel.OpType.Add)
    return _solid(body), np.asarray(body.to_mesh64().face_id, dtype=np.int64)


def _kernel() -> Any:
    return importlib.import_module("manifold3d")


def _manifold(solid: Mesh, numbers: Indices | None = None) -> Any:
    kernel = _kernel()
    mesh = kernel.Mesh64(
        np.array(solid.vertices, order="C"),
        np.array(solid.triangles, dtype=np.uint64, order="C"),
        face_id=None if numbers is None else np.array(numbers, dtype=np.uint64),
    )
    body = kernel.Manifold(mesh)
    if body.status() != kernel.Error.NoError:
        raise InputError(f"the mesh is not closed and orientable ({body.status().name}); repair it")
    return body


def _solid(body: Any) -> Solid:
    mesh = body.to_mesh64()
    return Solid(
        np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3],
        np.asarray(mesh.tri_verts, dtype=np.int64),
    )
