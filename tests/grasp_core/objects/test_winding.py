import math
from itertools import pairwise

import numpy as np
import pytest
import trimesh

from grasp_core.objects.sheets import sampled, winding_on, wound_alike


def seen(rectangle, eye):
    """The solid angle of a rectangle from (x, y) low to high at height z, from below it."""
    (low, high), z = rectangle[:2], rectangle[2]
    height = z - eye[2]
    corners = [(low[0], low[1], 1), (high[0], high[1], 1),
               (low[0], high[1], -1), (high[0], low[1], -1)]  # fmt: skip
    angle = 0.0
    for x, y, sign in corners:
        a, b = x - eye[0], y - eye[1]
        angle += sign * math.atan2(a * b, height * math.sqrt(a * a + b * b + height * height))
    return angle


def moebius(count):
    """A strip with half a turn."""
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)[:, None]
    width = np.array([-0.2, 0.2])
    reach = 1.0 + width * np.cos(0.5 * turn)
    points = np.stack([reach * np.cos(turn), reach * np.sin(turn), width * np.sin(0.5 * turn)], 2)
    rim = [(2 * k, 2 * k + 1) for k in range(count)] + [(1, 0)]
    faces = [t for (a, b), (c, d) in pairwise(rim) for t in ((a, b, c), (b, d, c))]
    return points.reshape(-1, 3), np.array(faces)


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.icosphere(subdivisions=2),
        trimesh.creation.torus(1.0, 0.3, 12, 8),
        trimesh.creation.box((1, 2, 3)),
    ],
)
def test_the_mean_of_both_sides_is_a_half_on_a_closed_surface(mesh):
    every = np.arange(len(mesh.faces))
    corners = mesh.vertices[mesh.faces]
    np.testing.assert_allclose(winding_on(corners, every), 0.5, atol=1e-9)
    np.testing.assert_allclose(winding_on(corners[:, ::-1], every), -0.5, atol=1e-9)


def test_it_is_three_halves_inside_another_solid_and_a_half_beside_it():
    outer = trimesh.creation.icosphere(subdivisions=2).triangles
    inner, beside = 0.3 * outer, 0.3 * outer + [2.0, 0.0, 0.0]
    every = np.arange(3 * len(outer))
    around, inside, apart = np.split(winding_on(np.concatenate([outer, inner, beside]), every), 3)
    np.testing.assert_allclose(around, 0.5, atol=1e-9)
    np.testing.assert_allclose(inside, 1.5, atol=1e-9)
    np.testing.assert_allclose(apart, 0.5, atol=1e-9)


def test_a_missing_face_of_a_cube_takes_its_share_of_the_sphere_away():
    cube = trimesh.creation.box((2, 2, 2))
    left = cube.triangles[cube.face_normals[:, 2] < 0.5]
    assert len(left) == 10
    found = winding_on(left, np.arange(10))
    for corners, winding in zip(left, found, strict=True):
        angle = seen(((-1, -1), (1, 1), 1), corners.mean(axis=0))
        assert angle > 0.1
        assert winding == pytest.approx(0.5 - angle / (4.0 * math.pi), abs=1e-12)


def test_samples_stand_for_equal_shares_of_the_surface():
    areas = np.array([1.0] * 500 + [500.0])
    chosen = sampled(areas)
    assert (chosen == 500).mean() == pytest.approx(0.5, abs=0.01)
    assert len(np.unique(chosen)) == (chosen < 500).sum() + 1
    assert sampled(np.ones(3)).tolist() == [0, 1, 2]


@pytest.mark.parametrize("seed", range(3))
def test_triangles_turned_at_random_are_turned_back(seed):
    mesh = trimesh.creation.icosphere(subdivisions=2)
    wrong = np.random.default_rng(seed).random(len(mesh.faces)) < 0.35
    flipped = np.where(wrong[:, None], mesh.faces[:, ::-1], mesh.faces)
    corners, turned = wound_alike(flipped, mesh.area_faces)
    np.testing.assert_array_equal(corners, mesh.faces)
    np.testing.assert_array_equal(turned, wrong)


def test_each_part_keeps_the_winding_of_the_larger_area():
    box = trimesh.creation.box()
    faces = np.concatenate([box.faces, box.faces[:, ::-1] + 8])
    areas = np.ones(24)
    faces[0], faces[12] = faces[0, ::-1], faces[12, ::-1]
    corners, turned = wound_alike(faces, areas)
    assert np.flatnonzero(turned).tolist() == [0, 12]
    np.testing.assert_array_equal(corners[:12], box.faces)
    areas[0] = 12.0  # more than the eleven others together
    _, turned = wound_alike(faces, areas)
    assert np.flatnonzero(turned).tolist() == [*range(1, 12), 12]


def test_a_surface_with_one_side_cannot_be_wound_alike():
    _, faces = moebius(24)
    assert wound_alike(faces, np.ones(len(faces))) is None
    assert wound_alike(faces[:-2], np.ones(len(faces) - 2)) is not None
