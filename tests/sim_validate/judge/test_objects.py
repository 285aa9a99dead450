"""Objects of records are found by name in a folder, of which nothing outside is ever read."""

from itertools import product

import numpy as np
import pytest
import trimesh

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from sim_validate.judge import objects as judged
from sim_validate.judge.objects import KEPT, recorded_object
from tests.bad_input.of_threemf import PLACE, archive, item, mesh, model, object_

CUBE = ((0, 0, 0), (1, 1, 1))
PAIR = [((0, 0, 0), (2, 1, 1)), ((1, 0, 0), (3, 1, 1))]
"""Boxes that overlap: a bar of 3 by 1 by 1."""
SCALE = 0.02


def write(path, *boxes):
    """Write boxes into one file, as CoACD writes pieces."""
    lines, faces = list[str](), trimesh.creation.box().faces
    for number, box in enumerate(boxes):
        corners = product(*np.transpose(box).tolist())
        lines += [f"o convex_{number}", *(f"v {x} {y} {z}" for x, y, z in corners)]
        lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1 + 8 * number).tolist()]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines))
    return path


def assert_bar(found, pieces):
    assert found.body.volume == pytest.approx(3 * SCALE**3, rel=1e-9)
    np.testing.assert_allclose(found.body.center_of_mass, SCALE * np.array([1.5, 0.5, 0.5]),
                               atol=1e-12)  # fmt: skip
    assert len(found.pieces) == pieces


@pytest.mark.parametrize("name", ["mug", "mug.obj", "assets/object/mug", "a\\b\\mug", "./mug/"])
def test_a_mesh_file_is_found_by_name_and_loaded_as_everywhere(name, tmp_path):
    path = write(tmp_path / "mug.obj", CUBE)
    found = recorded_object(name, SCALE, tmp_path)
    assert found.pieces is None
    assert found.body == gc.load_polyhedron(path, scale=SCALE)
    assert len(found.body.faces) == 6


@pytest.mark.parametrize("kind", ["stl", "ply", "off", "glb"])
def test_every_format_of_meshes_is_read(kind, tmp_path):
    write(tmp_path / "pair.obj", *PAIR)
    trimesh.load(tmp_path / "pair.obj", process=False).export(tmp_path / f"mug.{kind}")
    found = recorded_object("mug", SCALE, tmp_path)
    assert found.body.volume == pytest.approx(3 * SCALE**3, rel=1e-6)
    assert len(found.pieces) == 2


def test_the_unit_that_a_file_states_counts(tmp_path):
    boxes = [trimesh.creation.box(bounds=box) for box in PAIR]
    objects = [object_(mesh(box.vertices.tolist(), box.faces.tolist()), 1 + number)
               for number, box in enumerate(boxes)]  # fmt: skip
    whole = model("".join(objects), item(1) + item(2), 'unit="centimeter"')
    (tmp_path / "mug.3mf").write_bytes(archive((PLACE, whole)))
    assert_bar(recorded_object("mug", 100.0 * SCALE, tmp_path), 2)


@pytest.mark.parametrize("layout", ["coacd/decomposed.obj", "mesh/coacd.obj", "mesh/any.obj"])
def test_pieces_in_one_file_are_taken_together(layout, tmp_path):
    write(tmp_path / "mug" / layout, *PAIR)
    found = recorded_object("set/mug", SCALE, tmp_path)
    assert_bar(found, 2)
    assert found.body.name == "mug"


def test_pieces_in_several_files_are_taken_together(tmp_path):
    for number, box in enumerate([*PAIR, ((0.5, 0.2, 0.2), (1.0, 0.8, 0.8))]):
        write(tmp_path / "mug/urdf/meshes" / f"convex_piece_{number:03}.obj", box)
    write(tmp_path / "mug/mesh/simplified.obj", CUBE)
    assert_bar(recorded_object("mug", SCALE, tmp_path), 3)


def test_a_mesh_of_dexgraspbench_without_pieces_is_one_solid(tmp_path):
    write(tmp_path / "mug/mesh/simplified.obj", CUBE)
    write(tmp_path / "mug/mesh/normalized.obj", *PAIR)
    assert recorded_object("mug", SCALE, tmp_path).pieces is None
    (tmp_path / "mug/mesh/simplified.obj").rename(tmp_path / "mug/mesh/other.obj")
    recorded = "set/mug"  # another name, as the first is kept
    with pytest.raises(InputError, match=r"expected one mesh in .*mug.mesh, got 2"):
        recorded_object(recorded, SCALE, tmp_path)


def test_the_longest_ending_of_a_path_counts(tmp_path):
    write(tmp_path / "mug.obj", CUBE)
    write(tmp_path / "set/mug/coacd/decomposed.obj", *PAIR)
    assert_bar(recorded_object("assets/set/mug", SCALE, tmp_path), 2)
    assert recorded_object("assets/other/mug", SCALE, tmp_path).pieces is None


def test_one_file_stands_for_the_objects_of_all_records(tmp_path):
    path = write(tmp_path / "pair.obj", *PAIR)
    assert_bar(recorded_object("anything", SCALE, path), 2)
    assert_bar(recorded_object("../elsewhere", SCALE, str(path)), 2)


def test_built_in_objects_are_found_by_name(tmp_path):
    wedge = scenes.example_object("wedge")
    assert recorded_object("wedge", 1.0, tmp_path).body == wedge
    assert recorded_object("anything", 1.0, "wedge").body == wedge
    half = recorded_object("wedge", 0.5, tmp_path)
    assert half.pieces is None
    assert half.body.volume == pytest.approx(wedge.volume / 8.0)
    write(tmp_path / "wedge.obj", CUBE)
    assert len(recorded_object("set/wedge", SCALE, tmp_path).body.faces) == 6


@pytest.mark.parametrize(
    "name",
    ["../secret", "a/../../secret", "..", "..\\secret", "{outside}/secret", "{outside}/secret.obj",
     "C:\\secret", "C:secret", "\\\\host\\secret", "", ".", "/", "secret\0", "se\ncret", "\ud800",
     "../secret.obj", "inside/../../secret", "inside/" * 65],
)  # fmt: skip
def test_a_name_that_may_lead_elsewhere_is_refused(name, tmp_path):
    write(tmp_path / "secret.obj", CUBE)
    folder = tmp_path / "objects"
    write(folder / "inside.obj", CUBE)
    with pytest.raises(InputError, match=r"expected a name, or a path of at most 64 parts below"):
        recorded_object(name.format(outside=tmp_path), SCALE, folder)


@pytest.mark.parametrize("link", ["mug.obj", "mug", "mug/coacd", "mug/coacd/decomposed.obj",
                                  "mug/urdf/meshes/1.obj", "set"])  # fmt: skip
def test_a_link_that_leads_outside_is_refused(link, tmp_path, monkeypatch):
    outside, folder = tmp_path / "outside", tmp_path / "objects"
    write(outside / "coacd/decomposed.obj", CUBE)
    write(outside / "decomposed.obj", CUBE)
    write(outside / "mug.obj", CUBE)
    (folder / link).parent.mkdir(parents=True)
    (folder / link).symlink_to(outside / "mug.obj" if link.endswith(".obj") else outside)
    monkeypatch.setattr(judged, "read_triangles", lambda *_: pytest.fail("it was read"))
    with pytest.raises(InputError, match="a link leads out of the folder"):
        recorded_object("set/mug", SCALE, folder)


def test_links_within_the_folder_are_followed(tmp_path):
    write(tmp_path / "real/store/mug.obj", CUBE)
    (tmp_path / "objects").symlink_to(tmp_path / "real")
    (tmp_path / "real/cup.obj").symlink_to("store/mug.obj")
    assert recorded_object("cup", SCALE, tmp_path / "objects").body.volume > 0.0


def test_links_in_a_circle_and_names_that_are_too_long_are_refused(tmp_path):
    (tmp_path / "mug").symlink_to("mug")
    for name in ("mug", "m" * 400, "/".join(60 * ["m" * 100])):
        with pytest.raises(InputError, match=r"^object 'm.* cannot be looked for"):
            recorded_object(name, SCALE, tmp_path)


def test_a_missing_object_is_told_with_the_places_that_were_searched(tmp_path):
    with pytest.raises(InputError) as caught:
        recorded_object("set/mug", SCALE, tmp_path)
    for words in ("'set/mug'", str(tmp_path), "NAME/coacd/decomposed.obj", "obj|stl", "built-in"):
        assert words in str(caught.value)
    with pytest.raises(InputError, match="nowhere: expected a folder with objects"):
        recorded_object("set/mug", SCALE, tmp_path / "nowhere")
    for bad in (np.nan, 0.0, -1.0):
        with pytest.raises(InputError, match="scale"):
            recorded_object("mug", bad, tmp_path)


def test_a_bad_mesh_is_named(tmp_path):
    write(tmp_path / "mug.obj", CUBE).write_text("v 0 0 0\nf 1 1 1\n")
    write(tmp_path / "cup/coacd/decomposed.obj", CUBE)
    with pytest.raises(gc.MeshError, match=r"mug\.obj"):
        recorded_object("mug", SCALE, tmp_path)
    with pytest.raises(gc.MeshError, match=r"decomposed\.obj: the object is 1e-05 m across"):
        recorded_object("cup", 1e-5, tmp_path)


def test_objects_and_refusals_are_read_once_and_kept_in_bounds(tmp_path, monkeypatch):
    write(tmp_path / "mug.obj", *PAIR)
    write(tmp_path / "cup.obj", CUBE).write_text("nothing")
    read, files = judged.read_triangles, list[str]()

    def counted(path, limits):
        files.append(path.name)
        return read(path, limits)

    monkeypatch.setattr(judged, "read_triangles", counted)
    for _ in range(3):
        for scale in (SCALE, 2.0 * SCALE):
            recorded_object("mug", scale, tmp_path)
        with pytest.raises(InputError):
            recorded_object("cup", SCALE, tmp_path)
    assert files == ["mug.obj", "mug.obj", "cup.obj"]
    for number in range(2 * KEPT):
        recorded_object("mug", SCALE * (1.0 + number), tmp_path)
    assert judged._kept.cache_info().currsize == KEPT
