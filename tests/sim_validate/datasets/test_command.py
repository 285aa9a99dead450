"""Datasets from the command line."""

import contextlib
import json
import re
import shutil

import numpy as np
import pytest

import sim_validate as sv
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.datasets.engines import contents, here

pytest.importorskip("pyarrow")
LIGHT = ("--frictions", "0.5", "--families", "concurrent", "--limit", "1")
OBJECTS = ("tetrahedron", "wedge")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "ds"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sim_validate.datasets.clusters.local_processes", here)
        words = ["dataset", "build", *OBJECTS, *LIGHT, "--out", str(folder), "-q"]
        assert main(words) == Exit.GOOD
    return folder


def test_a_dataset_is_made_and_nothing_is_wrong_with_it(dataset, answer):
    assert answer("dataset", "verify", dataset) == {"dataset": str(dataset), "faults": []}


@pytest.mark.usefixtures("built_here")
def test_a_build_tells_where_the_time_went(tmp_path, spent, capsys):
    words = ["dataset", "build", "tetrahedron", *LIGHT, "--out", str(tmp_path / "ds"), "-v"]
    assert main(words) == Exit.GOOD
    assert capsys.readouterr().err.splitlines()[-1].startswith("time: ")
    assert list(spent) == ["planning", "analysis", "scenes", "stepping", "files"]
    assert min(spent.values()) > 0.0


def test_a_build_says_how_many_objects_each_split_has(dataset, capsys):
    assert main(["dataset", "build", *OBJECTS, *LIGHT, "--out", str(dataset)]) == Exit.GOOD
    last = capsys.readouterr().out.splitlines()[-1]
    found = re.fullmatch(r"train (\d), validation (\d), test (\d) objects", last)
    counts = dict(zip(("train", "validation", "test"), map(int, found.groups()), strict=True))
    assert sum(counts.values()) == 2
    for split, count in counts.items():
        warned = contextlib.nullcontext() if count else pytest.warns(UserWarning, match=last)
        with warned:
            grasps = sv.load_dataset(dataset, split)["grasps"]
        assert len(set(grasps["object_id"])) == count
        assert grasps["held"].dtype == bool
    assert 0 in counts.values()


def test_the_trials_of_its_rows_are_replayed(dataset, answer):
    tables = sv.load_dataset(dataset)
    grasps, trials = tables["grasps"], tables["trials"]
    for name, outcome in list(zip(grasps["grasp_id"], grasps["outcome"], strict=True))[:3]:
        found = answer("replay", dataset, "--grasp", name)
        (row,) = np.flatnonzero((trials["grasp_id"] == name) & (trials["name"] == found["wrench"]))
        assert found["outcome"] == trials["outcome"][row]
        assert found["displacement_m"] == trials["displacement_m"][row]
        assert found["recorded_outcome"] == outcome


def test_a_changed_file_is_named(dataset, tmp_path, capsys):
    spoiled = shutil.copytree(dataset, tmp_path / "ds")
    path = next(spoiled.glob("data/trials/*.parquet"))
    path.write_bytes(path.read_bytes()[:-1] + b"!")
    assert main(["dataset", "verify", str(spoiled)]) == Exit.NEGATIVE
    assert path.name in capsys.readouterr().err


@pytest.mark.usefixtures("built_here")
def test_a_toml_file_says_the_same_as_flags(dataset, tmp_path):
    settings = tmp_path / "ds.toml"
    settings.write_text((dataset / "config.toml").read_text())
    folder = tmp_path / "ds"
    assert main(["dataset", "build", str(settings), "--out", str(folder), "-q"]) == Exit.GOOD
    assert contents(folder) == contents(dataset)
    again = ["dataset", "build", str(settings), "--limit", "3", "--out", str(tmp_path / "x")]
    assert main(again) == Exit.INPUT


@pytest.mark.usefixtures("built_here")
def test_a_bad_mesh_is_left_out_and_said(tmp_path, capsys):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "bad.stl").write_text("solid nothing")
    names = ["tetrahedron", str(tmp_path / "meshes"), *LIGHT]
    code = main(["dataset", "build", *names, "--out", str(tmp_path / "ds")])
    assert code == Exit.PARTIAL
    said = capsys.readouterr()
    assert "quarantine.jsonl" in said.err
    assert f"will hold the path {tmp_path / 'meshes' / 'bad.stl'}" in " ".join(said.err.split())
    assert "2 units (2 made now, 0 before): 1 with rows, 1 quarantined; 1 object," in said.out
    (line,) = (tmp_path / "ds" / "quarantine.jsonl").read_text().splitlines()
    assert json.loads(line)["object"].endswith("bad.stl")
