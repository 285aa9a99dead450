"""What several benchmarks plan: built-in objects, scaled ones and hulls."""

import numpy as np
import trimesh

import grasp_core as gc
import scenes

FAMILIES = ("concurrent", "pencil", "regulus", "free")
PAPER = FAMILIES[:3]
TEN_DEGREES = 0.1763
"""The paper's friction."""


def scaled(name, radius_m):
    """A built-in object of a radius, about its centre of mass."""
    body = scenes.example_object(name)
    vertices = (body.vertices - body.center_of_mass) * radius_m / body.radius
    return gc.Polyhedron.from_mesh(vertices, body.triangles, name=name)


def sphere_hull(faces, seed=0):
    """A polytope with so many triangles: the hull of points on a sphere."""
    points = np.random.default_rng(seed).normal(size=(faces // 2 + 2, 3))
    hull = trimesh.convex.convex_hull(points / np.linalg.norm(points, axis=1, keepdims=True))
    name = f"hull of {faces} faces"
    return gc.Polyhedron.from_mesh(hull.vertices, hull.faces, name=name, faces="planar")
