"""How deep a flat pyramid below a piece of surface may be, so that it stays inside the object.

A pyramid and a triangle of the surface have no common inner point if an axis separates them: a
normal of either, or a cross product of an edge of each (separating axes of convex bodies). The
depth is halved until every triangle that comes near is separated.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled

TOUCHING = 1e-9
"""How far the two may overlap along an axis and count as touching, in object radii."""


class Surface:
    """Triangles of a surface, found by where they are."""

    def __init__(self, corners: Array, radius: float) -> None:
        """Sort the triangles by their middles.

        Takes `corners` (t, 3, 3) [m]; `radius` [m].
        """
        self.corners, self.slack = corners, TOUCHING * radius
        middles = corners.mean(axis=1)
        self.widest = float(np.linalg.norm(corners - middles[:, None], axis=2).max())
        spatial: Any = importlib.import_module("scipy.spatial")
        self.tree = spatial.KDTree(middles)

    def clear_depth(self, base: Array, inward: Array, depth: float) -> float:
        """Return the largest of depth, depth / 2, depth / 4, ... at which a pyramid is inside.

        Args:
            base: Corners of its base on the surface, (n, 3) [m].
            inward: Unit normal of the base into the object, (3,).
            depth: Depth to start from [m].
        """
        middle = base.mean(axis=0)
        extent = float(np.linalg.norm(base - middle, axis=1).max())
        near = self.tree.query_ball_point(middle, extent + depth + self.widest)
        kernel = compiled("scenes.execution.clearance_kernel")
        found = np.array(near, np.int64)
        return float(kernel.clear_depth(base, inward, depth, self.corners, found, self.slack))
