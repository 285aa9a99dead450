"""Convexity against shapes that are known to be convex, or not, by their making."""

import numpy as np
import pytest
import trimesh

import grasp_core as gc
import scenes
from grasp_core.objects.polyhedron import is_convex


@pytest.mark.parametrize("subdivisions", [1, 2, 3])
def test_a_ball_is_convex_however_fine(subdivisions):
    """The finer ones are planned on patches, whose planes cut through the ball."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.05)
    ball = gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces, name="ball")
    assert is_convex(ball)
    single = mesh.vertices.astype(np.float32).astype(np.float64)
    assert is_convex(gc.Polyhedron.from_mesh(single, mesh.faces, name="ball"))


def test_a_dent_in_a_ball_is_seen():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    vertices = np.array(mesh.vertices)
    vertices[7] *= 0.98
    assert not is_convex(gc.Polyhedron.from_mesh(vertices, mesh.faces, name="dented"))


@pytest.mark.parametrize(
    ("name", "convex"),
    [("box", True), ("random-40-1", True), ("dodecahedron", True), ("wedge", True),
     ("l-bracket", False), ("cross", False), ("hex-nut", False), ("mug", False)],
)  # fmt: skip
def test_examples_are_what_they_are(name, convex):
    assert is_convex(scenes.example_object(name)) is convex
