"""Decides whether a point with a normal lies on the surface of a triangle mesh."""

import math
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.nearest_points import nearest_on_triangles

LEAN = math.cos(3e-3)
"""Cosine of the largest angle at which a normal and a triangle's normal agree: planar faces are
flat to within `Flatness`, and files keep six digits."""


class Surface:
    """The surface of a closed triangle mesh whose triangles face outwards."""

    def __init__(self, vertices: Array, triangles: Indices) -> None:
        self._corners: Any = vertices[triangles]
        outward = np.cross(
            self._corners[:, 1] - self._corners[:, 0], self._corners[:, 2] - self._corners[:, 0]
        )
        lengths = np.linalg.norm(outward, axis=1, keepdims=True)
        self._inward = -outward / np.where(lengths > 0.0, lengths, 1.0)

    def holds(self, point: Array, normal: Array | None, slack: float) -> bool:
        """Return whether a point is on a triangle whose normal agrees with the given one.

        Args:
            point: The point, (3,) [m].
            normal: Unit vector into the solid, (3,); None accepts every triangle.
            slack: How far the point may be from a triangle [m].
        """
        near = np.linalg.norm(nearest_on_triangles(self._corners, point) - point, axis=1) <= slack
        if normal is None:
            return bool(near.any())
        return bool((self._inward[near] @ normal >= LEAN).any())
