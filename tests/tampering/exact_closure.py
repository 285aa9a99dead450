"""Force closure by its definition: exact cones by Clarabel, long numbers, and ranks.

Nothing of the package is asked, here and in `on_planes` and `wrench_bounds`. Slacks are those that
the certificates state, doubled.
"""

import math

import clarabel
import numpy as np
from scipy import sparse

UNIT = 2e-9
ANY_FRICTION = 1e9
"""Stands in for an infinite coefficient."""
TOLERANCE = 2e-8
"""Of margins, relative to friction and margin: what the conic solver is good for."""


def tangents(n):
    return np.linalg.svd(n[None])[2][1:].T


def unit_arms(x):
    arms = x - x.mean(axis=0)
    size = np.linalg.norm(arms, axis=1).max()
    return (arms / size if size > 0.0 else arms), size or 1.0


def conic(q, A, b, equalities, nonnegative, cones):
    """Solve a conic program whose last rows are `cones` cones of one dimension."""
    size = (len(b) - equalities - nonnegative) // max(cones, 1)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    kinds = [clarabel.ZeroConeT(equalities), clarabel.NonnegativeConeT(nonnegative)]
    kinds += [clarabel.SecondOrderConeT(size)] * cones
    none, rows = sparse.csc_matrix((len(q), len(q))), sparse.csc_matrix(A)
    return clarabel.DefaultSolver(none, np.array(q), rows, np.array(b), kinds, settings).solve()


def locals_of(x, n, mu):
    """Wrenches of (push, tangent / mu, tangent / mu) of each contact, (6, 3k), zeros at mu = 0."""
    columns = []
    for arm, normal, friction in zip(x, n, mu, strict=True):
        frame = np.column_stack([normal, friction * tangents(normal)])
        columns.append(np.vstack([frame, np.cross(arm, frame.T).T]))
    return np.hstack(columns)


def margin_of(x, n, mu):
    """Optimum of the margin program: t / (mu or 1) + |tangent / mu| <= push; -inf if none."""
    k, flat = len(x), mu == 0.0
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    pushing = np.tile([True, False, False], k)
    free = pushing | np.repeat(~flat, 3)
    W = locals_of(unit_arms(x)[0], n, mu)[:, free]
    _, sizes, rows = np.linalg.svd(W, full_matrices=False)  # without redundant equations
    W = rows[sizes > 1e-12 * sizes[0]]
    m, count = len(W), int(free.sum())
    scale = float(mu.max()) or 1.0
    depth = np.where(pushing, np.repeat(scale / np.where(flat, 1.0, mu), 3), 0.0)[free]
    order = np.argsort(~np.repeat(flat, 3)[free], kind="stable")
    A = np.zeros((m + 1 + count, count + 1))
    A[:m, :-1], A[m, :-1] = W, pushing[free]
    A[m + 1 + np.arange(count), order] = -1.0
    A[m + 1 :, -1] = depth[order]
    b = np.zeros(len(A))
    b[m] = 1.0
    equations = np.vstack([W, pushing[free]])
    nearest = np.linalg.lstsq(equations, b[: m + 1], rcond=1e-12)[0]
    if np.abs(equations @ nearest - b[: m + 1]).max() > 1e-7:
        return -math.inf  # no forces balance, whatever their cones
    q = np.append(np.zeros(count), -1.0)
    found = conic(q, A, b, m + 1, int(flat.sum()), int((~flat).sum()))
    name = str(found.status)
    if "PrimalInfeasible" in name:
        return -math.inf
    return scale * found.x[-1] if "Solved" in name else math.nan


def contacts_make_sense(x, n, mu):
    return (
        np.ndim(x) == 2 and np.shape(x) == np.shape(n) == (len(x), 3)
        and np.shape(mu) == (len(x),) and np.isfinite(x).all() and np.isfinite(mu).all()
        and (mu >= 0.0).all() and (np.abs(np.linalg.norm(n, axis=1) - 1.0) <= UNIT).all()
    )  # fmt: skip


def closure(c):
    """A closure certificate is true in every field."""
    x, n, mu = c.positions, c.normals, c.friction
    if not contacts_make_sense(x, n, mu) or not isinstance(c.closed, bool):
        return False
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    optimum = margin_of(x, n, mu)
    slack = TOLERANCE * (mu.max() + min(abs(c.margin), 1e6))
    full = np.linalg.matrix_rank(locals_of(unit_arms(x)[0], n, mu), 1e-10) == 6
    if c.closed:
        return (
            full and c.separating_wrench is None and 0.0 < c.margin <= optimum + slack
            and _balance(c.forces, x, n, mu)
        )  # fmt: skip
    if c.margin == 0.0:  # nothing but the lack of closure
        bounded = not full or optimum <= slack
    else:
        bounded = optimum <= c.margin + slack or (c.margin == -math.inf and optimum <= -0.9e6)
    return bool(
        c.forces is None and c.margin <= 0.0 and bounded
        and separates(c.separating_wrench, x, n, mu)
    )  # fmt: skip


def interval(c):
    """Both ends of a critical friction are proved by what is shown beside them."""
    x, n, lower, upper = c.positions, c.normals, c.lower, c.upper
    if not contacts_make_sense(x, n, np.zeros(len(x))) or not 0.0 <= lower <= upper:
        return False
    if upper < math.inf:
        mu = np.full(len(x), upper)
        if np.shape(c.forces) != np.shape(x) or closed(x, n, mu) is False:
            return False
        forces = _balanced(c.forces, x, n, upper)
        pushes = np.einsum("ki,ki->k", forces, n).sum()
        if not (pushes > 0.0 and _balance(forces / pushes, x, n, mu)):
            return False
    if lower == 0.0:
        return c.twist is None
    if np.shape(c.twist) != (6,):
        return False
    velocity, turning = np.split(c.twist, 2)
    about_origin = np.concatenate([velocity - np.cross(turning, x[0]), turning])
    return separates(about_origin, x, n, np.full(len(x), min(lower, ANY_FRICTION)))


def _balanced(f, x, n, friction):
    """Forces without their imbalance, which those deep in their cones take up."""
    arms = unit_arms(x)[0]
    G = np.vstack(
        [np.tile(np.eye(3), len(x)), np.hstack([np.cross(np.eye(3), a).T for a in -arms])]
    )
    along = np.einsum("ki,ki->k", f, n)
    depths = friction * along - np.linalg.norm(f - along[:, None] * n, axis=1)
    W = np.repeat(np.maximum(depths, 0.0) / np.abs(depths).max(), 3)
    for _ in range(3):  # once, and what rounding leaves
        f = f - (W * (np.linalg.pinv(G * W) @ (G @ f.ravel()))).reshape(f.shape)
    return f


def _balance(f, x, n, mu):
    if np.shape(f) != np.shape(x) or not np.isfinite(f).all():
        return False
    along = np.einsum("ki,ki->k", f, n)
    across = np.linalg.norm(f - along[:, None] * n, axis=1)
    torque = np.cross(unit_arms(x)[0], f).sum(axis=0)
    inside = np.where(mu > 0.0, across < mu * along, (across <= UNIT) & (along > 0.0))
    off = max(np.abs(f.sum(axis=0)).max(), np.abs(torque).max(), abs(along.sum() - 1.0))
    return bool(inside.all()) and off <= UNIT


def separates(y, x, n, mu):
    """To within rounding of 1e-12 at unit size, and of where the frame's origin is."""
    if np.shape(y) != (6,) or not np.isfinite(y).all():
        return False
    y = np.asarray(y, dtype=np.longdouble)
    x = np.asarray(x, dtype=np.longdouble)
    center, (_, size) = x.mean(axis=0), unit_arms(np.asarray(x, dtype=float))
    v = y[:3] + np.cross(y[3:], x)
    along = np.einsum("ki,ki->k", v, n)
    across = np.linalg.norm((v - along[:, None] * n).astype(float), axis=1)
    length = float(np.hypot(np.linalg.norm((y[:3] + np.cross(y[3:], center)).astype(float)),
                            np.linalg.norm(y[3:].astype(float)) * size))  # fmt: skip
    far = 1.0 + np.linalg.norm(center.astype(float)) / size
    excess = (along.astype(float) + mu * across) / np.sqrt(1.0 + mu**2)
    return length > 0.0 and bool((excess <= 1e-11 * far * length).all())


def closed(x, n, mu):
    """Force closure by the margin; None where it is too close to zero to tell."""
    optimum = margin_of(x, n, mu)
    if math.isnan(optimum):
        return None
    full = np.linalg.matrix_rank(locals_of(unit_arms(x)[0], n, mu), 1e-9) == 6
    slack = 1e-8 * max(mu.max(), 1e-3)
    return None if full and abs(optimum) <= slack else bool(full and optimum > slack)
