"""How far a focus can be from contacts on faces, for many quadruples (see `grasp_core.reaches`)."""

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType, reportMissingTypeStubs]

from grasp_core.arrays import Array, Indices
from grasp_core.kernels.tables import Corners
from grasp_core.kernels.vectors import balancing_weights, dotted

FINGERS = 4
PARALLEL = 1e-6
"""Axes whose 1 - a_i.a_j is below this bound no width."""


def try_out() -> None:
    """Bound one quadruple."""
    corners = Corners(np.zeros((4, 1, 3)), np.ones(4, dtype=np.int64))
    faces, axes = np.arange(4)[None], np.ones((1, 4, 3))
    fill(corners, faces, axes, np.empty(1), np.empty((1, 4, 4)))


@njit(cache=True)
def fill(corners: Corners, faces: Indices, axes: Array, reaches: Array, widths: Array) -> None:
    """Bound the reach and the widths of quadruples.

    Args:
        corners: Of all faces.
        faces: (q, 4)
        axes: Of force cones that positively span, (q, 4, 3).
        reaches: Filled with upper bounds on the mean distance of a focus, (q,).
        widths: Filled with upper bounds on s_i + s_j, (q, 4, 4); infinite on the diagonal.
    """
    weights, apart = np.empty(FINGERS), np.empty(3)
    for q in range(len(faces)):
        balancing_weights(axes[q], weights)
        before, behind = 0.0, 0.0
        for i in range(FINGERS):
            low, high = _extent(corners, faces[q, i], axes[q, i])
            before, behind = before - weights[i] * low, behind + weights[i] * high
            widths[q, i, i] = np.inf
            for j in range(i):
                for d in range(3):
                    apart[d] = axes[q, i, d] - axes[q, j, d]
                share = 0.5 * dotted(apart, apart)
                widths[q, i, j] = widths[q, j, i] = np.inf
                if share > PARALLEL:
                    _, high = _extent(corners, faces[q, j], apart)
                    low, _ = _extent(corners, faces[q, i], apart)
                    widths[q, i, j] = widths[q, j, i] = (high - low) / share
        reaches[q] = max(before, behind)


@njit(cache=True)
def _extent(corners: Corners, face: int, direction: Array) -> tuple[float, float]:
    """Least and largest height of a face's corners along a direction."""
    low, high = np.inf, -np.inf
    for k in range(corners.counts[face]):
        height = dotted(corners.points[face, k], direction)
        low, high = min(low, height), max(high, height)
    return low, high
