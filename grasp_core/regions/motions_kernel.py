"""Decides how a twist moves a contact anywhere in its site, and whether friction resists it.

A motion is six numbers for each contact and each twist of length one: the velocity of the contact's
point along its normal and two tangents, and the rate of turning about these tangents and the
normal.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.regions.sites import AHEAD, CLEAR_OF_CONE, Sites

MOTIONS = 6
STEPS = 40
"""Largest number of steps towards the place where a contact resists a twist least."""


@loop("numpy")
def lowest(
    motion: Array, sites: Sites, i: int, force: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Find the least power of a force n + f t_1 + g t_2 over a contact's site, and the place."""
    f, g = force
    u, v, w = motion[3] - motion[5] * f, motion[4] - motion[5] * g, f * motion[4] - g * motion[3]
    least, x, y = np.inf, 0.0, 0.0
    for corner in range(sites.corners.shape[1]):
        height = u * sites.corners[i, corner, 1] - v * sites.corners[i, corner, 0]
        if height < least:
            least, x, y = height, sites.corners[i, corner, 0], sites.corners[i, corner, 1]
    length = math.sqrt(u * u + v * v)
    if sites.radii[i] > 0.0 and length > 0.0:
        least -= sites.radii[i] * length
        x += sites.radii[i] * v / length
        y -= sites.radii[i] * u / length
    out = -sites.depths[i] if w > 0.0 else sites.depths[i]
    return motion[0] + f * motion[1] + g * motion[2] + least + out * w, out, x, y


@loop("numpy")
def velocity(
    motion: Array, place: Array | tuple[float, float, float]
) -> tuple[float, float, float]:
    """Compute the velocity of a contact at a place away from its point, along the frame."""
    out, x, y = place
    return (
        motion[0] + motion[3] * y - motion[4] * x,
        motion[1] - motion[5] * y + motion[4] * out,
        motion[2] + motion[5] * x - motion[3] * out,
    )


@loop("numpy")
def longest(f: float, g: float, most: float) -> tuple[float, float]:
    """Scale a tangential direction (f, g) to the length that friction allows."""
    length = math.sqrt(f * f + g * g)
    return (f * most / length, g * most / length) if length > 0.0 else (0.0, 0.0)


@loop("numpy")
def holds(sites: Sites, i: int, x: float, y: float) -> bool:
    """Return whether a place in a contact's plane is in its polygon or in its disc."""
    if x * x + y * y <= sites.radii[i] ** 2:
        return True
    corners, sides = sites.corners[i], 0
    for place in range(len(corners)):
        here, there = corners[place - 1], corners[place]
        sides += int(here[0] != there[0] or here[1] != there[1])
        ahead = (there[0] - here[0]) * (y - here[1]) - (there[1] - here[1]) * (x - here[0])
        if ahead < 0.0:
            return False
    return sides > 0


@loop("numpy")
def resists(motion: Array, sites: Sites, i: int, shift: Array) -> bool:
    """Return whether a contact resists a twist wherever it is; `shift` is a place where it may not.

    Friction has no power on a contact that does not slide. Elsewhere the largest power that
    friction allows is convex in the place, and the search steps to where it is least. The result is
    also False, with a place that does resist, if too many steps would be needed.
    """
    most = sites.friction[i] * (1.0 - CLEAR_OF_CONE)
    out, x, y = 0.0, 0.0, 0.0
    if motion[5] != 0.0:
        # the one place that does not slide
        shift[0], shift[1], shift[2] = 0.0, -motion[2] / motion[5], motion[1] / motion[5]
        if holds(sites, i, shift[1], shift[2]) and velocity(motion, shift)[0] <= 0.0:
            return False
    for step in range(STEPS):
        _, q, r = velocity(motion, (out, x, y))
        least, out_ahead, x_ahead, y_ahead = lowest(motion, sites, i, longest(q, r, most))
        if least > AHEAD:
            return True
        share = 2.0 / (step + 2.0)
        out += share * (out_ahead - out)
        x += share * (x_ahead - x)
        y += share * (y_ahead - y)
        p, q, r = velocity(motion, (out, x, y))
        if p + sites.friction[i] * math.sqrt(q * q + r * r) <= 0.0:
            break
    shift[0], shift[1], shift[2] = out, x, y
    return False


@loop("numpy")
def is_open(motions: Array, sites: Sites, shifts: Array) -> bool:
    """Return whether no contact resists a twist at some places; fill these in as `shifts`."""
    for i in range(len(sites.points)):
        if resists(motions[i], sites, i, shifts[i]):
            return False
        p, q, r = velocity(motions[i], (shifts[i, 0], shifts[i, 1], shifts[i, 2]))
        if p + sites.friction[i] * math.sqrt(q * q + r * r) > 0.0:
            return False
    return True
