"""Open surfaces, of which it is certain on which side the material is, or which are refused."""

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.errors import MeshRefusal

RADIUS = 0.05


def ball(below, *, radius=RADIUS):
    """A fine sphere without its triangles above a height."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return mesh.vertices, mesh.faces[mesh.triangles_center[:, 2] < below]


def together(*meshes):
    """Several meshes as one."""
    return trimesh.util.append_faces(*zip(*meshes, strict=True))


def sheet():
    """A square that is cut finely and flat."""
    line = np.linspace(0.0, 0.1, 9)
    points = np.array([(x, y, 0.0) for x in line for y in line])
    corners = [(9 * i + j, 9 * i + j + 9) for i in range(8) for j in range(8)]
    return points, np.array([t for a, b in corners for t in ((a, b, a + 1), (b, b + 1, a + 1))])


def test_a_large_hole_leaves_the_volume_unknown_and_the_fingers_pushing_inwards():
    points, faces = ball(0.042)
    whole = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS)
    assert 1.0 - len(faces) / len(whole.faces) == pytest.approx(0.08, abs=0.005)
    body = gc.Polyhedron.from_mesh(points, faces[:, ::-1])
    assert not body.surface.closed
    assert body.surface.volume_source == "convex hull"
    assert body.volume == pytest.approx(trimesh.convex.convex_hull(body.vertices).volume)
    assert any("of the convex hull" in note and "no mass" in note for note in body.notes)
    assert any("inside out" in note for note in body.notes)
    assert len(body.faces) >= 10
    for face in body.faces:
        assert face.normal @ face.centroid < -0.9 * RADIUS
    with pytest.raises(gc.InputError, match=r"density gives no mass.*volume.*give the mass, or cl"):
        body.mass_at(1000.0)


@pytest.mark.parametrize(
    "mesh",
    [ball(0.0), ball(0.01), sheet()],
    ids=["half a ball or a bowl", "more", "sheet"],
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
