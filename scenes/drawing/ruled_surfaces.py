"""Makes the ruled surface on which the lines of force of a regulus lie.

Take three pairwise skew lines. Through each point of the first, exactly one line meets the other
two: the intersection of the planes that the point spans with them. These transversals sweep a
hyperboloid of one sheet. Every line that depends linearly on the three, such as the fourth line of
force, meets all of them, and so lies on it too (Sudsang & Ponce 1995, section 2.2).
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from grasp_core.arrays import Array

RULINGS = 40
PARALLEL = 1e-9
"""Least length of the cross product that gives the direction of a transversal, relative to the
squared reach."""


def rulings(points: Array, directions: Array, center: Array, reach: float) -> tuple[Array, ...]:
    """Cut the transversals of three lines to segments inside a ball.

    Takes `points` (k, 3) [m]; `directions` (k, 3); `center` (3,) [m]; `reach` [m]. Gives ends of
    each segment, (2, 3) [m], with neighbouring segments next to each other.
    """
    segments = list[Array]()
    for along in np.linspace(-reach, reach, RULINGS):
        start = points[0] + along * directions[0]
        planes = np.cross(points[1:3] - start, directions[1:3])
        way = np.cross(planes[0], planes[1])
        length = float(np.linalg.norm(way))
        if length > PARALLEL * reach**2:
            segments += _inside(start, way / length, center, reach)
    return tuple(segments)


def _inside(start: Array, way: Array, center: Array, reach: float) -> list[Array]:
    """Return the part of a line inside a ball, as a list with one segment or none."""
    middle = float((center - start) @ way)
    room = reach**2 - float(np.linalg.norm(center - start - middle * way)) ** 2
    if room <= 0.0:
        return []
    half = math.sqrt(room)
    return [np.array([start + (middle - half) * way, start + (middle + half) * way])]


def between(segments: Sequence[Array]) -> tuple[Array, ...]:
    """Make the quadrilaterals between neighbouring segments, each (4, 3)."""
    quads = list[Array]()
    for one, two in pairwise(segments):
        turned = two if (one[1] - one[0]) @ (two[1] - two[0]) > 0.0 else two[::-1]
        quads.append(np.array([one[0], one[1], turned[1], turned[0]]))
    return tuple(quads)
