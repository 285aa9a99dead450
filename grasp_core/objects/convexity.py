"""Whether a surface is that of its convex hull, so that the hull can stand in for it.

A point of the hull is at most d from its border iff it is at most d below the plane of some facet.
If the centroid of a triangle is, so are its corners, three times as far below the same plane, as
none of them is above it: the whole triangle is then within 3 d of the hull's border.
"""

import importlib
from typing import Any

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron

FLUSH = 1e-6
"""How far below the hull's border a triangle's centroid may be, in object radii: coordinates in
single precision are off by a tenth of this."""
BLOCK = 256
"""Triangles that are compared with all facets at a time: a few megabytes."""


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
