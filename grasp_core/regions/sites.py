"""Describes the sites where contacts may be, for the search for proofs (covers).

A cone of twists is covered if contact forces together have power on all of its six rays. Such
forces are found in rounds. In each round every ray has a weight, by how much power it has lacked so
far, and the forces that are best for these weights are chosen. The mean of the chosen forces, later
ones counting more, comes to have power on all rays if any forces do.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.solvers.ties import GRID_DIGITS, coarse, on_grid

# of the game, at most
ROUNDS = 30
ANSWERS = 3
"""Number of forces per contact that are tried as the best one for given weights."""
AHEAD = 1e-8
"""Least power of a force that counts, relative to its size and the farthest place: more than
rounding sites to a grid can change it."""
EVEN = 0.02
"""Weight added to each ray in the choice of the edge to cut, so that all edges are cut in time."""
CLEAR_OF_CONE = 1e-12
"""Share of the friction that contact forces leave unused, so that rounding does no harm."""


class Sites(NamedTuple):
    """Where each of k contacts may be, as plain arrays for compiled loops."""

    points: Array
    """Points of the contacts about any origin, (k, 3)."""
    frames: Array
    """Frames as columns (inward normal, tangent, tangent), right-handed, (k, 3, 3)."""
    friction: Array
    """Coulomb coefficients, (k,)."""
    corners: Array
    """Corners of convex polygons, along the tangents and relative to `points`, (k, c, 2); the last
    corner may be repeated."""
    radii: Array
    """Radii of the discs by which the polygons are widened, (k,)."""
    depths: Array
    """Largest distance of contacts from the planes of their polygons, (k,)."""

    def on_grid(self) -> "Sites":
        """Round to a grid, so that last digits do not matter to a search; friction never rises."""
        friction = -coarse(-self.friction, GRID_DIGITS)
        return Sites(*map(on_grid, self))._replace(friction=np.clip(friction, 0.0, self.friction))

    def clear(self) -> Array:
        """Return the power per unit of force and twist that rounding to the grid may take, (k,)."""
        aside = np.sqrt(np.einsum("kcj,kcj->kc", self.corners, self.corners)).max(axis=1)
        places = np.sqrt(np.einsum("kj,kj->k", self.points, self.points))
        farthest = 1.0 + float((places + aside + self.radii + self.depths).max())
        return AHEAD * farthest * (1.0 + self.friction)

    def lowest(self, i: int, slopes: Array) -> Array:
        """Find the least values of functions with slopes (..., 2) over a contact's site, (...,)."""
        lengths = np.sqrt(np.einsum("...j,...j->...", slopes, slopes))
        return (slopes @ self.corners[i].T).min(axis=-1) - self.radii[i] * lengths


def stacked_corners(polygons: list[Array]) -> Array:
    """Put polygons (c, 2) into one array, with the last corners of shorter ones repeated."""
    if min(map(len, polygons)) == 0:
        raise InputError("the site of each contact must have at least one corner, got none")
    most = max(map(len, polygons))
    return np.array([
        np.vstack([polygon, np.repeat(polygon[-1:], most - len(polygon), axis=0)])
        for polygon in polygons
    ])  # fmt: skip
