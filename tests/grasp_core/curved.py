"""Curved bodies as fine meshes, and what a line along a patch's normal meets."""

from functools import cache

import numpy as np
import trimesh

import grasp_core as gc


def bumpy_ellipsoid(seed=0, noise=0.0, subdivisions=4, radii=(0.05, 0.042, 0.036)):
    """Vertices [m] and triangles; noise is in object radii, a wave makes it neither convex."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    rng = np.random.default_rng(seed)
    away = 1.0 + 0.03 * np.sin(4.0 * ball.vertices[:, 0] + seed)
    away += noise * rng.uniform(-1.0, 1.0, len(away))
    return ball.vertices * away[:, None] * np.array(radii), np.array(ball.faces)


@cache
def curved_body(**shape):
    few = gc.PatchLimits(most=12)
    return gc.Polyhedron.from_mesh(*bumpy_ellipsoid(**shape), name="bumpy", patches=few)


def inside(polygon, rng, count):
    """Points of a convex polygon (k, 3), many of them near its corners."""
    weights = rng.dirichlet(np.full(len(polygon), 0.3), count)
    return weights @ polygon


def met(body, face, point):
    """Triangles of a patch that the line along its normal meets: heights and inward normals."""
    corners = body.vertices[body.triangles[face.facets]]
    edges = np.roll(corners, -1, axis=1) - corners
    turns = np.cross(edges, point - corners) @ face.normal
    hit = corners[(turns >= 0.0).all(axis=1) | (turns <= 0.0).all(axis=1)]
    inward = -np.cross(hit[:, 1] - hit[:, 0], hit[:, 2] - hit[:, 0])
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    heights = np.einsum("fi,fi->f", hit[:, 0] - point, inward) / (inward @ face.normal)
    return heights, inward


def check_patches(body, rng, count, lean=1e-9):
    """Over each point of a patch is one point of the surface, as near and as steep as it says."""
    for face in body.faces:
        for point in inside(face.polygon, rng, count):
            heights, inward = met(body, face, point)
            np.testing.assert_allclose(heights, heights[:1], atol=1e-7 * body.radius)
            assert np.abs(heights).max() <= face.depth + 1e-9 * body.radius
            assert np.arccos(np.minimum(inward @ face.normal, 1.0)).max() <= face.spread + lean
