"""Decides force closure of soft contacts: finds forces and torques, or a twist, that prove it.

Solved, in the local coordinates x = (n, a) of `contacts`, with r_i = 1 / mu_i:

    maximise t  subject to  sum A_i x_i = 0,  sum n_i = 1,  |a_i| + r_i t <= n_i.       (1)

Each cone has four dimensions, so the conic solver solves (1); what its answers prove is decided by
`proofs`. As with hard contacts, margins of zero need a twist that lies on the cones, or one that
leaves contacts at rest that balance by themselves.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.margin_program import SMALLEST_NORMAL, departing_twist
from grasp_core.closure.proofs import RANK
from grasp_core.closure.soft.contacts import LOCAL, SoftContacts
from grasp_core.closure.soft.proofs import depths, margin_ceiling, proved_margin, supports
from grasp_core.closure.wrenches import WRENCH
from grasp_core.errors import SolverError
from grasp_core.solvers.conic import ConicProgram, minimize

DECIDED = 1e-9
"""Distance of a margin from zero below which a certificate alone decides: a hundred times the
tolerance that the solver is asked for."""
INTERIOR = 1e-6
"""Depth in a cone above which a force counts as interior, if normal parts sum to 1: far more than
the solver leaves on a boundary."""
TOUCHING = 1e-9
"""Supports of a unit twist above minus this value count as zero: the tolerance of the solver."""
NEWTON_STEPS = 3


@dataclass(frozen=True, slots=True, eq=False)
class SoftAnswer:
    """The solution of the program (1), and the verdict on force closure that it proves."""

    margin: float
    """Optimum of the program as the solver found it, dimensionless; only `closed` is proved."""
    local: Array
    """Balancing local coordinates, (k, 4); they prove closure if `closed` is True."""
    twist: Array
    """Twist of the dual program, (6,); it refutes closure if `closed` is False."""
    closed: bool | None
    """The verdict; None where neither closure nor its opposite is proved."""


def decide(contacts: SoftContacts) -> SoftAnswer:
    """Decide force closure of soft contacts at unit size."""
    try:
        margin, local, twist = margin_program(contacts.matrix, contacts.shares)
    except SolverError:
        return SoftAnswer(math.nan, *_nothing(len(contacts.friction)), closed=None)
    if proved_margin(contacts, local) > 0.0:
        return SoftAnswer(margin, local, twist, closed=True)
    candidates = [twist]
    if abs(margin) < DECIDED:
        candidates.append(_touching(contacts, twist))
    sparing = _sparing(contacts, local) if margin > -DECIDED else None
    candidates += [] if sparing is None else [sparing, _touching(contacts, sparing)]
    for each in candidates:
        if margin_ceiling(contacts, each) <= 0.0:
            return SoftAnswer(margin, local, each, closed=False)
    return SoftAnswer(margin, local, twist, closed=None)


def margin_program(balance: Array, shares: Array) -> tuple[float, Array, Array]:
    """Solve (1) for the margin, local coordinates (k, 4), and the twist of the dual program.

    Takes `balance` (m, 4k); `shares` (k,).
    """
    k, m = len(shares), len(balance)
    n = LOCAL * k
    pushing = np.tile([1.0, 0.0, 0.0, 0.0], k)
    used = (np.abs(balance) > 0.0).any(axis=0) | (pushing > 0.0)
    departing = departing_twist(balance[:, used], pushing[used])
    if departing is not None:
        return -math.inf, np.zeros((k, LOCAL)), departing
    least = float(shares.min())
    A, b, q = np.zeros((m + 1 + n, n + 1)), np.zeros(m + 1 + n), np.zeros(n + 1)
    # equations: balance, and normal parts that sum to one
    A[:m, :n], A[m, :n], b[m], q[-1] = balance, pushing, 1.0, -1.0
    # cones: n - r t >= |a|, with t in units that keep its columns of order one
    A[m + 1 :, :n] = -np.eye(n)
    A[m + 1 :: LOCAL, n] = shares / least
    solution = minimize(ConicProgram(q, A, b, m + 1, 0, (LOCAL,) * k))
    x = solution.x[:-1]
    # what the solver leaves of the imbalance is taken off by least squares
    x = x - np.asarray(np.linalg.lstsq(balance, balance @ x, rcond=None)[0], dtype=np.float64)
    return float(solution.x[-1]) / least, x.reshape(k, LOCAL), -solution.z[:m]


def _nothing(count: int) -> tuple[Array, Array]:
    return np.zeros((count, LOCAL)), np.zeros(WRENCH)


def _touching(contacts: SoftContacts, twist: Array) -> Array:
    """Change a twist by Newton's method, so that nearly zero supports are zero up to rounding."""
    twist = twist / max(float(np.linalg.norm(twist)), SMALLEST_NORMAL)
    for _ in range(NEWTON_STEPS):
        slopes = contacts.slopes(twist)
        across = np.maximum(np.linalg.norm(slopes[:, 1:], axis=1), SMALLEST_NORMAL)
        excess = supports(slopes)
        touched = excess > -TOUCHING
        # the gradient of s_i in y is the wrench of the force in cone i that works most along y
        working = np.hstack([np.ones((len(slopes), 1)), slopes[:, 1:] / across[:, None]])
        gradients = np.einsum("kwj,kj->kw", contacts.A, working)[touched]
        step = np.asarray(
            np.linalg.lstsq(gradients, excess[touched], rcond=RANK)[0], dtype=np.float64
        )
        twist = twist - step
    return twist


def _sparing(contacts: SoftContacts, local: Array) -> Array | None:
    """Find a separating twist where some contacts balance each other, as for hard contacts.

    Such a twist leaves the balanced contacts at rest. Among these twists the program is solved
    again for the other contacts, until its optimum is negative or no contact is left.
    """
    rest, twists = np.arange(len(local)), np.eye(WRENCH)
    while True:  # each turn takes balanced contacts from the rest, or returns
        balanced = depths(local) > INTERIOR
        if not balanced.any():
            return None
        # a force inside its cone can work along all that its contact feels, so that must be zero
        held = contacts.A[rest[balanced]].transpose(0, 2, 1).reshape(-1, WRENCH)
        twists = _null_space(held @ twists, twists)
        rest = rest[~balanced]
        if not twists.shape[1]:
            return None
        if not rest.size:
            return twists[:, 0]
        left = contacts.A[rest].transpose(1, 0, 2).reshape(WRENCH, -1)
        try:
            margin, local, reduced = margin_program(twists.T @ left, contacts.shares[rest])
        except SolverError:
            return None
        if margin < -DECIDED:
            return twists @ reduced
        if margin > DECIDED:
            return None


def _null_space(rows: Array, basis: Array) -> Array:
    """Return a basis of the vectors in the span of `basis` (columns) that `rows` maps to 0."""
    _, values, right = np.linalg.svd(rows)
    return basis @ right[int((values > RANK).sum()) :].T
