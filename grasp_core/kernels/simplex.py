"""The dual simplex method on one small dense program.

    maximise c.x  subject to  a_k.x <= b_k (or = b_k).

Solved: which n rows hold with equality at a best vertex, or with which of them another row is in
contradiction. `lp` solves for the vertex and the multipliers afresh and checks them.

Method. Any n independent rows, the basis, meet in a point x and give c = y_1 a_1 + .. + y_n a_n. As
long as y >= 0 (of any sign for equalities), c.x is at least the optimum. The corner on the side of
c of the box |x_i| <= BOX is such a basis, with which the search begins. If x violates a row r,
write a_r = alpha_1 a_1 + .. + alpha_n a_n: r enters, and the row with the least y_j / alpha_j among
positive alpha_j leaves, which keeps y >= 0 and lowers c.x. Without a positive alpha_j no point
meets both r and the basis. Of the violated rows the one that is violated most enters; after many
steps that lower nothing the first one does, which leaves most circles. Steps are limited: a circle
ends as LOST.
"""

from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType, reportMissingTypeStubs]
from numba.core.errors import NumbaError  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices

BOX = 1e3
"""Programs are of order one; what ends at the box is left to another solver."""
VIOLATED = 1e-10
"""Distance from a row that counts as a violation."""
POSITIVE = 1e-9
"""Least alpha_j that may become a pivot."""
SAME_RATIO = 1e-12
UNCHANGED = 1e-13
"""Steps that lower c.x by less do not count as progress."""
PATIENCE, MOST = 3, 60
"""Steps without progress until the first row enters, and steps in all, per variable."""
OPTIMAL, INFEASIBLE, BELOW, LOST = 0, 1, 2, 3


def try_out() -> None:
    """Solve a tiny program.

    Raises:
        RuntimeError: The method cannot be compiled here.
    """
    basis = np.empty(1, dtype=np.int64)
    one = np.ones(1)
    try:
        solve(one, Rows(np.ones((1, 1)), one, one, 0), -np.inf, basis)
    except NumbaError as error:
        raise RuntimeError(f"numba: {error}") from error


class Rows(NamedTuple):
    """The rows of a program; those of equalities come last, and may be turned around."""

    A: Array
    """(rows, n), contiguous."""
    b: Array
    """(rows,)"""
    norms: Array
    """Their lengths, (rows,)."""
    equalities: int


@njit(cache=True)
def solve(c: Array, rows: Rows, cutoff: float, basis: Indices) -> tuple[int, int]:
    """Find a best vertex.

    Args:
        c: (n,)
        rows: Of the program.
        cutoff: Stop as soon as the optimum is known to be smaller.
        basis: Filled with the rows of the basis, (n,); rows + 2 i and rows + 2 i + 1 are the upper
            and the lower side of the box.

    Returns:
        How it ended, and the row that contradicts the basis, if one does.
    """
    n, count, idle = len(c), len(rows.b), 0
    inverse, x, y, value = _corner(c, count, basis)
    alpha, inside = np.empty(n), np.zeros(count, dtype=np.bool_)
    for _ in range(MOST * n):
        if value < cutoff and not _leans_on_box(y, basis, count):
            return BELOW, -1
        entering = _violated(x, rows, inside, idle > PATIENCE * n)
        if entering < 0:
            return OPTIMAL, -1
        excess = _turned(x, rows, entering)
        _combined(rows.A[entering], inverse, alpha)
        leaving = _leaving(y, alpha, basis, rows)
        if leaving < 0:
            return INFEASIBLE, entering
        drop = max(y[leaving] / alpha[leaving], 0.0)
        idle = idle + 1 if drop * excess < UNCHANGED else 0
        value -= drop * excess
        _exchange(inverse, x, alpha, leaving, excess)
        for j in range(n):
            y[j] -= drop * alpha[j]
        y[leaving] = drop
        if basis[leaving] < count:
            inside[basis[leaving]] = False
        inside[entering] = True
        basis[leaving] = entering
    return LOST, -1


@njit(cache=True)
def _corner(c: Array, count: int, basis: Indices) -> tuple[Array, Array, Array, float]:
    """The corner of the box on the side of c: inverse of its basis, x, y and c.x."""
    n = len(c)
    inverse, x, y, value = np.zeros((n, n)), np.empty(n), np.empty(n), 0.0
    for i in range(n):
        side = 1.0 if c[i] >= 0.0 else -1.0
        basis[i] = count + 2 * i + (0 if side > 0.0 else 1)
        inverse[i, i], x[i], y[i] = side, side * BOX, abs(c[i])
        value += c[i] * x[i]
    return inverse, x, y, value


@njit(cache=True)
def _leans_on_box(y: Array, basis: Indices, count: int) -> bool:
    leans = False
    for j in range(len(y)):
        leans |= basis[j] >= count and y[j] > 0.0
    return leans


@njit(cache=True)
def _violated(x: Array, rows: Rows, inside: NDArray[np.bool_], first: bool) -> int:
    """The row that x violates most, or the first one; -1 if it violates none."""
    worst, found = VIOLATED, -1
    for k in range(len(rows.b)):
        if inside[k]:
            continue
        excess = _excess(x, rows, k)
        if k >= len(rows.b) - rows.equalities:
            excess = abs(excess)
        if excess > worst * rows.norms[k]:
            worst, found = excess / rows.norms[k], k
            if first:
                break
    return found


@njit(cache=True)
def _excess(x: Array, rows: Rows, k: int) -> float:
    excess = -rows.b[k]
    for i in range(len(x)):
        excess += rows.A[k, i] * x[i]
    return excess


@njit(cache=True)
def _turned(x: Array, rows: Rows, k: int) -> float:
    """How far x is beyond a row, where an equality is turned so that it is beyond."""
    excess = _excess(x, rows, k)
    if excess < 0.0:
        rows.b[k] = -rows.b[k]
        for i in range(len(x)):
            rows.A[k, i] = -rows.A[k, i]
    return abs(excess)


@njit(cache=True)
def _combined(row: Array, inverse: Array, alpha: Array) -> None:
    """Write a row as a combination of those of the basis."""
    for j in range(len(row)):
        alpha[j] = 0.0
        for i in range(len(row)):
            alpha[j] += row[i] * inverse[i, j]


@njit(cache=True)
def _leaving(y: Array, alpha: Array, basis: Indices, rows: Rows) -> int:
    """Of the least ratios y / alpha the one with the largest alpha; -1 if no alpha is positive.

    Equalities stay.
    """
    count, least, found = len(rows.b), np.inf, -1
    for j in range(len(y)):
        if alpha[j] <= POSITIVE or count - rows.equalities <= basis[j] < count:
            continue
        ratio = y[j] / alpha[j]
        tie = ratio <= least + SAME_RATIO
        if ratio < least - SAME_RATIO or (tie and alpha[j] > alpha[found]):
            least, found = min(ratio, least), j
    return found


@njit(cache=True)
def _exchange(inverse: Array, x: Array, alpha: Array, leaving: int, excess: float) -> None:
    """Put a row in the place of another: the point moves onto it along the others."""
    n = len(x)
    for i in range(n):
        step = inverse[i, leaving] / alpha[leaving]
        for j in range(n):
            inverse[i, j] -= alpha[j] * step
        inverse[i, leaving] = step
        x[i] -= excess * step
