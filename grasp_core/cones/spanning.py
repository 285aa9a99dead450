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
the axes over det A, which is how the code evaluates it. theta* never exceeds asin(1/3): the
ball of radius sin(theta*) lies in a tetrahedron inscribed in the unit sphere.

Source: Sudsang & Ponce 1995, Definition 3 and Proposition 4; the closed form is this project's.
"""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import Array, Indices, frozen, frozen_units
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.values import FINGERS

SIGNS = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]], dtype=np.float64)
KERNEL = "grasp_core.cones.spanning_kernel"
FEW = 30
"""Number of directions up to which trying all quadruples is faster than loading compiled code."""
GUESS = 2
"""Number of quadruples per pair of directions for which memory is reserved before they are counted.
"""
OTHERS = ([1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2])
"""Indices of the other three cones, for each of the four."""
DEPENDENT = 1e-12
"""Determinant below which three unit vectors count as coplanar: a few rounding errors."""
TRIPLES = np.array(list(combinations(range(FINGERS), 3)))
"""Indices of three of four vectors, (4, 3)."""


def span_angle(normals: ArrayLike) -> float:
    """Find the largest half-angle below which four cones around unit vectors positively span.

    Args:
        normals: Unit vectors, (4, 3).

    Returns:
        theta* [rad]; 0.0 when the vectors themselves do not positively span R^3.
    """
    units = frozen_units(normals, (4, 3), "normals")
    if not positively_span(units):
        return 0.0
    # (2), the minimum over signs being taken in `triple_sine`
    return math.asin(min(abs(triple_sine(*units[triple])) for triple in TRIPLES))


def count_spanning(normals: ArrayLike, least: float) -> int:
    """Count the quadruples of unit vectors (n, 3) that span at an angle [rad]."""
    units = frozen_units(normals, (None, 3), "normals")
    if len(units) <= FEW:
        every = np.array(list(combinations(units, 4))).reshape(-1, 4, 3)
        return int(np.count_nonzero(span_sines(every) > math.sin(least)))
    table = SpanningTable(units, least)
    return sum(table.count(newest) for newest in range(len(units)))


def span_sines(units: Array) -> Array:
    """Compute sin(theta*) of many quadruples (q, 4, 3), (q,); negative where they do not span.

    The negative value tells how far the worst weight in a vanishing combination is from positive.

    The formula is (2), written with the cosines between the vectors: with (v x w).(w x u) =
    (v.w)(w.u) - u.v, the largest |+-(v x w) +-(w x u) +-(u x v)| needs no cross products. A few
    arrays along all quadruples make this ten times as fast as a formula for each.
    """
    one, two, three, four = np.ascontiguousarray(np.moveaxis(units, 0, -1))
    # weights of a vanishing combination: all of one sign where the four positively span
    front, back = _crossed(one, two), _crossed(three, four)
    minors = (_dotted(two, back), _dotted(one, back), _dotted(four, front), _dotted(three, front))
    signed: Array = np.stack([minors[0], -minors[1], minors[2], -minors[3]])
    total: Array = np.sum(signed, axis=0)
    lowest: Array = np.min(signed * np.sign(total), axis=0, initial=np.inf)
    farthest: Array = np.max(np.abs(signed), axis=0, initial=0.0)
    sided: NDArray[np.bool_] = np.abs(total) > DEPENDENT  # else none is positive, but for rounding
    worst: Array = np.where(sided, lowest, -farthest)
    vectors = (one, two, three, four)
    cosines = {
        frozenset(pair): _dotted(vectors[pair[0]], vectors[pair[1]])
        for pair in combinations(range(4), 2)
    }
    least = np.full(len(units), np.inf)
    # each triple's term of (2): its determinant over the longest signed sum of cross products
    for minor, rest in zip(minors, OTHERS, strict=True):
        g, h, k = (cosines[frozenset(pair)] for pair in combinations(rest, 2))
        a, b, c = h * k - g, g * k - h, g * h - k
        # the largest square over the signs of (2)
        most = np.maximum(np.maximum(a + b + c, a - b - c), np.maximum(b - a - c, c - a - b))
        squared = 3.0 - g * g - h * h - k * k + 2.0 * most
        size = np.abs(minor)
        safe = np.where(size > DEPENDENT, squared, np.inf)
        least = np.minimum(least, size / np.sqrt(safe))
    return np.where(worst > DEPENDENT, least, np.minimum(worst, 0.0))


def _dotted(one: Sequence[Array], two: Sequence[Array]) -> Array:
    """Compute dot products of vectors that are given by columns, (q,)."""
    return one[0] * two[0] + one[1] * two[1] + one[2] * two[2]


def _crossed(one: Sequence[Array], two: Sequence[Array]) -> tuple[Array, Array, Array]:
    """Compute cross products of vectors that are given by columns, three of (q,)."""
    (x, y, z), (u, v, w) = one, two
    return y * w - z * v, z * u - x * w, x * v - y * u


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
    signed = signed_determinants(vectors)
    found: NDArray[np.bool_] = (signed.min(axis=-1) > DEPENDENT) | (
        signed.max(axis=-1) < -DEPENDENT
    )
    return found


def balancing_weights(vectors: Array) -> Array:
    """Return weights of sum w_i v_i = 0, sum |w_i| = 1; positive if vectors span, (..., 4)."""
    signed = signed_determinants(vectors)
    tiny = float(np.finfo(np.float64).tiny)
    total = np.maximum(np.abs(signed).sum(axis=-1, keepdims=True), tiny)
    return signed / total * np.sign(signed.sum(axis=-1, keepdims=True))


def signed_determinants(vectors: Array) -> Array:
    """Return the weights of a vanishing combination by Cramer's rule, (..., 4)."""
    minors = np.stack([vectors[..., rest, :] for rest in OTHERS], axis=-3)
    determinants: Array = np.asarray(np.linalg.det(minors), dtype=np.float64)
    return determinants * (1.0, -1.0, 1.0, -1.0)


def triple_sine(one: Array, two: Array, three: Array) -> Array:
    """Compute the term of one triple of axes (..., 3) in (2), (...): zero where they are coplanar.

    It is the sine of the half-angle at which three cones first touch one plane, with the sign of
    the axes' determinant.
    """
    one, two, three = np.broadcast_arrays(one, two, three)
    crosses = np.stack([np.cross(two, three), np.cross(three, one), np.cross(one, two)], axis=-2)
    determinant = np.einsum("...i,...i->...", one, crosses[..., 0, :])
    longest = np.linalg.norm(SIGNS @ crosses, axis=-1).max(axis=-1)
    safe = np.where(np.abs(determinant) > DEPENDENT, longest, np.inf)
    return determinant / safe


class SpanningTable:
    """Spanning quadruples of directions, listed by the last of their directions."""

    def __init__(self, normals: Array, least_angle: float) -> None:
        self.units, self.least = np.ascontiguousarray(normals), math.sin(least_angle)
        self.kernel = compiled(KERNEL)
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
    triples = normals[:, TRIPLES]
    # (2), the minimum over signs being taken in `triple_sine`
    sines = np.abs(triple_sine(triples[:, :, 0], triples[:, :, 1], triples[:, :, 2]))
    least = sines.min(axis=1, initial=1.0)
    return np.where(positively_span(normals), np.arcsin(least), 0.0)


def each_cones_positively_span(axes: Array, half_angles: Array) -> NDArray[np.bool_]:
    """Return which quadruples of circular cones satisfy the generalised P3, (q,)."""
    # positive spanning is what continuity in the derivation starts from
    spans = positively_span(axes)
    triples = axes[spans][:, TRIPLES]
    sines = np.sin(half_angles[spans])[:, TRIPLES]
    # the corners of the box (1), whose sides now differ: none may reach the unit sphere
    corners = np.linalg.solve(triples, (SIGNS * sines[:, :, None]).swapaxes(-1, -2))
    spans[spans] = np.linalg.norm(corners, axis=-2).max(axis=(1, 2), initial=0.0) < 1.0
    return spans
