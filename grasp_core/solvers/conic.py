"""Solves conic programs, and checks each primal and dual solution again; only it calls Clarabel.

    minimise q.x  subject to  b - A x in K,

with K a product of zero, non-negative and second-order cones. The dual variable z lies in
the dual cone and satisfies A'z + q = 0; at the optimum q.x = -b.z.
"""

import importlib
import math
from dataclasses import dataclass
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError

CONIC_RESIDUAL = 1e-7
"""Largest accepted violation, relative to the solution's size. Callers prove their own results from
a solution, so this only catches answers that are plainly wrong."""
REQUESTED = 1e-11

WAYS: tuple[tuple[str, float] | None, ...] = (
    None,
    ("equilibrate_enable", False),
    ("max_step_fraction", 0.9),
)
"""Changes to Clarabel's settings, in the order they are tried: at frictions below 1e-3 it sometimes
stops early, and succeeds with other settings."""


@dataclass(frozen=True, slots=True, eq=False)
class ConicProgram:
    """The data of one conic program, rows ordered as zero, non-negative, second-order."""

    q: Array  # coefficients of the objective q.x, (n,)
    A: Array  # matrix of the constraints b - A x in K, (rows, n)
    b: Array  # right-hand sides of the constraints, (rows,)
    zeros: int  # number of rows of b - A x that must be zero
    nonnegatives: int  # number of rows of b - A x that must not be negative
    cones: tuple[int, ...] = ()
    """Length of each second-order cone, whose rows satisfy s0 >= |(s1, ...)|."""


@dataclass(frozen=True, slots=True, eq=False)
class ConicSolution:
    """A primal and a dual solution, both checked against the program's data."""

    x: Array
    z: Array  # dual variable: one multiplier per row of the program, (rows,)
    value: float


def minimize(program: ConicProgram) -> ConicSolution:
    """Solve a conic program that is feasible and bounded."""
    failure = SolverError("Clarabel was not called with any settings")
    for change in WAYS:
        solution, status = answered(program, change)
        try:
            _check(program, solution, status)
        except SolverError as error:
            failure = error
        else:
            return solution
    raise failure


def answered(
    program: ConicProgram, change: tuple[str, float] | None = None
) -> tuple[ConicSolution, str]:
    """Return what Clarabel answers, not checked, and what it says of it.

    Where it finds no feasible point, the dual variable is a proof: A'z = 0 and b.z < 0.
    """
    kinds = list(_kinds(program.zeros, program.nonnegatives, program.cones))
    solver = _clarabel().DefaultSolver(
        _no_squares(len(program.q)), program.q, _columns(program.A), program.b, kinds,
        _settings(change),
    )  # fmt: skip
    answer = solver.solve()
    x = np.array(answer.x)
    return ConicSolution(x, np.array(answer.z), float(program.q @ x)), str(answer.status)


@lru_cache(maxsize=256)
def _kinds(zeros: int, nonnegatives: int, cones: tuple[int, ...]) -> tuple[Any, ...]:
    """Name the parts of the cone K as Clarabel does."""
    clarabel = _clarabel()
    return (
        *((clarabel.ZeroConeT(zeros),) if zeros else ()),
        *((clarabel.NonnegativeConeT(nonnegatives),) if nonnegatives else ()),
        *(clarabel.SecondOrderConeT(length) for length in cones),
    )


def _check(program: ConicProgram, solution: ConicSolution, status: str) -> None:
    x, z = solution.x, solution.z
    if not (np.isfinite(x).all() and np.isfinite(z).all()):
        raise SolverError(f"the conic solver Clarabel returned no numbers (status {status})")
    slack = program.b - program.A @ x
    allowed = CONIC_RESIDUAL * (1.0 + float(np.abs(x).max()) + float(np.abs(z).max()))
    failures = {
        "the conic solver's answer violates a constraint": _outside(program, slack, dual=False),
        "the conic solver's multipliers leave the dual cone": _outside(program, z, dual=True),
        "the conic solver's multipliers do not give the objective": np.abs(
            program.A.T @ z + program.q
        ).max(),
        "the conic solver's primal and dual values differ": abs(program.q @ x + program.b @ z),
    }
    for failure, size in failures.items():
        if not size <= allowed:  # nor is it when a number is missing
            raise SolverError(f"{failure} by {size:.3g}, allowed {allowed:.3g} ({status})")


def _outside(program: ConicProgram, rows: Array, *, dual: bool) -> float:
    """Return how far a vector lies outside the cone K, or outside its dual cone."""
    start = program.zeros
    worst = 0.0 if dual else float(np.abs(rows[:start]).max(initial=0.0))
    worst = max(worst, -float(rows[start : start + program.nonnegatives].min(initial=0.0)))
    start += program.nonnegatives
    cones = program.cones
    if len(set(cones)) == 1:  # as usual, and quicker together
        each = rows[start:].reshape(len(cones), cones[0])
        return max(worst, float((np.linalg.norm(each[:, 1:], axis=1) - each[:, 0]).max()))
    for length in cones:
        tail = rows[start + 1 : start + length]
        worst = max(worst, math.sqrt(tail @ tail) - rows[start])
        start += length
    return float(worst)


def _columns(A: Array) -> SimpleNamespace:
    """Compress a matrix to columns without its zeros, with the attributes that Clarabel reads.

    A sparse matrix of scipy has these attributes too, but it checks its data again, and importing
    it takes longer than planning on a small object.
    """
    columns = A.T
    filled = columns != 0.0
    starts = np.concatenate([[0], filled.sum(axis=1).cumsum()])
    return SimpleNamespace(
        data=columns[filled], indices=filled.nonzero()[1], indptr=starts, shape=A.shape,
        has_canonical_format=True,
    )  # fmt: skip


@cache
def _no_squares(n: int) -> SimpleNamespace:
    return _columns(np.zeros((n, n)))


@cache
def _clarabel() -> Any:
    return importlib.import_module("clarabel")


@cache
def _settings(change: tuple[str, float] | None) -> Any:
    settings = _clarabel().DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = REQUESTED
    settings.max_threads = 1
    if change is not None:
        setattr(settings, *change)
    return settings
