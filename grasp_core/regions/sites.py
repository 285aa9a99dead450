"""The sites where the contacts of a cover may be, and the game by which its forces are found.

A cone is covered if forces have power together on all of its six rays. In each round the rays have
weights, by how much power each has lacked so far, and the force that answers these weights best is
played. The mean of the answers, later ones counting more, comes to have power on all rays if any
forces do.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.solvers.ties import GRID_DIGITS, coarse, on_grid

# of the game, at most
ROUNDS = 30
ANSWERS = 3
"""Number of forces tried per contact as the best answer to weights."""
AHEAD = 1e-8
"""Least power of a force that counts, relative to its size and the farthest place: more than
rounding sites to a grid may cost it."""
EVEN = 0.02
"""Weight added to each ray in the choice of the edge to cut, so that all edges are cut in time."""
CLEAR_OF_CONE = 1e-12
"""Share of the friction that forces keep clear of, for rounding."""


class Sites(NamedTuple):
    """Sites of k contacts, in plain arrays as compiled loops take them."""

    points: Array
    """Points of the contacts about any origin, (k, 3)."""
    frames: Array
    """Frames as columns (inward normal, tangent, tangent), right-handed, (k, 3, 3)."""
    friction: Array
    """Coulomb coefficients, (k,)."""
    corners: Array
    """Corners of convex polygons, along the tangents about the points, some perhaps twice,
    (k, c, 2)."""
    radii: Array
    """Radii of discs that widen the polygons, (k,)."""
    depths: Array
    """Largest distance of contacts from the planes, (k,)."""

    def on_grid(self) -> "Sites":
        """These sites rounded for a search that must not see last digits; friction never grows."""
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

        Rounding to the grid costs forces less than this.
        """
        aside = np.sqrt(np.einsum("kcj,kcj->kc", self.corners, self.corners)).max(axis=1)
        places = np.sqrt(np.einsum("kj,kj->k", self.points, self.points))
        farthest = 1.0 + float((places + aside + self.radii + self.depths).max())
        return AHEAD * farthest * (1.0 + self.friction)

    def lowest(self, i: int, slopes: Array) -> Array:
        """Least values of linear functions over a contact's polygon and disc, (...,).

        Args:
            i: Index of the contact.
            slopes: Slopes of the functions along the tangents, (..., 2).
        """
        lengths = np.sqrt(np.einsum("...j,...j->...", slopes, slopes))
        return (slopes @ self.corners[i].T).min(axis=-1) - self.radii[i] * lengths


def stacked_corners(polygons: list[Array]) -> Array:
    """Polygons (c, 2) of different numbers of corners as one array, last corners repeated.

    Raises:
        InputError: A polygon has no corners, so that nothing would be asked of its contact.
    """
    if min(map(len, polygons)) == 0:
        raise InputError("a contact's site has no corners, expected one at least")
    most = max(map(len, polygons))
    return np.array([
        np.vstack([polygon, np.repeat(polygon[-1:], most - len(polygon), axis=0)])
        for polygon in polygons
    ])  # fmt: skip
