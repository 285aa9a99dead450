"""Decides between equal candidates with a margin, never by the last digits of numbers.

Two machines, or two ways to write the same object down, give numbers that differ in their last
digits. Where candidates are equal in truth, a plain comparison would pick another one on each.
These rules replace it wherever something is chosen.

1. *Optima of linear programs* are often faces of the feasible set, not points. Of all points whose
   value is within `SAME_VALUE` of the best, `nearest_optimum` takes the one nearest to the origin
   of the variables. It is unique, as the squared distance is strictly convex, and it moves
   only as far as rounding moves the rows, times a constant of the program.
2. *The best of several:* `first_best` takes the first one that is within a margin of the best.
   Where candidates come one by one, a later one has to be better by a margin, see `surpassing`.
3. *Orders:* `smallest_first` calls numbers equal that a chain of small gaps connects, so that a
   second key decides, as a rule the faces, ascending. Of numbers that come one by one, `graded`
   counts the cells of a grid up to each. The grid is shifted by a fraction that no ratio of small
   whole numbers comes near: the numbers of regular objects (0, 1/2, 1/3) are far from borders.
4. *Searches of many steps*, whose every comparison would need a margin, are given no last digits:
   compiled loops get numbers that lie on a grid, see `on_grid` and `few_digits`. Their sums have
   one order on all machines, so that they decide alike. What they find is proved for the exact
   numbers.

What is left to chance is a number that comes within rounding of a border by accident: with
fourteen good digits and cells of 1e-7, one in ten million.
"""

import math
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SHIFT, Array, Indices
from grasp_core.solvers.lp import LinearProgram, Optimum
from grasp_core.solvers.qp import least_distance

SAME_VALUE = 1e-5
"""Share of a program's value that the nearest optimum may give up: with less, optima form thin
slivers, in which rounding moves the nearest point farther."""
CONDITIONS_MET = 1e-7
"""Error up to which the conditions of a nearest optimum are met. They are met by far or not at all:
an answer near this limit would be accepted on one machine only."""
GRID_DIGITS = 9
"""Digits after the point to which numbers are rounded before searches of many steps, at size one.
"""
FEASIBLE = 1e-9
"""Distance by which the nearest optimum may violate a row."""
SAME_DIGITS = 7
"""Default number of digits after the point to which numbers are compared, at object size one."""
SAME_SHARE = 1e-6
"""Difference from the best value, as a share of it, that does not count."""


@overload
def graded(values: float, digits: int = SAME_DIGITS) -> float: ...
@overload
def graded(values: Array, digits: int = SAME_DIGITS) -> Array: ...
def graded(values: float | Array, digits: int = SAME_DIGITS) -> float | Array:
    """Number the cells of a grid in which values lie, of any shape; equal values share a cell."""
    cells = np.floor(np.asarray(values, dtype=np.float64) * 10.0**digits + SHIFT)
    return cells if cells.ndim else float(cells)


@overload
def coarse(values: float, digits: int = SAME_DIGITS) -> float: ...
@overload
def coarse(values: Array, digits: int = SAME_DIGITS) -> Array: ...
def coarse(values: float | Array, digits: int = SAME_DIGITS) -> float | Array:
    """Return the upper end of each value's cell: an upper bound that equal values share."""
    return (graded(values, digits) + (1.0 - SHIFT)) * 10.0**-digits


def on_grid(values: Array, digits: int = GRID_DIGITS) -> Array:
    """Replace each value by a number of its cell, of any shape; equal values then share all bits.

    The number has `digits` digits after the point, and is at most 0.62 units of the last one away.
    """
    return graded(values, digits) * 10.0**-digits


def few_digits(number: float, share: float) -> float:
    """Round a positive number down to few binary digits, by less than a share of it."""
    digits = 2 - math.frexp(share)[1]
    mantissa, exponent = math.frexp(number)
    return math.ldexp(math.floor(math.ldexp(mantissa, digits)), exponent - digits)


def ranks(values: ArrayLike, share: float = SAME_SHARE) -> Indices:
    """Rank numbers, (n,): 0 for the smallest and all that equal it, 1 for the next, and so on."""
    numbers = np.asarray(values, dtype=np.float64)
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    sizes = np.where(np.isfinite(ordered), np.abs(ordered), 0.0)
    with np.errstate(invalid="ignore"):  # infinities are equal to themselves, and to nothing else
        near = np.diff(ordered) <= share * np.maximum(sizes[1:], sizes[:-1])
    apart = ~near & (ordered[1:] != ordered[:-1])
    found = np.empty(len(numbers), dtype=np.int64)
    found[order] = np.concatenate([[0], np.cumsum(apart)])[: len(numbers)]
    return found


def smallest_first(values: ArrayLike) -> list[int]:
    """List the indices of numbers in rising order, (n,); equal ones keep their order."""
    return [int(place) for place in np.argsort(ranks(values), kind="stable")]


def largest_first(values: ArrayLike) -> list[int]:
    """List the indices of numbers in falling order, (n,); equal ones keep their order."""
    return smallest_first(-np.asarray(values, dtype=np.float64))


def first_best(values: ArrayLike, margin: float | None = None) -> int:
    """Find the index of the first value, (n,), that equals the largest one within a margin."""
    numbers = np.asarray(values, dtype=np.float64)
    best = float(numbers.max())
    allowed = SAME_SHARE * abs(best) if margin is None else margin
    near = numbers >= best - allowed if math.isfinite(best) else numbers == best
    return int(np.argmax(near))


def surpassing(best: float) -> float:
    """Return what a later candidate must exceed to count as better than the best so far."""
    return best + SAME_SHARE * abs(best) if math.isfinite(best) else best


def nearest_optimum(program: LinearProgram, optimum: Optimum, share: float = SAME_VALUE) -> Array:
    """Find the optimum nearest to the origin, (n,), or the optimum itself if it cannot be found."""
    G, h = program.stacked()
    kept = optimum.value - share * (1.0 + abs(optimum.value))
    equalities = slice(len(program.b), None)
    rows = np.vstack([G, -program.c[None], -G[equalities]])
    limits = np.concatenate([h, [-kept], -h[equalities]])
    x = least_distance(rows, limits, accuracy=CONDITIONS_MET)
    return x if float((rows @ x - limits).max()) <= FEASIBLE else optimum.x  # nor if there is none
