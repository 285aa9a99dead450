"""Many sets of contacts, as many contacts in each, in one pair of arrays."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen, frozen_units
from grasp_core.errors import InputError
from grasp_core.values import FINGERS, Grasp, contact_arrays

FEWEST = 2


def many_contact_arrays(
    positions: ArrayLike | Iterable[Grasp], normals: ArrayLike | None
) -> tuple[Array, Array]:
    """Positions and inward normals, each (g, k, 3), from grasps or from two arrays.

    Raises:
        InputError: Shapes differ, a normal is not a unit vector, or fewer than two contacts.
    """
    given: Any = positions
    if normals is None:
        grasps: list[Any] = [given] if isinstance(given, Grasp) else list(given)
        both = np.array([contact_arrays(grasp, None) for grasp in grasps], dtype=np.float64)
        points, units = np.moveaxis(both.reshape(-1, 2, FINGERS, 3), 1, 0)
        return points, units
    points = frozen(given, (None, None, 3), "positions")
    units = frozen_units(normals, points.shape, "normals")
    if points.shape[1] < FEWEST:
        raise InputError(f"at least two contacts are needed, got {points.shape[1]}")
    return points, units


def unit_sizes(points: Array) -> tuple[Array, Array, Array]:
    """As `unit_size`, of many sets (g, k, 3): arms, centres (g, 3) and lengths (g,)."""
    centers = points.mean(axis=1)
    arms = points - centers[:, None]
    sizes = np.linalg.norm(arms, axis=2).max(axis=1)
    sizes[sizes == 0.0] = 1.0
    return arms / sizes[:, None, None], centers, sizes
