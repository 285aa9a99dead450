"""What fingertips can touch, against the object's mesh itself.

The judge is the winding number of the mesh around a point: one inside, zero outside.
"""

from functools import cache

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

import grasp_core as gc
import scenes
from scenes.mujoco.surface import touched_solids
from tests.judges import winding
from tests.scenes.meshes import dented_ball

NEAR = 1e-6
"""How far beside the surface points are asked for, in object radii."""
EVERYWHERE = 10.0


def thin_bracket():
    """an L of 100 mm, 0.5 mm thin, whose faces are much wider than it is thick."""
    outline = np.array([[0, 0], [100, 0], [100, 40], [40, 40], [40, 100], [0, 100]]) / 1000.0
    flat = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    low, high = (np.column_stack([outline, np.full(6, z)]) for z in (0.0, 0.0005))
    i, j = np.arange(6), (np.arange(6) + 1) % 6
    walls = np.vstack([np.column_stack([i, j, j + 6]), np.column_stack([i, j + 6, i + 6])])
    triangles = np.vstack([flat[:, ::-1], flat + 6, walls])
    return gc.Polyhedron.from_mesh(np.vstack([low, high]), triangles, name="thin bracket")


MADE = {"thin bracket": thin_bracket, "dented ball": dented_ball}
OBJECTS = ("l-bracket", "hex-nut", *MADE)


@cache
def body_of(name):
    return MADE[name]() if name in MADE else scenes.example_object(name)


@cache
def solids_of(name):
    body = body_of(name)
    return touched_solids(body, np.zeros((1, 3)), EVERYWHERE * body.radius)


@cache
def sides_of(name):
    """Planes of each solid: unit normals outwards and offsets, [(m, 4)]."""
    return [ConvexHull(corners / body_of(name).radius).equations for corners in solids_of(name)]


def points_on(body, count):
    """Points spread over the surface, and the outward normals there."""
    mesh = body.to_trimesh()
    points, chosen = trimesh.sample.sample_surface(mesh, count, seed=2)
    return points - body.center_of_mass, mesh.face_normals[chosen]


def in_solids(name, points):
    """How many solids hold each point."""
    scaled = points / body_of(name).radius
    inside = [(scaled @ sides[:, :3].T + sides[:, 3]).max(axis=1) < 0.0 for sides in sides_of(name)]
    return np.sum(inside, axis=0)


@pytest.mark.parametrize("name", OBJECTS)
def test_no_solid_sticks_out_of_the_object(name):
    """Every mixture of a solid's corners is in the object. Points come from near the base, from
    its edges and from near the apex; all are drawn towards the solid's middle by 1 %."""
    body, rng = body_of(name), np.random.default_rng(1)
    surface, found = body.vertices[body.triangles] - body.center_of_mass, 0
    for corners in solids_of(name)[:: 1 + len(solids_of(name)) // 500]:
        weights = np.vstack(
            [rng.dirichlet(np.full(len(corners), 0.3), 8), np.eye(len(corners))[-1:]]
        )
        points = 0.99 * weights @ corners + 0.01 * corners.mean(axis=0)
        assert winding(surface, points) == pytest.approx(1.0, abs=1e-4)
        found += len(points)
    assert found > 8 * len(body.faces)


@pytest.mark.parametrize("name", OBJECTS)
def test_the_surface_is_the_outer_side_of_solids(name):
    """Points just below the surface are in a solid, and points just above it in none."""
    body = body_of(name)
    points, normals = points_on(body, 500)
    aside = NEAR * body.radius * normals
    assert not in_solids(name, points + aside).any()
    # a pyramid is thinner than this only on a strip along its edges
    assert np.mean(in_solids(name, points - aside) > 0) > 0.99
