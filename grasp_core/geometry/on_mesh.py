"""The surface of a triangle mesh, and whether a point with a normal lies on it."""

import math
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.nearest_points import nearest_on_triangles

LEAN = math.cos(3e-3)
"""Cosine of the largest angle between a normal and a triangle's that still agree: planar faces are
as flat as `FlatnessLimits` say, and six digits round."""


class Surface:
    """The surface of a closed triangle mesh, wound outwards."""

    def __init__(self, vertices: Array, triangles: Indices) -> None:
        self._corners: Any = vertices[triangles]
        outward = np.cross(
            self._corners[:, 1] - self._corners[:, 0], self._corners[:, 2] - self._corners[:, 0]
        )
        lengths = np.linalg.norm(outward, axis=1, keepdims=True)
        self._inward = -outward / np.where(lengths > 0.0, lengths, 1.0)

    def holds(self, point: Array, normal: Array | None, slack: float) -> bool:
        """Return whether a point is on the surface, on a triangle with the normal if one is given.

        Args:
            point: The point, (3,) [m].
            normal: Unit vector into the solid, (3,); None if any will do.
            slack: How far the point may be from a triangle [m].
        """
        near = np.linalg.norm(nearest_on_triangles(self._corners, point) - point, axis=1) <= slack
        if normal is None:
            return bool(near.any())
        return bool((self._inward[near] @ normal >= LEAN).any())
