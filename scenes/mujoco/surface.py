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
from collections.abc import Iterator, Sequence
from itertools import compress
from typing import Any

import numpy as np

from grasp_core.arrays import Array
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
    triangles = body.vertices[body.triangles] - body.center_of_mass
    middles = triangles.mean(axis=1)
    widest = float(np.linalg.norm(triangles - middles[:, None], axis=2).max())
    spatial: Any = importlib.import_module("scipy.spatial")
    tree, kernel = spatial.KDTree(middles), compiled("scenes.mujoco.clearance_kernel")
    found, thin, slack = list[Array](), THIN_PIECE * body.radius, OVERLAP_SLACK * body.radius
    pieces = list(_flat_pieces(body))
    for corners, inward in compress(pieces, _distances(pieces, near) <= reach):
        middle = corners.mean(axis=0)
        extent = float(np.linalg.norm(corners - middle, axis=1).max())
        edges = nearest_on_segments(corners, np.roll(corners, -1, axis=0), middle)
        width = float(np.linalg.norm(edges - middle, axis=1).min())
        if width > thin:
            depth = SLOPE * width
            near_by = np.array(tree.query_ball_point(middle, extent + depth + widest), np.int64)
            depth = float(kernel.clear_depth(corners, inward, depth, triangles, near_by, slack))
            found.append(np.vstack([corners, middle + depth * inward]))
    return tuple(found)


def _distances(pieces: Sequence[tuple[Array, Array]], points: Array) -> Array:
    """Return how far each piece is from the nearest of points (k, 3), (pieces,) [m]."""
    counts = [len(corners) - 2 for corners, _ in pieces]
    fans = [corners[[0, at, at + 1]] for corners, _ in pieces for at in range(1, len(corners) - 1)]
    away = nearest_on_triangles(np.array(fans), points) - points[:, None]
    distances = np.linalg.norm(away, axis=2).min(axis=0)
    return np.minimum.reduceat(distances, np.cumsum([0, *counts[:-1]]))


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
