import numpy as np
import pytest
import trimesh

import grasp_core as gc
import scenes
from grasp_core.mesh_files.limits import MESH_FORMATS
from grasp_core.objects.polyhedron import is_convex, polyhedron_from_mesh
from tests.bad_input.of_threemf import mesh, model, object_, threemf


@pytest.fixture
def box():
    return trimesh.creation.box(extents=(0.1, 0.2, 0.3))


@pytest.mark.parametrize("kind", MESH_FORMATS)
def test_every_format_gives_the_same_box(box, kind, tmp_path):
    path = tmp_path / f"part.{kind}"
    if kind == "3mf":  # trimesh writes it in millimetres, by packages that nothing else here needs
        path.write_bytes(threemf(model(object_(mesh(box.vertices, box.faces)))))
    else:
        box.export(path)
    body = gc.load_polyhedron(path)
    assert body.name == "part"
    assert len(body.faces) == 6
    assert len(body.vertices) == 8
    assert body.volume == pytest.approx(0.006, rel=1e-6)
    np.testing.assert_allclose(
        np.diag(body.inertia) / body.volume, [0.13 / 12, 0.1 / 12, 0.05 / 12], rtol=1e-6
    )


def test_a_scale_multiplies_the_coordinates_of_a_file_besides_its_unit(box, tmp_path):
    path = tmp_path / "box.obj"
    box.copy().apply_scale(2000.0).export(path)
    for lengths in ({"unit": "mm", "scale": 0.5}, {"scale": 5e-4}, {"unit": "cm", "scale": 0.05}):
        body = gc.load_polyhedron(path, **lengths)
        assert body.volume == pytest.approx(0.006, rel=1e-6)
    assert gc.load_polyhedron(path, unit="mm").volume == pytest.approx(0.048, rel=1e-6)
    for scale in (1.0, 1e-7):
        with pytest.raises(gc.MeshError, match=r"--unit .*--scale"):
            gc.load_polyhedron(path, scale=scale)


def test_the_content_hash_ignores_names_and_orders(box, tmp_path):
    rng = np.random.default_rng(0)
    body = polyhedron_from_mesh(box.vertices, box.faces, name="one")
    place = rng.permutation(len(box.vertices))
    shuffled = rng.permutation(np.roll(np.argsort(place)[box.faces], 1, axis=1))
    other = polyhedron_from_mesh(box.vertices[place], shuffled, name="two")
    moved = polyhedron_from_mesh(box.vertices + 1e-6, box.faces)
    assert body.content_sha256 == other.content_sha256
    assert body.content_sha256 != moved.content_sha256
    box.export(tmp_path / "a.obj")
    box.export(tmp_path / "b.obj")
    hashes = {gc.load_polyhedron(tmp_path / f"{name}.obj").source_sha256 for name in "ab"}
    assert len(hashes) == 1


def test_an_inside_out_mesh_is_turned_and_says_so(box):
    body = polyhedron_from_mesh(box.vertices, box.faces[:, ::-1])
    assert body.volume == pytest.approx(0.006)
    assert "inside out" in body.notes[0]
    assert not polyhedron_from_mesh(box.vertices, box.faces).notes


def test_a_density_gives_a_mass(box):
    body = gc.Polyhedron.from_mesh(box.vertices, box.faces)
    assert body.mass_at(2700.0) == pytest.approx(2700.0 * 0.006, rel=1e-8)
    for wrong in (0.0, -1.0, float("nan"), float("inf"), "1", True):
        with pytest.raises(gc.InputError, match="density_kg_m3 must be a number"):
            body.mass_at(wrong)


@pytest.mark.parametrize("name", ["wedge", "hex-nut"])
def test_a_polyhedron_comes_back_from_trimesh_as_it_was(name):
    body = scenes.example_object(name)
    mesh = body.to_trimesh()
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(body.volume, rel=1e-12)
    np.testing.assert_allclose(mesh.center_mass, body.center_of_mass, atol=1e-12)
    again = gc.Polyhedron.from_mesh(mesh.vertices, mesh.faces, name=name)
    assert again.content_sha256 == body.content_sha256
    assert len(again.faces) == len(body.faces)


@pytest.mark.parametrize("height", [0.0, 5e-7, 5e-6, 1e-2])
def test_a_box_is_convex_unless_its_top_has_a_dent(height):
    """Flat to a millionth of its radius is flat; the planes of faces and the hull say the same."""
    mesh = trimesh.creation.box((0.1, 0.08, 0.06))
    top = mesh.vertices[:, 2] > 0.0
    rim = [corner for corner in np.flatnonzero(top)]
    points = np.vstack([mesh.vertices, [0.0, 0.0, 0.03 - height * 0.07]])
    kept = [face for face in mesh.faces if not top[face].all()]
    ring = [rim[place] for place in (0, 1, 3, 2)]
    fan = [[a, b, len(mesh.vertices)] for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    outward = np.cross(*(points[fan[0][1:]] - points[fan[0][0]]))[2] > 0.0
    faces = [*kept, *(each if outward else each[::-1] for each in fan)]
    body = gc.Polyhedron.from_mesh(points, np.array(faces), name="dented", faces="planar")
    assert is_convex(body) is (height < 1e-6)


@pytest.mark.parametrize("dent", [1.0, 0.9])
def test_a_ball_is_convex_unless_it_has_a_dent(dent):
    """It is planned on patches, whose planes cut through the ball."""
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    points = np.array(mesh.vertices)
    points[7] *= dent
    single = points.astype(np.float32).astype(np.float64)
    body = gc.Polyhedron.from_mesh(single, mesh.faces, name="ball")
    assert body.patches is not None
    assert is_convex(body) is (dent == 1.0)
