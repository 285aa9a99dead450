"""Force closure by its definition: exact cones by Clarabel, long numbers, and ranks.

Nothing of the package is asked, here and in `on_planes` and `wrench_bounds`. Slacks are those that
the certificates state, doubled. A contact without torsion is one whose coefficient mu_t is zero;
local coordinates are (push, tangent / mu, tangent / mu, torque / mu_t), so that every cone is the
same.
"""

import math

import clarabel
import numpy as np
from scipy import sparse

from tests.grasp_core.exact_judges import closed_exactly, open_exactly

UNIT = 2e-9
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


def soft_locals(x, n, mu, mu_t):
    """Wrenches of local coordinates at unit size, (6, 4k), zeros where a coefficient is."""
    arms, size = unit_arms(x)
    hard = locals_of(arms, n, mu).reshape(6, len(x), 3)
    turning = np.vstack([np.zeros((3, len(x))), mu_t / size * n.T])
    return np.concatenate([hard, turning[:, :, None]], axis=2).reshape(6, -1)


def margin_of(x, n, mu, mu_t=None):
    """The largest t with t / (mu or 1) + |(tangents / mu, torque / mu_t)| <= push; -inf if none.

    Pushes have sum one; t is in units of the largest friction, or of one.
    """
    k, mu_t = len(x), np.zeros(len(x)) if mu_t is None else mu_t
    used = np.column_stack([mu >= 0.0, mu > 0.0, mu > 0.0, mu_t > 0.0]).ravel()
    W = soft_locals(x, n / np.linalg.norm(n, axis=1, keepdims=True), mu, mu_t)[:, used]
    _, sizes, rows = np.linalg.svd(W, full_matrices=False)  # without redundant equations
    W = rows[sizes > 1e-12 * sizes[0]]
    m, scale = len(W), float(mu.max()) or 1.0
    A, b = np.zeros((m + 1 + 4 * k, int(used.sum()) + 1)), np.zeros(m + 1 + 4 * k)
    A[:m, :-1], A[m, :-1], b[m] = W, np.arange(4 * k)[used] % 4 == 0, 1.0
    A[m + 1 + np.flatnonzero(used), np.arange(used.sum())] = -1.0
    A[m + 1 :: 4, -1] = scale / np.where(mu == 0.0, 1.0, mu)
    equations = A[: m + 1, :-1]
    nearest = np.linalg.lstsq(equations, b[: m + 1], rcond=1e-12)[0]
    if np.abs(equations @ nearest - b[: m + 1]).max() > 1e-7:
        return -math.inf  # no forces balance, whatever their cones
    found = conic(np.append(np.zeros(A.shape[1] - 1), -1.0), A, b, m + 1, 0, k)
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


def torsions_make_sense(mu, mu_t):
    return (
        np.shape(mu_t) == np.shape(mu) and bool(np.isfinite(mu_t).all() and (mu_t >= 0.0).all())
        and bool(mu_t.any()) and not ((mu_t > 0.0) & (mu == 0.0)).any()
    )  # fmt: skip


def closure(c):
    """A closure certificate is true in every field.

    One that has lost its torsion speaks of hard contacts, of which it may still be true.
    """
    x, n, mu, mu_t = c.positions, c.normals, c.friction, c.torsion_m
    if not contacts_make_sense(x, n, mu) or not isinstance(c.closed, bool):
        return False
    if not (c.torques is None if mu_t is None else torsions_make_sense(mu, mu_t)):
        return False
    mu_t = np.zeros(len(x)) if mu_t is None else mu_t
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    optimum = margin_of(x, n, mu, mu_t)
    reach = mu_t.max() / unit_arms(x)[1]
    slack = TOLERANCE * (mu.max() + reach + min(abs(c.margin), 1e6))
    full = np.linalg.matrix_rank(soft_locals(x, n, mu, mu_t), 1e-10) == 6
    if c.closed:
        torques = np.zeros(len(x)) if c.torsion_m is None else c.torques
        return bool(
            full and c.separating_wrench is None and 0.0 < c.margin <= optimum + slack
            and balance(c.forces, x, n, mu, torques, mu_t)
        )  # fmt: skip
    if c.margin == 0.0:  # nothing but the lack of closure
        bounded = not full or optimum <= slack
    else:
        bounded = optimum <= c.margin + slack or (c.margin == -1e6 and optimum <= -0.9e6)
    return bool(
        c.forces is None and c.torques is None and c.margin <= 0.0 and bounded
        and separates(c.separating_wrench, x, n, mu, mu_t)
    )  # fmt: skip


def interval(c):
    """Both ends of a critical friction are proved, without rounding, by what is beside them."""
    x, n, lower, upper = c.positions, c.normals, c.lower, c.upper
    if not contacts_make_sense(x, n, np.zeros(len(x))) or not 0.0 <= lower <= upper:
        return False
    if upper < math.inf and not (
        np.shape(c.forces) == np.shape(x) and closed_exactly(c.forces, x, n, upper)
    ):
        return False
    if lower == 0.0:
        return c.twist is None
    return np.shape(c.twist) == (6,) and open_exactly(c.twist, x, n, lower)


def balance(f, x, n, mu, m=None, mu_t=None):
    """Forces, and torques about normals, are inside their cones, balance, and push by one."""
    m, mu_t = (np.zeros(len(x)) if each is None else each for each in (m, mu_t))
    if np.shape(f) != np.shape(x) or np.shape(m) != np.shape(mu) or not np.isfinite(f).all():
        return False
    arms, size = unit_arms(x)
    along = np.einsum("ki,ki->k", f, n)
    across = np.linalg.norm(f - along[:, None] * n, axis=1)
    slides = np.where(mu > 0.0, across / np.where(mu > 0.0, mu, 1.0), 0.0)
    turns = np.where(mu_t > 0.0, np.abs(m) / np.where(mu_t > 0.0, mu_t, 1.0), 0.0)
    loose = max(across[mu == 0.0].max(initial=0.0), np.abs(m[mu_t == 0.0]).max(initial=0.0) / size)
    torque = np.cross(arms, f).sum(axis=0) + (m / size) @ n
    off = max(np.abs(f.sum(axis=0)).max(), np.abs(torque).max(), abs(along.sum() - 1.0), loose)
    return bool((np.hypot(slides, turns) < along).all()) and off <= UNIT * (1 + (mu_t / size).max())


def separates(y, x, n, mu, mu_t=0.0):
    """The supports of the cones along a twist are not positive.

    To within rounding of 1e-12 at unit size, and of where the frame's origin is.
    """
    if np.shape(y) != (6,) or not np.isfinite(y).all():
        return False
    y, x = np.asarray(y, dtype=np.longdouble), np.asarray(x, dtype=np.longdouble)
    center, (_, size) = x.mean(axis=0), unit_arms(np.asarray(x, dtype=float))
    v = y[:3] + np.cross(y[3:], x)
    along = np.einsum("ki,ki->k", v, n)
    across = np.linalg.norm((v - along[:, None] * n).astype(float), axis=1)
    length = float(np.hypot(np.linalg.norm((y[:3] + np.cross(y[3:], center)).astype(float)),
                            np.linalg.norm(y[3:].astype(float)) * size))  # fmt: skip
    far = 1.0 + np.linalg.norm(center.astype(float)) / size
    swung = np.hypot(mu * across, mu_t * (n @ y[3:]).astype(float))
    excess = (along.astype(float) + swung) / np.sqrt(1.0 + mu**2 + (mu_t / size) ** 2)
    return length > 0.0 and bool((excess <= 1e-11 * far * length).all())


def closed(x, n, mu):
    """Force closure by the margin; None where it is too close to zero to tell."""
    optimum = margin_of(x, n, mu)
    if math.isnan(optimum):
        return None
    full = np.linalg.matrix_rank(locals_of(unit_arms(x)[0], n, mu), 1e-9) == 6
    slack = 1e-8 * max(mu.max(), 1e-3)
    return None if full and abs(optimum) <= slack else bool(full and optimum > slack)
