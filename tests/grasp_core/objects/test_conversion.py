import numpy as np
import pytest
import trimesh

import grasp_core as gc
import scenes


@pytest.mark.parametrize("name", ["wedge", "hex-nut"])
def test_a_polyhedron_comes_back_from_trimesh_as_it_was(name):
    body = scenes.example_object(name)
    mesh = body.to_trimesh()
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(body.volume, rel=1e-12)
    np.testing.assert_allclose(mesh.center_mass, body.center_of_mass, atol=1e-12)
    again = gc.from_trimesh(mesh, name=name)
    assert again.content_sha256 == body.content_sha256
    assert len(again.faces) == len(body.faces)


def test_meshes_of_trimesh_are_checked_like_files():
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    assert len(gc.from_trimesh(box).faces) == 6
    box.faces = box.faces[:-1]
    with pytest.raises(gc.MeshError, match="OPEN"):
        gc.from_trimesh(box)
    with pytest.raises(gc.InputError, match="Trimesh, got str"):
        gc.from_trimesh("part.stl")
