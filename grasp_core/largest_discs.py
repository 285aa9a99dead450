"""Four discs of the largest common radius, and then each as large as it can be.

The first program maximises the smallest radius. It is free in sign, so that the program is
always feasible and the sign of its optimum, with the multipliers that prove it, decides. The
second keeps the smallest radius and maximises the sum of the four, so that contacts whose discs
have room do not end up against an arbitrary edge.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError
from grasp_core.lp import (
    RESIDUAL,
    Below,
    Infeasible,
    LinearProgram,
    Optimum,
    maximize,
    maximize_above,
)
from grasp_core.placements import NoPlacement

KEPT = 1e-9
"""Share of the smallest radius that the second program may give up: the accuracy asked of the
first."""


def largest_discs(
    A: Array, b: Array, radii: slice, smallest: int, least: float
) -> Array | NoPlacement:
    """Solve both programs over the variables x with A x <= b.

    Args:
        A: (rows, n); rows must keep the smallest radius below each of the four.
        b: (rows,)
        radii: Where the four radii are in x.
        smallest: Where their lower bound is.
        least: Smaller discs count as none.

    Returns:
        The variables (n,), with the radii reduced by what a program's answer may be off; or, if
        the common radius is below `least`, the proof.

    Raises:
        SolverError: A program's answer failed its check.
    """
    n = A.shape[1]
    common = np.eye(n)[smallest]
    first = maximize_above(LinearProgram(common, A, b), least)
    if isinstance(first, Infeasible):
        raise SolverError("a program that is feasible for small enough radii was called infeasible")
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
    x = (second if isinstance(second, Optimum) else first).x.copy()
    x[radii] = np.maximum(x[radii] - RESIDUAL, 0.0)
    return x
