"""Linear program -> optimum or proof of infeasibility, both re-checked; the door to HiGHS.

    maximise c.x  subject to  A x <= b,  A_eq x = b_eq,  x free.

An optimum comes with multipliers y >= 0, z such that c = A'y + A_eq'z, which bound every
feasible value by b.y + b_eq.z. An infeasible program comes with y >= 0, z such that
A'y + A_eq'z = 0 and b.y + b_eq.z < 0, which no feasible x survives. Both are checked in
plain arithmetic before they are returned; the solver's status is not believed.
"""

import importlib
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError

RESIDUAL = 1e-8
"""Largest accepted violation, for programs whose data are of order one (the planner scales
objects to unit size): ten times the tolerance the solver is asked for."""
FARTHEST = 1e4
"""A proof of infeasibility excludes all points with |x|_1 up to this, at unit size."""

STRATEGIES = (1, 4)
"""HiGHS's dual and primal simplex, in the order they are tried: one program in some thousand ends
as unknown under the one and is solved under the other."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearProgram:
    """Data of one program; the equality part may be empty."""

    c: Array
    """Objective, (n,)."""
    A: Array
    """(rows, n)"""
    b: Array
    """(rows,)"""
    A_eq: Array | None = None
    """(equalities, n)"""
    b_eq: Array | None = None
    """(equalities,)"""

    def stacked(self) -> tuple[Array, Array]:
        """Inequality rows, then equality rows, with their right-hand sides."""
        if self.A_eq is None or self.b_eq is None:
            return self.A, self.b
        return np.vstack([self.A, self.A_eq]), np.concatenate([self.b, self.b_eq])


@dataclass(frozen=True, slots=True, eq=False)
class Optimum:
    """A best point, with the multipliers that prove it is best."""

    x: Array
    value: float
    multipliers: Array
    """(rows + equalities,); the first `rows` are non-negative."""


@dataclass(frozen=True, slots=True, eq=False)
class Infeasible:
    """No point with |x|_1 <= `FARTHEST` is feasible, by a combination of the rows (Farkas)."""

    multipliers: Array
    """(rows + equalities,)"""


def maximize(program: LinearProgram) -> Optimum | Infeasible:
    """Solve a linear program, or prove that it has no feasible point.

    Raises:
        SolverError: The solver's answer failed our check, or the program is unbounded.
    """
    failure = SolverError("no way of solving was tried")
    for strategy in STRATEGIES:
        try:
            return _solved(program, strategy)
        except SolverError as error:
            failure = error
    return _refuted_by_least_violation(program, failure)


def _refuted_by_least_violation(program: LinearProgram, failure: SolverError) -> Infeasible:
    """Infeasible if every point violates some row: the least violation always exists.

    The violation, a further variable, is kept above -1 to bound it.
    """
    G, h = program.stacked()
    rows = len(program.b)
    relaxed = np.vstack([G, -G[rows:]])
    limits = np.concatenate([h, -h[rows:]])
    violation = np.append(np.zeros(G.shape[1]), -1.0)
    with_violation = np.vstack([np.hstack([relaxed, -np.ones((len(relaxed), 1))]), violation])
    limits = np.append(limits, 1.0)
    answer = _solved(LinearProgram(violation, with_violation, limits), STRATEGIES[0])
    if not isinstance(answer, Optimum) or answer.value > -RESIDUAL:
        raise failure
    multipliers = answer.multipliers[: len(G)].copy()
    multipliers[rows:] -= answer.multipliers[len(G) : -1]
    return _checked_ray(program, multipliers)


def _solved(program: LinearProgram, strategy: int) -> Optimum | Infeasible:
    solver, status = _run(program, strategy)
    kinds = _highspy().HighsModelStatus
    if status == kinds.kOptimal:
        solution = solver.getSolution()
        x, duals = np.array(solution.col_value), np.array(solution.row_dual)
        return _checked_optimum(program, x, duals)
    if status == kinds.kInfeasible:
        return _checked_ray(program, np.array(solver.getDualRay()[2]))
    raise SolverError(f"the linear program ended as {solver.modelStatusToString(status)}")


def _checked_optimum(program: LinearProgram, x: Array, duals: Array) -> Optimum:
    G, h = program.stacked()
    rows = len(program.b)
    slack = h - G @ x
    stationarity = np.abs(program.c - G.T @ duals).max()
    scale = 1.0 + float(np.abs(x).max(initial=0.0))
    value = float(program.c @ x)
    failures = {
        "a row is violated": max(-slack[:rows].min(initial=0.0), np.abs(slack[rows:]).max(initial=0.0)),  # noqa: E501
        "a multiplier is negative": -duals[:rows].min(initial=0.0),
        "the multipliers do not give the objective": stationarity,
        "the bound does not meet the value": abs(float(h @ duals) - value),
    }  # fmt: skip
    for failure, size in failures.items():
        if size > RESIDUAL * scale:
            raise SolverError(f"{failure} by {size:.3g}, allowed {RESIDUAL * scale:.3g}")
    return Optimum(x, value, duals)


def _checked_ray(program: LinearProgram, ray: Array) -> Infeasible:
    G, h = program.stacked()
    rows = len(program.b)
    unit = ray / max(float(np.abs(ray).max(initial=0.0)), np.finfo(np.float64).tiny)
    for multipliers in (unit, -unit):
        if multipliers[:rows].min(initial=0.0) < -RESIDUAL:
            continue
        multipliers[:rows] = np.maximum(multipliers[:rows], 0.0)
        combined = np.abs(G.T @ multipliers).max(initial=0.0)
        if -float(h @ multipliers) > FARTHEST * combined + RESIDUAL:
            return Infeasible(multipliers)
    raise SolverError("called infeasible, but the proof does not check")


def _run(program: LinearProgram, strategy: int) -> tuple[Any, Any]:
    highspy = _highspy()
    G, h = program.stacked()
    lower = np.full(len(h), -np.inf)
    lower[len(program.b) :] = h[len(program.b) :]
    model = highspy.HighsLp()
    model.num_col_, model.num_row_ = G.shape[1], G.shape[0]
    model.sense_ = highspy.ObjSense.kMaximize
    model.col_cost_ = program.c
    model.col_lower_ = np.full(G.shape[1], -np.inf)
    model.col_upper_ = np.full(G.shape[1], np.inf)
    model.row_lower_, model.row_upper_ = lower, h
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    filled = G != 0.0
    model.a_matrix_.start_ = np.concatenate([[0], np.cumsum(filled.sum(axis=1))])
    model.a_matrix_.index_ = np.nonzero(filled)[1]
    model.a_matrix_.value_ = G[filled]
    solver = _solver()
    solver.clearSolver()
    solver.setOptionValue("simplex_strategy", strategy)
    solver.passModel(model)
    solver.run()
    return solver, solver.getModelStatus()


@cache
def _highspy() -> Any:
    return importlib.import_module("highspy")


@cache
def _solver() -> Any:
    solver = _highspy().Highs()
    options = {
        "output_flag": False,
        "threads": 1,
        "presolve": "off",  # keeps the proof of infeasibility
        "solver": "simplex",
        "primal_feasibility_tolerance": 1e-9,
        "dual_feasibility_tolerance": 1e-9,
    }
    for name, value in options.items():
        solver.setOptionValue(name, value)
    return solver
