"""Finds balanced contact forces that need the least friction, in exact circular cones.

Solved: the least mu such that forces with |tangential part| <= mu normal part balance a wrench
within limits on the normal parts. With mu the coefficient that the current forces need,

    minimise t  subject to  G f = -w,                                                   (1)
                            l <= f_n <= u  for all contacts,                            (2)
                            |f_t| <= mu f_n + t  for all contacts                       (3)

gives forces that need less, unless t = 0 (Dinkelbach). Contacts whose frictions differ have
weights a, and |f_t| <= a (mu f_n + t). Forces planned with pyramids, where the
search starts, need up to 2 % more than these.
"""

from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import SolverError
from grasp_core.forces.balance import NO_FORCE, Balance
from grasp_core.solvers.conic import ConicProgram, minimize

IMPROVEMENT = 1e-4
"""Share by which the coefficient must fall in a round for the iteration to go on; it ends some 1e-4
above the least."""
MAX_ROUNDS = 12
"""Most programs: the excess falls by half or more in each, and faster unless a finger idles."""
FINE_RESIDUAL = 1e-9
"""Largest imbalance, and distance outside the limits, in units of the largest force."""
FRICTIONLESS = 1e-6
"""Friction coefficient below which no lower one is searched for."""


def lower_friction(balance: Balance, weights: Array, forces: Array) -> Array:
    """Find forces that balance the first wrench and need the least friction.

    Takes `weights` (k,); `forces` (3k,). Gives local forces, (3k,); the given ones where the solver
    finds none that need less.
    """
    best, friction = forces, _needed_friction(forces, weights)
    program = _without_friction(balance, weights)
    for _ in range(MAX_ROUNDS):
        if friction <= FRICTIONLESS:
            break
        try:
            better = _with_least_excess(program, friction * weights)
        except SolverError:
            break
        better = balance.checked(better[None], FINE_RESIDUAL)[0]
        needed = _needed_friction(better, weights)
        if not needed < friction:
            break
        # an improvement is kept, but a small one ends the search
        improved = needed < friction * (1.0 - IMPROVEMENT)
        best, friction = better, needed
        if not improved:
            break
    return best


def _needed_friction(forces: Array, weights: Array) -> float:
    """Return the largest ratio of tangential to weighted normal force."""
    along, across = forces[0::3], np.hypot(forces[1::3], forces[2::3])
    ratios = across / np.maximum(weights * along, NO_FORCE)
    return float(ratios[weights > 0.0].max())


def _without_friction(balance: Balance, weights: Array) -> ConicProgram:
    """Build the module's program with mu = 0; its last 3k rows are the cones (3)."""
    n, count = balance.G.shape[1], len(weights)
    normal, excess = np.eye(n, n + 1)[0::3], np.eye(n + 1)[n]
    # the first row of each cone, a (mu f_n + t), gets its mu in `_with_least_excess`
    balanced, cones = np.hstack([balance.G, np.zeros((6, 1))]), -np.eye(n, n + 1)
    cones[0::3] = -weights[:, None] * excess
    bounded = [(-normal, np.full(count, -balance.least[0]))]
    if np.isfinite(balance.largest[0]):
        bounded.append((normal, np.full(count, balance.largest[0])))
    # rows: the balance (1), the limits (2), the cones (3)
    A = np.vstack([balanced, *(rows for rows, _ in bounded), cones])
    b = np.concatenate([-balance.W[0], *(limit for _, limit in bounded), np.zeros(n)])
    return ConicProgram(excess, A, b, 6, count * len(bounded), (3,) * count)


def _with_least_excess(program: ConicProgram, friction: Array) -> Array:
    A, n = program.A.copy(), program.A.shape[1] - 1
    cones = A[len(A) - n :]
    np.fill_diagonal(cones[0::3, 0::3], -friction)
    return minimize(replace(program, A=A)).x[:n]
