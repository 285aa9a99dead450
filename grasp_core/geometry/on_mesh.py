"""Is a point on a triangle mesh, with the mesh's normal there?"""

import math
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.nearest_points import nearest_on_triangles

LEAN = math.cos(3e-3)
"""Of the angle between a normal and a triangle's that count as one: planar faces are as flat as
`FlatnessLimits` say, and six digits round."""


class Surface:
    """A closed triangle mesh, wound outwards."""

    def __init__(self, vertices: Array, triangles: Indices) -> None:
        self._corners: Any = vertices[triangles]
        outward = np.cross(
            self._corners[:, 1] - self._corners[:, 0], self._corners[:, 2] - self._corners[:, 0]
        )
        lengths = np.linalg.norm(outward, axis=1, keepdims=True)
        self._inward = -outward / np.where(lengths > 0.0, lengths, 1.0)

    def holds(self, point: Array, normal: Array | None, slack: float) -> bool:
        """Whether a point is on the surface, and a triangle there has the normal if one is given.

        Args:
            point: (3,) [m]
            normal: Into the solid, (3,).
            slack: How far the point may be from a triangle [m].
        """
        near = np.linalg.norm(nearest_on_triangles(self._corners, point) - point, axis=1) <= slack
        if normal is None:
            return bool(near.any())
        return bool((self._inward[near] @ normal >= LEAN).any())
