"""Inscribes pyramids in circular cones, which replace the cones in linear programs.

The edges of a pyramid with m sides lie on the cone, so the pyramid is inside: what is proved for it
holds for the cone. Across the axis it is a regular polygon, whose sides are nearer to the middle
than its corners by the factor cos(pi / m). So a pyramid in a cone of half-angle alpha holds the
cone of half-angle psi with

    tan(psi)  =  tan(alpha) cos(pi / m),                                                      (1)

and gives away 1 - cos(pi / m) of the friction coefficient: 1.9 % with sixteen sides.
"""

import math
from functools import cache

import numpy as np

from grasp_core.arrays import Array, frozen

PYRAMID_SIDES = 16


def inscribed_share(sides: int = PYRAMID_SIDES) -> float:
    """Return the share of a cone's tangent that its pyramid keeps in every direction, by (1)."""
    return math.cos(math.pi / sides)


def pyramid_facets(axes: Array, half_angle: float, toward: Array, sides: int) -> Array:
    """Compute inward unit normals g, (..., sides, 3), of pyramids g.v >= 0 in equal cones."""
    first = toward - np.sum(toward * axes, axis=-1, keepdims=True) * axes
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    across = facet_turns(sides) @ np.stack([first, np.cross(axes, first)], axis=-2)
    psi = float(np.arctan(np.tan(half_angle) * inscribed_share(sides)))
    return np.sin(psi) * axes[..., None, :] - np.cos(psi) * across


@cache
def facet_turns(sides: int) -> Array:
    """Compute cosines and sines of the directions in which facets lean, (sides, 2)."""
    turns = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    return frozen(np.column_stack([np.cos(turns), np.sin(turns)]), (sides, 2), "turns")
