"""The surface that fingertips touch, as convex solids whose outer sides are exactly the object's.

The simulator only knows convex solids. A convex object is one. Of any other object, each convex
piece of a face (or each triangle of a curved surface) becomes a flat pyramid: its base is the
piece, and its apex lies below the piece's middle. The union of the bases is the surface itself, so
a fingertip meets what it would meet on the object: flat faces, edges and the faces behind them. No
decomposition of the solid is needed, and none is approximated.

The sides of a pyramid slope by `SLOPE`, or by less where the object is thin or an edge is sharp, so
that no pyramid sticks out of the object. A pyramid and a triangle of the surface have no common
inner point if an axis separates them: a normal of either, or a cross product of an edge of each
(separating axes of convex bodies). The depth is halved until every triangle that comes near is
separated.
"""

import importlib
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from grasp_core.arrays import Array, frozen_copy
from grasp_core.compiled import compiled
from grasp_core.geometry.polygons import nearest_on_segments
from grasp_core.objects.on_faces import nearest_on_triangles
from grasp_core.objects.polyhedron import Polyhedron, is_convex
from grasp_core.objects.surface import areas_and_normals

OVERLAP_SLACK = 1e-9
"""How far the two may overlap along an axis and count as touching, in object radii."""
SLOPE = 0.05
"""Depth of a pyramid per distance of its base's middle from the nearest edge."""
THIN_PIECE = 1e-5
"""Width of a piece below which it is left out, in object radii; neighbours close the gap."""


def touched_solids(body: Polyhedron, near: Array, reach: float) -> tuple[Array, ...] | None:
    """Return the corners of each convex solid within `reach` of points, (n, 3) each [m].

    Takes `near` (k, 3) [m]; `reach` [m]. Gives corners from the centre of mass; None for a convex
    object, which is such a solid itself.
    """
    if is_convex(body):
        return None
    pyramids = _pyramids_of(body)
    places = np.flatnonzero(pyramids.distances(near) <= reach).tolist()
    return tuple(solid for solid in map(pyramids.solid, places) if solid is not None)


class _Pyramids:
    """The flat pieces of an object's surface, and the pyramid on each, which is made once."""

    def __init__(self, body: Polyhedron) -> None:
        self.pieces = list(_flat_pieces(body))
        counts = [len(corners) - 2 for corners, _ in self.pieces]
        self.starts = np.cumsum([0, *counts[:-1]])
        self.fans = np.array([
            corners[[0, at, at + 1]]
            for corners, _ in self.pieces for at in range(1, len(corners) - 1)
        ])  # fmt: skip
        self.triangles = body.vertices[body.triangles] - body.center_of_mass
        middles = self.triangles.mean(axis=1)
        self.widest = float(np.linalg.norm(self.triangles - middles[:, None], axis=2).max())
        spatial: Any = importlib.import_module("scipy.spatial")
        self.tree = spatial.KDTree(middles)
        self.thin, self.slack = THIN_PIECE * body.radius, OVERLAP_SLACK * body.radius
        self.solids: dict[int, Array | None] = {}

    def distances(self, points: Array) -> Array:
        """Return how far each piece is from the nearest of points (k, 3), (pieces,) [m]."""
        away = nearest_on_triangles(self.fans, points) - points[:, None]
        distances = np.linalg.norm(away, axis=2).min(axis=0)
        return np.minimum.reduceat(distances, self.starts)

    def solid(self, place: int) -> Array | None:
        """Return the corners of the pyramid on a piece, (n, 3) [m]; None for one that is thin."""
        if place not in self.solids:
            self.solids[place] = self._made(*self.pieces[place])
        return self.solids[place]

    def _made(self, corners: Array, inward: Array) -> Array | None:
        middle = corners.mean(axis=0)
        extent = float(np.linalg.norm(corners - middle, axis=1).max())
        edges = nearest_on_segments(corners, np.roll(corners, -1, axis=0), middle)
        width = float(np.linalg.norm(edges - middle, axis=1).min())
        if width <= self.thin:
            return None
        depth, kernel = SLOPE * width, compiled("scenes.mujoco.clearance_kernel")
        found = self.tree.query_ball_point(middle, extent + depth + self.widest)
        near_by = np.array(found, np.int64)
        depth = kernel.clear_depth(corners, inward, depth, self.triangles, near_by, self.slack)
        return frozen_copy(np.vstack([corners, middle + float(depth) * inward]))


@lru_cache(maxsize=2)
def _pyramids_of(body: Polyhedron) -> _Pyramids:
    """Return the pyramids of an object, which all scenes of its grasps share."""
    return _Pyramids(body)


def _flat_pieces(body: Polyhedron) -> Iterator[tuple[Array, Array]]:
    """Yield corners (n, 3) and inward normal (3,) of each flat convex piece of the surface."""
    if body.patches is None:
        for face in body.faces:
            yield from ((piece - body.center_of_mass, face.normal) for piece in face.pieces)
        return
    # patches are only a part of a curved surface
    triangles = body.vertices[body.triangles] - body.center_of_mass
    _, outward = areas_and_normals(triangles)
    pairs = zip(triangles, outward, strict=True)
    yield from ((corners, -normal) for corners, normal in pairs if normal.any())
