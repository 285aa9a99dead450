"""Folders that are taken, have strange names, or hold what others or killed commands left."""

import json
import os
import shutil

import pytest

from grasp_core.files.text_files import UNFINISHED
from sim_validate.files.locks import LOCK
from sim_validate.files.output_folders import alone_in
from sim_validate.main import main
from tests.faults.conftest import contents

PLAN = ["plan", "tetrahedron", "--families", "concurrent", "-q"]


@pytest.mark.parametrize("below", ["", "out"])
@pytest.mark.parametrize("command", ["run", "plan"])
def test_a_file_in_place_of_a_folder_is_refused(command, below, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main([command, "tetrahedron", "-q", "--out", str(tmp_path / "file" / below)]) == 4
    assert "exists and is not a folder; give another --out" in capsys.readouterr().err
    assert contents(tmp_path) == {"file": b"mine"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a" * 255, "a\nb", os.fsdecode(b"\xff\xfe")])
def test_strange_names_are_names(name, tmp_path, capsys):
    folder = tmp_path / name
    assert main([*PLAN, "--out", str(folder)]) == 0
    assert main(["report", str(folder)]) == 0
    assert (folder / "report" / "index.html").is_file()
    assert all(line.isprintable() for line in capsys.readouterr().out.splitlines())


def test_a_folder_that_another_command_is_at_work_in_is_refused(tmp_path, capsys):
    with alone_in(tmp_path):
        for command in ([*PLAN], ["run", "tetrahedron", "-q"], ["report", str(tmp_path)]):
            asked = command if command[0] == "report" else [*command, "--out", str(tmp_path)]
            assert main(asked) == 4
            assert "another command is writing to it" in capsys.readouterr().err
    (tmp_path / LOCK).touch()  # as a killed command leaves it
    assert main([*PLAN, "--out", str(tmp_path)]) == 0
    assert set(contents(tmp_path)) == {"grasps.json"}


def test_only_folders_that_were_made_for_nothing_go_again(tmp_path):
    with alone_in(tmp_path / "new" / "deep"):
        assert (tmp_path / "new" / "deep").is_dir()
    assert tmp_path.is_dir()
    assert not (tmp_path / "new").exists()


def test_a_new_plan_removes_results_about_another_and_nothing_else(tmp_path):
    """Results about ids of people's own go as well; files that only end as results do stay."""
    out, grasps = str(tmp_path), tmp_path / "grasps.json"
    assert main([*PLAN, "--limit", "1", "--out", out]) == 0
    document = json.loads(grasps.read_text())
    document["grasps"][0]["id"] = "mine-1"
    grasps.write_text(json.dumps(document))
    assert main(["validate", str(grasps), "--traces", "-q", "--out", out]) == 0
    certify = ["regions", str(grasps), "--max-cones", "64", "-q"]
    assert main([*certify, "--out", out]) == 0
    assert main(["scene", str(grasps), "-q", "--out", str(tmp_path / "scenes")]) == 0
    results = {"traces/mine-1.npz", "proofs/mine-1.npz", "scenes/mine-1.xml"}
    own = {"traces/own.npz", "proofs/own.npz", "scenes/own.xml"}
    for name in own:
        (tmp_path / name).write_bytes(b"own")
    assert own | results < set(contents(tmp_path))
    assert main([*PLAN, "--out", out]) == 0
    assert set(contents(tmp_path)) == own | {"grasps.json"}


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planned")
    assert main([*PLAN, "--out", str(folder)]) == 0
    return folder / "grasps.json"


def test_what_a_killed_writer_left_goes_with_the_next_command(planned, tmp_path):
    for part in ("", "scenes", "report", "report/grasps"):
        (tmp_path / part).mkdir(exist_ok=True)
        (tmp_path / part / f".a.json{UNFINISHED}x7y.json").write_text("{")
        (tmp_path / part / f".report{UNFINISHED}x7y").mkdir()
        (tmp_path / part / f".report{UNFINISHED}x7y" / "index.html").write_text("half")
    shutil.copy(planned, tmp_path)
    (tmp_path / ".mine.json").write_text("{}")
    assert main(["scene", str(planned), "--out", str(tmp_path), "-q"]) == 0
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"grasps.json", "c-0-1-2-3.xml", ".mine.json"}
