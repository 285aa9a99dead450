"""Decides whether a surface is that of its convex hull, so that the hull can replace it.

A point of the hull is at most d from its border iff it is at most d below the plane of some facet.
If that holds for the centroid of a triangle, each corner is at most 3 d below the same plane, as no
corner is above it. The whole triangle is then within 3 d of the hull's border.
"""

import importlib
from typing import Any

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron

FLUSH = 1e-6
"""Largest depth of a triangle's centroid below the surface of the convex hull, in object radii: ten
times the error of coordinates in single precision."""
BLOCK = 256
"""Number of triangles compared with all facets at a time, which needs a few megabytes."""


def is_convex(body: Polyhedron) -> bool:
    """Return whether all triangles of an object lie on the surface of their convex hull."""
    spatial: Any = importlib.import_module("scipy.spatial")
    points = (body.vertices - body.center_of_mass) / body.radius
    facets: Array = spatial.ConvexHull(points).equations
    centroids = points[body.triangles].mean(axis=1)
    for start in range(0, len(centroids), BLOCK):
        depths = -(centroids[start : start + BLOCK] @ facets[:, :3].T + facets[:, 3])
        if (depths.min(axis=1) > FLUSH).any():
            return False
    return True
