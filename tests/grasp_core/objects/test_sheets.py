"""Open surfaces, of which it is certain on which side the material is, or which are refused."""

import math

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.objects.shells import sampled, winding_on, wound_alike

RADIUS = 0.05


def ball(below, *, radius=RADIUS):
    """A fine sphere without its triangles above a height."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return mesh.vertices, mesh.faces[mesh.triangles_center[:, 2] < below]


def together(*meshes):
    """Several meshes as one."""
    counts = np.cumsum([0, *(len(points) for points, _ in meshes)])
    faces = [faces + count for (_, faces), count in zip(meshes, counts, strict=False)]
    return np.concatenate([points for points, _ in meshes]), np.concatenate(faces)


def sheet():
    """A square that is cut finely and flat."""
    line = np.linspace(0.0, 0.1, 9)
    points = np.array([(x, y, 0.0) for x in line for y in line])
    corners = [(9 * i + j, 9 * i + j + 9) for i in range(8) for j in range(8)]
    return points, np.array([t for a, b in corners for t in ((a, b, a + 1), (b, b + 1, a + 1))])


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_large_hole_leaves_the_volume_unknown_and_the_fingers_pushing_inwards(inside_out):
    points, faces = ball(0.042)
    whole = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS)
    assert 1.0 - len(faces) / len(whole.faces) == pytest.approx(0.08, abs=0.005)
    body = gc.Polyhedron.from_mesh(points, faces[:, ::-1] if inside_out else faces)
    assert not body.surface.closed
    assert body.surface.volume_source == "convex hull"
    assert body.volume == pytest.approx(trimesh.convex.convex_hull(body.vertices).volume)
    assert any("of the convex hull" in note and "no mass" in note for note in body.notes)
    assert any("inside out" in note for note in body.notes) is inside_out
    assert len(body.faces) >= 10
    for face in body.faces:
        assert face.normal @ face.centroid < -0.9 * RADIUS
    with pytest.raises(gc.InputError, match=r"density gives no mass.*volume.*give the mass, or cl"):
        body.mass_at(1000.0)


@pytest.mark.parametrize(
    "mesh",
    [ball(0.0), ball(-0.02), ball(0.01), sheet()],
    ids=["half a ball or a bowl", "less", "more", "sheet"],
)
def test_where_either_side_may_be_inside_the_mesh_is_refused(mesh):
    points, faces = mesh
    for wound in (faces, faces[:, ::-1]):
        with pytest.raises(gc.MeshError, match="not certain which side is inside") as caught:
            gc.Polyhedron.from_mesh(points, wound, faces="patches")
        assert caught.value.reason is MeshRefusal.OPEN


def test_a_part_of_an_open_surface_that_is_inside_out_is_turned():
    one, (points, faces) = ball(0.042), ball(0.042)
    body = gc.Polyhedron.from_mesh(*together(one, (points + np.array([0.1, 0, 0]), faces[:, ::-1])))
    assert any(note.startswith("1 of 2 parts of the open surface") for note in body.notes)
    for face in body.faces:
        middle = np.array([0.1 * (face.centroid[0] > 0.05), 0.0, 0.0])
        assert face.normal @ (face.centroid - middle) < -0.9 * RADIUS


def test_an_open_part_inside_another_is_refused_unless_the_largest_is_asked_for():
    points, faces = together(ball(0.042), ball(0.021, radius=0.5 * RADIUS))
    with pytest.raises(gc.MeshError, match="largest-part") as caught:
        gc.Polyhedron.from_mesh(points, faces)
    assert caught.value.reason in {MeshRefusal.OVERLAP, MeshRefusal.OPEN}
    body = gc.Polyhedron.from_mesh(points, faces, largest_part=True)
    assert body.surface.dropped == pytest.approx(0.2, abs=0.02)
    assert any("left out" in note for note in body.notes)
    assert np.linalg.norm(body.vertices, axis=1).min() == pytest.approx(RADIUS)


def test_a_speck_inside_an_open_surface_is_left_out_and_said_so():
    points, faces = together(ball(0.042), ball(1.0, radius=0.05 * RADIUS))
    body = gc.Polyhedron.from_mesh(points, faces)
    assert 0.0 < body.surface.dropped < 0.01
    assert any(note.startswith("1 part with") and "left out" in note for note in body.notes)


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
