"""What several benchmarks plan: families of grasps, and hulls."""

import numpy as np
import trimesh

import grasp_core as gc

FAMILIES = ("concurrent", "pencil", "regulus", "free")
PAPER = FAMILIES[:3]
TEN_DEGREES = 0.1763
"""The paper's friction."""


def sphere_hull(faces, seed=0):
    """A polytope with so many triangles: the hull of points on a sphere."""
    points = np.random.default_rng(seed).normal(size=(faces // 2 + 2, 3))
    hull = trimesh.convex.convex_hull(points / np.linalg.norm(points, axis=1, keepdims=True))
    name = f"hull of {faces} faces"
    return gc.Polyhedron.from_mesh(hull.vertices, hull.faces, name=name, faces="planar")
