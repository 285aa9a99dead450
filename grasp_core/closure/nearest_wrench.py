"""The wrench nearest to zero that contact forces can apply whose normal parts sum to one.

A cone program that always has a solution finds it. Its forces show how near to balance the contacts
come, and the direction from that wrench to zero is a twist y in which no contact has more support
than minus the distance. If the distance is positive, y separates the contacts' wrenches from zero.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.solvers.conic import ConicProgram, minimize


def nearest_wrench(wrenches: WrenchSet) -> tuple[Array, Array]:
    """Find local forces (3k,) with the wrench nearest to zero, and the way to zero, (m,)."""
    m, n = wrenches.G.shape
    k = n // 3
    q = np.append(np.zeros(n), 1.0)
    share = np.append(np.tile([1.0, 0.0, 0.0], k), 0.0)
    distance = np.vstack([-q, np.hstack([-wrenches.G / wrenches.size, np.zeros((m, 1))])])
    sides = np.zeros((n, n + 1))
    sides[np.arange(n), np.arange(n)] = -1.0
    sides[::3, :n:3] = -np.diag(wrenches.friction)
    pushes = np.hstack([-np.eye(n)[::3], np.zeros((k, 1))])
    # rows: normal parts sum to one, are not negative, distance >= |wrench|, friction cones
    A = np.vstack([share, pushes, distance, sides])
    b = np.append(1.0, np.zeros(len(A) - 1))
    answer = minimize(ConicProgram(q, A, b, 1, k, (m + 1, *(3,) * k)))
    facing = answer.z[k + 2 : k + m + 2]
    return _into_cones(answer.x[:n], wrenches.friction), facing


def _into_cones(forces: Array, friction: Array) -> Array:
    """Move forces into the cones and scale them so that their normal parts sum to one exactly."""
    each = forces.reshape(-1, 3).copy()
    each[:, 0] = np.maximum(each[:, 0], 0.0)
    across, allowed = np.hypot(each[:, 1], each[:, 2]), friction * each[:, 0]
    outside = across > allowed
    each[outside, 1:] *= (allowed[outside] / across[outside])[:, None]
    return each.ravel() / each[:, 0].sum()
