"""What is claimed of qualities and limits: by descent, hulls, and programs solved again."""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from tests.tampering.exact_closure import (
    UNIT,
    conic,
    contacts_make_sense,
    soft_locals,
    tangents,
    torsions_make_sense,
    unit_arms,
)

SINGLE = 1e-6
"""How far normals that are given may be from unit length."""


def support(G, mu, norm, y):
    slopes = (y @ G).reshape(len(mu), -1)
    each = slopes[:, 0] + mu * np.linalg.norm(slopes[:, 1:], axis=1)
    return each.max() if norm == "l1" else np.maximum(each, 0.0).sum()


def quality(q, rng):
    """Bounds of the least support over unit directions, sought by descent from many starts."""
    w = q.wrenches
    if not are_contacts(w):
        return False
    size = longest(w)
    h = lambda y: support(w.G, w.friction, w.norm, y / np.linalg.norm(y))  # noqa: E731
    if abs(np.linalg.norm(q.direction) - 1.0) > 1e-9 or h(q.direction) > q.upper + 1e-11 * size:
        return False
    if not q.lower <= q.upper or (q.polytope is None) == (q.forces is None):
        return False
    starts = [q.direction, *rng.normal(size=(4, 6))]
    least = min(min(minimize(h, y, method="Nelder-Mead").fun, h(y)) for y in starts)
    return q.lower <= least + 1e-9 * size and _allowed(q)


def longest(w):
    return np.linalg.norm(w.G, axis=0).max() * np.sqrt(1.0 + w.friction.max() ** 2)


def demand(measure, y):
    """How much of the loads of a measure a twist asks for."""
    if measure.name == "weight":
        return np.linalg.norm(y[:3])
    if measure.name == "task":
        return max(0.0, *(-load @ y for load in measure.loads))
    return np.linalg.norm(y)


def resisted(q, rng):
    """Bounds of the least support over demand, sought by descent from many starts."""
    w = q.wrenches
    if not (are_contacts(w) and w.norm == "l1" and q.measure.name in ("weight", "task")):
        return False
    h = lambda y: support(w.G, w.friction, "l1", y / np.linalg.norm(y))  # noqa: E731
    d = lambda y: demand(q.measure, y / np.linalg.norm(y))  # noqa: E731
    slack = 1e-11 * longest(w)
    if abs(np.linalg.norm(q.direction) - 1.0) > 1e-9 or not q.lower <= q.upper:
        return False
    if h(q.direction) > q.upper * d(q.direction) + slack:
        return False
    if q.lower < 0.0:  # claims nothing
        return True

    def allowed(y):
        return h(y) / d(y) if d(y) > 1e-9 else 1e6 if h(y) >= -1e-7 else -1.0

    starts = [q.direction, *rng.normal(size=(2, 6)), *-q.measure.loads[:1]]
    least = min(min(minimize(allowed, y, method="Nelder-Mead").fun, allowed(y)) for y in starts)
    return q.lower <= least + slack * (1.0 + abs(least))


def are_contacts(w):
    """Whether a wrench set is that of some contacts."""
    k = len(w.friction)
    known = w.G.shape in ((6, 3 * k), (6, 4 * k)) and w.norm in ("l1", "linf")
    if not known or (w.friction < 0.0).any():
        return False
    for G in w.G.reshape(6, k, -1).transpose(1, 0, 2):
        R, T, torques = G[:3, :3], G[3:, :3], G[:, 3:]
        turned = torques[3:] - R[:, :1] * (R[:, 0] @ torques[3:])  # none but about the normal
        straight = np.abs(turned).max(initial=0.0) <= 1e-8 * (1 + np.abs(torques).max(initial=0.0))
        if torques[:3].any() or not straight or (R[:, 0] @ torques[3:] < 0.0).any():
            return False
        S = T @ R.T
        skew = np.abs(S + S.T).max() <= 1e-8 * (1 + abs(S).max())
        if not skew or np.abs(R.T @ R - np.eye(3)).max() > 1e-8:
            return False
    return True


def _allowed(q):
    forces = q.forces[None] if q.polytope is None else q.polytope.forces
    if (
        q.polytope is not None
        and (abs(np.linalg.norm(q.polytope.normals, axis=1) - 1.0) > UNIT).any()
    ):
        return False
    each = forces.reshape(len(forces), len(q.wrenches.friction), -1)
    across = np.linalg.norm(each[:, :, 1:], axis=2)
    pushes = each[:, :, 0]
    summed = abs(pushes.sum(axis=1) - 1.0) if q.wrenches.norm == "l1" else pushes.max(axis=1) - 1.0
    return (across <= q.wrenches.friction * pushes + 1e-11).all() and (summed <= 1e-11).all()


def as_given(normals):
    """Normals that are beside a certificate: those of single precision are divided by lengths."""
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    return normals / np.where(np.abs(lengths - 1.0) <= SINGLE, lengths, 1.0)


def wrench_limit(c):
    """The largest multiple, solved again, is between the limit and the upper bound."""
    c = replace(c, normals=as_given(c.normals))
    found, x, n, largest = c.found, c.positions, c.normals, c.max_normal_force
    mu = np.full(len(x), c.friction) if np.ndim(c.friction) == 0 else np.asarray(c.friction)
    mu_t = np.zeros(len(x)) if np.ndim(c.torsion_m) == 0 else np.asarray(c.torsion_m)
    if not contacts_make_sense(np.asarray(x), np.asarray(n), mu):
        return False
    if np.ndim(c.torsion_m) and not torsions_make_sense(mu, mu_t):
        return False
    k, (arms, size) = len(x), unit_arms(x)
    load, (torques, room), best = multiple_of(c, mu, mu_t)
    length = np.linalg.norm(load)
    f, m = found.forces / largest, np.zeros(k)
    if mu_t.any():
        m = found.torques / largest
    along = np.einsum("ki,ki->k", f, n)
    across = np.linalg.norm(f - along[:, None] * n, axis=1)
    levers = np.where(mu_t > 0.0, mu / np.where(mu_t > 0.0, mu_t, 1.0), 0.0)
    left = np.append(f.sum(axis=0), np.cross(arms, f).sum(axis=0) + (m / size) @ n)
    left += found.limit / largest * load
    turned = (mu_t / size / np.maximum(mu, 1e-3)).max()
    weight = np.sqrt(1.0 + mu.max() ** 2) * (1.0 + turned)
    slack = 1e-6 * (weight if mu_t.any() else 1.0) * (best + largest / length)
    strong = np.abs(torques).max(initial=1.0)
    scale_error = abs(found.facet @ found.wrench + 1.0)  # of a size that says nothing of the limit
    return bool(
        found.limit <= best + slack and found.upper >= best - slack and found.limit <= found.upper
        and (m[mu_t == 0.0] == 0.0).all()
        and (np.hypot(across, levers * m) <= mu * along + 1e-6 * weight).all()
        and along.max() <= 1.0 + 1e-6 * weight
        and (torques @ local_of(f, n) <= room + 1e-6 * weight * strong).all()
        and np.linalg.norm(left) <= 1e-6 * weight and scale_error <= 2e-6
    )  # fmt: skip


def multiple_of(c, mu, mu_t):
    """The load of a limit at unit size, rows of motors, and the multiple that is resisted."""
    x, n, w, most = c.positions, c.normals, c.found.wrench, c.max_normal_force
    moved = w[3:] - np.cross(x.mean(axis=0) - c.center, w[:3])
    load, rows = np.append(w[:3], moved / unit_arms(x)[1]), torques_of(c.motors, n, most)
    return load, rows, largest_multiple(x, n, mu, mu_t, load, rows, most)


def largest_multiple(x, n, mu, mu_t, load, motors, largest):
    """How much of a load at unit size, (6,), contacts resist within rows of torques and room."""
    k, length, (torques, room) = len(x), np.linalg.norm(load), motors
    hard = np.arange(4 * k) % 4 < 3
    A = np.zeros((6 + k + len(room) + 4 * k, 4 * k + 1))
    A[:6, :-1], A[:6, -1] = soft_locals(x, n, mu, mu_t), load / length
    A[6 + np.arange(k), 4 * np.arange(k)] = 1.0
    A[6 + k : -4 * k, np.flatnonzero(hard)] = torques @ scaled(mu)
    A[-4 * k :, :-1] = -np.eye(4 * k)
    b = np.r_[np.zeros(6), np.ones(k), room, np.zeros(4 * k)]
    solved = conic(np.append(np.zeros(4 * k), -1.0), A, b, 6, k + len(room), k)
    return largest * solved.x[-1] / length


def torques_of(motors, n, largest):
    """Rows of both directions of every joint for local unit forces, over limits, and their room."""
    if motors is None or not len(motors.limits):
        return np.zeros((0, 3 * len(n))), np.zeros(0)
    frames = np.array([np.column_stack([normal, tangents(normal)]) for normal in n])
    levers = np.einsum("jki,kil->jkl", motors.levers.reshape(-1, len(n), 3), frames)
    share = largest * levers.reshape(len(levers), -1) / motors.limits[:, None]
    carried = motors.gravity / motors.limits
    return np.vstack([share, -share]), np.append(1.0 - carried, 1.0 + carried)


def scaled(mu):
    """From the coordinates of `locals_of` to local forces, (3k, 3k)."""
    return np.diag(np.ravel([[1.0, m, m] for m in mu]))


def local_of(f, n):
    """Forces in the contacts' frames, (3k,)."""
    frames = np.array([np.column_stack([normal, tangents(normal)]) for normal in n])
    return np.einsum("kil,ki->kl", frames, f).ravel()
