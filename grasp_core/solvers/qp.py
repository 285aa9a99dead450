"""Finds points of least norm exactly on the active constraints.

General ones are found by qpsolvers,

    minimise |x|  subject to  C x <= d,  A x = b.                                                (1)

ProxQP, the usual solver, calls some feasible programs of contact forces infeasible, so it is asked
for the closest feasible point, and no solver's status is read: whoever asks checks the answer. A
solver stops anywhere within its tolerance, at a point that depends on where its numbers lie in
memory. The conditions of optimality on the active constraints E x = e are linear equations with one
answer,

    [1 E'; E 0] (x, u) = (0, e),                                                                 (2)

and that answer is returned where it is feasible and as good.

Points nearest to the origin of a polyhedron are found by compiled code (`nearest_point_kernel`):

    minimise |x|  subject to  C x <= d.                                                          (3)
"""

import importlib
import warnings
from functools import cache
from typing import Any

import numpy as np

from grasp_core.allowed_values import one_of
from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError

PROXQP = "proxqp"
OPTIONS: dict[str, dict[str, Any]] = {
    PROXQP: {"eps_abs": 1e-8, "max_iter": 300, "primal_infeasibility_solving": True}
}
"""Options of solvers: absolute tolerance, most iterations, as feasible programs of forces take
about twenty while infeasible ones would go on for minutes, and the closest feasible point."""
ACTIVE = (1e-6, 1e-5, 1e-7, 1e-8)
"""Slacks below which a constraint may count as active; the one with the least error is taken."""
MOST_ERROR = 1e-6
"""Error up to which the solution of (2) is accepted, in its equations, the constraints or the
objective: a hundred times the accuracy asked of ProxQP."""
NEAREST_POINT_KERNEL = "grasp_core.solvers.nearest_point_kernel"
NEAREST = 1e-11
"""Accepted violation of the conditions of optimality, relative to x: some thousand rounding
errors, and a hundredth of any difference that matters."""


def check_solver(name: str) -> None:
    """Refuse a solver that qpsolvers does not know or that is not installed."""
    if name != PROXQP:  # which is not loaded for this
        one_of(name, _qpsolvers().available_solvers, "solver")


def least_norm(C: Array, d: Array, A: Array, b: Array, solver: str = PROXQP) -> Array | None:
    """Solve (1), (n,); None where the solver returns no numbers."""
    qpsolvers, n = _qpsolvers(), A.shape[1]
    options = dict(OPTIONS.get(solver, {}))
    with warnings.catch_warnings():  # that a solver wants sparse matrices
        warnings.simplefilter("ignore", qpsolvers.warnings.SparseConversionWarning)
        asked = qpsolvers.Problem(np.eye(n), np.zeros(n), C, d, A, b)
        answer = qpsolvers.solve_problem(asked, solver=solver, **options)
    if answer.x is None or not np.isfinite(answer.x).all():
        return None
    best, least = np.asarray(answer.x, dtype=np.float64), MOST_ERROR
    square = float(best @ best)
    for slack in ACTIVE:
        active = d - C @ answer.x < slack
        E, e = np.vstack([A, C[active]]), np.concatenate([b, d[active]])
        conditions = np.block([[np.eye(n), E.T], [E, np.zeros((len(e), len(e)))]])
        targets = np.concatenate([np.zeros(n), e])
        solved = np.linalg.lstsq(conditions, targets, rcond=None)[0]
        exact = np.asarray(solved, dtype=np.float64)[:n]
        unmet = float(np.abs(conditions @ solved - targets).max())
        outside = float((C @ exact - d).max())
        error = max(unmet, outside, 0.5 * (float(exact @ exact) - square))
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
    unmet, _ = compiled(NEAREST_POINT_KERNEL).nearest(np.array(C, order="C"), np.array(d), x)
    return x if unmet <= accuracy else np.full(len(x), np.nan)
