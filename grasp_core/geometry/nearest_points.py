"""Finds the nearest points of triangles without tolerances, however small or thin they are.

Solved: for a point p and a triangle a, b, c, the point q of the triangle nearest to p.

Method. q is the foot of p on the triangle's plane if that is inside, else it is on one of the
edges. With n = (b - a) x (c - a) the foot is a + v (b - a) + w (c - a), v = n.((p - a) x (c - a)) /
n.n and w = n.((b - a) x (p - a)) / n.n; it is inside if v, w >= 0 and v + w <= 1. Of these four
candidates the nearest is taken. As each candidate is on the triangle, rounding can make q too far
from p, never too near. The error is some 1e-16 lengths of the triangle, divided by the ratio of its
height to its length, but no more than its height: at worst 1e-8 lengths, for very thin triangles.

Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5. The signs tested there are
products of four lengths, which no single threshold suits, so the nearest candidate is taken
instead.
"""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.solvers.ties import first_best


def nearest_on_surface(vertices: Array, triangles: Indices, points: Array) -> Array:
    """Find the surface point nearest to each of several points, (n, 3) [m].

    Args:
        vertices: Vertices of the surface, (v, 3) [m].
        triangles: Indices of the vertices of each triangle, (t, 3).
        points: Points to start from, (n, 3) [m].
    """
    corners = vertices[triangles]
    nearest = np.empty((len(points), 3))
    for place, point in enumerate(points):
        candidates = nearest_on_triangles(corners, point)
        nearest[place] = candidates[first_best(-np.linalg.norm(candidates - point, axis=1))]
    return nearest


def nearest_on_triangles(corners: Array, point: Array) -> Array:
    """Find the point of each of several triangles nearest to a point, (t, 3) [m].

    Args:
        corners: Corners of the triangles, (t, 3, 3) [m].
        point: Point to start from, (3,) [m].
    """
    candidates = np.stack([*_on_edges(corners, point), _foot(corners, point)])
    nearest = np.linalg.norm(candidates - point, axis=2).argmin(axis=0)
    return candidates[nearest, np.arange(len(corners))]


def _on_edges(corners: Array, point: Array) -> list[Array]:
    """Return the point of each edge nearest to a point, three times (t, 3)."""
    found: list[Array] = []
    for start, end in ((0, 1), (1, 2), (2, 0)):
        tails = corners[:, start]
        along = corners[:, end] - tails
        shares = np.clip(_divided(_dots(point - tails, along), _dots(along, along)), 0.0, 1.0)
        found.append(tails + shares[:, None] * along)
    return found


def _foot(corners: Array, point: Array) -> Array:
    """Return the foot of a point on each triangle if that is inside, else a corner, (t, 3)."""
    tails = corners[:, 0]
    one, other, away = corners[:, 1] - tails, corners[:, 2] - tails, point - tails
    normals = np.cross(one, other)
    squares = _dots(normals, normals)
    v = _divided(_dots(normals, np.cross(away, other)), squares)
    w = _divided(_dots(normals, np.cross(one, away)), squares)
    inside = (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    return (
        tails + np.where(inside, v, 0.0)[:, None] * one + np.where(inside, w, 0.0)[:, None] * other
    )


def _dots(a: Array, b: Array) -> Array:
    return np.einsum("ti,ti->t", a, b)


def _divided(a: Array, b: Array) -> Array:
    """Divide arrays, with zero where the divisor is zero.

    The divisor is zero for a triangle or an edge without size, whose corners are candidates anyway.
    """
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0.0)
