"""Where each contact of a set may be: a polygon widened by a disc, and a depth across its plane."""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.cover_game import AHEAD
from grasp_core.errors import InputError
from grasp_core.ties import GRID_DIGITS, coarse, on_grid


class Sites(NamedTuple):
    """Places of k contacts. Plain arrays, as compiled loops take them."""

    points: Array
    """About any origin, (k, 3)."""
    frames: Array
    """Columns (inward normal, tangent, tangent), right-handed, (k, 3, 3)."""
    friction: Array
    """(k,)"""
    corners: Array
    """Of convex polygons, along the tangents about the points, some perhaps twice, (k, c, 2)."""
    radii: Array
    """Of discs that widen the polygons, (k,)."""
    depths: Array
    """How far contacts may be off the planes, (k,)."""

    def on_grid(self) -> "Sites":
        """The same for a search, which is to see no last digits; friction is less than it is."""
        friction = -coarse(-self.friction, GRID_DIGITS)
        return Sites(
            on_grid(self.points),
            on_grid(self.frames),
            np.clip(friction, 0.0, self.friction),
            on_grid(self.corners),
            on_grid(self.radii),
            on_grid(self.depths),
        )

    def clear(self) -> Array:
        """Power per length of twist that one unit of each contact's normal force must leave, (k,).

        Rounding to the grid costs forces less.
        """
        aside = np.sqrt(np.einsum("kcj,kcj->kc", self.corners, self.corners)).max(axis=1)
        places = np.sqrt(np.einsum("kj,kj->k", self.points, self.points))
        farthest = 1.0 + float((places + aside + self.radii + self.depths).max())
        return AHEAD * farthest * (1.0 + self.friction)

    def lowest(self, i: int, slopes: Array) -> Array:
        """Least values over a contact's polygon and disc of linear functions, (...,).

        Args:
            i: The contact.
            slopes: Along the tangents, (..., 2).
        """
        lengths = np.sqrt(np.einsum("...j,...j->...", slopes, slopes))
        return (slopes @ self.corners[i].T).min(axis=-1) - self.radii[i] * lengths


def stacked_corners(polygons: list[Array]) -> Array:
    """Polygons (c, 2) of different numbers of corners as one array, last corners repeated.

    Raises:
        InputError: One has no corners: nothing would be asked of its contact.
    """
    if min(map(len, polygons)) == 0:
        raise InputError("a contact's site has no corners")
    most = max(map(len, polygons))
    return np.array([
        np.vstack([polygon, np.repeat(polygon[-1:], most - len(polygon), axis=0)])
        for polygon in polygons
    ])  # fmt: skip
