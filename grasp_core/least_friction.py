"""Balanced contact forces that need the least friction, with exact circular cones.

Solved: the least mu such that forces with |tangential part| <= mu normal part balance a wrench
within limits on the normal parts. With mu the coefficient that the forces at hand need,

    minimise t  subject to  G f = -w,  l <= f_n <= u,  |f_t| <= mu f_n + t   for all contacts

gives forces that need less, unless t = 0 (Dinkelbach). Forces planned with pyramids, where the
search starts, need up to 2 % more than these.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.conic import ConicProgram, minimize
from grasp_core.errors import SolverError

IMPROVEMENT = 1e-4
"""Iteration ends when the coefficient falls by less than this share: some 1e-4 from the least."""
MAX_ROUNDS = 12
"""Each costs a program; the excess falls by half or more a round, faster unless a finger idles."""
ROUNDING = 1e-9
"""Largest imbalance, and distance outside the limits, in units of the largest force."""
FRICTIONLESS = 1e-6
"""Coefficients below this are not lowered further."""


def lower_friction(G: Array, w: Array, limits: tuple[float, float], forces: Array) -> Array:
    """Forces that balance as the given ones do and need the least friction.

    Args:
        G: Map from contact forces (normal, tangent, tangent) to their wrench, (6, 3k).
        w: External wrench, (6,).
        limits: Least and largest normal part.
        forces: Balanced forces to start from, (3k,).

    Returns:
        (3k,); the given forces where the solver finds none that need less.
    """
    best, friction = forces, needed_friction(forces)
    for _ in range(MAX_ROUNDS):
        if friction <= FRICTIONLESS:
            break
        try:
            better = _with_least_excess(G, w, limits, friction)
        except SolverError:
            break
        correction = np.linalg.lstsq(G, G @ better + w, rcond=None)[0]
        better = better - np.asarray(correction, dtype=np.float64)
        needed = needed_friction(better)
        outside = max(limits[0] - better[0::3].min(), better[0::3].max() - limits[1])
        imbalance = float(np.abs(G @ better + w).max())
        if max(outside, imbalance) > ROUNDING or needed >= friction:
            break
        improved = needed < friction * (1.0 - IMPROVEMENT)
        best, friction = better, needed
        if not improved:
            break
    return best


def needed_friction(forces: Array) -> float:
    """The largest ratio of tangential to normal part, (3k,) as (normal, tangent, tangent)."""
    along, across = forces[0::3], np.hypot(forces[1::3], forces[2::3])
    return float((across / np.maximum(along, np.finfo(np.float64).tiny)).max())


def _with_least_excess(G: Array, w: Array, limits: tuple[float, float], friction: float) -> Array:
    n = G.shape[1]
    normal, excess = np.eye(n + 1)[0:n:3], np.eye(n + 1)[n]
    bounded = [(-normal, np.full(len(normal), -limits[0]))]
    if np.isfinite(limits[1]):
        bounded.append((normal, np.full(len(normal), limits[1])))
    cones = [
        -np.vstack([friction * normal[i] + excess, np.eye(n + 1)[3 * i + 1 : 3 * i + 3]])
        for i in range(len(normal))
    ]
    A = np.vstack([np.hstack([G, np.zeros((len(G), 1))]), *(rows for rows, _ in bounded), *cones])
    b = np.concatenate([-w, *(limit for _, limit in bounded), np.zeros(n)])
    nonnegatives = len(normal) * len(bounded)
    return minimize(ConicProgram(excess, A, b, len(G), nonnegatives, (3,) * len(normal))).x[:n]
