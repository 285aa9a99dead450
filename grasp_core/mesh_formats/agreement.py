"""Whether two readings of a file are the same triangles, in whatever order."""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices

ROUNDING = 1e-9
"""Of matrices of a scene, multiplied in another order, relative to the largest coordinate."""


def same_triangles(one: tuple[Array, Indices], other: tuple[Array, Indices]) -> bool:
    """Whether vertices (n, 3) and triangles (t, 3) of two readings give the same triangles."""
    if not _sound(*one) or not _sound(*other):
        return False  # the other reader has lost vertices, or found other numbers
    rows = [_rows(*reading) for reading in (one, other)]
    if rows[0].shape != rows[1].shape:
        return False
    if (rows[0] == rows[1]).all():
        return True
    return _near(rows[0], rows[1]) and _near(rows[1], rows[0])


def _sound(points: Array, triangles: Indices) -> bool:
    known = not triangles.size or 0 <= triangles.min() <= triangles.max() < len(points)
    return bool(known and np.isfinite(points).all())


def _rows(points: Array, triangles: Indices) -> Array:
    """The nine coordinates of each triangle, in the order of their size, (t, 9)."""
    rows = points[triangles].reshape(-1, 9) + 0.0
    return rows[np.lexsort(rows.T)]


def _near(rows: Array, others: Array) -> bool:
    spatial: Any = importlib.import_module("scipy.spatial")
    distances, _ = spatial.KDTree(others).query(rows)
    return bool((distances <= ROUNDING * np.abs(others).max()).all())
