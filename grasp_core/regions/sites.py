"""The game by which forces of a cover are found, as both ways of `cover_search` play it.

A cone is covered if forces have power together on all of its six rays. Weights of the rays, chosen
by what they regret not to have been, meet the force that answers them best; the mean of the
answers, late ones counting more, comes to have power on all rays if any forces do.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError

ROUNDS = 30
ANSWERS = 3
"""Forces that are tried per contact as the best answer to weights."""
AHEAD = 1e-9
"""Power per length of twist with which a force counts."""
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
