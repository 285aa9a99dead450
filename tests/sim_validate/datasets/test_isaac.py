"""Isaac grasp files, read back by an independent reader, are compared with the dataset."""

import re
import shutil
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import grasp_core as gc
import sim_validate
from grasp_core.files.text_files import UNFINISHED
from grasp_core.objects.on_faces import nearest_on_surface
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets.config import SPLITS, SplitName
from sim_validate.datasets.isaac import export
from sim_validate.datasets.open_dataset import read_manifest, write_manifest
from sim_validate.files.output_folders import whole_folder
from sim_validate.main import main
from tests.sim_validate.datasets.engines import contents, silent
from tests.sim_validate.datasets.forging import forged

pytest.importorskip("pyarrow")


@pytest.fixture
def copy(small_dataset, tmp_path):
    return shutil.copytree(small_dataset, tmp_path / "copy")


def planned(dataset):
    """The grasps that are no controls, by their names."""
    grasps = sim_validate.load_dataset(dataset)["grasps"]
    chosen = np.flatnonzero(grasps["label"] == "grasp")
    return {grasps["grasp_id"][i]: {name: grasps[name][i] for name in grasps} for i in chosen}


def tips(grasp, posture):
    """Centres of fingertips in the object's frame, (4, 3)."""
    assert grasp["orientation"] == {"w": 1.0, "xyz": [0.0, 0.0, 0.0]}
    joints = grasp[posture]
    assert list(joints) == [f"finger{i}_{axis}" for i in range(4) for axis in "xyz"]
    assert all(isinstance(value, float) for value in joints.values())
    return np.array(grasp["position"]) + np.reshape(list(joints.values()), (4, 3))


def test_isaac_files_touch_where_the_tables_say_and_come_from_outside(small_dataset, tmp_path):
    """A tip's centre is a sum of three lengths below a metre: some 1e-16 of rounding."""
    yaml = pytest.importorskip("yaml")
    export(small_dataset, tmp_path / "out", None, silent)
    stored, compared = planned(small_dataset), 0
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
            mesh = small_dataset / "meshes" / f"{row['object_id']}.obj"
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
    assert compared == 3


def test_a_grasp_that_slipped_has_no_confidence(copy, tmp_path):
    yaml, slipped = pytest.importorskip("yaml"), []
    forged(copy, "grasps", lambda rows: [row.update(held=False, outcome="slipped") for row in rows])
    export(copy, tmp_path / "out", None, silent)
    for path in (tmp_path / "out").iterdir():
        grasps = yaml.safe_load(path.read_text(encoding="utf-8"))["grasps"].values()
        slipped += [grasp["confidence"] == 0.0 for grasp in grasps]
    assert sum(slipped) >= 1
    assert len(slipped) == 3


def test_the_same_bytes_come_again_and_with_the_splits_together_all_grasps(small_dataset, tmp_path):
    whole = export(small_dataset, tmp_path / "one", None, silent)
    assert whole.rows == {"objects": 3, "grasps": 3}
    assert export(small_dataset, tmp_path / "again", None, silent) == whole
    assert whole.files == len(contents(tmp_path / "one"))
    assert contents(tmp_path / "one") == contents(tmp_path / "again")
    parts = [
        export(small_dataset, tmp_path / split, split, silent).rows for split in get_args(SplitName)
    ]
    assert {name: sum(part[name] for part in parts) for name in whole.rows} == whole.rows
    assert sum(part["grasps"] > 0 for part in parts) >= 2
    labels = sim_validate.load_dataset(small_dataset)["grasps"]["label"]
    assert (labels != "grasp").sum() > whole.rows["grasps"]  # of which none is exported


@pytest.mark.parametrize(
    "text", ["../../etc/passwd", "x" * 400, 'a: [b]\n"c": !!python/object', "\x7f\u2028"]
)
def test_names_of_objects_are_harmless_in_names_of_files_and_in_yaml(copy, tmp_path, text):
    yaml = pytest.importorskip("yaml")
    forged(copy, "objects", lambda rows: rows[0].update(source_name=text))
    export(copy, tmp_path / "deep" / "out", None, silent)
    paths = list((tmp_path / "deep" / "out").iterdir())
    assert len(paths) == 3
    assert all(re.fullmatch(r"[0-9a-f]{16}-[\w.-]{1,140}\.yaml", path.name) for path in paths)
    assert sorted(p.name for p in (tmp_path / "deep").iterdir()) == ["out"]
    frames = [yaml.safe_load(path.read_text(encoding="utf-8"))["object_frame"] for path in paths]
    assert frames.count(text) == 1


def test_what_is_there_already_is_left_alone(small_dataset, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("all my work")
    for out in (mine, mine / "thesis.tex"):
        with pytest.raises(gc.InputError, match="not an empty folder"):
            export(small_dataset, out, None, silent)
    with pytest.raises(gc.InputError, match="inside the dataset to export"):
        export(small_dataset, small_dataset / "exports", None, silent)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert (mine / "thesis.tex").read_text() == "all my work"
    assert not (small_dataset / "exports").exists()
    (tmp_path / "empty").mkdir()
    assert export(small_dataset, tmp_path / "empty", None, silent).files == 3


def test_a_damaged_dataset_is_refused_and_leaves_nothing(copy, tmp_path):
    kept = {path: path.read_text() for path in (copy / "meshes").iterdir()}
    for path, text in kept.items():
        path.write_text(text.replace("v ", "v 0.001 0 0\nv ", 1))
    with pytest.raises(gc.InputError, match="another object"):
        export(copy, tmp_path / "out", None, silent)
    for path, text in kept.items():
        path.write_text(text)
    manifest = read_manifest(copy)
    more = [replace(each, rows=each.rows + 1) if each.table == "objects" else each
            for each in manifest.files]  # fmt: skip
    write_manifest(copy, replace(manifest, files=more))
    with pytest.raises(gc.InputError, match="rows, but the manifest lists"):
        export(copy, tmp_path / "out", None, silent)
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    with pytest.raises(IsADirectoryError), whole_folder(tmp_path / "out") as place:
        place.write_text("a")
    assert not list(tmp_path.iterdir())
    left = tmp_path / f".out{UNFINISHED}of-one-that-was-killed"
    left.mkdir()
    with whole_folder(tmp_path / "out") as other:
        assert not left.exists()
        with whole_folder(tmp_path / "out"):  # another command; the first one is still at work
            assert other.is_dir()
    with whole_folder(tmp_path / "deep" / "out") as place:
        (place / "all").write_text("a")
        assert not (tmp_path / "deep" / "out").exists()
    assert (tmp_path / "deep" / "out" / "all").read_text() == "a"


def test_the_command_says_what_it_wrote(small_dataset, tmp_path, answer, capsys):
    command = ["dataset", "export", str(small_dataset)]
    out = tmp_path / "out"
    assert answer(*command, "--to", "isaac", "--out", out) == {
        "dataset": str(small_dataset), "to": "isaac", "split": None, "out": str(out), "files": 3,
        "rows": {"objects": 3, "grasps": 3},
    }  # fmt: skip
    assert main([*command, "--out", str(out)]) == Exit.INPUT
    assert "not an empty folder" in capsys.readouterr().err
    assert main([*command, "--to", "pickle", "--out", str(tmp_path / "x")]) == Exit.USAGE
    assert main([*command, "--out", str(tmp_path / "x"), "--split", "all"]) == Exit.USAGE
    assert main(["dataset", "export", str(tmp_path), "--out", "x"]) == Exit.INPUT
    assert not (tmp_path / "x").exists()
    assert set(get_args(SplitName)) == {name for name, _ in SPLITS}
