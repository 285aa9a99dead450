import numpy as np
import pytest

import grasp_core as gc
from scenes.example_objects import example_names, example_object
from sim_validate.datasets.layout import CONFIG
from sim_validate.datasets.open_dataset import Dataset, mesh_path, mesh_text
from tests.grasp_core.planning import test_recorded_surfaces as recorded

NAMES = [*(name for name in example_names() if "FACES" not in name), "random-30-1"]


def dataset_in(folder):
    """A dataset whose meshes alone are there, with faces of the usual kind."""
    (folder / CONFIG).write_text('objects = ["wedge"]\n')
    return Dataset(folder, None)


def stored(body, folder):
    path = mesh_path(folder, body.content_sha256)
    path.parent.mkdir(exist_ok=True)
    path.write_text(mesh_text(body))
    return dataset_in(folder).body(body.content_sha256, body.name)


def same(one, other):
    fields = ("vertices", "triangles", "center_of_mass", "inertia", "normals")
    return (
        all(np.array_equal(getattr(one, name), getattr(other, name)) for name in fields)
        and one.volume == other.volume
        and one.content_sha256 == other.content_sha256
        and len(one.faces) == len(other.faces)
        and all(
            np.array_equal(face.polygon, found.polygon)
            for face, found in zip(one.faces, other.faces, strict=True)
        )
    )


@pytest.mark.parametrize("name", NAMES)
def test_a_stored_object_comes_back_to_the_last_bit(name, tmp_path):
    body = example_object(name)
    assert same(body, stored(body, tmp_path))
    mesh = dataset_in(tmp_path).surface(body.content_sha256)
    vertices, triangles = mesh.vertices, mesh.triangles
    np.testing.assert_array_equal(vertices, body.vertices)
    np.testing.assert_array_equal(triangles, body.triangles)


@pytest.mark.parametrize("make", recorded.BODIES)
def test_what_is_known_of_a_stored_surface_comes_back(make, tmp_path):
    body = make()
    found = stored(body, tmp_path)
    assert same(body, found)
    assert found.surface == body.surface
    assert found.notes == body.notes


def test_a_stored_surface_whose_first_line_is_no_record_is_refused_by_field(tmp_path):
    body = recorded.capped()
    path = mesh_path(tmp_path, body.content_sha256)
    path.parent.mkdir()
    text = mesh_text(body)
    path.write_text(text.replace('"caps": [190, 191]', '"caps": [190, 192]'))
    with pytest.raises(gc.InputError, match="obj: caps must be numbers of triangles below 192"):
        dataset_in(tmp_path).body(body.content_sha256, "capped")
    path.write_text(text.replace('"holes": 2', '"holes": "two"'))
    with pytest.raises(gc.InputError, match=r"obj: first line: holes must be a whole"):
        dataset_in(tmp_path).body(body.content_sha256, "capped")


def test_the_mesh_of_another_object_is_refused(tmp_path):
    wedge, prism = example_object("wedge"), example_object("prism")
    path = mesh_path(tmp_path, wedge.content_sha256)
    path.parent.mkdir()
    path.write_text(mesh_text(prism))
    with pytest.raises(gc.InputError, match="another object"):
        dataset_in(tmp_path).body(wedge.content_sha256, "wedge")
    with pytest.raises(gc.InputError, match="another object"):
        dataset_in(tmp_path).surface(wedge.content_sha256)
