"""Decides which side of a surface is inside, by winding numbers, and winds triangles alike.

The winding number of a point is the sum of the solid angles of all triangles as seen from it,
divided by that of the whole sphere. It is one inside a closed surface that is wound
counter-clockwise seen from outside, and zero outside. It jumps by one across each triangle, so on a
triangle the mean of both sides, in which the triangle itself does not count, is

    1/2   where the triangle bounds the solid,
    -1/2  where it does so inside out,
    3/2   where it is inside another part of the solid.

Holes change these values by the share of the sphere that they fill, seen from the triangle.

Sources: Van Oosterom and Strackee, "The solid angle of a plane triangle", 1983; Jacobson, Kavan and
Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", 2013.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.objects.planar_faces import triangle_neighbours

MOST_ANGLES = 2_000_000
"""Largest number of solid angles that are computed for one mesh."""
FEWEST_SAMPLES, MOST_SAMPLES = 32, 256
BLOCK = 20_000
"""Number of solid angles computed at a time, which stays in the processor's cache."""


def sampled(areas: Array) -> Indices:
    """Choose triangles that stand for equal shares of a surface each, (s,).

    Takes `areas` (t,).
    """
    count = min(max(MOST_ANGLES // len(areas), FEWEST_SAMPLES), MOST_SAMPLES, len(areas))
    upto: Array = np.cumsum(areas)
    middles = np.linspace(0.0, float(upto[-1]), 2 * count + 1)[1::2]
    return np.minimum(np.searchsorted(upto, middles), len(areas) - 1)


def winding_on(corners: Array, places: Indices) -> Array:
    """Compute the mean of the winding numbers on both sides of triangles, at their middles, (s,).

    Takes `corners` (t, 3, 3); `places` (s,).
    """
    found = np.zeros(len(places))
    step = max(BLOCK // len(corners), 1)
    axes = np.ascontiguousarray(corners.transpose(2, 1, 0))
    for start in range(0, len(places), step):
        asked = places[start : start + step]
        angles = _solid_angles(axes, corners[asked].mean(axis=1))
        angles[np.arange(len(asked)), asked] = 0.0
        found[start : start + step] = angles.sum(axis=1) / (4.0 * math.pi)
    return found


def _solid_angles(axes: Array, points: Array) -> Array:
    """Compute the solid angles of triangles as seen from points, (p, t).

    Takes `axes` (3, 3, t); `points` (p, 3).
    """
    x, y, z = (axes[k] - points[:, k, None, None] for k in range(3))
    lengths = np.sqrt(x * x + y * y + z * z)
    (ax, bx, cx), (ay, by, cy), (az, bz, cz), (a, b, c) = (
        each.transpose(1, 0, 2) for each in (x, y, z, lengths)
    )
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    spread = (
        a * b * c
        + (ax * bx + ay * by + az * bz) * c
        + (bx * cx + by * cy + bz * cz) * a
        + (cx * ax + cy * ay + cz * az) * b
    )
    return 2.0 * np.arctan2(volume, spread)


def wound_alike(corners: Indices, areas: Array) -> tuple[Indices, NDArray[np.bool_]] | None:
    """Wind triangles like their neighbours; None if the surface has only one side.

    In each part that connects across edges of two triangles, the larger area keeps its winding.

    Takes `corners` (t, 3); `areas` (t,). Gives the triangles, and which of them were turned.
    """
    across = triangle_neighbours(corners)
    against = _against(corners, across)
    turned, part = np.zeros(len(corners), dtype=np.bool_), np.full(len(corners), -1)
    for seed in range(len(corners)):
        if part[seed] < 0:
            _spread(seed, across, against, turned, part)
    inner = across >= 0
    if (inner & ((turned[:, None] ^ turned[across]) != against)).any():
        return None
    size, swept = (
        np.bincount(part, weights=weight, minlength=len(corners))
        for weight in (areas, areas * turned)
    )
    turned ^= (swept > 0.5 * size)[part]
    return np.where(turned[:, None], corners[:, ::-1], corners), turned


def _spread(
    seed: int,
    across: Indices,
    against: NDArray[np.bool_],
    turned: NDArray[np.bool_],
    part: Indices,
) -> None:
    """Carry the winding of one triangle to all that connect with it; each is reached once."""
    part[seed] = seed
    front = [seed]
    while front:
        here = front.pop()
        for side in range(3):
            other = int(across[here, side])
            if other >= 0 and part[other] < 0:
                part[other], turned[other] = seed, turned[here] ^ against[here, side]
                front.append(other)


def _against(corners: Indices, across: Indices) -> NDArray[np.bool_]:
    """Tell across which edges the neighbour runs along the edge in the same direction, (t, 3)."""
    tails, heads = corners, np.roll(corners, -1, axis=1)
    others = corners[across]
    ahead = np.roll(others, -1, axis=2)
    same = (others == tails[..., None]) & (ahead == heads[..., None])
    return same.any(axis=2) & (across >= 0)
