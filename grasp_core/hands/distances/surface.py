"""Sorts the triangles of a surface into a tree of balls, in which compiled loops find near ones."""

from functools import lru_cache

import numpy as np

from grasp_core.arrays import Array
from grasp_core.hands.by_identity import kept_by_identity
from grasp_core.hands.loop_values import SurfaceTree
from grasp_core.objects.polyhedron import Polyhedron

LEAF = 4
"""Largest number of triangles of a node without children."""


@kept_by_identity(8)
@lru_cache(maxsize=8)
def surface_tree(body: Polyhedron) -> SurfaceTree:
    """Sort the triangles of an object; equal objects share the tree."""
    triangles = body.vertices[body.triangles]
    middles, order = triangles.mean(axis=1), np.arange(len(triangles))
    balls: list[tuple[Array, float]] = []
    links: list[tuple[int, int]] = []

    def add(first: int, end: int) -> int:
        part = order[first:end]
        corners = triangles[part].reshape(-1, 3)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        balls.append((middle, float(np.linalg.norm(corners - middle, axis=1).max())))
        links.append((-(end - first), first))
        return len(balls) - 1

    ahead = [(add(0, len(order)), 0, len(order))]
    while ahead:
        node, first, end = ahead.pop()
        if end - first <= LEAF:
            continue
        at = middles[order[first:end]]
        axis = int(np.argmax(np.ptp(at, axis=0)))
        order[first:end] = order[first:end][np.argsort(at[:, axis], kind="stable")]
        half = (first + end) // 2
        children = add(first, half), add(half, end)
        links[node] = children
        ahead += [(children[0], first, half), (children[1], half, end)]
    corners = triangles[order]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(across, axis=1, keepdims=True)
    return SurfaceTree(
        np.ascontiguousarray(corners),
        np.divide(across, sizes, out=np.zeros_like(across), where=sizes > 0.0),
        order.astype(np.int64),
        np.array([middle for middle, _ in balls]),
        np.array([radius for _, radius in balls]),
        np.array(links, np.int64),
    )
