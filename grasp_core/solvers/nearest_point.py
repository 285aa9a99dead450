"""Finds the point nearest to the origin in each of many polyhedra with the same normals.

Solved: minimise |x| subject to C x <= d, for every row d of D.

A point x is nearest iff C x <= d and x = -C'u for some u >= 0 that vanishes off the active rows,
where equality holds. A compiled dual active-set method finds x and u, or v >= 0 with C'v = 0 and
d.v < 0, which proves that nothing is feasible. Where it fails, or its answer misses these
conditions, least squares find u (Lawson & Hanson): with the residual (y, s) of

    minimise |C'v|^2 + (1 + d.v)^2  over  v >= 0

x = -y / s and u = v / s; where the residual vanishes, v proves that nothing is feasible. The active
rows a alone give x = C_a^+ d_a, linear in d, so the active rows of one d are tried on others: for
loads along a path or along few directions, few programs need to be solved.

Source: Lawson & Hanson, "Solving Least Squares Problems", 1974, chapter 23.
"""

import importlib
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled

KERNEL = "grasp_core.solvers.nearest_point_kernel"
EXACT = 1e-11
"""Accepted violation of the conditions, relative to x: some thousand rounding errors, and a
hundredth of any difference that matters."""
FARTHEST = 1e4
"""Largest |x| that a proof of an empty polyhedron must exclude, where the largest distance of a
violated row from the origin is 1."""
TRIED = 200
"""Number of right-hand sides on which known active rows are tried: this takes about twice as long
as finding new ones."""
WORTH = 2
"""Number of successes at which trying active rows saves time; below it, they are tried half as
often."""


def least_distance(C: Array, D: Array, *, accuracy: float = EXACT) -> Array:
    """Find the nearest points, (n, v), as rows; a row is NaN where none was proved to be near.

    Polyhedra that are proved to be empty, or to be farther than `FARTHEST` times the largest
    violation, have NaN as well.

    A row of the answer does not depend on the other rows of D, except for rounding.

    Takes `C` (m, v); `D` (n, m).
    """
    X = np.zeros((len(D), C.shape[1]))
    outside = np.flatnonzero(D.min(axis=1) < 0.0)
    sizes = -D[outside].min(axis=1)[:, None]
    alike = D[outside] / sizes
    near, proved, empty = _by_kernel(C, alike, accuracy)
    near[empty] = np.nan
    left = ~(proved | empty)
    if left.any():
        near[left] = _by_least_squares(C, alike[left])
    X[outside] = sizes * near
    return X


def _by_kernel(
    C: Array, D: Array, accuracy: float
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Find points by the compiled method, (n, v).

    Gives the points; which of them are proved, (n,); and which polyhedra are proved to be empty or
    farther than `FARTHEST` from the origin, (n,).
    """
    X, U = np.zeros((len(D), C.shape[1])), np.zeros(D.shape)
    compiled(KERNEL).solve(np.array(C, order="C"), np.array(D, order="C"), X, U)
    slack = D - X @ C.T
    unmet = np.abs(X + U @ C).max(axis=1, initial=0.0)
    np.maximum(unmet, -slack.min(axis=1), out=unmet)
    np.maximum(unmet, np.where(U != 0.0, slack, 0.0).max(axis=1), out=unmet)
    np.maximum(unmet, -U.min(axis=1), out=unmet)
    proved = unmet <= accuracy * np.abs(X).max(axis=1, initial=1.0)
    # with v >= 0, v.(C x - d) >= -d.v - |C'v| |x|: positive for all |x| that come into question,
    # by more than rows may be off together
    gaps = -(D * U).sum(axis=1)
    allowed = FARTHEST * (np.linalg.norm(U @ C, axis=1) + EXACT * U.sum(axis=1))
    return X, proved, ~proved & (U.min(axis=1) >= 0.0) & (gaps > allowed)


def _by_least_squares(C: Array, D: Array) -> Array:
    """Find nearest points by least squares, (n, v); every row of D has a negative entry."""
    X, V = np.zeros((len(D), C.shape[1])), np.zeros(D.shape)
    waiting, solved = np.ones(len(D), dtype=bool), np.zeros(len(D), dtype=bool)
    pause, wait = 1, 0
    for i in range(len(D)):
        if not waiting[i]:
            continue
        V[i] = _weights(C, D[i])
        solved[i], waiting[i], wait = True, False, wait - 1
        others = np.flatnonzero(waiting[i : i + TRIED]) + i
        if others.size and wait < 0:
            near, proved = _on_rows(C, D[others], np.flatnonzero(V[i]))
            X[others[proved]], waiting[others[proved]] = near[proved], False
            pause = 1 if np.count_nonzero(proved) > WORTH else 2 * pause
            wait = pause - 1
    X[solved] = _from_weights(C, D[solved], V[solved])
    return X


def _weights(C: Array, d: Array) -> Array:
    """Compute the least-squares weights v of the module; zero after too many iterations."""
    target = np.zeros(C.shape[1] + 1)
    target[-1] = -1.0
    try:
        return _optimize().nnls(np.vstack([C.T, d]), target)[0]
    except RuntimeError:
        return np.zeros(len(d))


def _from_weights(C: Array, D: Array, V: Array) -> Array:
    """Compute nearest points from vectors v, check them, and correct them where they fail."""
    left = np.maximum(1.0 + (D * V).sum(axis=1, keepdims=True), np.finfo(np.float64).eps)
    X = -(V @ C) / left
    slack = D - X @ C.T
    unmet = np.maximum(-slack.min(axis=1), np.where(V > 0.0, slack, 0.0).max(axis=1))
    for i in np.flatnonzero(~(unmet <= _allowed(X))):
        near, proved = _on_rows(C, D[i : i + 1], np.flatnonzero(V[i]))
        X[i] = near[0] if proved[0] else np.nan
    return X


def _on_rows(C: Array, D: Array, active: Indices) -> tuple[Array, NDArray[np.bool_]]:
    """Compute nearest points if these rows are active, (n, v); also return which are proved."""
    inverse = np.linalg.pinv(C[active])
    X = D[:, active] @ inverse.T
    slack, multipliers = D - X @ C.T, -(X @ inverse)
    unmet = np.maximum(-slack.min(axis=1), slack[:, active].max(axis=1, initial=0.0))
    unmet = np.maximum(unmet, -multipliers.min(axis=1, initial=0.0))
    return X, unmet <= _allowed(X)


def _allowed(X: Array) -> Array:
    return EXACT * np.abs(X).max(axis=1, initial=1.0)


@cache
def _optimize() -> Any:
    return importlib.import_module("scipy.optimize")
