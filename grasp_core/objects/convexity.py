"""Whether a surface is the surface of its convex hull, so that the hull can stand in for it.

A point of the hull is at most d from its border iff it is at most d below the plane of some facet.
If that holds for the centroid of a triangle, each corner is at most 3 d below the same plane, as no
corner is above it. The whole triangle is then within 3 d of the hull's border.
"""

import importlib
from typing import Any

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron

FLUSH = 1e-6
"""Largest depth of a triangle's centroid below the hull's border, in object radii: coordinates in
single precision are off by a tenth of this."""
BLOCK = 256
"""Number of triangles compared with all facets at a time: a few megabytes."""


def is_convex(body: Polyhedron) -> bool:
    """Whether the triangles of a body lie on the border of their convex hull."""
    spatial: Any = importlib.import_module("scipy.spatial")
    points = (body.vertices - body.center_of_mass) / body.radius
    facets: Array = spatial.ConvexHull(points).equations
    centroids = points[body.triangles].mean(axis=1)
    for start in range(0, len(centroids), BLOCK):
        depths = -(centroids[start : start + BLOCK] @ facets[:, :3].T + facets[:, 3])
        if (depths.min(axis=1) > FLUSH).any():
            return False
    return True
