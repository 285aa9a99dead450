"""Makes the flat sides of a box with rounded edges: all points within a radius of a box.

The sides are those of a coarse ball whose eight octants are moved apart to the corners of the box.
The points of the ball are at equal steps of latitude and longitude, and those on the border of two
octants occur twice, once for the corner on either side: what lies between the two is a side of the
box or a part of a round edge. Where the box or the radius has no size, sides without area are left
out. So the same rule makes boxes, capsules and balls.
"""

from collections.abc import Iterator
from functools import cache
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices

STEPS = 3
"""Number of sides along a quarter of a circle."""
FEWEST_CORNERS = 3
SAME = 1e-9
"""Distance below which corners of a box of size 1 are one: far above rounding."""
Truths: TypeAlias = NDArray[np.bool_]
"""Array of truths, of any shape."""
Ends: TypeAlias = tuple[bool, bool, bool]
"""A truth about each axis of a box."""


def rounded_box(low: Array, high: Array, radius: float, outer: Truths) -> tuple[Array, ...]:
    """Make the sides of a rounded box, or of a piece of one that is cut across its axes.

    Takes `low`, `high` (3,) [m]; `radius` [m]; `outer` (2, 3). Gives flat sides in the axes of the
    box, (k, 3) each [m], corners counter-clockwise as seen from outside.
    """
    first, last = _ends(outer[0]), _ends(outer[1])
    sides = _sides(_ends(high > low), radius > 0.0, first, last)
    corners = _corners(low, high, radius, first, last)
    return tuple(corners[side] for side in sides)


def _ends(row: Truths) -> Ends:
    x, y, z = row.tolist()
    return x, y, z


def _corners(low: Array, high: Array, radius: float, first: Ends, last: Ends) -> Array:
    """Place every point of the ball, (rows * columns, 3) [m]."""
    ways, upper = _grid()
    reach = radius * np.where(upper, last, first)
    return (np.where(upper, high, low) + reach * ways).reshape(-1, 3)


@cache
def _sides(long: Ends, rounded: bool, first: Ends, last: Ends) -> tuple[Indices, ...]:
    """Return the corners of each side that has an area and is not a cut."""
    # which corners coincide does not depend on sizes, so that a box of size 1 tells
    high = np.array(long, dtype=float)
    corners = _corners(-high, high, float(rounded), first, last)
    cut = np.zeros(len(corners), dtype=np.int64)  # one bit for each cut that a corner lies in
    for bit, (end, sign) in enumerate([(first, -1.0), (last, 1.0)]):
        for axis in range(3):
            if not end[axis]:
                on = np.abs(corners[:, axis] - sign * high[axis]) < SAME
                cut |= on.astype(np.int64) << (3 * bit + axis)
    kept = (_without_repeats(side, corners) for side in _around())
    return tuple(
        side for side in kept
        if len(side) >= FEWEST_CORNERS and not np.bitwise_and.reduce(cut[side])
    )  # fmt: skip


def _around() -> Iterator[Indices]:
    """Yield the corners of the sides around the poles, and of those between them."""
    rows, columns = _grid()[0].shape[:2]
    places: Indices = np.arange(rows * columns, dtype=np.int64).reshape(rows, columns)
    yield places[0]
    yield places[-1, ::-1]
    for i, j in product(range(rows - 1), range(columns)):
        k = (j + 1) % columns
        yield places[[i, i + 1, i + 1, i], [j, j, k, k]]


def _without_repeats(side: Indices, corners: Array) -> Indices:
    """Leave out corners that are where the next one is."""
    here = corners[side]
    return side[np.abs(np.roll(here, -1, axis=0) - here).max(axis=1) > SAME]


@cache
def _grid() -> tuple[Array, Truths]:
    """Return the points of a ball, from its upper pole to its lower one, and their octants.

    Gives unit vectors, (rows, columns, 3), and whether each belongs to the upper half along each
    axis, of the same shape.
    """
    quarter = np.linspace(0.0, 0.5 * np.pi, STEPS + 1)
    heights = np.concatenate([quarter[::-1], -quarter])
    above = np.repeat([1.0, -1.0], STEPS + 1)
    turns = (0.5 * np.pi * np.arange(4)[:, None] + quarter).ravel()
    middles = np.repeat(0.5 * np.pi * np.arange(4) + 0.25 * np.pi, STEPS + 1)
    flat, up = np.cos(heights)[:, None], np.sin(heights)[:, None]
    ones = np.ones((len(heights), len(turns)))
    ways = np.stack([flat * np.cos(turns), flat * np.sin(turns), up * ones], axis=-1)
    signs = np.stack(
        [np.sign(np.cos(middles)) * ones, np.sign(np.sin(middles)) * ones, above[:, None] * ones],
        axis=-1,
    )
    return ways, signs > 0.0
