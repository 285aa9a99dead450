"""False qualities and false multiples of loads.

No quality exceeds the support in any direction, which is a closed form, and the hull of some edges
of the cones holds no more than the set does.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

import grasp_core.quality.measures as resisted
from grasp_core.closure import wrench_sets
from grasp_core.closure.wrench_sets import WrenchSet, into_cones
from grasp_core.quality import ferrari_canny
from grasp_core.quality.ferrari_canny import (
    COUNTING_RAYS,
    FerrariCanny,
    InnerPolytope,
    wrench_set_quality,
)
from grasp_core.quality.measures import Measure, resisted_loads, task_limits
from tests.attacks.searching import Attack, always, power
from tests.judges import random_contacts
from tests.tampering.exact_closure import conic
from tests.tampering.wrench_bounds import demand, scaled, support


@cache
def closed_set(seed):
    """Contacts whose edges' hull holds zero: their set, and what its quality is at least."""
    while True:
        rng = np.random.default_rng(seed)
        x, n = random_contacts(rng, int(rng.integers(4, 7)), 0.7)
        found = WrenchSet.of(x, n, rng.choice([0.3, 0.5, 1.0]), center=x.mean(axis=0),
                             torque_scale=float(np.ptp(x, axis=0).max()))  # fmt: skip
        least = hull_radius(found)
        if least > 1e-3:
            return found, least
        seed += 1000


def hull_radius(w, ways=8):
    """The radius of the ball in the hull of edges of cones, by qhull."""
    turns = 2.0 * np.pi * np.arange(ways) / ways
    edges = [
        w.G[:, 3 * i] + mu * (np.cos(turn) * w.G[:, 3 * i + 1] + np.sin(turn) * w.G[:, 3 * i + 2])
        for i, mu in enumerate(w.friction) for turn in turns
    ]  # fmt: skip
    return float(-ConvexHull(np.array(edges), qhull_options="QJ").equations[:, -1].max())


@cache
def most_quality(seed):
    """A quality that the set does not exceed: its support in some direction."""
    w, _ = closed_set(seed)
    h = lambda y: support(w.G, w.friction, "l1", y / np.linalg.norm(y))  # noqa: E731
    starts = np.random.default_rng(seed).normal(size=(3, 6))
    return min(float(minimize(h, y, method="Nelder-Mead").fun) for y in starts)


@cache
def genuine(seed):
    return wrench_set_quality(closed_set(seed)[0], 1e-3)


@cache
def balance(seed):
    """Local forces, pushes of sum one, that balance as deep in their cones as any."""
    w, _ = closed_set(seed)
    return scaled(w.friction) @ optimum(w, np.zeros(6), 1.0)[:-1]


def optimum(w, load, depth):
    """Forces with pushes of sum one, and the largest t for which t times the load is balanced.

    Or for which they are t times the depth inside their cones, (3k + 1,).
    """
    k = len(w.friction)
    A, b = np.zeros((7 + 3 * k, 3 * k + 1)), np.zeros(7 + 3 * k)
    A[:6, :-1], A[:6, -1], A[6, :-1:3], b[6] = w.G @ scaled(w.friction), load, 1.0, 1.0
    A[7:, :-1], A[7::3, -1] = -np.eye(3 * k), depth
    return conic(np.append(np.zeros(3 * k), -1.0), A, b, 7, 0, k).x


@cache
def along_ray(seed, place):
    """Forces whose wrench is far out along a ray on which simplices are counted, and the ray."""
    w, _ = closed_set(seed)
    u = COUNTING_RAYS[place] / np.linalg.norm(COUNTING_RAYS[place])
    (limit,) = task_limits(w, Measure("task", -u[None]))
    f = into_cones(0.95 * into_cones(limit.forces, w.friction) + 0.05 * balance(seed), w.friction)
    p = w.G @ f
    return f - np.linalg.pinv(w.G) @ (p - u * (p @ u)), u


def slivers(w, f, eps, rng, count):
    """Forces next to some, whose wrenches are corners of a thin simplex with theirs on a face."""
    d = rng.normal(size=(count, len(w.friction), 3))
    d[..., 0] -= d[..., 0].mean(axis=1, keepdims=True)
    face = rng.permutation(count)[: rng.integers(1, count + 1)]
    d[face[-1]] = -d[face[:-1]].sum(axis=0)  # theirs is the mean of these corners
    near = f + eps * d.reshape(count, -1)
    return near / near[:, ::3].sum(axis=1, keepdims=True)


def claimed(w, seed, polytope, rng):
    """A quality above the truth, as far as the polytope's simplices are away."""
    most = most_quality(seed)
    radius = float(polytope._heights(polytope.forces @ w.G.T)[0].min())
    if not radius > most * (1.0 + 1e-6):
        return None
    lower = rng.uniform(most * (1.0 + 1e-6), radius)
    u = polytope.normals[0]
    return lambda: FerrariCanny(lower, max(lower, w.support(u)[0]), w, u, polytope, None)


def any_ray(rng):
    """The first of the rays, on which the answer mostly rests, or another."""
    return 0 if rng.uniform() < 0.6 else int(rng.integers(len(COUNTING_RAYS)))


def seen_from(points, u):
    """The least share with which a ray meets a simplex, as solving says, by the corners' order."""

    def least(order):
        try:
            return np.linalg.solve(points[order].T, u).min()
        except np.linalg.LinAlgError:
            return 0.0

    return least


def doubled_slivers(rng):
    """One thin simplex an even number of times, in orders of corners that seem to differ."""
    seed, place = int(rng.integers(8)), any_ray(rng)
    f, u = along_ray(seed, place)
    w, _ = closed_set(seed)
    forces = slivers(w, f, power(rng, -12, -6), rng, 6)
    copies = int(rng.choice([2, 2, 4]))
    orders = sorted((rng.permutation(6) for _ in range(12)), key=seen_from(forces @ w.G.T, u))
    corners = np.array(orders[: copies // 2] + orders[-copies // 2 :])
    return claimed(w, seed, InnerPolytope(forces, corners, np.tile(u, (copies, 1))), rng)


def thin_borders(rng):
    """The whole border of a thin simplex of seven corners, off zero."""
    seed, place = int(rng.integers(8)), any_ray(rng)
    f, u = along_ray(seed, place)
    w, _ = closed_set(seed)
    forces = slivers(w, f, power(rng, -12, -6), rng, 7)
    corners = np.array([rng.permutation(np.delete(np.arange(7), j)) for j in range(7)])
    return claimed(w, seed, InnerPolytope(forces, corners, np.tile(u, (7, 1))), rng)


def far_only(rng):
    """The simplices of a true polytope that are far enough, an even number of times each."""
    seed = int(rng.integers(8))
    q, (w, _) = genuine(seed), closed_set(seed)
    P, most = q.polytope, most_quality(seed)
    heights = np.einsum("mj,mcj->mc", P.normals, (P.forces @ w.G.T)[P.corners]).min(axis=1)
    far = np.flatnonzero(heights > most * (1.0 + power(rng, -5, 0)))
    if not len(far):
        return None
    corners = np.vstack([P.corners[far], rng.permuted(P.corners[far], axis=1)])
    return claimed(w, seed, replace(P, corners=corners, normals=P.normals[np.tile(far, 2)]), rng)


def upper_too_low(rng):
    """An upper bound below what the hull of edges shows, in directions of all kinds."""
    seed = int(rng.integers(8))
    w, least = closed_set(seed)
    upper = least * (1.0 - power(rng, -4, 0))
    y = genuine(seed).direction + power(rng, -9, 0) * rng.normal(size=6)
    y /= np.linalg.norm(y) * (1.0 + power(rng, -16, -11))
    return lambda: FerrariCanny(-1.0, upper, w, y, None, np.tile([1.0, 0, 0], len(w.friction)) / len(w.friction))  # fmt: skip  # noqa: E501


def far_levers(rng):
    """Add one contact to a set, so far away that a slack relative to it covers all others."""
    seed = int(rng.integers(8))
    w, least = closed_set(seed)
    lever = power(rng, 3, 13)
    k = len(w.friction) + 1
    x = np.array([lever, 0.0, 0.0])
    far = WrenchSet.at(x[None], np.array([[1.0, 0.0, 0.0]]), w.friction[:1])
    more = WrenchSet(np.hstack([w.G, far.G]), np.append(w.friction, w.friction[0]), "l1")
    y = genuine(seed).direction.copy()
    y[4:] = 0.0  # next to no power at the far contact
    y[1:3] *= rng.choice([0.0, 1.0])
    y = y / (np.linalg.norm(y) or 1.0)
    reach = more.support(y)[0]
    upper = min(least, reach) * (1.0 - power(rng, -2, 0))
    forces = np.tile([1.0, 0, 0], k) / k
    lower = -float(np.linalg.norm(more.G @ forces))
    return lambda: FerrariCanny(min(lower, upper), upper, more, y, None, forces)


def crossed_by_sign(monkeypatch):
    """Simplices are crossed where computed shares are positive, however rounded they are."""

    def crossed(polytope, points, _lowest, _highest, ray):
        cells = points[polytope.corners].transpose(0, 2, 1)
        cells = cells[np.abs(np.linalg.det(cells)) > 0.0]
        shares = np.linalg.solve(cells, np.tile(ray[:, None], (len(cells), 1, 1)))
        return int((shares > 0.0).all(axis=(1, 2)).sum())

    monkeypatch.setattr(InnerPolytope, "_crossed", crossed)


def far_slack(monkeypatch):
    """Slacks grow with levers, and levers may be of any length."""
    monkeypatch.setattr(ferrari_canny, "MOST_SLACK", np.inf)
    monkeypatch.setattr(wrench_sets, "LONGEST_LEVER", np.inf)


@cache
def multiples(seed):
    """Loads, and the largest multiple of all of them that the contacts resist, by programs."""
    w, _ = closed_set(seed)
    loads = np.random.default_rng(seed).normal(size=(3, 6))
    return resisted_loads(w, Measure("task", loads), 0.1), min(
        optimum(w, v, 0.0)[-1] for v in loads
    )


def more_resisted(rng):
    """A larger multiple, its forces grown or moved, or a ball that takes rests away."""
    seed = int(rng.integers(8))
    r, most = multiples(seed)
    lower = most * (1.0 + power(rng, -5, 2))
    grown = lower / r.lower
    forces = r.forces * rng.choice([1.0, grown]) + power(rng, -13, -1) * rng.normal(
        size=r.forces.shape
    )
    ball = replace(r.ball, lower=r.ball.lower * power(rng, 0, 9))
    ball = replace(ball, upper=max(ball.upper, ball.lower))
    ball = ball if rng.uniform() < 0.5 else r.ball
    return lambda: replace(r, lower=lower, upper=max(r.upper, lower), forces=forces, ball=ball)


def less_resisted(rng):
    """A smaller bound, by twists that ask for little."""
    seed = int(rng.integers(8))
    r, most = multiples(seed)
    upper = most * (1.0 - power(rng, -5, 0))
    y = r.direction + power(rng, -12, 0) * rng.normal(size=6)
    if rng.uniform() < 0.5:  # next to no power against the loads
        y -= np.linalg.pinv(r.measure.loads) @ (r.measure.loads @ y) * (1.0 - power(rng, -17, 0))
    y /= np.linalg.norm(y)
    if demand(r.measure, y) == 0.0:
        return None
    return lambda: replace(r, lower=-1.0, upper=upper, direction=y, ball=None, forces=None)


QUALITY = Attack(
    (doubled_slivers, thin_borders, far_only, upper_too_low, far_levers),
    (crossed_by_sign, far_slack), 5000,
)  # fmt: skip
LOADS = Attack(
    (more_resisted, less_resisted),
    (lambda monkeypatch: monkeypatch.setattr(resisted, "are_allowed", always(True)),),
)
