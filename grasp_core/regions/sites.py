"""Where the contacts of a cover may be, and the game by which its forces are found.

A cone is covered if forces have power together on all of its six rays. Weights of the rays, chosen
by what they regret not to have been, meet the force that answers them best; the mean of the
answers, late ones counting more, comes to have power on all rays if any forces do.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.solvers.ties import GRID_DIGITS, coarse, on_grid

ROUNDS = 30
ANSWERS = 3
"""Forces that are tried per contact as the best answer to weights."""
AHEAD = 1e-8
"""Power with which a force counts, relative to its size and the farthest place: more than rounding
sites to a grid may cost it."""
EVEN = 0.02
"""Weight that each ray keeps in the choice of the edge that is cut, so that all are cut in time."""
TINY = 1e-12
"""Share of the friction that forces keep clear of, for rounding."""


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
