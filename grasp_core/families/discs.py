"""Finds four discs of the largest common radius, and then enlarges each as far as possible.

The first program maximises the smallest radius. That radius may be negative, so the program is
always feasible and the sign of its optimum, with the multipliers that prove it, decides. The
second keeps the smallest radius and maximises the sum of the four, so that contacts whose discs
have room do not end up against an arbitrary edge. Among its optima the point nearest to the origin
of the variables is taken (see `ties`).
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError
from grasp_core.families.placements import NoPlacement
from grasp_core.solvers.lp import (
    RESIDUAL,
    Below,
    Infeasible,
    LinearProgram,
    Optimum,
    maximize,
    maximize_above,
)
from grasp_core.solvers.ties import nearest_optimum

KEPT = 1e-6
"""Share of the smallest radius that the second program may give up. With less, its optima would
form slivers, in which rounding moves the nearest point a thousand times as far."""


@dataclass(frozen=True, slots=True, eq=False)
class LargestDiscs:
    """The variables of the disc program, and the radius that it maximised."""

    x: Array
    """Variables, (n,); the radii among them are reduced by the error of a program's answer."""
    merit: float
    """Largest value of the smallest radius: the same on every machine except for the last digits.
    """


def largest_discs(
    A: Array, b: Array, radii: slice, smallest: int, least: float
) -> LargestDiscs | NoPlacement:
    """Find the largest four equal discs, then enlarge each, subject to rows A x <= b.

    Takes `A` (rows, n); `b` (rows,). Gives the discs, or a proved bound below `least` on their
    common radius.
    """
    n = A.shape[1]
    common = np.eye(n)[smallest]
    first = maximize_above(LinearProgram(common, A, b), least)
    if isinstance(first, Infeasible):
        raise SolverError(
            "the solver called a disc program infeasible, though small discs always fit"
        )
    if isinstance(first, Below):
        return NoPlacement(first.bound)
    if first.value < least:
        return NoPlacement(first.value)
    kept = LinearProgram(
        np.eye(n)[radii].sum(axis=0),
        np.vstack([A, -common]),
        np.append(b, -first.value * (1.0 - KEPT)),
    )
    try:
        second = maximize(kept)
    except SolverError:
        second = first  # within rounding of infeasible where discs are tiny
    x = nearest_optimum(kept, second) if isinstance(second, Optimum) else first.x
    x = np.array(x)
    x[radii] = np.maximum(x[radii] - RESIDUAL, 0.0)
    return LargestDiscs(x, first.value - RESIDUAL)
