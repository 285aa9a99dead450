import math

import numpy as np
import pytest

import grasp_core as gc
import scenes
from scenes import example_objects

FACES = {
    "tetrahedron": 4, "octahedron": 8, "dodecahedron": 12, "icosahedron": 20, "wedge": 8,
    "chamfered-box": 14, "hexagonal-pyramid": 7, "box": 6, "prism": 5, "double-wedge-bar": 8,
    "hex-nut": 24, "l-bracket": 8, "cross": 30, "screwdriver": 39, "mug": 35,
}  # fmt: skip


@pytest.mark.parametrize("name", FACES)
def test_an_object_is_a_solid_of_hand_size_with_its_faces(name):
    body = scenes.example_object(name)
    assert body.name == name
    assert len(body.faces) == FACES[name]
    assert not body.notes
    assert 0.03 < body.radius < 0.15
    outward = sum(face.area * face.normal for face in body.faces)
    np.testing.assert_allclose(outward, 0.0, atol=1e-12)


def test_volumes_of_simple_objects_are_their_formulas():
    expected = {
        "tetrahedron": 8 / 3 * 0.04**3,
        "octahedron": 4 / 3 * 0.06**3,
        "box": 8 * 0.05 * 0.035 * 0.025,
        "prism": 3 * math.sqrt(3) / 4 * 0.05**2 * 0.08,
        "cross": 3 * 0.11 * 0.036**2 - 2 * 0.036**3,
    }
    for name, volume in expected.items():
        assert scenes.example_object(name).volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize(("faces", "seed"), [(12, 3), (60, 2)])
def test_random_objects_have_the_asked_number_of_faces_and_repeat(faces, seed):
    one, two = (scenes.example_object(f"random-{faces}-{seed}") for _ in range(2))
    assert len(one.faces) == faces
    assert one.content_sha256 == two.content_sha256
    assert one.content_sha256 != scenes.example_object(f"random-{faces}-{seed + 1}").content_sha256


def test_a_random_object_that_no_draw_makes_is_refused(monkeypatch):
    monkeypatch.setattr(example_objects, "MOST_DRAWS", 3)
    with pytest.raises(gc.InputError, match="random-4-7: 3 draws made no"):
        scenes.example_object("random-4-7")


def test_names_are_forgiving_and_an_unknown_one_comes_with_a_hint():
    for name in ("hex_nut", " Hex-Nut "):
        assert scenes.example_object(name).name == "hex-nut"
    for name, hint in (("tetrahedon", "tetrahedron"), ("qqq", "objects")):
        with pytest.raises(gc.InputError, match=hint):
            scenes.example_object(name)
