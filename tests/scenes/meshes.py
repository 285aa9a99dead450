"""Meshes to try pictures and surfaces on."""

import numpy as np

import grasp_core as gc
import scenes
from tests.bad_input.mesh_texts import obj


def sphere_mesh(levels):
    """A unit sphere from an octahedron, each triangle cut into four so many times."""
    vertices = np.vstack([np.eye(3), -np.eye(3)])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2],
                          [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])  # fmt: skip
    for _ in range(levels):
        corners = vertices[triangles]
        middles = corners + np.roll(corners, -1, axis=1)
        middles /= np.linalg.norm(middles, axis=2, keepdims=True)
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = middles.transpose(1, 0, 2)
        parts = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]])
        flat = parts.transpose(0, 2, 1, 3).reshape(-1, 3)
        vertices, index = np.unique(np.round(flat, 12), axis=0, return_inverse=True)
        triangles = index.reshape(-1, 3)
    return vertices, triangles


def dented_ball():
    """A ball of 50 mm with a dent on its top, all of it curved."""
    points, triangles = sphere_mesh(3)
    points = 0.05 * points * (1.0 - 0.6 * np.clip(points[:, 2:] - 0.3, 0.0, None))
    return gc.Polyhedron.from_mesh(points, triangles, name="dented ball", faces="patches")


def box_obj(*half_sizes):
    """The text of an OBJ file of a box around the origin."""
    box = scenes.example_object("box")
    corners = np.sign(box.vertices - box.center_of_mass) * half_sizes
    return obj(corners.tolist(), box.triangles.tolist())
