"""How deep a flat pyramid below a piece of surface may be, so that it stays inside the object.

A pyramid and a triangle of the surface have no common inner point if an axis separates them: a
normal of either, or a cross product of an edge of each (separating axes of convex bodies). The
depth is halved until every triangle that comes near is separated.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array

TOUCHING = 1e-9
"""How far the two may overlap along an axis and count as touching, in object radii."""
MOST_HALVINGS = 12
"""Halvings of the depth after which a pyramid is left as it is: the object is a sheet there."""
PARALLEL = 1e-12
"""Sine of the angle between edges below which their cross product is no axis."""


class Surface:
    """Triangles of a surface, and the spheres around them."""

    def __init__(self, corners: Array, radius: float) -> None:
        """Enclose the triangles.

        Args:
            corners: Corners of the triangles, (t, 3, 3) [m].
            radius: Radius of the object [m].
        """
        self.corners, self.slack = corners, TOUCHING * radius
        self.middles = corners.mean(axis=1)
        self.extents = np.linalg.norm(corners - self.middles[:, None], axis=2).max(axis=1)
        self.widest = float(self.extents.max())
        spatial: Any = importlib.import_module("scipy.spatial")
        self.tree = spatial.KDTree(self.middles)

    def clear_depth(self, base: Array, inward: Array, depth: float) -> float:
        """Return the largest of depth, depth / 2, depth / 4, ... at which a pyramid is inside.

        Args:
            base: Corners of its base on the surface, (n, 3) [m].
            inward: Unit normal of the base into the object, (3,).
            depth: Depth to start from [m].
        """
        middle = base.mean(axis=0)
        extent = float(np.linalg.norm(base - middle, axis=1).max())
        reach = extent + depth
        found = np.sort(self.tree.query_ball_point(middle, reach + self.widest)).astype(np.int64)
        away = np.linalg.norm(self.middles[found] - middle, axis=1)
        triangles = self.corners[found[away <= self.extents[found] + reach]]
        depths = (triangles - middle) @ inward
        below = (depths.max(axis=1) > self.slack) & (depths.min(axis=1) < depth)
        triangles = triangles[below]
        for _ in range(MOST_HALVINGS):
            if len(triangles):
                apart = self._separated(base, inward, depth, triangles)
                triangles = triangles[np.logical_not(apart)]
            if not len(triangles):
                break
            depth *= 0.5
        return depth

    def _separated(self, base: Array, inward: Array, depth: float, triangles: Array) -> Array:
        """Return which triangles (t, 3, 3) have no inner point in common with a pyramid, (t,)."""
        solid = np.vstack([base, base.mean(axis=0) + depth * inward])
        rim, slopes = np.roll(base, -1, axis=0) - base, solid[-1] - base
        sides = np.roll(triangles, -1, axis=1) - triangles
        count = len(triangles)
        own = np.vstack([np.cross(rim, slopes), inward[None]])
        own = np.broadcast_to(own, (count, *own.shape))
        flat = np.cross(sides[:, 0], sides[:, 1])[:, None]
        across = _crosses(np.vstack([rim, slopes]), sides)
        axes = np.concatenate([own, flat, across], axis=1)
        lengths = np.linalg.norm(axes, axis=2)
        axes = axes / np.where(lengths > 0.0, lengths, 1.0)[..., None]
        mine, theirs = axes @ solid.T, axes @ triangles.transpose(0, 2, 1)
        gaps = np.maximum(
            theirs.min(axis=2) - mine.max(axis=2), mine.min(axis=2) - theirs.max(axis=2)
        )
        return ((gaps >= -self.slack) & (lengths > 0.0)).any(axis=1)


def _crosses(edges: Array, sides: Array) -> Array:
    """Return the cross products of edges (e, 3) and sides (t, 3, 3), (t, 3 e, 3); 0 if parallel."""
    lengths = np.linalg.norm(edges, axis=1)[:, None]
    edges = edges / np.where(lengths > 0.0, lengths, 1.0)
    sides = sides / np.linalg.norm(sides, axis=2)[:, :, None]
    found = np.cross(edges[None, :, None], sides[:, None])
    found[np.linalg.norm(found, axis=3) <= PARALLEL] = 0.0
    return found.reshape(len(sides), -1, 3)
