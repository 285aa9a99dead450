"""Holds what compiled code places for many attempts, as plain arrays."""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.values import FINGERS

LEFT, NONE, PLACED = -1, 0, 1
"""Ends of an attempt: left to the methods that place one by one, proved to hold no discs as large
as asked for, or placed."""


class Placed(NamedTuple):
    """Contacts of many attempts, with the letters of `Placement`."""

    ends: Indices
    """How each attempt ended, (a,): `LEFT`, `NONE` or `PLACED`."""
    positions: Array
    """Contact points, (a, 4, 3)."""
    forces: Array
    """Balanced forces whose normal parts sum to one, (a, 4, 3)."""
    foci: Array
    """Foci, (a, 2, 3); concurrent grasps use the first only."""
    radii: Array
    """Radii of the discs, (a, 4)."""
    merits: Array
    """The smallest radius that was maximised, (a,)."""


class Footprints(NamedTuple):
    """Regions of concurrent grasps for many attempts."""

    polygons: Array
    """Corners in space, (a, 4, c, 3); a region with fewer corners leaves rows unused."""
    counts: Indices
    """Number of corners of each region, (a, 4); zero where it is left to `families.concurrent`."""
    radii: Array
    """Radii of the largest discs in the regions, (a, 4)."""


def room_for(count: int) -> Placed:
    """Return placements of a number of attempts, all zero."""
    return Placed(
        np.zeros(count, dtype=np.int64),
        np.zeros((count, FINGERS, 3)),
        np.zeros((count, FINGERS, 3)),
        np.zeros((count, 2, 3)),
        np.zeros((count, FINGERS)),
        np.zeros(count),
    )
