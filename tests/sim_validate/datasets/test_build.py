import dataclasses
import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

import grasp_core as gc
import sim_validate
from sim_validate.datasets import build as build_module
from sim_validate.datasets import tables
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.manifest import listed, read_manifest, write_manifest
from sim_validate.datasets.redo import Sample, drawn
from sim_validate.datasets.tables import parquet_bytes, read_rows
from sim_validate.datasets.tasks import Limits
from sim_validate.datasets.units import units_of
from sim_validate.datasets.verify import verify
from sim_validate.engines import local_processes
from tests.sim_validate.datasets.engines import Here, WorkerEndedError, contents, silent

pytest.importorskip("pyarrow")
ROOT = Path(__file__).parents[3]
CONFIG = DatasetConfig(
    objects=("tetrahedron", "wedge"), frictions=(0.4, 0.5), families=("concurrent",), limit=2
)


class KilledError(BaseException):
    """Stands for the end of the process."""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "ds"
    built = build(CONFIG, folder, Here(), silent)
    assert (built.units, built.made, built.quarantined) == (4, 4, 0)
    return folder


@pytest.fixture
def copy(dataset, tmp_path):
    return shutil.copytree(dataset, tmp_path / "copy")


def all_rows(folder, name):
    return [
        row for path in sorted(folder.glob(f"data/{name}/*.parquet")) for row in read_rows(path)
    ]


def test_a_dataset_holds_every_object_at_every_friction(dataset):
    assert verify(dataset) == []
    grasps = [row for row in all_rows(dataset, "grasps") if row["label"] == "grasp"]
    names = {row["object_id"]: row["source_name"] for row in all_rows(dataset, "objects")}
    assert sorted(names.values()) == ["tetrahedron", "wedge"]
    assert {(names[row["object_id"]], row["friction"]) for row in grasps} == {
        (name, friction) for name in CONFIG.objects for friction in CONFIG.frictions
    }
    assert all(row["held"] for row in grasps)
    assert not (dataset / "staging").exists()


def test_it_is_the_same_bytes_on_processes_and_in_another_order(dataset, tmp_path):
    turned = dataclasses.replace(CONFIG, objects=CONFIG.objects[::-1])
    with local_processes(2) as engine:
        built = build(turned, tmp_path / "other", engine, silent, Limits(120.0))
    assert built.made == 4
    before, after = contents(dataset), contents(tmp_path / "other")
    tables = {path for path in before if path.startswith("data/")}
    assert len(tables) >= 3
    assert tables == {path for path in after if path.startswith("data/")}


@pytest.mark.parametrize("killed_at", range(4))
def test_a_killed_build_goes_on_where_it_was(dataset, tmp_path, killed_at):
    folder = tmp_path / "ds"

    def die(_):
        if len(engine.submitted) == killed_at + 1:
            raise KilledError

    engine = Here(die)
    with pytest.raises(KilledError):
        build(CONFIG, folder, engine, silent)
    with pytest.raises(gc.InputError, match="not finished"):
        verify(folder)
    again = Here()
    built = build(CONFIG, folder, again, silent)
    assert len(again.submitted) == built.made == 4 - killed_at
    assert contents(folder) == contents(dataset)


def test_what_a_killed_worker_left_is_removed_and_damaged_units_are_done_again(dataset, tmp_path):
    folder = tmp_path / "ds"

    def die(_):
        if len(engine.submitted) == 4:
            raise KilledError

    engine = Here(die)
    with pytest.raises(KilledError):
        build(CONFIG, folder, engine, silent)
    (folder / "staging" / ".halfway").mkdir()
    shard = next((folder / "staging").glob("*/trials.parquet"))
    shard.write_bytes(shard.read_bytes()[:-8])
    again = Here()
    build(CONFIG, folder, again, silent)
    assert len(again.submitted) == 2
    assert contents(folder) == contents(dataset)


def test_a_finished_dataset_is_left_alone(copy):
    before, engine = contents(copy), Here()
    built = build(CONFIG, copy, engine, silent)
    assert not engine.submitted
    assert built.rows["objects"] == 2
    assert contents(copy) == before


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
    built = build(config, tmp_path / "ds", Here(), silent)
    assert (built.units, built.quarantined, built.rows["objects"]) == (3, 2, 1)
    lines = (tmp_path / "ds" / "quarantine.jsonl").read_text().splitlines()
    reasons = {json.loads(line)["object"]: json.loads(line)["reason"] for line in lines}
    assert "the same object as" in reasons[str(twin)]
    assert reasons[str(bad)].startswith("GP-MESH-OPEN")
    assert verify(tmp_path / "ds") == []


def test_a_unit_that_ends_its_worker_is_tried_again_alone_then_quarantined(tmp_path):
    ends = {0.4: 1, 0.5: 9}

    def crash(unit):
        if unit.object == "wedge" and ends[unit.friction]:
            ends[unit.friction] -= 1
            raise WorkerEndedError

    engine = Here(crash)
    built = build(CONFIG, tmp_path / "ds", engine, silent)
    assert built.quarantined == 1
    assert len(engine.submitted) == 6
    (line,) = (tmp_path / "ds" / "quarantine.jsonl").read_text().splitlines()
    assert json.loads(line)["friction"] == 0.5
    assert json.loads(line)["reason"] == "its worker ended, twice"


def test_a_unit_that_never_ends_is_given_up(tmp_path):
    config = dataclasses.replace(CONFIG, objects=("tetrahedron",), frictions=(0.5,))
    with local_processes(1) as engine:
        built = build(config, tmp_path / "ds", engine, silent, Limits(0.1))
    assert built.quarantined == 1
    assert "took too long, twice" in (tmp_path / "ds" / "quarantine.jsonl").read_text()


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


def test_two_builds_do_not_work_in_one_folder(tmp_path):
    def another(_):
        with pytest.raises(gc.InputError, match="another build"):
            build(CONFIG, tmp_path / "ds", Here(), silent)
        tried.append(1)

    tried = []
    build(CONFIG, tmp_path / "ds", Here(another), silent)
    assert len(tried) == 4


def test_folders_of_something_else_are_refused(copy, tmp_path):
    with pytest.raises(gc.InputError, match="another configuration"):
        build(dataclasses.replace(CONFIG, limit=3), copy, Here(), silent)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("all my work")
    with pytest.raises(gc.InputError, match=r"thesis\.tex: is there"):
        build(CONFIG, tmp_path / "mine", Here(), silent)
    with pytest.raises(gc.InputError, match="no dataset"):
        verify(tmp_path / "mine")


@pytest.mark.parametrize("name", ["meshes/part.obj", "README.md", "data/x", "manifest.json"])
def test_what_a_dataset_would_overwrite_in_a_folder_of_another_is_refused(tmp_path, name):
    path = tmp_path / "mine" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(gc.InputError, match="not of this dataset"):
        build(CONFIG, tmp_path / "mine", Here(), silent)
    assert path.read_text() == "mine"


def test_meshes_inside_the_folder_are_refused(tmp_path):
    path = tmp_path / "ds" / "meshes" / "box.stl"
    path.parent.mkdir(parents=True)
    trimesh.creation.box(extents=(0.04, 0.05, 0.06)).export(path)
    config = dataclasses.replace(CONFIG, objects=(str(path),))
    with pytest.raises(gc.InputError, match="holds nothing else"):
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


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(gc.InputError, match=r"--out .* no folder can be made"):
        build(CONFIG, tmp_path / "file", Here(), silent)


def test_a_dataset_without_any_grasp_is_one(tmp_path):
    config = DatasetConfig(objects=("wedge",), frictions=(0.1,), families=("regulus",),
                           cones="normal")  # fmt: skip
    built = build(config, tmp_path / "ds", Here(), silent)
    assert built.rows == {"objects": 1, "grasps": 0, "trials": 0}
    assert verify(tmp_path / "ds", Sample(1.0)) == []
    grasps = sim_validate.load_dataset(tmp_path / "ds")["grasps"]
    assert grasps["contact_points_m"].shape == (0, 4, 3)


def test_what_was_half_written_is_removed(dataset, tmp_path):
    folder = tmp_path / "ds"
    folder.mkdir()
    (folder / ".config.toml.x7y").write_text("objects")
    (folder / ".manifest.json.x7y").write_text("{")
    build(CONFIG, folder, Here(), silent)
    assert contents(folder) == contents(dataset)
    (folder / "staging" / "old").mkdir(parents=True)
    assert verify(folder) == []
    build(CONFIG, folder, Here(), silent)
    assert not (folder / "staging").exists()


KILL = """
import os, shutil, sys, pathlib
left = int(sys.argv[2])
def counted(plain):
    def call(*args, **kwargs):
        global left
        if left == 0:
            os._exit(9)
        left -= 1
        return plain(*args, **kwargs)
    return call
pathlib.Path.replace = counted(pathlib.Path.replace)
pathlib.Path.rename = counted(pathlib.Path.rename)
os.replace, os.unlink = counted(os.replace), counted(os.unlink)
from tests.sim_validate.datasets.test_build import CONFIG
from tests.sim_validate.datasets.engines import Here, silent
from sim_validate.datasets.build import build
build(CONFIG, pathlib.Path(sys.argv[1]), Here(), silent)
print("done")
"""


@pytest.mark.slow
def test_a_build_killed_at_any_step_of_its_end_goes_on(dataset, tmp_path):
    staged = tmp_path / "staged"

    def die(*_):
        raise KilledError

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(build_module, "finish", die)
        with pytest.raises(KilledError):
            build(CONFIG, staged, Here(), silent)
    killed = 0
    for step in range(200):
        folder = shutil.copytree(staged, tmp_path / f"at {step}")
        command = [sys.executable, "-c", KILL, str(folder), str(step)]
        ended = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=False)
        build(CONFIG, folder, Here(), silent)
        assert contents(folder) == contents(dataset)
        if ended.returncode == 0:
            break
        assert ended.returncode == 9
        killed += 1
    assert killed >= 10


def test_one_byte_changed_in_any_file_is_named(dataset, tmp_path):
    files = [path for path in contents(dataset) if path != "manifest.json"]
    assert len(files) >= 5
    for path in files:
        spoiled = shutil.copytree(dataset, tmp_path / "spoiled")
        data = bytearray((spoiled / path).read_bytes())
        if data:
            data[len(data) // 2] ^= 1
        else:
            data += b"x"
        (spoiled / path).write_bytes(bytes(data))
        assert any(path in fault for fault in verify(spoiled))
        (spoiled / path).unlink()
        assert f"{path}: missing" in verify(spoiled)
        shutil.rmtree(spoiled)


def forged(folder, name, change):
    """The same dataset with changed rows of one table, and hashes to match."""
    path = next(folder.glob(f"data/{name}/*.parquet"))
    rows = read_rows(path)
    change(rows)
    data = parquet_bytes(name, rows, {})
    path.write_bytes(data)
    manifest, name = read_manifest(folder), path.relative_to(folder).as_posix()
    others = [each for each in manifest.files if each.path != name]
    (entry,) = [each for each in manifest.files if each.path == name]
    changed = dataclasses.replace(
        entry, bytes=len(data), sha256=hashlib.sha256(data).hexdigest(), rows=len(rows)
    )
    write_manifest(folder, dataclasses.replace(manifest, files=(*others, changed)))


def untried(rows):
    rows[0].update(label="given", outcome="not_tried", held=None, trials=0)


def leaning(rows):
    """A normal that is not the surface's, with the margin it gives."""
    row = rows[0]
    normal = np.array(row["contact_normals"][0]) + np.array([0.1, 0.0, 0.05])
    row["contact_normals"][0] = (normal / np.linalg.norm(normal)).tolist()
    points, normals = row["contact_points_m"], row["contact_normals"]
    row["closure_margin"] = gc.force_closure(points, normals, row["friction"]).margin


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("grasps", lambda rows: rows[0].update(closure_margin=0.9), "closure margin"),
        (
            "grasps",
            lambda rows: rows[0]["contact_normals"][0].__setitem__(0, 2.0),
            "no unit vector",
        ),
        ("grasps", lambda rows: rows[0].update(held=not rows[0]["held"]), "its trials say"),
        ("grasps", lambda rows: rows[0].update(object_id="0" * 64), "its object is not there"),
        ("grasps", lambda rows: rows[0].update(force_closed=False), "force-closed is"),
        (
            "grasps",
            lambda rows: rows[0]["contact_points_m"].__setitem__(0, [1.0, 0.0, 0.0]),
            "not on the object",
        ),
        ("grasps", untried, "was not tried, but claims something"),
        ("grasps", lambda rows: rows[0].update(trials=0), "its trials say something else"),
        ("grasps", lambda rows: rows[0].update(friction=-1.0), "none of the configuration's"),
        ("grasps", lambda rows: rows[0].update(label="given", friction=-1.0), "cannot be asked"),
        ("grasps", lambda rows: rows[0].update(contacts=0), "are missing"),
        ("grasps", lambda rows: rows[0].update(closure_margin=None), "are missing"),
        ("grasps", lambda rows: rows[0].update(outcome="slipped"), "outcome 'slipped'"),
        ("grasps", leaning, "not with its normals"),
        ("grasps", lambda rows: rows[0].update(split="validation"), "rows of another split"),
        ("trials", lambda rows: rows.pop(), "its trials say something else"),
        ("trials", lambda rows: rows[0].update(grasp_id="nobody"), "nobody is no grasp"),
        ("trials", lambda rows: rows[0].update(outcome="slipped"), "its trials say something else"),
    ],
)
def test_rows_that_contradict_each_other_are_named(copy, name, change, message):
    forged(copy, name, len)
    assert verify(copy) == []
    forged(copy, name, change)
    assert any(message in fault for fault in verify(copy))


def test_all_of_it_comes_out_again(dataset):
    assert verify(dataset, Sample(1.0)) == []


def shifted(rows, column):
    row = next(row for row in rows if row[column])
    row[column] *= 1.0 + 1e-4


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("objects", lambda rows: shifted(rows, "volume_m3"), "volume_m3 is"),
        ("grasps", lambda rows: shifted(rows, "ferrari_canny_lower_n"), "ferrari_canny_lower_n is"),
        ("grasps", lambda rows: rows[0].update(family="pencil"), "family is pencil"),
        ("trials", lambda rows: rows[0].update(name="gravity"), "name is gravity"),
        ("trials", lambda rows: shifted(rows, "displacement_m"), "displacement_m is"),
    ],
)
def test_what_comes_out_otherwise_is_named(copy, name, change, message):
    forged(copy, name, change)
    assert verify(copy) == []
    faults = verify(copy, Sample(1.0))
    assert any(message in fault for fault in faults)


@pytest.mark.parametrize("change", [{"arithmetic": "another"}, {"versions": {"mujoco": "3.0.0"}}])
def test_with_other_rounding_verdicts_and_critical_frictions_count(copy, change):
    write_manifest(copy, dataclasses.replace(read_manifest(copy), **change))
    forged(copy, "trials", lambda rows: shifted(rows, "displacement_m"))
    forged(copy, "grasps", lambda rows: shifted(rows, "ferrari_canny_lower_n"))
    assert verify(copy, Sample(1.0)) == []
    forged(copy, "grasps", lambda rows: shifted(rows, "critical_friction"))
    faults = verify(copy, Sample(1.0))
    assert any("critical friction" in fault for fault in faults), faults


def test_a_grasp_that_was_left_out_is_named(copy):
    (first, *_) = all_rows(copy, "grasps")
    gone = first["grasp_id"]

    def kept(row):
        return gone not in (row["grasp_id"], row.get("control_of")) and not row[
            "grasp_id"
        ].startswith(f"{gone}:")

    for name in ("grasps", "trials"):
        forged(copy, name, lambda rows: rows.__setitem__(slice(None), list(filter(kept, rows))))
    assert verify(copy) == []
    assert any(gone in fault and "not there" in fault for fault in verify(copy, Sample(1.0)))


def test_objects_of_the_same_file_name_are_told_apart(tmp_path):
    for folder, sides in (("a", (0.04, 0.05, 0.06)), ("b", (0.04, 0.05, 0.07))):
        (tmp_path / folder).mkdir()
        trimesh.creation.box(extents=sides).export(tmp_path / folder / "model.obj")
    bad = tmp_path / "b" / "model.obj"
    bad.write_text(bad.read_text().rpartition("f ")[0])
    paths = (str(tmp_path / "a" / "model.obj"), str(bad))
    config = dataclasses.replace(CONFIG, objects=paths, frictions=(0.5,))
    built = build(config, tmp_path / "ds", Here(), silent)
    assert built.quarantined == 1
    assert verify(tmp_path / "ds", Sample(1.0)) == []
    forged(tmp_path / "ds", "trials", lambda rows: shifted(rows, "displacement_m"))
    assert any("displacement_m" in fault for fault in verify(tmp_path / "ds", Sample(1.0)))


def test_what_is_quarantined_has_no_rows(copy):
    (row, *_) = all_rows(copy, "objects")
    line = {"object": "x", "source_sha256": row["source_sha256"], "given": [], "reason": "no"}
    lines = [json.dumps(line | {"friction": friction}) for friction in CONFIG.frictions]
    path = copy / "quarantine.jsonl"
    path.write_text("\n".join(lines) + "\n")
    manifest = read_manifest(copy)
    kept = [each for each in manifest.files if each.path != path.name]
    files = (*kept, listed(copy, path))
    write_manifest(copy, dataclasses.replace(manifest, files=files, quarantined=2))
    assert sum("is quarantined, but has rows" in fault for fault in verify(copy, Sample(1.0))) == 2


def test_settings_that_are_not_the_manifests_are_named(copy):
    path = copy / "config.toml"
    path.write_text(path.read_text().replace("limit = 2", "limit = 3"))
    manifest = read_manifest(copy)
    kept = [each for each in manifest.files if each.path != path.name]
    files = (*kept, listed(copy, path))
    write_manifest(copy, dataclasses.replace(manifest, files=files))
    assert any("not the configuration" in fault for fault in verify(copy))


def test_a_larger_sample_holds_a_smaller_one():
    units = [(f"{i:064x}", 0.5) for i in range(100)]
    some, more = drawn(units, Sample(0.1, seed=3)), drawn(units, Sample(0.25, seed=3))
    assert (len(some), len(more)) == (10, 25)
    assert more[:10] == some
    assert drawn(units, Sample(0.1, seed=4)) != some
    assert len(drawn(units, Sample(0.001))) == 1


def test_scenes_are_written_on_request(dataset, tmp_path):
    config = dataclasses.replace(CONFIG, scenes=True, objects=("tetrahedron",), frictions=(0.5,))
    build(config, tmp_path / "ds", Here(), silent)
    assert verify(tmp_path / "ds", Sample(1.0)) == []
    rows = [row for row in all_rows(tmp_path / "ds", "grasps") if row["label"] == "grasp"]
    scenes = {path.stem: path for path in (tmp_path / "ds" / "scenes").iterdir()}
    assert rows
    assert sorted(scenes) == sorted(row["grasp_id"] for row in rows)
    for path in scenes.values():
        assert mujoco.MjModel.from_xml_string(path.read_text()).ngeom > 4
    assert not (dataset / "scenes").exists()


def test_many_rows_take_several_files(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "GROUP_ROWS", 5)
    monkeypatch.setattr(tables, "FILE_ROWS", 12)
    build(CONFIG, tmp_path / "ds", Here(), silent)
    assert verify(tmp_path / "ds") == []
    files = sorted((tmp_path / "ds" / "data" / "trials").glob("*.parquet"))
    assert len(files) > len(list((dataset / "data" / "trials").glob("*.parquet")))
    for name in ("objects", "grasps", "trials"):
        assert all_rows(tmp_path / "ds", name) == all_rows(dataset, name)


def test_a_dataset_is_loaded_as_arrays(dataset):
    tables = sim_validate.load_dataset(dataset)
    grasps = tables["grasps"]
    rows = all_rows(dataset, "grasps")
    count = len(rows)
    assert {len(column) for column in grasps.values()} == {count}
    assert grasps["contact_points_m"].shape == (count, 4, 3)
    assert grasps["contact_points_m"].dtype == np.float64
    for row, points, family in zip(rows, grasps["contact_points_m"], grasps["family"], strict=True):
        there = row["contacts"]
        np.testing.assert_array_equal(points[:there], row["contact_points_m"][:there])
        assert np.isnan(points[row["contacts"] :]).all()
        assert family == row["family"]
    parts = [sim_validate.load_dataset(dataset, part) for part in ("train", "validation", "test")]
    assert sum(len(part["trials"]["trial"]) for part in parts) == len(tables["trials"]["trial"])
    with pytest.raises(gc.InputError, match="expected one of"):
        sim_validate.load_dataset(dataset, "training")


def test_units_are_the_same_wherever_they_are_made():
    assert [unit.id for unit in units_of(CONFIG)] == [unit.id for unit in units_of(CONFIG)]
