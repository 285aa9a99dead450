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
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.objects.polyhedron import Polyhedron, is_convex

TOUCHING = 1e-9
"""How far the two may overlap along an axis and count as touching, in object radii."""


SLOPE = 0.05
"""Depth of a pyramid per distance of its base's middle from the nearest edge."""
THIN = 1e-5
"""Width of a piece below which it is left out, in object radii; neighbours close the gap."""


def touched_solids(body: Polyhedron, near: Array, reach: float) -> tuple[Array, ...] | None:
    """Return the corners of each convex solid that fingertips may touch, (n, 3) each [m].

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
    found, thin, slack = list[Array](), THIN * body.radius, TOUCHING * body.radius
    for corners, inward in _flat_pieces(body):
        middle = corners.mean(axis=0)
        extent = float(np.linalg.norm(corners - middle, axis=1).max())
        if float(np.linalg.norm(near - middle, axis=1).min()) > reach + extent:
            continue
        width = _least_distance(corners, middle)
        if width > thin:
            depth = SLOPE * width
            near_by = np.array(tree.query_ball_point(middle, extent + depth + widest), np.int64)
            depth = float(kernel.clear_depth(corners, inward, depth, triangles, near_by, slack))
            found.append(np.vstack([corners, middle + depth * inward]))
    return tuple(found)


def _flat_pieces(body: Polyhedron) -> Iterator[tuple[Array, Array]]:
    """Yield corners (n, 3) and inward normal (3,) of each flat convex piece of the surface."""
    if body.patches is None:
        for face in body.faces:
            yield from ((piece - body.center_of_mass, face.normal) for piece in face.pieces)
        return
    # patches are only a part of a curved surface
    triangles = body.vertices[body.triangles] - body.center_of_mass
    first = triangles[:, 0]
    normals = np.cross(triangles[:, 2] - first, triangles[:, 1] - first)
    for corners, across in zip(triangles, normals, strict=True):
        size = float(np.linalg.norm(across))
        if size > 0.0:
            yield corners, across / size


def _least_distance(corners: Array, middle: Array) -> float:
    """Return the least distance of the middle from the lines of a polygon's edges [m]."""
    along = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(along, axis=1)
    real = lengths > 0.0
    units = along[real] / lengths[real, None]
    away = middle - corners[real]
    away -= np.einsum("ni,ni->n", away, units)[:, None] * units
    return float(np.linalg.norm(away, axis=1).min())
