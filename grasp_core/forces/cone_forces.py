"""Finds balanced contact forces of least norm in the exact circular friction cones.

Solved: for one wrench w, with the map G from forces to their wrench,

    minimise |f|  subject to  G f = -w,                                                       (1)
                              l <= f_n <= u  for all contacts,                                (2)
                              |f_t| <= mu f_n  for all contacts.                              (3)

Pyramids inside the cones give away 2 % of the friction; just above the critical friction they hold
no forces where the cones do. Forces there are many times the load, so they are sought in units of
their own size: the program is solved once to find that size, and again for the digits.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError
from grasp_core.forces.balance import FORCE_RESIDUAL, Balance, needed_friction
from grasp_core.solvers.conic import ConicProgram, minimize

KEPT_BACK = 1e-7
"""Share of the friction that is not used, to cover the errors of the solver."""


def least_norm_in_cones(balance: Balance, friction: Array) -> Array | None:
    """Find local forces (3k,) in the cones that balance the first wrench, or None.

    Takes `friction` (k,).
    """
    unit = 1.0
    for _ in range(2):
        try:
            f = unit * minimize(_program(balance, friction * (1.0 - KEPT_BACK), unit)).x[:-1]
        except SolverError:
            return None
        found = balance.checked(f[None])
        if needed_friction(found, friction)[0] <= 1.0 + FORCE_RESIDUAL:
            return found[0]
        unit = max(float(np.abs(f).max()), 1.0)
    return None


def _program(balance: Balance, friction: Array, unit: float) -> ConicProgram:
    """Build the program (1) to (3), with a bound on |f| as the last variable."""
    n, flat = balance.G.shape[1], friction == 0.0
    normal, rows = np.eye(n, n + 1)[0::3], -np.eye(n, n + 1)
    rows[0::3] *= friction[:, None]
    # a cone of friction zero is a ray: its tangential parts are equations instead
    cones, slides = rows[np.repeat(~flat, 3)], np.eye(n, n + 1)[np.repeat(flat, 3)]
    slides = np.delete(slides, np.s_[::3], axis=0)
    bounded = [(-normal, -balance.least[0])]
    if np.isfinite(balance.largest[0]):
        bounded.append((normal, balance.largest[0]))
    norm = -np.vstack([np.eye(n + 1)[n], np.eye(n, n + 1)])
    equations = np.vstack([np.hstack([balance.G, np.zeros((6, 1))]), slides])
    # rows: (1) and the rays, (2), the cones (3), then |f| <= the last variable
    A = np.vstack([equations, *(side for side, _ in bounded), cones, norm])
    b = np.zeros(len(A))
    b[:6] = -balance.W[0] / unit
    for side, (_, limit) in enumerate(bounded):
        start = len(equations) + side * len(normal)
        b[start : start + len(normal)] = limit / unit
    each = (3,) * int((~flat).sum())
    return ConicProgram(
        np.eye(n + 1)[n], A, b, len(equations), len(normal) * len(bounded), (*each, n + 1)
    )
