"""The command `transfer`: files, exit codes, and what later commands make of its grasps."""

import json

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.files.text_files import write_text
from grasp_core.records.grasps_json import load_grasps
from scenes.example_objects import example_object
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.bad_input.mesh_texts import obj
from tests.changed_parts import with_face_moved, with_hole


def written(path, body):
    return write_text(path, obj((1e3 * body.vertices).tolist(), body.triangles.tolist()))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A part and its grasps, and the part with a face moved and with a hole."""
    folder = tmp_path_factory.mktemp("transfer")
    body = example_object("box")
    written(folder / "part.obj", body)
    written(folder / "moved.obj", with_face_moved(body, 3, 1e-3))
    assert main(["plan", str(folder / "part.obj"), "--unit", "mm", "--limit", "6",
                 "--out", str(folder / "plan"), "-q"]) == Exit.GOOD  # fmt: skip
    grasp = load_grasps(folder / "plan" / "grasps.json").grasps[0]
    hole = with_hole(body, grasp.faces[0], grasp.positions[0], 5e-3, 4e-3)
    written(folder / "hole.obj", hole)
    return folder


def transfer(folder, part, *more):
    grasps = folder / "plan" / "grasps.json"
    return main(["transfer", str(grasps), str(folder / part), "--unit", "mm", *more])


def test_a_scale_is_that_of_the_changed_part(folder, tmp_path, capsys):
    moved = with_face_moved(example_object("box"), 3, 1e-3)
    write_text(tmp_path / "odd.obj", obj((4e3 * moved.vertices).tolist(), moved.triangles.tolist()))
    assert transfer(folder, tmp_path / "odd.obj") == Exit.NONE
    assert "say its unit with --unit, or its scale with --scale" in capsys.readouterr().err
    assert transfer(folder, tmp_path / "odd.obj", "--scale", "0.25") == Exit.GOOD
    assert "6 of 6 grasps were carried over" in capsys.readouterr().out


def test_the_changed_part_may_be_a_built_in_object(folder, capsys):
    command = ["transfer", str(folder / "plan" / "grasps.json"), "box"]
    assert main(command) == Exit.GOOD
    assert "6 of 6 grasps were carried over" in capsys.readouterr().out
    assert main([*command, "--unit", "mm"]) == Exit.INPUT
    assert "leave out --unit" in capsys.readouterr().err


def test_it_writes_grasps_and_what_became_of_them(folder, tmp_path, capsys):
    assert transfer(folder, "moved.obj", "--out", str(tmp_path / "new")) == Exit.GOOD
    said = capsys.readouterr().out
    assert "moved: face 3 moved 1.00 mm outward; 4 faces of another area" in said
    assert "6 of 6 grasps were carried over" in said
    record = json.loads((tmp_path / "new" / "transfer.json").read_text())
    saved = load_grasps(tmp_path / "new" / "grasps.json")
    assert saved.body.name == "moved"
    assert record["new"]["content_sha256"] == saved.body.content_sha256
    assert [each["new_id"] for each in record["grasps"]] == [grasp.id for grasp in saved.grasps]
    assert record["summary"]["grasps"] == 6
    assert record["summary"]["contacts_moved"] == sum(
        contact["moved_m"] > 5e-4 for each in record["grasps"] for contact in each["contacts"]
    )
    for each, grasp in zip(record["grasps"], saved.grasps, strict=True):
        for contact, face, position in zip(
            each["contacts"], grasp.faces, grasp.positions, strict=True
        ):
            assert contact["new_face"] == face
            assert contact["moved_m"] == pytest.approx(1e-3 * (contact["old_face"] == 3))
            assert contact["contact"]["position_m"] == position.tolist()
    (moved,) = [face for face in record["faces"] if face["moved"]]
    assert (moved["old"], moved["moved_m"]) == (3, pytest.approx(1e-3))


def test_its_grasps_go_on_from_there(folder, tmp_path):
    out = str(tmp_path / "new")
    assert transfer(folder, "moved.obj", "--out", out, "-q") == Exit.GOOD
    grasps = f"{out}/grasps.json"
    assert main(["validate", grasps, "--limit", "1", "--jobs", "1", "-q"]) == Exit.GOOD
    assert main(["analyze", grasps, "--jobs", "1", "-q"]) == Exit.GOOD


def test_lost_grasps_end_with_1_and_no_grasp_at_all_with_5(folder, tmp_path, capsys):
    assert transfer(folder, "hole.obj", "--out", str(tmp_path / "new")) == Exit.NEGATIVE
    said = capsys.readouterr()
    assert "gone: finger 0 has lost face" in said.err
    large = written(folder / "large.obj", gc.Polyhedron.from_mesh(
        1.4 * example_object("box").vertices, example_object("box").triangles))  # fmt: skip
    assert transfer(folder, large.name, "--out", str(tmp_path / "none")) == Exit.NONE
    assert "no grasp is left" in capsys.readouterr().err
    record = json.loads((tmp_path / "none" / "grasps.json").read_text())
    assert record["grasps"] == []
    assert record["absence"] == "none of the 6 grasps could be carried over to the changed part"


def test_the_old_grasps_are_not_overwritten(folder, capsys):
    before = (folder / "plan" / "grasps.json").read_text()
    assert transfer(folder, "moved.obj", "--out", str(folder / "plan")) == Exit.INPUT
    assert "give another --out" in capsys.readouterr().err
    assert (folder / "plan" / "grasps.json").read_text() == before


def test_a_given_centre_of_mass_stays(folder, tmp_path):
    line = ["plan", str(folder / "part.obj"), "--unit", "mm", "--limit", "2", "-q"]
    plan = tmp_path / "plan"
    center = ["--center-of-mass-m", "0.001", "0.002", "0.003"]
    assert main([*line, *center, "--out", str(plan)]) == Exit.GOOD
    asked = ["transfer", str(plan / "grasps.json"), str(folder / "moved.obj"), "--unit", "mm", "-q"]
    main([*asked, "--out", str(tmp_path / "kept")])
    kept = load_grasps(tmp_path / "kept" / "grasps.json").body.center_of_mass
    np.testing.assert_array_equal(kept, [0.001, 0.002, 0.003])
    main([*asked, "--out", str(tmp_path / "other"), "--center-of-mass-m", "0", "0", "0.004"])
    other = load_grasps(tmp_path / "other" / "grasps.json").body.center_of_mass
    np.testing.assert_array_equal(other, [0.0, 0.0, 0.004])
