"""Every format is read back by an independent reader and compared with the dataset cell by cell."""

import csv
import hashlib
import json
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args

import mujoco
import numpy as np
import pytest
import trimesh

import grasp_core as gc
import sim_validate
from grasp_core.geometry.nearest_points import nearest_on_surface
from sim_validate.cli.exit_codes import Exit
from sim_validate.datasets.building.build import build
from sim_validate.datasets.columns import TABLES, ExportFormat, SplitName
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.exports.formats import EXPORTERS, export
from sim_validate.datasets.exports.isaac import yaml_number
from sim_validate.datasets.object_rows import SPLITS
from sim_validate.files.writing import whole_folder
from sim_validate.main import main
from tests.sim_validate.datasets.engines import Here, silent
from tests.sim_validate.datasets.forging import forged

ROOT = Path(__file__).parents[3]

pytest.importorskip("pyarrow")
FORMATS = tuple(EXPORTERS)
SHAPED = {
    "center_of_mass_m": ["x", "y", "z"],
    "faces": ["0", "1", "2", "3"],
    "contact_points_m": [f"{i}_{a}" for i in range(4) for a in "xyz"],
    "contact_normals": [f"{i}_{a}" for i in range(4) for a in "xyz"],
    "wrench_n_nm": ["fx", "fy", "fz", "tx", "ty", "tz"],
    "slip_m": ["0", "1", "2", "3"],
    "region_radii_m": ["0", "1", "2", "3"],
}
"""What CSV calls the numbers of a cell."""
ODD_NAME = "=cmd|' \"\u00e9\n.stl"


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Two built-in objects in different splits, and a file with a name that means harm."""
    folder = tmp_path_factory.mktemp("made")
    box = trimesh.creation.box(extents=(0.04, 0.05, 0.06))
    (folder / ODD_NAME).write_bytes(trimesh.exchange.stl.export_stl(box))
    config = DatasetConfig(
        objects=("tetrahedron", "wedge", str(folder / ODD_NAME)),
        frictions=(0.4, 0.5),
        families=("concurrent",),
        limit=1,
        seed=5,
        scenes=True,
        license="CC-BY-4.0",
    )
    built = build(config, folder / "ds", Here(), silent)
    assert (built.units, built.quarantined) == (6, 0)
    return folder / "ds"


@pytest.fixture
def copy(dataset, tmp_path):
    return shutil.copytree(dataset, tmp_path / "copy")


def hashes(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def planned(dataset):
    """The grasps that are no controls, by their names."""
    grasps = sim_validate.load_dataset(dataset)["grasps"]
    chosen = np.flatnonzero(grasps["label"] == "grasp")
    return {grasps["grasp_id"][i]: {name: grasps[name][i] for name in grasps} for i in chosen}


def cells(dataset):
    """How many plain values all tables hold, nulls too."""
    tables = sim_validate.load_dataset(dataset).values()
    return sum(array.size for table in tables for array in table.values())


def same(found, stored, kind):
    """Whether a value that was read is the one of the arrays, where null is NaN, -1 or None."""
    if kind == "float":
        return math.isnan(stored) if found is None else found == stored
    if kind == "int":
        return (-1 if found is None else found) == stored
    return found == stored


def from_csv(text, kind):
    """A cell of a CSV file as a value."""
    if kind == "text":
        return text.removeprefix("'")
    if not text:
        return None
    return {"float": float, "int": int, "bool": {"true": True, "false": False}.__getitem__}[kind](
        text
    )


def test_csv_has_every_cell(dataset, tmp_path):
    export(dataset, "csv", tmp_path / "out", None, silent)
    compared = 0
    for name, table in sim_validate.load_dataset(dataset).items():
        with (tmp_path / "out" / f"{name}.csv").open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        for column in TABLES[name]:
            parts = [column.name]
            if column.shape:
                parts = [f"{column.name}_{part}" for part in SHAPED[column.name]]
            assert len(table[column.name]) == len(rows)
            for row, stored in zip(rows, table[column.name], strict=True):
                flat = np.ravel(stored)
                for part, value in zip(parts, flat, strict=True):
                    found = from_csv(row.pop(part), column.kind)
                    assert same(found, "" if value is None else value, column.kind)
                    compared += 1
        assert not any(rows)
    assert compared == cells(dataset) > 1000


def test_json_lines_have_every_cell_and_null_where_it_is_missing(dataset, tmp_path):
    export(dataset, "jsonl", tmp_path / "out", None, silent)
    compared, nulls = 0, 0
    for name, table in sim_validate.load_dataset(dataset).items():
        lines = (tmp_path / "out" / f"{name}.jsonl").read_text().splitlines()
        for number, line in enumerate(lines):
            row = json.loads(line)
            assert list(row) == [column.name for column in TABLES[name]]
            for column in TABLES[name]:
                stored = np.ravel(table[column.name][number])
                value = row[column.name]
                flat = [None] * stored.size if value is None else np.array(value, object).ravel()
                for found, expected in zip(flat, stored, strict=True):
                    assert same(found, expected, column.kind)
                    compared += 1
                    nulls += found is None
        assert len(lines) == len(table[TABLES[name][0].name])
    assert compared == cells(dataset)
    assert nulls > 100
    about = json.loads((tmp_path / "out" / "about.json").read_text())
    assert about["dataset"]["license"] == "CC-BY-4.0"
    units = {each["name"]: each["unit"] for each in about["columns"]["trials"]}
    assert units["slip_m"] == "m"


def compare_arrays(read, dataset):
    """Compare arrays with those of the dataset, where `read` gives one; how many cells were."""
    compared = 0
    for name, table in sim_validate.load_dataset(dataset).items():
        for column in TABLES[name]:
            stored, found = table[column.name], read(name, column)
            if column.kind == "text":
                stored = ["" if value is None else value for value in stored]
            assert found.shape == np.shape(stored)
            np.testing.assert_array_equal(found, stored)
            compared += found.size
    return compared


def test_archives_have_every_cell_and_no_pickle(dataset, tmp_path):
    export(dataset, "npz", tmp_path / "out", None, silent)
    kinds = {"text": "U", "bool": "i", "int": "i", "float": "f"}

    def read(name, column):
        with np.load(tmp_path / "out" / f"{name}.npz", allow_pickle=False) as archive:
            assert set(archive.files) == {each.name for each in TABLES[name]}
            array = archive[column.name]
        assert array.dtype.kind == kinds[column.kind]
        return array

    assert compare_arrays(read, dataset) == cells(dataset)


def test_hdf5_has_every_cell_with_its_unit_and_meaning(dataset, tmp_path):
    h5py = pytest.importorskip("h5py")
    export(dataset, "hdf5", tmp_path / "out", None, silent)
    (path,) = (tmp_path / "out").iterdir()
    with h5py.File(path) as file:
        assert file.attrs["license"] == "CC-BY-4.0"
        assert re.fullmatch(r"[0-9a-f]{64}", file.attrs["config_sha256"])
        assert set(file) == set(TABLES)
        assert all(set(file[name]) == {c.name for c in TABLES[name]} for name in TABLES)

        def read(name, column):
            there = file[name][column.name]
            assert there.attrs["meaning"] == column.meaning
            assert there.attrs.get("unit", "") == column.unit
            return there.asstr()[...] if column.kind == "text" else there[...]

        assert compare_arrays(read, dataset) == cells(dataset)


def tips(grasp, posture):
    """Centres of fingertips in the object's frame, (4, 3)."""
    assert grasp["orientation"] == {"w": 1.0, "xyz": [0.0, 0.0, 0.0]}
    joints = grasp[posture]
    assert list(joints) == [f"finger{i}_{axis}" for i in range(4) for axis in "xyz"]
    assert all(isinstance(value, float) for value in joints.values())
    return np.array(grasp["position"]) + np.reshape(list(joints.values()), (4, 3))


def test_isaac_files_touch_where_the_tables_say_and_come_from_outside(dataset, tmp_path):
    """A tip's centre is a sum of three lengths below a metre: some 1e-16 of rounding."""
    yaml = pytest.importorskip("yaml")
    export(dataset, "isaac", tmp_path / "out", None, silent)
    stored, compared = planned(dataset), 0
    bodies = {}
    for path in (tmp_path / "out").iterdir():
        text = path.read_text(encoding="utf-8")
        file = yaml.safe_load(text)
        assert list(file) == ["format", "format_version", "object_frame", "gripper_frame", "grasps"]
        assert (file["format"], file["format_version"]) == ("isaac_grasp", 1.0)
        radius = float(re.search(r"radius ([^ ]+) m", text).group(1))
        short, friction = path.name.split("-")[:2]
        for name, grasp in file["grasps"].items():
            row = stored.pop(f"{short}-{friction}-{name}")
            assert row["friction"] == float(friction)
            assert set(grasp) == {
                "confidence", "position", "orientation", "cspace_position",
                "pregrasp_cspace_position",
            }  # fmt: skip
            assert grasp["confidence"] == float(row["held"])
            mesh = dataset / "meshes" / f"{row['object_id']}.obj"
            body = bodies.setdefault(mesh, gc.load_polyhedron(mesh))
            touch = tips(grasp, "cspace_position")
            np.testing.assert_allclose(
                touch + radius * row["contact_normals"], row["contact_points_m"], atol=1e-15, rtol=0
            )
            away = tips(grasp, "pregrasp_cspace_position")
            for centers, least in ((touch, radius * (1 - 1e-6)), (away, 1.2 * radius)):
                nearest = nearest_on_surface(body.vertices, body.triangles, centers)
                assert (np.linalg.norm(nearest - centers, axis=1) >= least).all()
            compared += 1
    assert not stored
    assert compared == 6


def test_a_grasp_that_slipped_has_no_confidence(copy, tmp_path):
    yaml = pytest.importorskip("yaml")

    def slip(rows):
        for row in rows:
            row["held"] = False

    forged(copy, "grasps", slip)
    export(copy, "isaac", tmp_path / "out", None, silent)
    found = [
        grasp["confidence"]
        for path in (tmp_path / "out").iterdir()
        for grasp in yaml.safe_load(path.read_text(encoding="utf-8"))["grasps"].values()
    ]
    assert found.count(0.0) >= 2
    assert len(found) == 6


@pytest.mark.parametrize("value", [1e-05, -1e-300, 1e22, 0.1, -0.0, 1.5e-7, 123456.0])
def test_numbers_are_numbers_in_yaml(value):
    yaml = pytest.importorskip("yaml")
    found = yaml.safe_load(yaml_number(value))
    assert isinstance(found, float)
    assert found == value


def test_scenes_are_those_of_the_simulation_and_their_keyframes_do_what_they_say(dataset, tmp_path):
    done = export(dataset, "mjcf", tmp_path / "out", None, silent)
    assert done.rows == {"objects": 3, "grasps": 6}
    names = [path.name for path in sorted((dataset / "scenes").iterdir())]
    assert names == sorted(path.name for path in (tmp_path / "out").iterdir())
    assert {name.removesuffix(".xml") for name in names} == set(planned(dataset))
    for name in names:
        text = (tmp_path / "out" / name).read_text(encoding="utf-8")
        built = (dataset / "scenes" / name).read_text(encoding="utf-8")
        assert without_name(text) == without_name(built)
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        for key, least, most in (
            ("pregrasp", 1e-3, 1.0),
            ("grasp", -1e-10, 0.0),
        ):  # they press a little
            mujoco.mj_resetDataKeyframe(model, data, model.key(key).id)
            mujoco.mj_forward(model, data)
            apart = [
                mujoco.mj_geomDistance(
                    model, data, model.geom(f"finger{i}").id, model.geom(f"pad{i}").id, 1.0, None
                )
                for i in range(4)
            ]
            assert least < min(apart) <= max(apart) < most


def without_name(text):
    """A scene but for its title, which is the file's name where the dataset had the object's."""
    assert text.startswith("<mujoco model=")
    return text.partition(">")[2]


def test_the_same_bytes_come_again_and_with_the_splits_together_all_rows(dataset, tmp_path):
    whole = {}
    for to in FORMATS:
        whole[to] = export(dataset, to, tmp_path / to, None, silent)
        again = export(dataset, to, tmp_path / f"{to}-again", None, silent)
        assert again == whole[to]
        assert again.files == len(hashes(tmp_path / to))
        assert hashes(tmp_path / to) == hashes(tmp_path / f"{to}-again")
        parts = [
            export(dataset, to, tmp_path / f"{to}-{split}", split, silent)
            for split in get_args(SplitName)
        ]
        for name, count in whole[to].rows.items():
            assert sum(part.rows[name] for part in parts) == count > 0
        assert sum(part.rows["grasps"] > 0 for part in parts) >= 2
    assert whole["isaac"].rows["grasps"] < whole["csv"].rows["grasps"]


def test_controls_are_in_tables_and_in_nothing_to_be_grasped_with(dataset, tmp_path):
    labels = sim_validate.load_dataset(dataset)["grasps"]["label"]
    assert (labels != "grasp").sum() > 6
    counts = {to: export(dataset, to, tmp_path / to, None, silent).rows["grasps"] for to in FORMATS}
    assert counts == {to: 6 if to in ("isaac", "mjcf") else len(labels) for to in FORMATS}


EVIL = ("=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n", "\x00=1", "\uff1d1", "'=1", "'", "")


@pytest.mark.parametrize("text", EVIL)
def test_no_cell_is_a_formula_and_none_is_changed(copy, tmp_path, text):
    forged(copy, "objects", lambda rows: rows[0].update(source_name=text))
    export(copy, "csv", tmp_path / "out", None, silent)
    with (tmp_path / "out" / "objects.csv").open(newline="", encoding="utf-8") as stream:
        found = [row["source_name"] for row in csv.DictReader(stream)]
    assert len(found) == 3
    assert text in [cell.removeprefix("'") for cell in found]
    for cell in found:
        assert not cell or cell[0].isalnum() or cell[0] == "'"


NAMES = (
    "../../etc/passwd",
    ".hidden",
    "a/b\\c",
    "..",
    "x" * 400,
    'a: [b]\n"c": !!python/object',
    "",
)


@pytest.mark.parametrize("text", [*NAMES, "\x7f\u2028\U0001f600"])
def test_names_of_objects_are_harmless_in_names_of_files_and_in_yaml(copy, tmp_path, text):
    yaml = pytest.importorskip("yaml")
    forged(copy, "objects", lambda rows: rows[0].update(source_name=text))
    export(copy, "isaac", tmp_path / "deep" / "out", None, silent)
    paths = list((tmp_path / "deep" / "out").iterdir())
    assert len(paths) == 6
    assert all(re.fullmatch(r"[0-9a-f]{16}-[\w.-]{1,140}\.yaml", path.name) for path in paths)
    assert sorted(p.name for p in (tmp_path / "deep").iterdir()) == ["out"]
    frames = [yaml.safe_load(path.read_text(encoding="utf-8"))["object_frame"] for path in paths]
    assert frames.count(text) == 2


def test_two_grasps_are_not_written_to_one_file(copy, tmp_path):
    def rename(rows):
        own = [row for row in rows if row["label"] == "grasp"]
        for row, name in zip(own, ("a/b", "a_b"), strict=False):
            row["grasp_id"] = name

    forged(copy, "grasps", rename)
    with pytest.raises(gc.InputError, match=r"the same file name, a_b\.xml"):
        export(copy, "mjcf", tmp_path / "out", None, silent)
    assert not (tmp_path / "out").exists()


def test_what_is_there_already_is_left_alone(dataset, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("all my work")
    for to in FORMATS:
        for out in (mine, mine / "thesis.tex"):
            with pytest.raises(gc.InputError, match="not an empty folder"):
                export(dataset, to, out, None, silent)
        with pytest.raises(gc.InputError, match="inside the dataset to export"):
            export(dataset, to, dataset / "exports" / to, None, silent)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert (mine / "thesis.tex").read_text() == "all my work"
    assert not (dataset / "exports").exists()
    (tmp_path / "empty").mkdir()
    assert export(dataset, "csv", tmp_path / "empty", None, silent).files == 4


def test_a_damaged_dataset_is_refused_and_leaves_nothing(copy, tmp_path):
    for path in sorted((copy / "meshes").iterdir())[1:]:
        path.write_text(path.read_text().replace("v ", "v 0.001 0 0\nv ", 1))
    for to in ("isaac", "mjcf"):
        with pytest.raises(gc.InputError, match="another object"):
            export(copy, to, tmp_path / "out", None, silent)
    for path in copy.glob("data/trials/*.parquet"):
        data = bytearray(path.read_bytes())
        data[len(data) // 3] ^= 1
        path.write_bytes(bytes(data))
    for to in ("csv", "jsonl", "npz", "hdf5"):
        with pytest.raises(gc.InputError):
            export(copy, to, tmp_path / "out", None, silent)
    (copy / "manifest.json").unlink()
    with pytest.raises(gc.InputError, match="expected a finished dataset"):
        export(copy, "csv", tmp_path / "out", None, silent)
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]


def test_fewer_rows_than_listed_are_noticed(copy, tmp_path):
    (listed,) = [
        each for each in json.loads((copy / "manifest.json").read_text())["files"]
        if each.get("table") == "objects" and each["split"] == "train"
    ]  # fmt: skip
    text = (copy / "manifest.json").read_text()
    wrong = text.replace(f'"rows": {listed["rows"]},', f'"rows": {listed["rows"] + 1},')
    (copy / "manifest.json").write_text(wrong)
    with pytest.raises(gc.InputError, match="rows, but the manifest lists"):
        export(copy, "csv", tmp_path / "out", None, silent)


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    def stop_halfway():
        with whole_folder(tmp_path / "out") as place:
            (place / "half").write_text("a")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop_halfway()
    assert not list(tmp_path.iterdir())
    with whole_folder(tmp_path / "deep" / "out") as place:
        (place / "all").write_text("a")
        assert not (tmp_path / "deep" / "out").exists()
    assert (tmp_path / "deep" / "out" / "all").read_text() == "a"


KILLED = """
import os, sys
from pathlib import Path
from sim_validate.files.writing import whole_folder
with whole_folder(Path(sys.argv[1])) as place:
    (place / "half").write_text("a")
    os._exit(9)
"""


def test_what_a_killed_writer_of_a_folder_left_goes_when_it_is_written_again(tmp_path):
    subprocess.run([sys.executable, "-c", KILLED, tmp_path / "out"], cwd=ROOT, check=False)
    (left,) = tmp_path.iterdir()
    with whole_folder(tmp_path / "out") as other:
        assert not left.exists()
        with whole_folder(tmp_path / "out"):  # another command; the first one is still at work
            assert other.is_dir()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(("package", "extra"), [("h5py", "hdf5"), ("pyarrow", "dataset")])
def test_what_is_not_installed_is_named_with_its_extra(
    dataset, tmp_path, monkeypatch, package, extra
):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(gc.InputError, match=rf"graspproof\[{extra}\]"):
        export(dataset, "hdf5", tmp_path / "out", None, silent)
    assert not list(tmp_path.iterdir())


def test_the_command_says_what_it_wrote(dataset, tmp_path, capsys):
    command = ["dataset", "export", str(dataset), "--to"]
    out = tmp_path / "out"
    assert main([*command, "csv", "--out", str(out), "--json"]) == Exit.GOOD
    said = json.loads(capsys.readouterr().out)
    tables = sim_validate.load_dataset(dataset)
    rows = {name: len(tables[name][columns[0].name]) for name, columns in TABLES.items()}
    assert said == {
        "dataset": str(dataset), "to": "csv", "split": None, "out": str(out), "files": 4,
        "rows": rows,
    }  # fmt: skip
    assert main([*command, "csv", "--out", str(out)]) == Exit.INPUT
    assert "not an empty folder" in capsys.readouterr().err
    assert main([*command, "pickle", "--out", str(tmp_path / "x")]) == Exit.USAGE
    assert main([*command, "csv", "--out", str(tmp_path / "x"), "--split", "all"]) == Exit.USAGE
    assert main(["dataset", "export", str(tmp_path), "--to", "npz", "--out", "x"]) == Exit.INPUT
    assert not (tmp_path / "x").exists()


def test_the_flags_name_what_there_is():
    assert set(get_args(ExportFormat)) == set(FORMATS)
    assert set(get_args(SplitName)) == {name for name, _ in SPLITS}
