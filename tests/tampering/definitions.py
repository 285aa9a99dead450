"""What certificates claim, by its definition: exact cones by Clarabel, and plain geometry.

Nothing of the package is asked. Slacks are those that the certificates state, doubled.
"""

import math

import clarabel
import numpy as np
from scipy import sparse
from scipy.optimize import linprog, minimize
from scipy.spatial import ConvexHull

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
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    kinds = [clarabel.ZeroConeT(equalities), clarabel.NonnegativeConeT(nonnegative)]
    kinds += [clarabel.SecondOrderConeT(3)] * cones
    n = len(q)
    return clarabel.DefaultSolver(
        sparse.csc_matrix((n, n)), np.array(q, dtype=float), sparse.csc_matrix(A), np.array(b), kinds,
        settings,
    ).solve()  # fmt: skip


def locals_of(x, n, mu):
    """Wrenches of (push, tangent / mu, tangent / mu) of each contact, (6, 3k), zeros at mu = 0."""
    columns = []
    for arm, normal, friction in zip(x, n, mu, strict=True):
        frame = np.column_stack([normal, friction * tangents(normal)])
        columns.append(np.vstack([frame, np.cross(arm, frame.T).T]))
    return np.hstack(columns)


def margin_of(x, n, mu):
    """Optimum of the margin program: t / (mu or 1) + |tangent / mu| <= push; -inf if none."""
    k = len(x)
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    W = locals_of(unit_arms(x)[0], n, mu)
    scale = max(float(mu.max()), 1e-9) if mu.any() else 1.0
    A = np.zeros((7 + 3 * k, 3 * k + 1))
    A[:6, :-1], A[6, 0:-1:3] = W, 1.0
    A[7:, :-1] = -np.eye(3 * k)
    A[7::3, -1] = scale / np.where(mu == 0.0, 1.0, np.maximum(mu, 1e-300))
    b = np.zeros(len(A))
    b[6] = 1.0
    found = conic(np.append(np.zeros(3 * k), -1.0), A, b, 7, 0, k)
    name = str(found.status)
    if "PrimalInfeasible" in name:
        return -math.inf
    if "Solved" not in name:
        return math.nan
    return scale * found.x[-1]


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


def polygon_in_plane(p, n, scale):
    """Corners (k, 2) of a convex polygon, counter-clockwise about n; None if it is none."""
    if np.ndim(p) != 2 or len(p) < 3 or not np.isfinite(p).all():
        return None
    if np.abs((p - p[0]) @ n).max() > 4e-9 * scale:
        return None
    u = tangents(n)
    u = u if np.linalg.det(np.column_stack([u, n])) > 0.0 else u[:, ::-1]
    return convex((p - p[0]) @ u / scale)


def convex(q):
    q = q[np.linalg.norm(q - np.roll(q, 1, axis=0), axis=1) > 1e-9]
    if len(q) < 3:
        return None
    hull = ConvexHull(q)
    edges = np.roll(q, -1, axis=0) - q
    turns = (
        edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1]
        - edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]
    )
    x, y = q.T
    area = 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))
    good = (turns > -1e-8).all() and abs(area - hull.volume) <= 1e-8
    return q if good else None


def inradius(q):
    hull = ConvexHull(q)
    rows = np.column_stack([hull.equations[:, :2], np.ones(len(hull.equations))])
    best = linprog([0, 0, -1], A_ub=rows, b_ub=-hull.equations[:, 2], bounds=[(None, None)] * 3)
    return -best.fun


def inside(points, q, slack):
    hull = ConvexHull(q)
    return (points @ hull.equations[:, :2].T + hull.equations[:, 2] <= slack).all(axis=1)


def piece(p):
    """A face piece: its rows, corners, frame and width describe one polygon."""
    if np.shape(p.normal) != (3,) or abs(np.linalg.norm(p.normal) - 1.0) > UNIT:
        return False
    axes = np.column_stack([p.frame, p.normal])
    if axes.shape != (3, 3) or np.abs(axes.T @ axes - np.eye(3)).max() > 1e-8:
        return False
    q = convex(np.asarray(p.corners))
    if q is None or np.shape(p.E) != (len(p.b), 2) or np.shape(p.origin) != (3,):
        return False
    if (np.abs(np.linalg.norm(p.E, axis=1) - 1.0) > UNIT).any() or np.linalg.det(axes) < 0.0:
        return False
    if not (q @ p.E.T <= p.b + 4e-9).all():
        return False
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(20, 2))
    for way in ways:  # the widest of {E y <= b} is a corner's
        best = linprog(-way, A_ub=p.E, b_ub=p.b, bounds=[(None, None)] * 2)
        if best.status != 0 or -best.fun > (q @ way).max() + 1e-7 * np.linalg.norm(way):
            return False
    return abs(inradius(q) - p.inradius) <= 2e-6 * p.inradius + 2e-9


def drawn(corners, rng):
    return rng.dirichlet(np.full(len(corners), rng.choice([0.05, 1.0]))) @ corners


def absence(a, rng):
    """Contacts anywhere on the pieces are open."""
    if len(a.pieces) != 4 or not all(map(piece, a.pieces)) or not 0.0 <= a.friction < math.inf:
        return False
    if not all(closure(proof) for _, proof in a.leaves):
        return False
    n = np.array([p.normal for p in a.pieces])
    for _ in range(6):
        x = np.array([p.origin + p.frame @ drawn(p.corners, rng) for p in a.pieces])
        if closed(x, n, np.full(4, a.friction)):
            return False
    return True


def regions(r, rng):
    """All choices are closed, and what is told of polygons, discs and the open choice is so."""
    if not (r.scale > 0.0 and (r.depths >= 0.0).all() and np.isfinite(r.radius)):
        return False
    for i, region in enumerate(r.regions):
        n, start = r.normals[i], r.borders[i][0]
        if region.kind != "certified" or abs(np.linalg.norm(n) - 1.0) > UNIT:
            return False
        border = polygon_in_plane(r.borders[i], n, r.scale)
        polygon = polygon_in_plane(region.polygon, n, r.scale)
        flat = np.vstack([region.polygon, r.centers[i][None]]) - start
        if border is None or polygon is None or np.abs(flat @ n).max() > 4e-9 * r.scale:
            return False
        if abs(inradius(polygon) - region.inscribed_radius / r.scale) > 1e-7 + 2e-6 * inradius(
            polygon
        ):
            return False
        if not _disc_is_held(r, i):
            return False
    if max(
        np.linalg.norm(b - c, axis=1).max() for b, c in zip(r.borders, r.centers, strict=True)
    ) < (r.radius * (1.0 - 1e-8)):
        return False
    return _open_choice(r) and all_closed(
        [region.polygon for region in r.regions], r.normals, r.friction, rng, r.depths
    )


def _disc_is_held(r, i):
    """By points of what the border has of the disc: few are not in the polygon."""
    n, c = r.normals[i], r.centers[i]
    u = tangents(n)
    to = lambda p: (p - c) @ u / r.scale  # noqa: E731
    polygon, border = to(r.regions[i].polygon), to(r.borders[i])
    if not inside(np.zeros((1, 2)), polygon, 4e-9).all() or not inside(polygon, border, 4e-9).all():
        return False
    steps = np.linspace(-1.0, 1.0, 120)
    reach = min(r.radius / r.scale, float(np.linalg.norm(border, axis=1).max()))
    grid = reach * np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    grid = grid[np.linalg.norm(grid, axis=1) <= r.radius / r.scale]
    cell = (2.0 * reach / 119) ** 2
    lacking = (inside(grid, border, 0.0) & ~inside(grid, polygon, 1e-9)).sum() * cell
    return lacking <= 2e-3 * ConvexHull(polygon).volume * 1.05 + 40 * cell


def _open_choice(r):
    if r.open_choice is None:
        return r.open_wrench is None and r.limit == math.inf
    for p, border, n in zip(r.open_choice, r.borders, r.normals, strict=True):
        u = tangents(n)
        flat = inside(
            ((p - border[0]) @ u / r.scale)[None], (border - border[0]) @ u / r.scale, 4e-9
        )
        if abs((p - border[0]) @ n) > 4e-9 * r.scale or not flat.all():
            return False
    away = np.linalg.norm(r.open_choice - r.centers, axis=1).max()
    good = separates(r.open_wrench, r.open_choice, r.normals, r.friction)
    return good and abs(away - r.limit) <= 4e-9 * r.scale


def all_closed(polygons, n, mu, rng, depths=None, tries=8):
    n = np.asarray(n)
    if not (
        (np.abs(np.linalg.norm(n, axis=1) - 1.0) <= UNIT).all() and (np.asarray(mu) >= 0.0).all()
    ):
        return False
    for _ in range(tries):
        x = np.array([drawn(polygon, rng) for polygon in polygons])
        if depths is not None:
            x = x + (rng.uniform(-1, 1, 4) * depths)[:, None] * n
        if closed(x, n, np.asarray(mu)) is False:
            return False
    return True


def support(G, mu, norm, y):
    slopes = (y @ G).reshape(-1, 3)
    each = slopes[:, 0] + mu * np.linalg.norm(slopes[:, 1:], axis=1)
    return each.max() if norm == "l1" else np.maximum(each, 0.0).sum()


def quality(q, rng):
    """Bounds of the least support over unit directions, sought by descent from many starts."""
    w = q.wrenches
    k = len(w.friction)
    if w.G.shape != (6, 3 * k) or (w.friction < 0.0).any() or w.norm not in ("l1", "linf"):
        return False
    for i in range(k):
        R, T = w.G[:3, 3 * i : 3 * i + 3], w.G[3:, 3 * i : 3 * i + 3]
        S = T @ R.T
        if np.abs(R.T @ R - np.eye(3)).max() > 1e-8 or np.abs(S + S.T).max() > 1e-8 * (
            1 + abs(S).max()
        ):
            return False
    size = np.linalg.norm(w.G, axis=0).max() * np.sqrt(1.0 + w.friction.max() ** 2)
    h = lambda y: support(w.G, w.friction, w.norm, y / np.linalg.norm(y))  # noqa: E731
    if abs(np.linalg.norm(q.direction) - 1.0) > 1e-9 or h(q.direction) > q.upper + 1e-11 * size:
        return False
    if not q.lower <= q.upper or (q.polytope is None) == (q.forces is None):
        return False
    starts = [q.direction, *rng.normal(size=(4, 6))]
    least = min(min(minimize(h, y, method="Nelder-Mead").fun, h(y)) for y in starts)
    return q.lower <= least + 1e-9 * size and _allowed(q)


def _allowed(q):
    forces = q.forces[None] if q.polytope is None else q.polytope.forces
    if (
        q.polytope is not None
        and (abs(np.linalg.norm(q.polytope.normals, axis=1) - 1.0) > UNIT).any()
    ):
        return False
    each = forces.reshape(len(forces), -1, 3)
    across = np.linalg.norm(each[:, :, 1:], axis=2)
    pushes = each[:, :, 0]
    summed = abs(pushes.sum(axis=1) - 1.0) if q.wrenches.norm == "l1" else pushes.max(axis=1) - 1.0
    return (across <= q.wrenches.friction * pushes + 1e-11).all() and (summed <= 1e-11).all()


def hull_quality(x, n, mu):
    """A lower bound: the hull of sixteen edges of each cone."""
    turns = 2.0 * np.pi * np.arange(16) / 16
    rows = []
    for p, normal in zip(x, n, strict=True):
        u = tangents(normal)
        f = normal + mu * (np.cos(turns)[:, None] * u[:, 0] + np.sin(turns)[:, None] * u[:, 1])
        rows.append(np.hstack([f, np.cross(p, f)]))
    W = np.vstack(rows)
    if np.linalg.matrix_rank(W - W[0], 1e-9) < 6:
        return -math.inf
    return float(-ConvexHull(W, qhull_options="QJ").equations[:, -1].max())


def ceiling(c, rng):
    """No contacts on the pieces have a larger quality, of those that are drawn."""
    pieces = {id(p): p for choice in c.choices for p in choice}.values()
    if not all(map(piece, pieces)) or not 0.0 <= c.friction < math.inf or not np.isfinite(c.upper):
        return False
    for leaf in c.leaves:
        if abs(np.linalg.norm(leaf.direction) - 1.0) > UNIT or not 0 <= leaf.choice < len(
            c.choices
        ):
            return False
    for choice in c.choices:
        n = np.array([p.normal for p in choice])
        for _ in range(4):
            x = np.array([p.origin + p.frame @ drawn(p.corners, rng) for p in choice])
            if hull_quality(x, n, c.friction) > c.upper + 2e-9 * max(c.upper, 1.0):
                return False
    return True


def wrench_limit(found, x, n, mu, largest, center):
    """The largest multiple, solved again, is between the limit and the upper bound."""
    mu = np.full(len(x), mu) if np.ndim(mu) == 0 else np.asarray(mu)
    if not contacts_make_sense(np.asarray(x), np.asarray(n), mu):
        return False
    middle = x.mean(axis=0)
    arms, size = unit_arms(x)
    load = np.append(
        found.wrench[:3], (found.wrench[3:] - np.cross(middle - center, found.wrench[:3])) / size
    )
    k, length = len(x), np.linalg.norm(load)
    A = np.zeros((6 + 4 * k, 3 * k + 1))
    A[:6, :-1], A[:6, -1] = locals_of(arms, n, mu), load / length
    A[6 + np.arange(k), 3 * np.arange(k)] = 1.0
    A[6 + k :, :-1] = -np.eye(3 * k)
    solved = conic(
        np.append(np.zeros(3 * k), -1.0),
        A,
        np.r_[np.zeros(6), np.ones(k), np.zeros(3 * k)],
        6,
        k,
        k,
    )
    best = largest * solved.x[-1] / length
    slack = 1e-6 * (best + largest / length)
    f = found.forces / largest
    along = np.einsum("ki,ki->k", f, n)
    across = np.linalg.norm(f - along[:, None] * n, axis=1)
    left = np.append(f.sum(axis=0), np.cross(arms, f).sum(axis=0)) + found.limit / largest * load
    weight = np.sqrt(1.0 + mu.max() ** 2)
    return bool(
        found.limit <= best + slack and found.upper >= best - slack and found.limit <= found.upper
        and (across <= mu * along + 1e-6 * weight).all() and along.max() <= 1.0 + 1e-6 * weight
        and np.linalg.norm(left) <= 1e-6 * weight and abs(found.facet @ found.wrench + 1.0) <= 1e-6
    )  # fmt: skip
