"""Solves linear programs and proves every answer.

    maximise c.x  subject to  A x <= b,  A_eq x = b_eq,  x free.

An optimum comes with multipliers y >= 0, z such that c = A'y + A_eq'z, which bound every
feasible value by b.y + b_eq.z. An infeasible program comes with y >= 0, z such that
A'y + A_eq'z = 0 and b.y + b_eq.z < 0, which no feasible x survives. Both are checked in
plain arithmetic before they are returned; no solver's status is believed.

Programs go to a compiled dual simplex method first; it names the rows of a best vertex, and the
vertex and its multipliers are solved for afresh. Programs that it leaves or gets wrong are solved
as conic programs without second-order cones.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.solvers.conic import ConicProgram, answered

LP_RESIDUAL = 1e-8
"""Largest accepted violation, for programs whose data are of order one (the planner scales objects
to unit size)."""
EXCLUDED_SIZE = 1e4
"""Largest |x|_1 that a proof of infeasibility must exclude, at unit size."""

LP_KERNEL = "grasp_core.solvers.lp_kernel"


@dataclass(frozen=True, slots=True, eq=False)
class LinearProgram:
    """The data of one linear program; the equalities may be missing."""

    c: Array  # coefficients of the objective c.x, (n,)
    A: Array  # matrix of the inequalities, (rows, n)
    b: Array  # right-hand sides of the inequalities, (rows,)
    A_eq: Array | None = None  # matrix of the equalities, (equalities, n)
    b_eq: Array | None = None  # right-hand sides of the equalities, (equalities,)

    def stacked(self) -> tuple[Array, Array]:
        """Return the rows of inequalities and then of equalities, with right-hand sides."""
        if self.A_eq is None or self.b_eq is None:
            return self.A, self.b
        return np.vstack([self.A, self.A_eq]), np.concatenate([self.b, self.b_eq])


@dataclass(frozen=True, slots=True, eq=False)
class Optimum:
    """A best point, with the multipliers that prove that it is best."""

    x: Array
    value: float
    multipliers: Array
    """Multipliers y, then z, (rows + equalities,); the first `rows` are non-negative."""


@dataclass(frozen=True, slots=True, eq=False)
class Infeasible:
    """A proof (Farkas), by a combination of rows, that no |x|_1 <= `EXCLUDED_SIZE` is feasible."""

    multipliers: Array  # multipliers y, then z, of the combination, (rows + equalities,)


def maximize(program: LinearProgram) -> Optimum | Infeasible:
    """Solve a linear program, or prove that it has no feasible point."""
    try:
        return _by_simplex(program)
    except (SolverError, np.linalg.LinAlgError):
        return _by_interior_point(program)


def _by_interior_point(program: LinearProgram) -> Optimum | Infeasible:
    """Solve a linear program by Clarabel, whose rows begin with the equalities."""
    G, h = program.stacked()
    rows, order = len(program.b), np.roll(np.arange(len(h)), len(h) - len(program.b))
    answer, _ = answered(ConicProgram(-program.c, G[order], h[order], len(h) - rows, rows))
    multipliers = np.empty(len(h))
    multipliers[order] = answer.z
    try:
        return _checked_optimum(program, answer.x, multipliers)
    except SolverError:
        return _checked_ray(program, multipliers)


def _by_simplex(program: LinearProgram) -> Optimum | Infeasible:
    G, h = program.stacked()
    count, n = G.shape
    kernel = compiled(LP_KERNEL)
    ended = kernel.vertex_of(n)
    basis = ended.basis
    rows = kernel.LpRows(np.array(G.T, order="C"), np.array(h), count - len(program.b))
    status, against = kernel.solve(program.c, rows, -math.inf, ended, False)
    if status == kernel.NOT_SOLVED:
        raise SolverError("the simplex method reached its limit of steps without an answer")
    basis.sort()
    vertex = np.vstack([G, np.repeat(np.eye(n), 2, axis=0)])[basis]
    multipliers = np.zeros(count + 2 * n)
    if status == kernel.INFEASIBLE:
        row = rows.At[:, against]  # an equality may have been turned
        multipliers[basis] = -np.linalg.solve(vertex.T, row)
        as_given = (row == G[against]).all() and rows.b[against] == h[against]
        multipliers[against] = 1.0 if as_given else -1.0
        if np.abs(multipliers[count:]).max() > LP_RESIDUAL:
            raise SolverError(
                "the simplex method proved infeasibility only near the origin, not everywhere"
            )
        return _checked_ray(program, multipliers[:count])
    multipliers[basis] = np.linalg.solve(vertex.T, program.c)
    if basis[-1] >= count:
        raise SolverError(
            "the simplex method reached its largest numbers; the program may be unbounded"
        )
    x = np.asarray(np.linalg.solve(vertex, h[basis]), dtype=np.float64)
    return _checked_optimum(program, x, multipliers[:count])


def _checked_optimum(program: LinearProgram, x: Array, duals: Array) -> Optimum:
    G, h = program.stacked()
    rows = len(program.b)
    slack = h - G @ x
    stationarity = np.abs(program.c - G.T @ duals).max()
    scale = 1.0 + float(np.abs(x).max(initial=0.0))
    value = float(program.c @ x)
    failures = {
        "the linear program's answer violates a row": np.max([-slack[:rows].min(initial=0.0), np.abs(slack[rows:]).max(initial=0.0)]),  # noqa: E501
        "a multiplier of the linear program is negative": -duals[:rows].min(initial=0.0),
        "the linear program's multipliers do not give the objective": stationarity,
        "the linear program's bound differs from its value": abs(float(h @ duals) - value),
    }  # fmt: skip
    for failure, size in failures.items():
        if not size <= LP_RESIDUAL * scale:  # nor if it is not a number
            raise SolverError(f"{failure} by {size:.3g}, allowed {LP_RESIDUAL * scale:.3g}")
    return Optimum(x, value, duals)


def _checked_ray(program: LinearProgram, ray: Array) -> Infeasible:
    G, h = program.stacked()
    rows = len(program.b)
    unit = ray / max(float(np.abs(ray).max(initial=0.0)), np.finfo(np.float64).tiny)
    for multipliers in (unit, -unit):
        if multipliers[:rows].min(initial=0.0) < -LP_RESIDUAL:
            continue
        multipliers[:rows] = np.maximum(multipliers[:rows], 0.0)
        combined = np.abs(G.T @ multipliers).max(initial=0.0)
        if -float(h @ multipliers) > EXCLUDED_SIZE * combined + LP_RESIDUAL:
            return Infeasible(multipliers)
    raise SolverError("a linear program was neither solved nor proved infeasible")
