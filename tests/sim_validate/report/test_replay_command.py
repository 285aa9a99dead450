"""Trials of verdicts and of rows of datasets, replayed from the command line."""

import json
import shutil
from dataclasses import replace
from functools import partial

import pytest

from grasp_core.provenance import versions
from sim_validate.closure.verdict import Verdicts
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.changing import slipped


@pytest.fixture(scope="module")
def folder(wedge_plan, tmp_path_factory):
    """A run with a task that is too much."""
    folder = tmp_path_factory.mktemp("run")
    task = {"wrenches": [{"name": "too much", "force_n": [0, 0, 90]}]}
    (folder / "task.json").write_text(json.dumps(task))
    grasps = shutil.copy(wedge_plan, folder)
    trials = ("--wrenches", str(folder / "task.json"), "--seed", "3", "--repeats", "2")
    words = ["validate", str(grasps), "--limit", "1", *trials, "--out", str(folder), "-q"]
    assert main(words) == Exit.NEGATIVE
    return folder


@pytest.fixture
def replay(answer):
    return partial(answer, "replay")


def verdicts_in(folder):
    return json.loads((folder / "verdicts.json").read_text())["verdicts"]


def test_verdicts_their_controls_and_repeats(folder, replay):
    verdict = verdicts_in(folder)[0]
    found = replay(folder, "--grasp", verdict["id"])
    assert (found["wrench"], found["recorded_outcome"]) == ("too much", "slipped")
    for trial in verdict["wrenches"][:3]:
        found = replay(
            folder / "verdicts.json", "--grasp", verdict["id"], "--wrench", trial["name"]
        )
        for key in ("outcome", "displacement_m", "predicted_limit", "required_friction"):
            assert found[key] == trial[key]
        assert found["recorded_outcome"] == trial["outcome"]
    control, repeat = verdict["controls"][0], verdict["robustness"]["trials"][0]
    found = replay(folder, "--grasp", verdict["id"], "--control", control["name"])
    assert found["name"] == f"{verdict['id']}:{control['name']}"
    assert found["displacement_m"] == control["trials"][0]["displacement_m"]
    assert found["recorded_outcome"] == control["trials"][0]["outcome"]
    found = replay(folder, "--grasp", verdict["id"], "--trial", repeat["number"])
    assert found["recorded_outcome"] == repeat["outcome"]


def test_files_are_written(folder, replay, tmp_path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "no-such-library")
    name = verdicts_in(folder)[0]["id"]
    found = replay(folder, "--grasp", name, "--out", tmp_path / "new")
    files = {path.name for path in (tmp_path / "new").iterdir()}
    assert files == {"scene.xml", "trace.csv"}
    assert len(found["files"]) == 2
    rows = (tmp_path / "new" / "trace.csv").read_text().splitlines()
    head = rows[0].split(",")
    assert head[:4] == ["time_s", "displacement_m", "shift_m", "rotation_rad"]
    assert len(head) == 12
    largest = max(float(row.split(",")[1]) for row in rows[1:])
    # the file has the whole trial, the verdict is known before
    assert len(rows) == 1 + 40
    assert largest >= found["displacement_m"] > 0.0


def test_a_trial_that_ends_otherwise_than_recorded_is_negative(folder, tmp_path, replay):
    found = Verdicts.read(folder / "verdicts.json")
    found = replace(found, verdicts=(slipped(found[0]), *found.verdicts[1:]))
    (tmp_path / "verdicts.json").write_text(found.text())
    name = found[0].id
    flags = ("--grasp", name, "--wrench", "+force_x")
    found = replay(tmp_path, *flags, "--grasps", folder / "grasps.json", code=Exit.NEGATIVE)
    assert (found["outcome"], found["recorded_outcome"]) == ("held", "slipped")


def test_another_version_of_the_simulator_is_named(folder, tmp_path, capsys):
    found, here = Verdicts.read(folder / "verdicts.json"), versions()["mujoco"]
    words = ["replay", str(tmp_path), "--grasps", str(folder / "grasps.json")]
    for version in (here, "3.1.0"):
        written = replace(found, gate=replace(found.gate, mujoco=version))
        (tmp_path / "verdicts.json").write_text(written.text())
        assert main([*words, "--grasp", found[0].id]) == Exit.GOOD
        told = f"(the file says slipped, by MuJoCo 3.1.0; here: {here})"
        assert (told in capsys.readouterr().out) == (version != here)


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (("--grasp", "no"), "no grasp is named no; the file has "),
        (("--grasp", "FIRST", "--control", "no"), "has no negative control 'no'; choose from "),
        (("--grasp", "FIRST", "--trial", "0", "--control", "x"), "give only one of them"),
    ],
)
def test_what_is_not_there_is_named(folder, capsys, flags, message):
    first = verdicts_in(folder)[0]["id"]
    flags = [first if flag == "FIRST" else flag for flag in flags]
    assert main(["replay", str(folder), *flags]) == Exit.INPUT
    assert message in capsys.readouterr().err


def test_grasps_of_another_object_are_refused(folder, bracket_plan, capsys):
    other = str(bracket_plan)
    assert main(["replay", str(folder), "--grasp", "x", "--grasps", other]) == Exit.INPUT
    assert "are on another object" in capsys.readouterr().err


def test_other_contacts_under_the_same_id_are_refused(folder, tmp_path, capsys):
    found = Verdicts.read(folder / "verdicts.json")
    first = replace(found[0], contacts=found[0].contacts[::-1])
    path = tmp_path / "verdicts.json"
    path.write_text(replace(found, verdicts=(first,)).text())
    grasps = str(folder / "grasps.json")
    assert main(["replay", str(path), "--grasp", first.id, "--grasps", grasps]) == Exit.INPUT
    assert "have changed since these results" in capsys.readouterr().err
