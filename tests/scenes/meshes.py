"""Meshes to try pictures and surfaces on."""

import numpy as np
import trimesh

import grasp_core as gc
import scenes
from tests.bad_input.mesh_texts import obj


def dented_ball():
    """A ball of 50 mm with a dent on its top, all of it curved."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    points = 0.05 * ball.vertices * (1.0 - 0.6 * np.clip(ball.vertices[:, 2:] - 0.3, 0.0, None))
    return gc.Polyhedron.from_mesh(points, ball.faces, name="dented ball", faces="patches")


def box_obj(*half_sizes):
    """The text of an OBJ file of a box around the origin."""
    box = scenes.example_object("box")
    corners = np.sign(box.vertices - box.center_of_mass) * half_sizes
    return obj(corners.tolist(), box.triangles.tolist())
