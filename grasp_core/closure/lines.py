"""Classifies four lines in space: whether they are linearly dependent, and in which way (P1).

Solved: the Grassmann class of four lines, from the two numbers that decide it.

A line through x with unit direction d has the Pluecker vector (d, x x d). Forces along four
lines can only balance if the four vectors are dependent, of rank 3 at most:

    rank of the vectors (d_i, x_i x d_i)  <=  3.                                        (1)

The lines of their span are where the span meets the Klein quadric, the vectors with d.m = 0, so
the class is the rank, on that span, of the form

    <(d, m), (d', m')>  =  d.m' + d'.m:                                                 (2)

    3  regulus: a conic of pairwise skew lines, one family of a hyperboloid or paraboloid
    2  pencil: two flat pencils that share a line and lie in different planes
    0  concurrent (in one point, perhaps at infinity) or planar: every two lines meet

Source: Sudsang & Ponce 1995, Proposition 2; Dandurand, "The rigidity of compound spatial
grids", Structural Topology 10, 1984, for line varieties.
"""

import math
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, cross, frozen
from grasp_core.closure.contacts import check_spread
from grasp_core.errors import InputError

LineClass: TypeAlias = Literal["planar", "concurrent", "pencil", "regulus", "independent"]

ON_CLASS = 1e-7
"""Singular values and eigenvalues below this count as zero, for unit directions and points
spread over a unit length: ten times what a linear program's answer may be off."""
ONE_POINT = 1e-12
"""Points closer than this, relative to their coordinates, are one point."""
LINES = 4
REGULUS_RANK = 3
"""Rank of the reciprocal form on the span of four lines that lie on a regulus."""


def plucker_vectors(points: Array, directions: Array) -> Array:
    """Return the Pluecker vectors (d, x x d) of lines, (..., 6)."""
    return np.concatenate([directions, cross(points, directions)], axis=-1)


def classify_lines(points: ArrayLike, directions: ArrayLike) -> LineClass:
    """Classify the smallest line variety of rank 3 that holds four lines.

    Lines that lie in a plane are `planar` even if they also meet; parallel lines are
    `concurrent`. The spread of the points sets the length against which tolerances count.

    Args:
        points: One point on each line, (4, 3) [m].
        directions: Non-zero vectors along the lines, of any length, (4, 3).

    Raises:
        InputError: A shape is wrong, or a direction is zero.
    """
    x = frozen(points, (4, 3), "points")
    return classify_each(x[None], frozen(directions, (4, 3), "directions")[None])[0]


def classify_each(points: Array, directions: Array) -> list[LineClass]:
    """Classify many sets of four lines, (g, 4, 3) each, as `classify_lines` classifies one."""
    lengths = np.linalg.norm(directions, axis=-1, keepdims=True)
    if lengths.min(initial=math.inf) < SMALLEST_SIZE:
        raise InputError(
            f"directions must not be zero: each must have a length of {SMALLEST_SIZE:g} "
            f"at least, got {float(lengths.min()):.6g}"
        )
    check_spread(np.ptp(points, axis=1), "points")
    units = directions / lengths
    # lengths count relative to the spread, unless the points are one point but for rounding
    arms = points - points.mean(axis=1, keepdims=True)
    spreads = np.linalg.norm(arms, axis=-1).max(axis=-1, initial=0.0)
    wide = spreads > ONE_POINT * np.abs(points).max(axis=(1, 2), initial=0.0)
    arms = arms / np.where(wide, spreads, 1.0)[:, None, None]
    _, sizes, basis = np.linalg.svd(plucker_vectors(arms, units), full_matrices=False)
    # dependent vectors are those of (1)
    spanning = sizes > ON_CLASS
    span = basis * spanning[..., None]
    # (2), on an orthonormal basis of the span, and zero on what is left of the four
    form = span[..., :3] @ span[..., 3:].swapaxes(-1, -2)
    values = np.linalg.eigvalsh(form + form.swapaxes(-1, -2))
    meeting = (np.abs(values) > ON_CLASS).sum(axis=-1)
    # of form zero: planar lines and their points span two dimensions
    flat = np.linalg.svd(np.concatenate([units, arms], axis=1), compute_uv=False)[:, 2] <= ON_CLASS
    found: list[LineClass] = []
    ranks = spanning.sum(axis=-1)
    for rank, count, plane in zip(ranks.tolist(), meeting.tolist(), flat.tolist(), strict=True):
        together: LineClass = "planar" if plane else "concurrent"
        crossing: LineClass = "regulus" if count >= REGULUS_RANK else "pencil"
        found.append("independent" if rank == LINES else crossing if count else together)
    return found
