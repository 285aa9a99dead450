import dataclasses
import json
import shutil
import sys
from pathlib import Path

import mujoco
import pytest
import trimesh

import grasp_core as gc
import sim_validate
from scenes.example_objects import example_object
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets import build as build_module
from sim_validate.datasets import parquet
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig, config_from_toml, config_to_toml
from sim_validate.datasets.verify import verify
from sim_validate.main import main
from tests.sim_validate.datasets.configs import CONFIG, rows_of
from tests.sim_validate.datasets.engines import Here, WorkerEndedError, contents, silent

pytest.importorskip("pyarrow")


class KilledError(BaseException):
    """Stands for the end of the process."""


def test_a_dataset_holds_every_object_at_every_friction(dataset):
    assert verify(dataset) == []
    grasps = [row for row in rows_of(dataset, "grasps") if row["label"] == "grasp"]
    names = {row["object_id"]: row["source_name"] for row in rows_of(dataset, "objects")}
    assert sorted(names.values()) == ["tetrahedron", "wedge"]
    assert {(names[row["object_id"]], row["friction"]) for row in grasps} == {
        (name, friction) for name in CONFIG.objects for friction in CONFIG.frictions
    }
    assert all(row["held"] for row in grasps)
    assert not (dataset / "staging").exists()


@pytest.mark.usefixtures("built_here")
def test_mesh_files_have_the_scale_that_is_asked_for(tmp_path):
    """The configuration keeps it; built-in objects have none."""
    body = example_object("tetrahedron")
    mesh, out = tmp_path / "mesh.obj", tmp_path / "ds"
    trimesh.Trimesh(2e3 * body.vertices, body.triangles).export(mesh)
    line = ["dataset", "build", str(mesh), "wedge", "--limit", "1", "--families", "concurrent"]
    lengths = ["--unit", "mm", "--scale", "0.5"]
    assert main([*line, *lengths, "--out", str(out), "-q"]) == Exit.GOOD
    rows = {row["source_name"]: row for row in rows_of(out, "objects")}
    assert rows["mesh.obj"]["radius_m"] == pytest.approx(body.radius, rel=1e-6)
    assert rows["wedge"]["object_id"] == example_object("wedge").content_sha256
    assert config_from_toml(out / "config.toml").scale == 0.5
    assert verify(out) == []


def test_a_killed_build_goes_on_where_it_was(dataset, tmp_path):
    """What is half written then is removed, and a unit that is damaged is done again."""
    folder = tmp_path / "ds"

    def die(_):
        if len(engine.submitted) == 4:
            raise KilledError

    engine = Here(die)
    with pytest.raises(KilledError):
        build(CONFIG, folder, engine, silent)
    with pytest.raises(gc.InputError, match="expected a finished dataset"):
        verify(folder)
    shard = next((folder / "staging").glob("*/trials.parquet"))
    (folder / "staging" / f".{shard.parent.name}.unfinished-0").mkdir()
    shard.write_bytes(shard.read_bytes()[:-8])
    (folder / ".config.toml.x7y").write_text("objects")
    (folder / ".manifest.json.x7y").write_text("{")
    again = Here()
    built = build(CONFIG, folder, again, silent)
    assert len(again.submitted) == built.made == 2
    assert contents(folder) == contents(dataset)


def test_a_finished_dataset_is_left_alone(copy, dataset):
    (copy / "staging" / "old").mkdir(parents=True)
    assert verify(copy) == []
    engine = Here()
    assert build(CONFIG, copy, engine, silent).manifest.rows["objects"] == 2
    assert not engine.submitted
    assert not (copy / "staging").exists()
    assert contents(copy) == contents(dataset)


def test_a_bad_object_is_quarantined_with_its_reason_and_the_others_are_there(tmp_path):
    bad, twin = tmp_path / "open.stl", tmp_path / "twin.stl"
    box = trimesh.creation.box(extents=(0.04, 0.05, 0.06))
    trimesh.Trimesh(box.vertices, box.faces[:-2]).export(bad)
    body = gc.Polyhedron.from_mesh(box.vertices, box.faces)
    trimesh.Trimesh(body.vertices, body.triangles).export(twin)
    shutil.copy(twin, tmp_path / "again.stl")
    config = dataclasses.replace(
        CONFIG, objects=(str(bad), str(twin), str(tmp_path / "again.stl")), frictions=(0.5,)
    )
    made = build(config, tmp_path / "ds", Here(), silent).manifest
    assert (made.units, made.quarantined, made.rows["objects"]) == (3, 2, 1)
    lines = (tmp_path / "ds" / "quarantine.jsonl").read_text().splitlines()
    reasons = {json.loads(line)["object"]: json.loads(line)["reason"] for line in lines}
    assert reasons["twin.stl"] == "the same object as again.stl"
    assert reasons["open.stl"].startswith("GP-MESH-OPEN: open.stl: ")
    assert verify(tmp_path / "ds") == []


def test_what_is_left_out_is_told_in_the_same_words_wherever_the_meshes_are(tmp_path, monkeypatch):
    said = set()
    for folder in ("one", "two/deep"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "bad.stl").write_text("solid nothing")
        config = dataclasses.replace(CONFIG, objects=(str(tmp_path / folder / "bad.stl"),))
        build(config, tmp_path / folder / "ds", Here(), silent)
        said.add((tmp_path / folder / "ds" / "quarantine.jsonl").read_text())
        monkeypatch.chdir(tmp_path / folder)
        build(dataclasses.replace(CONFIG, objects=("bad.stl",)), Path("again"), Here(), silent)
        said.add(Path("again/quarantine.jsonl").read_text())
    (text,) = said
    assert str(tmp_path) not in text


def test_a_unit_that_ends_its_worker_is_tried_again_alone_then_quarantined(tmp_path):
    ends = {0.4: 1, 0.5: 9}

    def crash(unit):
        if unit.object == "wedge" and ends[unit.friction]:
            ends[unit.friction] -= 1
            raise WorkerEndedError

    engine = Here(crash)
    built = build(CONFIG, tmp_path / "ds", engine, silent)
    assert built.manifest.quarantined == 1
    assert len(engine.submitted) == 6
    (line,) = (tmp_path / "ds" / "quarantine.jsonl").read_text().splitlines()
    assert json.loads(line)["friction"] == 0.5
    assert json.loads(line)["reason"] == "its worker ended, twice"


def test_without_pyarrow_nothing_is_begun_and_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(gc.InputError, match=r"graspproof\[dataset\]"):
        build(CONFIG, tmp_path / "ds", Here(), silent)
    assert not (tmp_path / "ds").exists()
    with pytest.raises(gc.InputError, match=r"graspproof\[dataset\]"):
        verify(tmp_path / "ds")


def test_an_unfaithful_simulator_ends_a_build_before_it_begins(tmp_path, monkeypatch):
    def fail(*_):
        raise gc.UnfaithfulError("the simulator is off")

    monkeypatch.setattr(build_module, "require_faithful", fail)
    engine = Here()
    with pytest.raises(gc.UnfaithfulError):
        build(CONFIG, tmp_path / "ds", engine, silent)
    assert not engine.submitted


def test_a_dataset_of_other_settings_is_left_alone(copy):
    with pytest.raises(gc.InputError, match="made with other settings"):
        build(dataclasses.replace(CONFIG, limit=3), copy, Here(), silent)


def test_a_setting_more_at_the_beginning_is_another_setting(tmp_path):
    text = config_to_toml(dataclasses.replace(CONFIG, unit="mm"))
    (tmp_path / "config.toml").write_text(text)
    with pytest.raises(gc.InputError, match="made with other settings"):
        build(CONFIG, tmp_path, Here(), silent)
    assert (tmp_path / "config.toml").read_text() == text


@pytest.mark.parametrize("name", ["meshes/part.obj", "thesis.tex", "manifest.json"])
def test_a_folder_with_files_of_another_is_refused(tmp_path, name):
    path = tmp_path / "mine" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(gc.InputError, match="not part of the dataset"):
        build(CONFIG, tmp_path / "mine", Here(), silent)
    assert path.read_text() == "mine"


def test_meshes_inside_the_folder_are_refused(tmp_path):
    path = tmp_path / "ds" / "meshes" / "box.stl"
    path.parent.mkdir(parents=True)
    trimesh.creation.box(extents=(0.04, 0.05, 0.06)).export(path)
    config = dataclasses.replace(CONFIG, objects=(str(path),))
    with pytest.raises(gc.InputError, match="lies in the output folder"):
        build(config, tmp_path / "ds", Here(), silent)
    assert path.is_file()


def test_a_finished_dataset_of_a_mesh_that_has_changed_is_refused(tmp_path):
    path = tmp_path / "box.stl"
    trimesh.creation.box(extents=(0.04, 0.05, 0.06)).export(path)
    config = dataclasses.replace(CONFIG, objects=(str(path),), frictions=(0.5,))
    build(config, tmp_path / "ds", Here(), silent)
    assert build(config, tmp_path / "ds", Here(), silent).made == 0
    trimesh.creation.box(extents=(0.04, 0.05, 0.07)).export(path)
    with pytest.raises(gc.InputError, match="have changed since"):
        build(config, tmp_path / "ds", Here(), silent)


def test_a_finished_dataset_that_is_damaged_is_not_taken_for_one(copy):
    path = next(copy.glob("meshes/*.obj"))
    path.write_text(path.read_text() + "#")
    with pytest.raises(gc.InputError, match="missing or damaged"):
        build(CONFIG, copy, Here(), silent)
    path.unlink()
    with pytest.raises(gc.InputError, match="missing or damaged"):
        build(CONFIG, copy, Here(), silent)


def test_a_dataset_without_any_grasp_is_one(tmp_path):
    config = DatasetConfig(objects=("wedge",), frictions=(0.1,), families=("regulus",),
                           cones="normal")  # fmt: skip
    built = build(config, tmp_path / "ds", Here(), silent)
    assert built.manifest.rows == {"objects": 1, "grasps": 0, "trials": 0}
    assert verify(tmp_path / "ds") == []
    grasps = sim_validate.load_dataset(tmp_path / "ds")["grasps"]
    assert grasps["contact_points_m"].shape == (0, 4, 3)


def test_scenes_are_written_on_request(dataset, tmp_path):
    config = dataclasses.replace(CONFIG, scenes=True, objects=("tetrahedron",), frictions=(0.5,))
    build(config, tmp_path / "ds", Here(), silent)
    assert verify(tmp_path / "ds", 1.0) == []
    rows = [row for row in rows_of(tmp_path / "ds", "grasps") if row["label"] == "grasp"]
    scenes = {path.stem: path for path in (tmp_path / "ds" / "scenes").iterdir()}
    assert rows
    assert sorted(scenes) == sorted(row["grasp_id"] for row in rows)
    for path in scenes.values():
        assert mujoco.MjModel.from_xml_string(path.read_text()).ngeom > 4
    assert not (dataset / "scenes").exists()


def test_many_rows_take_several_files_whatever_the_order_of_objects(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "GROUP_ROWS", 5)
    monkeypatch.setattr(parquet, "FILE_ROWS", 12)
    turned = dataclasses.replace(CONFIG, objects=CONFIG.objects[::-1])
    build(turned, tmp_path / "ds", Here(), silent)
    assert verify(tmp_path / "ds") == []
    files = sorted((tmp_path / "ds" / "data" / "trials").glob("*.parquet"))
    assert len(files) > len(list((dataset / "data" / "trials").glob("*.parquet")))
    for name in ("objects", "grasps", "trials"):
        assert rows_of(tmp_path / "ds", name) == rows_of(dataset, name)
