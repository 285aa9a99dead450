"""Places regulus grasps: compiled code chooses the slopes, and HiGHS or it confirms the choice.

The program and its derivation are in `regulus_kernel`.
"""

import math
from collections.abc import Iterable
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.families.placements import LEFT, NONE, Attempts, FaceTable, Placed
from grasp_core.solvers.lp import RESIDUAL, LinearProgram, Optimum, maximize
from grasp_core.solvers.ties import nearest_optimum

KERNEL = "grasp_core.families.regulus_kernel"
GIVEN_UP = 1e-9
"""Offset given up in favour of the least variables: giving up less makes the contacts of two
pairings differ from each other's."""
Choice: TypeAlias = tuple[int, int, int]
"""A choice to try: indices of the two pairs' slopes, and of the side of the focus line."""
CHOICES: tuple[Choice, ...] = tuple(product(range(3), range(3), range(2)))


def nearly_symmetric(axes: Array, half_angles: Array) -> NDArray[np.bool_]:
    """Return whether both pairs of each quadruple leave their slopes a choice, (q,)."""
    found = np.empty(len(axes), dtype=np.bool_)
    kernel = compiled(KERNEL)
    kernel.nearly_symmetric(np.ascontiguousarray(axes), np.ascontiguousarray(half_angles), found)
    return found


def regulus_bounds(
    table: FaceTable, attempts: Attempts, *, any_choice: bool = False
) -> tuple[Array, Indices]:
    """Bound the merits of regulus grasps, minus the largest offsets, for many attempts.

    Gives the merits of the best choices, or of any choices, (a,): minus infinity where a proof
    excludes every choice, infinity where a choice was not decided. Then these choices, (a, 3), -1
    where there is none.
    """
    bounds = np.empty(len(attempts.faces))
    chosen = np.empty((len(bounds), 3), dtype=np.int64)
    compiled(KERNEL).regulus_bounds(table, attempts, any_choice, bounds, chosen)
    return bounds, chosen


def place_reguli(table: FaceTable, attempts: Attempts, placed: Placed) -> None:
    """Place four contacts for each attempt on the lines of one regulus, near the faces' middles.

    The merit is minus the largest offset t; no placement means none for the slopes tried.
    """
    merits, chosen = regulus_bounds(table, attempts)
    for a, (merit, choice) in enumerate(zip(merits.tolist(), chosen.tolist(), strict=True)):
        try:
            best = place_best(table, attempts, a, [tuple(choice)] if choice[0] >= 0 else [], placed)
            # the program, solved again, has to confirm what compiled code chose
            if not (best == merit or abs(best - merit) <= RESIDUAL):
                place_best(table, attempts, a, CHOICES, placed)
        except SolverError:
            placed.ends[a] = LEFT


def place_best(
    table: FaceTable, attempts: Attempts, a: int, choices: Iterable[Choice], placed: Placed
) -> float:
    """Enter the best placement of one attempt over given choices, and return its merit."""
    kernel, best, placed.ends[a] = compiled(KERNEL), -math.inf, NONE
    for choice in choices:
        usable, rows = kernel.regulus_program(table, attempts, a, choice)
        if not usable:
            continue
        A, equal = rows.At.T, len(rows.b) - rows.equalities
        c = -np.eye(A.shape[1])[kernel.T]
        program = LinearProgram(c, A[:equal], rows.b[:equal], A[equal:], rows.b[equal:])
        found = maximize(program)
        # ties go to the first choice: rounding must not decide between equal ones
        if isinstance(found, Optimum) and found.value > best + kernel.SAME_OFFSET:
            x, best = nearest_optimum(program, found, GIVEN_UP), found.value
            kernel.take(table, attempts, a, choice, x, best, placed)
    return best
