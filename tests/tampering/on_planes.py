"""What is claimed of faces and regions: shapes by hulls and linear programs, choices by drawing."""

import math

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from tests.tampering.exact_closure import UNIT, closed, closure, separates, tangents


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
    shapes = np.shape(p.normal), np.shape(p.frame), np.shape(p.origin), np.shape(p.E)
    if shapes != ((3,), (3, 2), (3,), (len(p.b), 2)):
        return False
    axes = np.column_stack([p.frame, p.normal])
    square = np.abs(axes.T @ axes - np.eye(3)).max() <= 1e-8  # left-handed on mirrored objects
    units = (np.abs(np.linalg.norm(p.E, axis=1) - 1.0) <= UNIT).all()
    q = convex(np.asarray(p.corners))
    if q is None or not (square and units and (q @ p.E.T <= p.b + 4e-9).all()):
        return False
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(6, 2))
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
    if not all(_is_placed(r, i) and _disc_is_held(r, i) for i in range(4)):
        return False
    pairs = zip(r.borders, r.centers, strict=True)
    farthest = max(np.linalg.norm(border - center, axis=1).max() for border, center in pairs)
    polygons = [region.polygon for region in r.regions]
    return (
        farthest >= r.radius * (1.0 - 1e-8)
        and _open_choice(r)
        and all_closed(polygons, r.normals, r.friction, rng, r.depths)
    )


def _is_placed(r, i):
    """Whether a region is a polygon in its plane, as wide as it says."""
    region, n = r.regions[i], r.normals[i]
    if region.kind != "certified" or abs(np.linalg.norm(n) - 1.0) > UNIT:
        return False
    border = polygon_in_plane(r.borders[i], n, r.scale)
    polygon = polygon_in_plane(region.polygon, n, r.scale)
    flat = np.vstack([region.polygon, r.centers[i][None]]) - r.borders[i][0]
    if border is None or polygon is None or np.abs(flat @ n).max() > 4e-9 * r.scale:
        return False
    width = inradius(polygon)
    return abs(width - region.inscribed_radius / r.scale) <= 1e-7 + 2e-6 * width


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
