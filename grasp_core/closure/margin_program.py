"""Solves the margin program of force closure, in compiled code or by the conic solver.

`force_closure` derives the program, (1) to (3) there, and `margin_kernel` the compiled method. What
a solution claims is proved by `proofs`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.closure.wrenches import WRENCH, contact_frames, in_frames
from grasp_core.compiled import compiled
from grasp_core.solvers.conic import ConicProgram, minimize

KERNEL = "grasp_core.closure.critical_friction_kernel"
"""Kernel of the search for critical friction, which solves the same program at many frictions."""
CHECK_SLACK = 1e-12
"""Slack of the plain-arithmetic checks, for data scaled to unit size: some thousand
rounding errors."""
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)
"""Least number that is divided by: the smallest of full precision."""
SIGN_SHARE = 0.1
"""Gap, as in `margin_kernel`, that may be left where only the sign of a margin is asked for."""


def deepest_forces(
    arms: Array, normals: Array, friction: Array, share: float = SIGN_SHARE
) -> tuple[Array, Array, Array]:
    """Balance many sets of contacts with forces as deep in the cones as possible.

    Takes `arms`, `normals` (g, k, 3); `friction` (g,). Gives forces, (g, k, 3); twists, (g, 6), on
    which the supports are at most the margin over the friction; and lower and upper bounds of the
    margin, (g, 2), where the forces balance. A search that broke down, as it does on degenerate
    contacts, ends with bounds that have crossed or are not numbers.
    """
    forces, twists = np.zeros_like(arms), np.zeros((len(arms), WRENCH))
    values = np.ones((len(arms), 2))
    given = tuple(np.array(each) for each in (arms, normals, friction))  # writable
    compiled(KERNEL).deepest(given, share, forces, twists, values)
    contacts = arms.shape[1]
    return forces, twists / contacts, friction[:, None] / contacts * (1.0 - values)


def margin_program(balance: Array, normals: Array, friction: Array) -> tuple[float, Array, Array]:
    """Solve for the margin t, balancing forces (k, 3), and the twist of the dual program.

    The twist has one entry for each row of `balance`. The unknowns of a contact are its normal
    force and its tangential force over mu, so that small coefficients are solved as well as large
    ones; without friction only the normal force is unknown.

    Takes `balance` (m, 3k); `normals` (k, 3); `friction` (k,).
    """
    k, m = len(normals), len(balance)
    frames = contact_frames(normals) * np.array([np.ones(k), friction, friction]).T[:, None]
    free = allowed(friction)
    rows = in_frames(balance, frames)[:, free]
    pushing = np.tile([True, False, False], k)[free]
    if (departing := departing_twist(rows, pushing * 1.0)) is not None:
        return -math.inf, np.zeros((k, 3)), departing
    n = int(free.sum())
    largest = float(friction.max()) or 1.0
    flat = friction == 0.0
    A = np.zeros((m + 1 + n, n + 1))
    # (1) and (2) of `force_closure` as equations
    A[:m, :n], A[m, :n] = rows, pushing
    order = np.argsort(~np.repeat(flat, 3)[free], kind="stable")  # frictionless rows first
    A[m + 1 + np.arange(n), order] = -1.0
    # (3), over mu: the normal part less t / mu bounds the tangential part over mu
    depths = largest / np.where(flat, 1.0, np.maximum(friction, SMALLEST_NORMAL))
    A[m + 1 :, n] = np.where(pushing, np.repeat(depths, 3)[free], 0.0)[order]
    b, q = np.zeros(len(A)), np.zeros(n + 1)
    b[m], q[-1] = 1.0, -1.0
    flats = int(flat.sum())
    solution = minimize(ConicProgram(q, A, b, m + 1, flats, (3,) * (k - flats)))
    local = np.zeros(3 * k)
    x = solution.x[:-1]
    # what the solver leaves of the imbalance is taken off by least squares
    local[free] = x - np.asarray(np.linalg.lstsq(rows, rows @ x, rcond=None)[0], dtype=np.float64)
    forces = np.einsum("kij,kj->ki", frames, local.reshape(k, 3))
    return largest * float(solution.x[-1]), forces, -solution.z[:m]


def allowed(friction: Array) -> NDArray[np.bool_]:
    """Return which components (normal, tangent, tangent) of forces may be non-zero, (3k,)."""
    sliding = friction > 0.0
    return np.column_stack([np.ones_like(sliding), sliding, sliding]).ravel()


def departing_twist(rows: Array, share: Array) -> Array | None:
    """Find a twist with which every contact leaves along its normal: then no forces balance."""
    sizes = np.maximum(np.linalg.norm(rows, axis=0), SMALLEST_NORMAL)
    scaled: Array = (rows / sizes).T
    twist = -np.asarray(np.linalg.lstsq(scaled, share / sizes, rcond=None)[0], dtype=np.float64)
    missed = np.abs(rows.T @ twist + share) / np.maximum(sizes, 1.0)
    if not np.isfinite(missed).all() or missed.max() > CHECK_SLACK * (
        1.0 + float(np.abs(twist).max())
    ):
        return None
    return twist
