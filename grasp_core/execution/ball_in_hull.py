"""Shows that the hull of points contains a ball about the origin.

If triangles of the points have the origin on their inner side, and every edge belongs to two of
them in opposite directions, then the cones over them cover all directions, and the ball whose
radius is the least distance of their planes is inside the hull.                            (1)

No hull is computed again to check this: sums, cross products and a look at the edges do.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices, is_indices
from grasp_core.solvers.ties import first_best, on_grid

UNITS_LOST = 16.0
"""Rounding units by which the volume of a triangle's cone may be off, relative to the product of
its sides and its distance: differences, products and sums lose about one each."""


def nearest_facet(points: Array) -> tuple[Array, float, Indices]:
    """Find the hull's facet nearest to zero: normal, distance; and all triangles, (t, 3)."""
    spatial: Any = importlib.import_module("scipy.spatial")
    hull = spatial.ConvexHull(points)
    equations: Array = hull.equations
    # equally near facets are taken in the order of their normals, the same on every machine
    equations = equations[np.lexsort(on_grid(equations[:, :3]).T)]
    nearest = equations[first_best(equations[:, 3])]
    return nearest[:3], -float(nearest[3]), np.asarray(hull.simplices, dtype=np.int64)


def outward(points: Array, triangles: Indices) -> Indices:
    """Turn triangles, (t, 3), so that the origin is on their inner side."""
    turned = np.linalg.det(points[triangles]) < 0.0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)


def least_distance(corners: Array) -> float:
    """Return the least distance of the origin from planes of triangles, (t, 3, 3).

    The distance is negative where a triangle has the origin on its outer side, and lower by what
    rounding may add, which is much for corners that are nearly in line.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    if not (lengths > 0.0).all():
        return -np.inf
    far = np.linalg.norm(corners, axis=2).max(axis=1)
    # a cross product is off by some rounding units of the product of its factors
    sides = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    lost = UNITS_LOST * np.finfo(np.float64).eps * far * sides
    return float(((np.einsum("ti,ti->t", normals, a) - lost) / lengths).min())


def ball_in(points: Array, triangles: Any) -> float:
    """Return the radius of the ball that triangles show by (1) to be in a hull, or -inf."""
    if not (is_indices(triangles, None, 3) and len(triangles)):
        return -np.inf
    if triangles.min() < 0 or triangles.max() >= len(points) or not _is_closed(triangles):
        return -np.inf
    return least_distance(points[triangles])


def _is_closed(triangles: Indices) -> bool:
    """Return whether every edge belongs to two triangles, in opposite directions."""
    edges = [tuple(edge) for t in triangles.tolist() for edge in zip(t, t[1:] + t[:1], strict=True)]
    known = set(edges)
    return len(known) == len(edges) and all((b, a) in known for a, b in edges)
