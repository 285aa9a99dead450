"""Whether two readings of a file are the same triangles, in whatever order."""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices

Reading = tuple[Array, Indices]
"""Vertices (n, 3) and triangles (t, 3)."""


def same_triangles(one: Reading, other: Reading, rounding: float) -> bool:
    """Whether two readings give the same triangles.

    Args:
        one: A reading.
        other: Another.
        rounding: How far coordinates may differ, relative to the largest.
    """
    if not _sound(*one) or not _sound(*other):
        return False  # the other reader has lost vertices, or found other numbers
    rows = [_rows(*reading) for reading in (one, other)]
    if rows[0].shape != rows[1].shape:
        return False
    if (rows[0] == rows[1]).all():
        return True
    reach = rounding * float(np.abs(rows[0]).max())
    return reach > 0.0 and _near(rows[0], rows[1], reach) and _near(rows[1], rows[0], reach)


def _sound(points: Array, triangles: Indices) -> bool:
    known = not triangles.size or 0 <= triangles.min() <= triangles.max() < len(points)
    return bool(known and np.isfinite(points).all())


def _rows(points: Array, triangles: Indices) -> Array:
    """The nine coordinates of each triangle, in the order of their size, (t, 9)."""
    rows = points[triangles].reshape(-1, 9) + 0.0
    return rows[np.lexsort(rows.T)]


def _near(rows: Array, others: Array, reach: float) -> bool:
    spatial: Any = importlib.import_module("scipy.spatial")
    distances, _ = spatial.KDTree(others).query(rows)
    return bool((distances <= reach).all())
