"""Solves quadratic programs with ProxQP, exactly on the constraints that are active.

    minimise x'Px/2 + q'x  subject to  G x <= h,  A x = b,  lower <= x <= upper.                 (1)

ProxQP calls some feasible programs of contact forces infeasible, so it is asked for the closest
feasible point, and its status is not read: whoever asks checks the answer. It stops anywhere within
its tolerance, at a point that depends on where its numbers lie in memory. The conditions of
optimality on the active constraints E x = e are linear equations with one answer,

    [P E'; E 0] (x, u) = (-q, e),                                                                (2)

and that answer is returned where it is feasible and as good.
"""

import importlib
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError

REQUESTED = 1e-8
"""Absolute tolerance that ProxQP is asked for."""
MAX_ITERATIONS = 300
"""Largest number of iterations of ProxQP: feasible programs of forces take about twenty; infeasible
ones would go on for minutes."""
ACTIVE = (1e-6, 1e-5, 1e-7, 1e-8)
"""Slacks below which a constraint may count as active; they are tried in turn."""
EXACT = 1e-6
"""Error up to which the solution of (2) is accepted, in its equations, the constraints or the
objective: a hundred times the accuracy asked of ProxQP."""


@dataclass(frozen=True, slots=True, eq=False)
class QuadraticProgram:
    """The data of the quadratic program (1)."""

    P: Array
    """Matrix of the quadratic term, symmetric and positive definite, (n, n)."""
    q: Array
    """Linear term of the objective, (n,)."""
    G: Array
    """Matrix of the inequalities, (m, n)."""
    h: Array
    """Right-hand sides of the inequalities, (m,)."""
    A: Array
    """Matrix of the equalities, (p, n); p may be 0."""
    b: Array
    """Right-hand sides of the equalities, (p,)."""
    lower: Array
    """Lower bounds of x, (n,); minus infinity where there is no bound."""
    upper: Array
    """Upper bounds of x, (n,); infinity where there is no bound."""

    def rows(self) -> tuple[Array, Array]:
        """Return C and d of all inequalities C x <= d, including the bounds."""
        below, above = np.isfinite(self.lower), np.isfinite(self.upper)
        unit = np.eye(len(self.q))
        C = np.vstack([self.G, unit[above], -unit[below]])
        return C, np.concatenate([self.h, self.upper[above], -self.lower[below]])


def minimize(program: QuadraticProgram) -> Array | None:
    """Solve a quadratic program, (n,); None where ProxQP returns no numbers."""
    solver = _qpsolvers()
    equations = (program.A, program.b) if len(program.b) else (None, None)
    asked = solver.Problem(
        program.P, program.q, program.G, program.h, *equations, lb=program.lower, ub=program.upper
    )
    answer = solver.solve_problem(
        asked, solver="proxqp", eps_abs=REQUESTED, max_iter=MAX_ITERATIONS,
        primal_infeasibility_solving=bool(len(program.b)),
    )  # fmt: skip
    if answer.x is None or not np.isfinite(answer.x).all():
        return None
    return _polished(program, np.asarray(answer.x, dtype=np.float64))


def _polished(program: QuadraticProgram, x: Array) -> Array:
    """Solve (2) for the constraints active at x; return x itself if that is no better."""
    P, q, A, b = program.P, program.q, program.A, program.b
    C, d = program.rows()
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
        if max(unmet, outside, worse) < EXACT:
            return exact
    return x


@cache
def _qpsolvers() -> Any:
    module: Any = importlib.import_module("qpsolvers")
    if "proxqp" not in module.available_solvers:
        raise SolverError(
            "ProxQP cannot be loaded; it needs the package proxsuite and the system library "
            "libgomp (on Debian: apt-get install libgomp1)"
        )
    return module
