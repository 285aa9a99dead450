"""Dirty meshes of a shape give grasps that hold the clean one."""

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from scenes.example_objects import example_object
from tests.grasp_core.curved import bumpy_ellipsoid
from tests.judges import winding

FAR = np.array([1.3, -1.1, 1.0])
"""Two metres away [m]."""


def mesh_of(name):
    """Vertices and triangles, fine enough that one that is missing hides hardly any volume."""
    if name == "bumpy":
        return bumpy_ellipsoid(subdivisions=3)
    body = example_object(name)
    fine = trimesh.Trimesh(body.vertices, body.triangles, process=False).subdivide().subdivide()
    return fine.vertices, fine.faces


def ways(points, faces):
    """The mesh, dirty in each way: vertices, triangles, and how far it was moved."""
    rng, here = np.random.default_rng(0), np.zeros(3)
    left = np.delete(faces, rng.choice(len(faces), len(faces) // 200, replace=False), 0)
    some = rng.random((len(faces), 1)) < 0.3
    yield points, faces[:, ::-1], here
    yield points, left, here
    yield points, left[:, ::-1], here
    yield points, np.where(some, faces[:, ::-1], faces), here
    yield (points + FAR).astype(np.float32).astype(np.float64), faces, FAR


@pytest.mark.parametrize(
    "name", ["dodecahedron", *(pytest.param(n, marks=pytest.mark.slow) for n in ("bumpy", "cross"))]
)
def test_fingers_push_into_the_material_of_the_clean_shape(name):
    points, faces = mesh_of(name)
    whole = gc.Polyhedron.from_mesh(points, faces)
    clean = gc.plan(whole, 0.5, families="concurrent", limit=3).grasps
    for vertices, triangles, moved in ways(points, faces):
        kind = "patches" if whole.patches else "planar"
        body = gc.Polyhedron.from_mesh(vertices, triangles, faces=kind)
        assert body.volume == pytest.approx(whole.volume, rel=0.02)
        found = gc.plan(body, 0.5, families="concurrent", limit=3).grasps
        assert found[0].radius >= 0.5 * clean[0].radius
        for grasp in found:
            depths = [body.faces[face].depth + 1e-3 * whole.radius for face in grasp.faces]
            off = np.array(depths)[:, None] * grasp.normals
            inside, outside = (
                winding(points[faces], grasp.positions - moved + sign * off) for sign in (1, -1)
            )
            assert inside == pytest.approx(1.0, abs=1e-3)
            assert outside == pytest.approx(0.0, abs=1e-3)
