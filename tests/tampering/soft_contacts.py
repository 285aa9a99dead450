"""What is claimed of contacts with torsion, by definition: cones of four dimensions by Clarabel.

Nothing of the package is asked. Local coordinates are (push, tangent / mu, tangent / mu, torque /
mu_t), so that every cone is the same.
"""

import math

import numpy as np

from tests.tampering.exact_closure import (
    TOLERANCE,
    UNIT,
    conic,
    contacts_make_sense,
    locals_of,
    unit_arms,
)
from tests.tampering.exact_closure import closure as hard_closure


def soft_locals(x, n, mu, mu_t):
    """Wrenches of local coordinates at unit size, (6, 4k)."""
    arms, size = unit_arms(x)
    hard = locals_of(arms, n, mu).reshape(6, len(x), 3)
    turning = np.vstack([np.zeros((3, len(x))), (mu_t / size * n.T)])
    return np.concatenate([hard, turning[:, :, None]], axis=2).reshape(6, -1)


def make_sense(x, n, mu, mu_t):
    return (
        contacts_make_sense(x, n, mu) and np.shape(mu_t) == np.shape(mu)
        and bool(np.isfinite(mu_t).all() and (mu_t >= 0.0).all() and mu_t.any())
        and not ((mu_t > 0.0) & (mu == 0.0)).any()
    )  # fmt: skip


def soft_margin(x, n, mu, mu_t):
    """The largest t with t / mu + |(tangents / mu, torque / mu_t)| <= push; -inf if none."""
    k = len(x)
    used = np.column_stack([mu >= 0.0, mu > 0.0, mu > 0.0, mu_t > 0.0]).ravel()
    W = soft_locals(x, n / np.linalg.norm(n, axis=1, keepdims=True), mu, mu_t)
    _, sizes, rows = np.linalg.svd(W, full_matrices=False)
    W = rows[sizes > 1e-12 * sizes[0]]
    m, scale = len(W), float(mu.max())
    A, b = np.zeros((m + 1 + 4 * k, 4 * k + 1)), np.zeros(m + 1 + 4 * k)
    A[:m, :-1], A[m, :-1:4], b[m] = W, 1.0, 1.0
    A[m + 1 :, :-1] = -np.diag(used.astype(float))
    A[m + 1 :: 4, -1] = scale / np.where(mu == 0.0, 1.0, mu)
    equations = A[: m + 1, :-1]
    nearest = np.linalg.lstsq(equations, b[: m + 1], rcond=1e-12)[0]
    if np.abs(equations @ nearest - b[: m + 1]).max() > 1e-7:
        return -math.inf
    found = conic(np.append(np.zeros(4 * k), -1.0), A, b, m + 1, 0, k)
    if "PrimalInfeasible" in str(found.status):
        return -math.inf
    return scale * found.x[-1] if "Solved" in str(found.status) else math.nan


def closure(c):
    """A closure certificate of soft contacts is true in every field.

    One that has lost its torsion speaks of hard contacts, of which it may still be true.
    """
    x, n, mu, mu_t = c.positions, c.normals, c.friction, c.torsion_m
    if mu_t is None:
        return c.torques is None and hard_closure(c)
    if not make_sense(x, n, mu, mu_t) or not isinstance(c.closed, bool):
        return False
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    optimum = soft_margin(x, n, mu, mu_t)
    reach = mu_t.max() / unit_arms(x)[1]
    slack = TOLERANCE * (mu.max() + reach + min(abs(c.margin), 1e6))
    full = np.linalg.matrix_rank(soft_locals(x, n, mu, mu_t), 1e-10) == 6
    if c.closed:
        return bool(
            full and c.separating_wrench is None and 0.0 < c.margin <= optimum + slack
            and _balance(c.forces, c.torques, x, n, mu, mu_t)
        )  # fmt: skip
    if c.margin == 0.0:
        bounded = not full or optimum <= slack
    else:
        bounded = optimum <= c.margin + slack or (c.margin == -math.inf and optimum <= -0.9e6)
    return bool(
        c.forces is None and c.torques is None and c.margin <= 0.0 and bounded
        and separates(c.separating_wrench, x, n, mu, mu_t)
    )  # fmt: skip


def _balance(f, m, x, n, mu, mu_t):
    if np.shape(f) != np.shape(x) or np.shape(m) != np.shape(mu):
        return False
    arms, size = unit_arms(x)
    along = np.einsum("ki,ki->k", f, n)
    across = np.linalg.norm(f - along[:, None] * n, axis=1)
    slides = np.where(mu > 0.0, across / np.where(mu > 0.0, mu, 1.0), 0.0)
    turns = np.where(mu_t > 0.0, np.abs(m) / np.where(mu_t > 0.0, mu_t, 1.0), 0.0)
    inside = np.hypot(slides, turns) < along
    loose = max(across[mu == 0.0].max(initial=0.0), np.abs(m[mu_t == 0.0]).max(initial=0.0) / size)
    torque = np.cross(arms, f).sum(axis=0) + (m / size) @ n
    off = max(np.abs(f.sum(axis=0)).max(), np.abs(torque).max(), abs(along.sum() - 1.0), loose)
    return bool(inside.all()) and off <= UNIT * (1.0 + (mu_t / size).max())


def separates(y, x, n, mu, mu_t):
    """The supports of the cones along a twist are not positive, to within rounding."""
    if np.shape(y) != (6,) or not np.isfinite(y).all():
        return False
    size, center = unit_arms(x)[1], x.mean(axis=0)
    v = y[:3] + np.cross(y[3:], x)
    along = np.einsum("ki,ki->k", v, n)
    across = np.linalg.norm(v - along[:, None] * n, axis=1)
    excess = along + np.hypot(mu * across, mu_t * (n @ y[3:]))
    length = np.hypot(np.linalg.norm(y[:3] + np.cross(y[3:], center)), np.linalg.norm(y[3:]) * size)
    far = 1.0 + np.linalg.norm(center) / size
    weight = np.sqrt(1.0 + mu**2 + (mu_t / size) ** 2)
    return length > 0.0 and bool((excess / weight <= 1e-11 * far * length).all())


def limit(c):
    """The largest multiple, solved again, is between the limit and the upper bound."""
    found, x, n, mu, largest = c.found, c.positions, c.normals, c.friction, c.max_normal_force
    if not make_sense(x, n, mu, c.torsion_m):
        return False
    k, (arms, size) = len(x), unit_arms(x)
    lever = np.cross(x.mean(axis=0) - c.center, found.wrench[:3])
    load = np.append(found.wrench[:3], (found.wrench[3:] - lever) / size)
    length = np.linalg.norm(load)
    A = np.zeros((6 + 5 * k, 4 * k + 1))
    A[:6, :-1], A[:6, -1] = soft_locals(x, n, mu, c.torsion_m), load / length
    A[6 + np.arange(k), 4 * np.arange(k)] = 1.0
    A[6 + k :, :-1] = -np.eye(4 * k)
    b = np.r_[np.zeros(6), np.ones(k), np.zeros(4 * k)]
    solved = conic(np.append(np.zeros(4 * k), -1.0), A, b, 6, k, k)
    best = largest * solved.x[-1] / length
    f, m = found.forces / largest, found.torques / largest
    along = np.einsum("ki,ki->k", f, n)
    across = np.linalg.norm(f - along[:, None] * n, axis=1)
    levers = np.where(c.torsion_m > 0.0, mu / np.where(c.torsion_m > 0.0, c.torsion_m, 1.0), 0.0)
    loose = bool((m[c.torsion_m == 0.0] == 0.0).all())
    left = np.append(f.sum(axis=0), np.cross(arms, f).sum(axis=0) + (m / size) @ n)
    left += found.limit / largest * load
    weight = np.sqrt(1.0 + mu.max() ** 2) * (
        1.0 + (c.torsion_m / size / np.maximum(mu, 1e-3)).max()
    )
    slack = 1e-6 * weight * (best + largest / length)
    return bool(
        found.limit <= best + slack and found.upper >= best - slack and found.limit <= found.upper
        and loose and (np.hypot(across, levers * m) <= mu * along + 1e-6 * weight).all()
        and along.max() <= 1.0 + 1e-6 * weight and np.linalg.norm(left) <= 1e-6 * weight
        and abs(found.facet @ found.wrench + 1.0) <= 1e-6
    )  # fmt: skip
