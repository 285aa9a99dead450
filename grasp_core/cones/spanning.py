"""Decides when four cones positively span space, whatever direction each contributes (P3).

Solved: Definition 3 of the paper in closed form, and all face quadruples that satisfy it.

Four vectors theta-positively span R^3 when every choice of one vector from each cone of
half-angle theta around them positively spans R^3. Let A have the unit axes of three of the
four cones as rows. If the axes themselves positively span, then by continuity the property
first fails when some triple of cones admits linearly dependent picks, that is, when a plane
through the origin with unit normal g meets all three,

    |A g| <= sin(psi)  row by row.                                                      (1)

With y = A g such a g exists iff some y in that box has |A^-1 y| >= 1, and a convex function is
largest at a corner of the box. So, for equal half-angles,

    sin(theta*) = min over the 4 triples, over signs s in {+-1}^3, of 1 / |A^-1 s|,     (2)

and the property holds exactly for theta < theta*. The columns of A^-1 are cross products of
the axes over det A; `spanning_kernel` evaluates it so. theta* never exceeds asin(1/3): the
ball of radius sin(theta*) lies in a tetrahedron inscribed in the unit sphere.

Source: Sudsang & Ponce 1995, Definition 3 and Proposition 4; the closed form is this project's.
"""

import math
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import Array, Indices, frozen, frozen_units
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.values import FINGERS

ORTHANT_SIGNS = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]], dtype=np.float64)
SPANNING_KERNEL = "grasp_core.cones.spanning_kernel"
FEW_DIRECTIONS = 30
"""Number of directions up to which trying all quadruples is faster than loading compiled code."""
GUESS = 2
"""Number of quadruples per pair of directions for which memory is reserved before they are counted.
"""
COPLANAR = 1e-12
"""Determinant below which three unit vectors count as coplanar: a few rounding errors."""
TRIPLES = np.array(list(combinations(range(FINGERS), 3)))


def span_angle(normals: ArrayLike) -> float:
    """Find the largest half-angle below which four cones around unit vectors positively span.

    Args:
        normals: Unit vectors, (4, 3).

    Returns:
        theta* [rad]; 0.0 when the vectors themselves do not positively span R^3.
    """
    return float(span_angles(frozen_units(normals, (4, 3), "normals")[None])[0])


def count_spanning(normals: ArrayLike, least: float) -> int:
    """Count the quadruples of unit vectors (n, 3) that span at an angle [rad]."""
    units = frozen_units(normals, (None, 3), "normals")
    if len(units) <= FEW_DIRECTIONS:
        every = np.array(list(combinations(units, 4))).reshape(-1, 4, 3)
        return int(np.count_nonzero(span_angles(every) > least))
    table = SpanningTable(units, least)
    return sum(table.count(newest) for newest in range(len(units)))


def span_sines(units: Array) -> Array:
    """Compute sin(theta*) of quadruples, (q,); below zero, by how much a weight is too small."""
    sines = np.empty(len(units))
    compiled(SPANNING_KERNEL).fill_span_sines(np.ascontiguousarray(units), sines)
    return sines


def cones_positively_span(axes: ArrayLike, half_angles: ArrayLike) -> bool:
    """Return whether four circular cones positively span R^3 whatever vector each contributes.

    The cones may have different half-angles and any axes: this is the generalised P3.

    Args:
        axes: Unit vectors, (4, 3).
        half_angles: Half-angles of the cones, (4,) [rad].

    Raises:
        InputError: Shapes, lengths or angles are wrong.
    """
    units = frozen_units(axes, (4, 3), "axes")
    angles = frozen(half_angles, (4,), "half_angles")
    if (angles < 0.0).any() or (angles >= np.pi / 2).any():
        raise InputError(
            f"half_angles must be at least 0 and below pi/2 rad, got {angles.tolist()}"
        )
    return bool(each_cones_positively_span(units[None], angles[None])[0])


def angles_between(one: Array, other: Array) -> Array:
    """Compute angles [rad] between vectors (..., 3), accurate for small ones too, (...).

    The inverse cosine would give up half of the digits of a small angle.
    """
    along = np.sum(one * other, axis=-1)
    across: Array = np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), along)
    return across


def positively_span(vectors: Array) -> NDArray[np.bool_]:
    """Return whether a combination of four vectors (..., 4, 3) with positive weights vanishes."""
    # the weights of a vanishing combination by Cramer's rule, but for signs
    signed = np.linalg.det(vectors[..., TRIPLES[::-1], :]) * (1.0, -1.0, 1.0, -1.0)
    found: NDArray[np.bool_] = (signed.min(axis=-1) > COPLANAR) | (signed.max(axis=-1) < -COPLANAR)
    return found


class SpanningTable:
    """Spanning quadruples of directions, listed by the last of their directions."""

    def __init__(self, normals: Array, least_angle: float) -> None:
        self.units, self.least = np.ascontiguousarray(normals), math.sin(least_angle)
        self.kernel = compiled(SPANNING_KERNEL)
        self.size, self.bits = 0, self.kernel.empty_table(len(normals))

    def quadruples(self, start: int, end: int) -> Indices:
        """List quadruples whose last direction is one of start .. end - 1, faces ascending."""
        self._extend(end)
        listed = np.concatenate([self._ending_in(newest) for newest in range(start, end)])
        # in lexicographic order
        places = end ** np.arange(3, -1, -1)
        return np.sort(listed @ places)[:, None] // places % end

    def count(self, newest: int) -> int:
        """Count the spanning quadruples whose last direction is the given one."""
        self._extend(newest + 1)
        return int(self.kernel.quadruples(self.bits, newest, np.empty((0, 4), dtype=np.int64)))

    def _extend(self, end: int) -> None:
        if self.size < end:
            self.kernel.extend(self.bits, self.units, self.size, end, self.least)
            self.size = end

    def _ending_in(self, newest: int) -> Indices:
        # rather than counting first, a guess at the room: counting costs as much as listing
        found = np.empty((GUESS * newest * newest, 4), dtype=np.int64)
        count = self.kernel.quadruples(self.bits, newest, found)
        if count > len(found):
            found = np.empty((count, 4), dtype=np.int64)
            self.kernel.quadruples(self.bits, newest, found)
        return found[:count].copy()


def span_angles(normals: Array) -> Array:
    """Find the span angles of quadruples (q, 4, 3), (q,) [rad]; 0.0 where they do not span."""
    spans, angles = positively_span(normals), np.zeros(len(normals))
    angles[spans] = np.arcsin(1.0 / _farthest(normals[spans], np.ones((1, FINGERS))))  # (2)
    return angles


def each_cones_positively_span(axes: Array, half_angles: Array) -> NDArray[np.bool_]:
    """Return which quadruples of circular cones satisfy the generalised P3, (q,)."""
    # positive spanning is what continuity in the derivation starts from
    spans = positively_span(axes)
    # none of the box (1) may reach the unit sphere
    spans[spans] = _farthest(axes[spans], np.sin(half_angles[spans])) < 1.0
    return spans


def _farthest(axes: Array, sines: Array) -> Array:
    """Find the largest |A^-1 y| over the triples' boxes |y_j| <= sines_j, (q,)."""
    corners = ORTHANT_SIGNS * sines[:, TRIPLES][:, :, None]
    reached = np.linalg.solve(axes[:, TRIPLES], corners.swapaxes(-1, -2))
    farthest: Array = np.linalg.norm(reached, axis=-2).max(axis=(1, 2), initial=0.0)
    return farthest
