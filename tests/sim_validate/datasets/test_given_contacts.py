"""Grasps of other tools: read, put on the object, judged."""

import dataclasses
import json

import numpy as np
import pytest

import grasp_core as gc
import sim_validate
from scenes.example_objects import example_object
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.verify import verify
from sim_validate.datasets.work_units import read_given
from sim_validate.main import main
from tests.sim_validate.datasets.engines import Here, silent
from tests.sim_validate.planning.test_analyze import contacts

pytest.importorskip("pyarrow")
BODY = example_object("wedge")


@pytest.fixture(scope="module")
def planned():
    return gc.plan(BODY, 0.5, families=("concurrent",), limit=2).grasps


def contacts_file(path, grasps):
    listed = [{"id": name, "contacts": contacts(*where)} for name, *where in grasps]
    path.write_text(json.dumps({"grasps": listed}))
    return path


def written(path, grasps):
    """A contacts file of planned grasps."""
    return contacts_file(path, [(each.id, each.positions, each.normals) for each in grasps])


def judged(folder, path, share=0.0, **settings):
    config = DatasetConfig(objects=("wedge",), contacts=str(path), **settings)
    build(config, folder, Here(), silent)
    assert verify(folder, share) == []
    grasps = sim_validate.load_dataset(folder)["grasps"]
    mine = grasps["label"] == "given"
    return {name: column[mine] for name, column in grasps.items()}


def test_planned_grasps_that_come_back_are_judged_as_they_were(planned, tmp_path):
    found = judged(tmp_path / "ds", written(tmp_path / "g.json", planned), share=1.0)
    assert list(found["name"]) == [grasp.id for grasp in planned]
    assert found["held"].all()
    assert found["force_closed"].all()
    assert found["moved_m"].max() < 1e-12
    for name in ("closure_margin", "critical_friction", "ferrari_canny_lower_n"):
        own = [grasp.ferrari_canny[0] if "ferrari" in name else getattr(grasp, name)
               for grasp in planned]  # fmt: skip
        # the quality's bounds are a ten-thousandth apart
        np.testing.assert_allclose(found[name], own, rtol=1e-4 if "ferrari" in name else 1e-6)


def test_contacts_beside_the_surface_are_put_on_it(planned, tmp_path):
    rng = np.random.default_rng(0)
    off = 0.002 * BODY.radius
    points = np.array([grasp.positions - off * grasp.normals for grasp in planned])
    lean = 0.05 * rng.normal(size=points.shape)
    normals = np.array([grasp.normals for grasp in planned]) + lean
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    names = [grasp.id for grasp in planned]
    path = contacts_file(tmp_path / "g.json", zip(names, points, -normals, strict=True))
    found = judged(tmp_path / "ds", path, outward=True)
    np.testing.assert_allclose(found["moved_m"], off, rtol=1e-6)
    for points, normals, grasp in zip(
        found["contact_points_m"], found["contact_normals"], planned, strict=True
    ):
        np.testing.assert_allclose(points, grasp.positions, atol=1e-12)
        np.testing.assert_allclose(normals, grasp.normals, atol=1e-12)


def test_what_is_open_lets_go_and_what_is_off_the_object_is_not_tried(planned, tmp_path):
    good = planned[0]
    face = BODY.faces[0]
    corner = face.polygon[0] - face.centroid
    spots = face.centroid + np.outer([0.1, -0.1, 0.2, -0.2], corner)
    far = good.positions + np.array([1.0, 0.0, 0.0])
    path = contacts_file(tmp_path / "g.json", [
        ("../../good", good.positions, good.normals), ("one face", spots, [face.normal] * 4),
        ("far", far, good.normals), ("turned", good.positions, -good.normals),
    ])  # fmt: skip
    found = judged(tmp_path / "ds", path)
    assert list(found["name"]) == ["../../good", "one face", "far", "turned"]
    np.testing.assert_array_equal(found["held"], [1.0, 0.0, np.nan, np.nan])
    np.testing.assert_array_equal(found["force_closed"], [1.0, 0.0, np.nan, np.nan])
    assert list(found["outcome"][2:]) == ["not_tried"] * 2
    assert all("contact 0 is on no face" in note for note in found["note"][2:])
    assert all(not note for note in found["note"][:2])
    assert {path.name for path in (tmp_path / "ds").iterdir()} >= {"contacts.json", "meshes"}
    assert not (tmp_path / "good").exists()


@pytest.mark.usefixtures("built_here")
def test_the_command_judges_a_file(planned, tmp_path):
    path = written(tmp_path / "g.json", planned[:1])
    flags = ["--frictions", "0.5", "--out", str(tmp_path / "ds"), "-q"]
    assert main(["dataset", "import", str(path), "wedge", *flags]) == Exit.GOOD
    assert main(["dataset", "verify", str(tmp_path / "ds"), "--share", "1"]) == Exit.GOOD


def test_three_contacts_and_two_objects_are_refused(tmp_path):
    three = contacts_file(tmp_path / "three.json", [("a", np.eye(3), np.eye(3))])
    with pytest.raises(gc.InputError, match="expected 4 contacts, got 3"):
        read_given(three)
    config = DatasetConfig(objects=("wedge",), contacts=str(three))
    with pytest.raises(gc.InputError, match="one object beside `contacts`"):
        dataclasses.replace(config, objects=("wedge", "prism"))


def test_a_bad_row_is_named_by_its_file_and_its_number(planned, tmp_path):
    one, two = planned
    good = ("a", one.positions, one.normals)
    for bad, said in (
        (("b", two.positions, 2.0 * two.normals), r"contacts\[\d\].normal: its length"),
        (("b", 1e-12 * two.positions, two.normals), "contacts: the contacts are .* m"),
    ):
        path = contacts_file(tmp_path / "g.json", [good, bad])
        with pytest.raises(gc.InputError, match=rf"g.json: grasps\[1\].{said}"):
            read_given(path)
    document = json.loads(contacts_file(tmp_path / "g.json", [good]).read_text())
    document["grasps"][0]["contacts"][2]["friction"] = 0.3
    (tmp_path / "g.json").write_text(json.dumps(document))
    with pytest.raises(gc.InputError, match=r"g.json: grasps\[0\] \(a\): friction: remove it"):
        read_given(tmp_path / "g.json")
