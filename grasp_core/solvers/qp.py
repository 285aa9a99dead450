"""Solves strictly convex quadratic programs exactly on the active constraints.

General ones are solved by qpsolvers,

    minimise x'Px/2 + q'x  subject to  G x <= h,  A x = b,  lower <= x <= upper.                 (1)

ProxQP, the usual solver, calls some feasible programs of contact forces infeasible, so it is asked
for the closest feasible point, and no solver's status is read: whoever asks checks the answer. A
solver stops anywhere within its tolerance, at a point that depends on where its numbers lie in
memory. The conditions of optimality on the active constraints E x = e are linear equations with one
answer,

    [P E'; E 0] (x, u) = (-q, e),                                                                (2)

and that answer is returned where it is feasible and as good.

Points nearest to the origin of a polyhedron are found by compiled code (`nearest_point_kernel`):

    minimise |x|  subject to  C x <= d.                                                          (3)
"""

import importlib
import warnings
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError
from grasp_core.kinds import one_of

PROXQP = "proxqp"
"""Name of the usual solver."""
OPTIONS = {PROXQP: {"eps_abs": 1e-8, "max_iter": 300}}
"""Options of solvers: absolute tolerance, and most iterations, as feasible programs of forces
take about twenty while infeasible ones would go on for minutes."""
ACTIVE = (1e-6, 1e-5, 1e-7, 1e-8)
"""Slacks below which a constraint may count as active; the one with the least error is taken."""
EXACT = 1e-6
"""Error up to which the solution of (2) is accepted, in its equations, the constraints or the
objective: a hundred times the accuracy asked of ProxQP."""
KERNEL = "grasp_core.solvers.nearest_point_kernel"
NEAREST = 1e-11
"""Accepted violation of the conditions of optimality, relative to x: some thousand rounding
errors, and a hundredth of any difference that matters."""


@dataclass(frozen=True, slots=True, eq=False)
class QuadraticProgram:
    """The data of the quadratic program (1)."""

    P: Array  # matrix of the quadratic term, symmetric and positive definite, (n, n)
    q: Array  # linear term of the objective, (n,)
    G: Array  # matrix of the inequalities, (m, n)
    h: Array  # right-hand sides of the inequalities, (m,)
    A: Array  # matrix of the equalities, (p, n); p may be 0
    b: Array  # right-hand sides of the equalities, (p,)
    lower: Array  # lower bounds of x, (n,); minus infinity where there is no bound
    upper: Array  # upper bounds of x, (n,); infinity where there is no bound


def check_solver(name: str) -> None:
    """Refuse a solver that qpsolvers does not know or that is not installed."""
    if name != PROXQP:  # which is not loaded for this
        one_of(name, _qpsolvers().available_solvers, "solver")


def minimize(program: QuadraticProgram, solver: str = PROXQP) -> Array | None:
    """Solve a quadratic program, (n,); None where the solver returns no numbers."""
    qpsolvers = _qpsolvers()
    equations = (program.A, program.b) if len(program.b) else (None, None)
    asked = qpsolvers.Problem(
        program.P, program.q, program.G, program.h, *equations, lb=program.lower, ub=program.upper
    )
    options = dict(OPTIONS.get(solver, {}))
    if solver == PROXQP:
        options["primal_infeasibility_solving"] = bool(len(program.b))
    with warnings.catch_warnings():  # that a solver wants sparse matrices
        warnings.simplefilter("ignore", qpsolvers.warnings.SparseConversionWarning)
        answer = qpsolvers.solve_problem(asked, solver=solver, **options)
    if answer.x is None or not np.isfinite(answer.x).all():
        return None
    return _polished(program, np.asarray(answer.x, dtype=np.float64))


def _polished(program: QuadraticProgram, x: Array) -> Array:
    """Solve (2) for the constraints active at x; return x itself if that is no better."""
    P, q, A, b = program.P, program.q, program.A, program.b
    below, above = np.isfinite(program.lower), np.isfinite(program.upper)
    unit = np.eye(len(q))
    C = np.vstack([program.G, unit[above], -unit[below]])
    d = np.concatenate([program.h, program.upper[above], -program.lower[below]])
    best, least = x, EXACT
    for slack in ACTIVE:
        active = d - C @ x < slack
        E, e = np.vstack([A, C[active]]), np.concatenate([b, d[active]])
        conditions = np.block([[P, E.T], [E, np.zeros((len(e), len(e)))]])
        targets = np.concatenate([-q, e])
        solved = np.linalg.lstsq(conditions, targets, rcond=None)[0]
        exact = np.asarray(solved, dtype=np.float64)[: len(q)]
        unmet = float(np.abs(conditions @ solved - targets).max())
        outside = float((C @ exact - d).max())
        worse = float(0.5 * (exact @ P @ exact - x @ P @ x) + q @ (exact - x))
        error = max(unmet, outside, worse)
        if error < least:
            best, least = exact, error
    return best


@cache
def _qpsolvers() -> Any:
    module: Any = importlib.import_module("qpsolvers")
    if PROXQP not in module.available_solvers:
        raise SolverError(
            "ProxQP cannot be loaded; it needs the package proxsuite and the system library "
            "libgomp (on Debian: apt-get install libgomp1)"
        )
    return module


def least_distance(C: Array, d: Array, *, accuracy: float = NEAREST) -> Array:
    """Find the nearest point (3), (v,); NaN where none was proved to be near."""
    x = np.empty(C.shape[1])
    unmet, _ = compiled(KERNEL).nearest(np.array(C, order="C"), np.array(d), x)
    return x if unmet <= accuracy else np.full(len(x), np.nan)
