"""Finds the point nearest to the origin in each of many polyhedra with the same normals.

Solved: minimise |x| subject to C x <= d, for every row d of D.

A point x is nearest iff C x <= d and x = -C'u for some u >= 0 that vanishes off the active rows,
where equality holds. A compiled dual active-set method finds x and u, or u >= 0 with C'u = 0 and
d.u < 0, which proves that nothing is feasible. An answer counts if it meets these conditions.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled

KERNEL = "grasp_core.solvers.nearest_point_kernel"
EXACT = 1e-11
"""Accepted violation of the conditions, relative to x: some thousand rounding errors, and a
hundredth of any difference that matters."""


def least_distance(C: Array, D: Array, *, accuracy: float = EXACT) -> Array:
    """Find the nearest points, (n, v), as rows; a row is NaN where none was proved to be near.

    A row of the answer does not depend on the other rows of D, except for rounding.

    Takes `C` (m, v); `D` (n, m).
    """
    X = np.zeros((len(D), C.shape[1]))
    outside = np.flatnonzero(D.min(axis=1) < 0.0)
    sizes = -D[outside].min(axis=1)[:, None]
    alike, near = D[outside] / sizes, np.zeros((len(outside), C.shape[1]))
    U = np.zeros(alike.shape)
    compiled(KERNEL).solve(np.array(C, order="C"), np.array(alike, order="C"), near, U)
    slack = alike - near @ C.T
    unmet = np.abs(near + U @ C).max(axis=1, initial=0.0)
    np.maximum(unmet, -slack.min(axis=1), out=unmet)
    np.maximum(unmet, np.where(U != 0.0, slack, 0.0).max(axis=1), out=unmet)
    np.maximum(unmet, -U.min(axis=1), out=unmet)
    near[~(unmet <= accuracy * np.abs(near).max(axis=1, initial=1.0))] = np.nan
    X[outside] = sizes * near
    return X
