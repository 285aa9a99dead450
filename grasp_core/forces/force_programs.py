"""Contact forces that balance wrenches are found by strictly convex programs.

Forces f are sought in pyramids inscribed in the friction cones, so that every answer lies in the
true cones. With the map G from forces to their wrench, the external wrench w, the least and largest
normal force l and u, and the rows R of the pyramids they satisfy

    G f = -w,                                                                                 (1)
    l <= f_n <= u,                                                                            (2)
    R f <= 0.                                                                                 (3)

There are three objectives: the least norm |f|; the least friction, that is, the smallest
coefficient r = max_i |f_t| / f_n; and, where nothing balances, the least imbalance. The second is
found by Dinkelbach's iteration: forces with

    the least excess max_i |f_t| - r f_n over the current r                                   (4)

have a smaller coefficient, until they do not; the last 2 % that pyramids give away come from
`least_friction`. Where pyramids hold no forces that balance, as just above the critical friction,
exact cones may (`cone_forces`).

All objectives ask for the nearest point of a polyhedron (`nearest_point`), the first two once (1)
is solved (`balance`). Where that point is not found, a quadratic program decides (`qp`), and its
answer counts when its own residuals are small.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.forces.balance import FORCE_RESIDUAL, Balance, needed_friction
from grasp_core.forces.cone_forces import least_norm_in_cones
from grasp_core.forces.least_friction import lower_friction
from grasp_core.solvers.nearest_point import least_distance
from grasp_core.solvers.qp import QuadraticProgram, minimize

REGULAR = 1e-3
"""Weight of the forces' own size that keeps the least-friction programs strictly convex."""
IMPROVEMENT = 1e-2
"""The iteration ends when the coefficient falls by less than this share."""
MAX_ROUNDS = 20
LEAST_CHARGE = 1e-3
"""Weight of the forces' own size against the imbalance in the third objective."""


def least_norm(balance: Balance, friction: Array) -> Array:
    """Find balanced forces of least norm, (n, 3k); NaN from the first wrench on that has none."""
    rows = balance.pyramids(friction)
    # |F0 + null z| is least where |z| is, F0 being orthogonal to the null space of (1)
    Z = least_distance(*balance.polyhedra(rows))
    F = balance.checked(balance.F0 + Z @ balance.null.T)
    P, hopeless = np.eye(F.shape[1]), balance.beyond(friction)
    # where the nearest point is not proved, ProxQP is asked, then the exact cones
    for i in np.flatnonzero(np.isnan(F[:, 0])):
        one = balance.one(int(i))
        if hopeless[i]:
            break
        f = _solve(P, 0.0 * P[0], rows, one, balanced=True)
        if f is not None:
            F[i] = one.checked(f[None])[0]
        if not in_cones(F[i], friction):
            f = least_norm_in_cones(one, friction)
            if f is None:
                break
            F[i] = f
    return F


def least_friction_each(balance: Balance, friction: Array) -> Array:
    """Find balanced forces of least friction, (n, 3k); NaN from the first wrench without any."""
    largest = float(friction.max())
    weights = friction / largest if largest > 0.0 else np.ones(len(friction))
    F = np.full(balance.F0.shape, np.nan)
    hopeless = balance.beyond(friction)
    for i in range(len(F)):
        if hopeless[i]:
            break
        one = balance.one(i)
        f = least_friction(one, largest, weights)
        # pyramids may hold no forces that the cones hold, so the iteration starts in the cones then
        if f is None or not in_cones(f, friction):
            start = least_norm_in_cones(one, friction)
            f = f if start is None else lower_friction(one, weights, start)
        if f is None:
            break
        F[i] = f
    return F


def in_cones(f: Array, friction: Array) -> bool:
    """Return whether local forces (3k,) are numbers and need no more than the friction."""
    return bool(needed_friction(f[None], friction)[0] <= 1.0 + FORCE_RESIDUAL)


def least_friction(balance: Balance, start: float, weights: Array) -> Array | None:
    """Find forces (3k,) that need the least r, each contact having the friction r times its weight.

    The iteration starts from a coefficient on the way to it.
    """
    best, friction = None, start
    for _ in range(MAX_ROUNDS):
        better = _toward_less_friction(balance, friction, weights)
        if np.isnan(better[0]):
            break
        needed = float(needed_friction(better[None], weights)[0])
        if best is not None and needed > friction * (1.0 - IMPROVEMENT):
            break
        best, friction = better, needed
    if best is None:
        return None
    return lower_friction(balance, weights, best)


def _toward_less_friction(balance: Balance, friction: float, weights: Array) -> Array:
    """Find balanced forces with the least excess (4) over `friction`, which is a further variable.

    With the forces F0 + null @ z and the excess t, what is minimised is, but for a constant,
    half the square of (sqrt(REGULAR) z, t + 1).
    """
    rows = balance.pyramids(friction * weights)
    # the pyramids (3) widened by t: R f <= weight t
    allowance = np.repeat(weights, len(rows) // len(weights))
    C, D = balance.polyhedra(rows)
    excess = np.zeros((len(C), 1))
    excess[: len(rows), 0] = -allowance
    D[:, : len(rows)] -= allowance
    root = math.sqrt(REGULAR)
    z = least_distance(np.hstack([C / root, excess]), D)[:, :-1] / root
    f = balance.checked(balance.F0 + z @ balance.null.T)[0]
    if not np.isnan(f[0]):
        return f
    n = balance.G.shape[1]
    P, q = np.diag([REGULAR] * n + [1.0]), np.array([0.0] * n + [1.0])
    x = _solve(P, q, np.hstack([rows, -allowance[:, None]]), balance, balanced=True)
    return f if x is None else balance.checked(x[None, :n])[0]


def least_imbalance(balance: Balance, friction: float) -> Array | None:
    """Find forces (3k,) that leave the least imbalance against the first wrench.

    Gives the forces, in pyramids and limits; None if no solver finds any.
    """
    # (3) and (2) hold, while (1) is only approached: the square of its residual is the objective
    rows = balance.pyramids(np.full(len(balance.frames), friction))
    P = balance.G.T @ balance.G + LEAST_CHARGE * np.eye(balance.G.shape[1])
    q = balance.G.T @ balance.W[0]
    f = _nearest_to_balance(P, q, rows, balance)
    return _solve(P, q, rows, balance, balanced=False) if np.isnan(f[0]) else f


def _nearest_to_balance(P: Array, q: Array, rows: Array, balance: Balance) -> Array:
    """Minimise f'Pf/2 + q'f in the cones and limits: with P = L L', the least |L'f + inv(L) q|."""
    L = np.linalg.cholesky(P)
    back, shift = np.linalg.inv(L).T, np.linalg.solve(L, q)
    # (3), then (2), as rows; the balance (1) is in the objective
    along = np.eye(len(q))[0::3]
    C, d = [rows, -along], [np.zeros(len(rows)), -np.broadcast_to(balance.least, len(along))]
    if np.isfinite(balance.largest).all():
        C.append(along)
        d.append(np.broadcast_to(balance.largest, len(along)))
    turned = np.vstack(C) @ back
    z = least_distance(turned, (np.concatenate(d) + turned @ shift)[None])[0]
    return back @ (z - shift)


def _solve(P: Array, q: Array, rows: Array, balance: Balance, *, balanced: bool) -> Array | None:
    """Minimise x'Px/2 + q'x with rows @ x <= 0 by ProxQP, for the first wrench.

    The variables are its forces, and perhaps a last one that is free.
    """
    forces = balance.G.shape[1]
    lower, upper = np.full(len(q), -np.inf), np.full(len(q), np.inf)
    # (2) as bounds on every third variable, (1) as equations unless its residual is the objective
    lower[0:forces:3], upper[0:forces:3] = balance.least, balance.largest
    map_of_all = np.hstack([balance.G, np.zeros((len(balance.G), len(q) - forces))])
    equations = (map_of_all, -balance.W[0]) if balanced else (map_of_all[:0], np.empty(0))
    return minimize(QuadraticProgram(P, q, rows, np.zeros(len(rows)), *equations, lower, upper))
