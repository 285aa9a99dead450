"""What the flags of `validate` and `run` put into a verdict."""

import json
import re

import numpy as np
import pytest

from grasp_core.time_spent import TIME_SPENT
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.processes import workers

TASK = '{"wrenches": [{"name": "lift", "force_n": [0, 0, -3], "torque_n_m": [0, 0.01, 0]}]}'


@pytest.fixture
def planned(wedge_plan, tmp_path, monkeypatch):
    """A folder with the plan of the wedge, and a task."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grasps.json").write_text(wedge_plan.read_text())
    (tmp_path / "task.json").write_text(TASK)
    return tmp_path


@pytest.fixture
def verdict(planned, answer):
    """Validates with flags; answers with the one verdict."""

    def validated(*flags, code=Exit.GOOD):
        asked = ["validate", planned / "grasps.json", "--limit", "1", *flags]
        (found,) = answer(*asked, code=code)["verdicts"]
        return found

    return validated


def by_name(verdict):
    return {trial["name"]: trial for trial in verdict["wrenches"]}


def test_a_task_and_weights_are_held_as_they_are(verdict):
    held = by_name(
        verdict("--wrenches", "task.json", "--weight-n", "2", "--weight-down", "0", "3", "0")
    )
    assert held["lift"]["wrench"] == [0, 0, -3, 0, 0.01, 0]
    assert held["weight_0"]["wrench"] == [0, 2, 0, 0, 0, 0]
    assert len(held) == 15
    assert held["lift"]["predicted_limit"] > 1.0


def test_a_task_too_heavy_for_the_grasp_makes_it_fail(verdict):
    found = verdict("--weight-n", "60", "--weight-down", "0", "0", "-1", code=Exit.NEGATIVE)
    trial = by_name(found)["weight_0"]
    assert found["held"] is False
    assert trial["predicted_limit"] < 1.0
    assert trial["outcome"] in {"slipped", "lost_contact"}
    assert found["mismatches"] == []


def test_traces_tell_how_contacts_moved(planned):
    command = ["validate", "grasps.json", "--limit", "1", "--traces", "--out", "v", "-q"]
    assert main(command) == Exit.GOOD
    (path,) = (planned / "v" / "traces").iterdir()
    (verdict,) = json.loads((planned / "v" / "verdicts.json").read_text())["verdicts"]
    with np.load(path) as traces:
        for name, trial in by_name(verdict).items():
            moved = traces[f"{name}.displacements_m"]
            assert moved.shape == traces[f"{name}.times_s"].shape
            assert moved.max() == pytest.approx(trial["displacement_m"])
            assert traces[f"{name}.slips_m"].shape == (len(moved), 4)
        assert any("separating" in name for name in traces.files)


def test_a_simulator_that_is_unfaithful_is_refused_with_its_figures(planned, capsys):
    (planned / "setup.toml").write_text('[physics]\ncone = "pyramidal"\n')
    before = sorted(planned.rglob("*"))
    command = ["validate", "grasps.json", "--setup", "setup.toml", "--out", "v"]
    assert main(command) == Exit.INTERNAL
    complaint = capsys.readouterr().err
    assert "slope at which a box slides" in complaint
    assert "0.995 to 1.005" in complaint
    assert sorted(planned.rglob("*")) == before


@pytest.mark.usefixtures("planned")
def test_flags_that_make_no_sense_are_refused_before_anything_runs(capsys):
    for flags, said in (
        ("--weight-down 0 0 -1", "give the weight with --weight-n too"),
        ("--traces", "with --out DIR too"),
        ("--weight-n 1 --weight-down 0 0 0", "zero"),
    ):
        assert main(["validate", "grasps.json", *flags.split()]) == Exit.USAGE
        assert said in capsys.readouterr().err


def test_a_run_that_is_refused_leaves_earlier_results_and_scenes_as_they_were_simulated(planned):
    (planned / "pyramids.toml").write_text('[physics]\ncone = "pyramidal"\n')
    (planned / "tips.toml").write_text("[fingers]\nfingertip_radius_m = 0.004\n")
    run = ["run", "tetrahedron", "--limit", "1", "--out", "r", "-q", "--no-report"]
    assert main([*run, "--setup", "tips.toml"]) == Exit.GOOD
    before = (planned / "r" / "verdicts.json").read_text()
    (found,) = json.loads(before)["verdicts"]
    assert found["setup"]["fingers"]["fingertip_radius_m"] == 0.004
    (scene,) = (planned / "r" / "scenes").iterdir()
    assert 'size="0.004"' in scene.read_text()
    for flags, code in (
        (["--weight-down", "0", "0", "-1"], Exit.USAGE),
        (["--setup", "pyramids.toml"], Exit.INTERNAL),
    ):
        assert main([*run, *flags]) == code
        assert (planned / "r" / "verdicts.json").read_text() == before


def test_what_a_verdict_lists_may_be_given_back(planned, verdict):
    """The tables of a setup file are those of a verdict's settings."""
    settings = verdict()["setup"]
    tables = ("physics", "fingers", "hold", "limit", "friction")
    lines: list[str] = []
    for table in tables:
        lines.append(f"[{table}]")
        given = {name: value for name, value in settings[table].items() if value is not None}
        lines += [f"{name} = {json.dumps(value)}" for name, value in given.items()]
    (planned / "same.toml").write_text("\n".join(lines))
    assert verdict("--setup", "same.toml")["setup"] == settings


@pytest.mark.usefixtures("planned")
def test_the_counts_of_controls_that_let_go_and_did_not_add_up(capsys):
    words = ["validate", "grasps.json", "--limit", "1", "--timeout-s", "1e-9"]
    assert main(words) == Exit.NEGATIVE
    said = " ".join(capsys.readouterr().out.split())
    assert "0 of 3 negative controls were let go (all should), 3 were not" in said


@pytest.mark.parametrize("jobs", [1, 2])
def test_details_end_with_where_the_time_went(planned, jobs, spent, monkeypatch, capsys):
    monkeypatch.setattr(workers, "UNITS_PER_PROCESS", 1)
    monkeypatch.setattr(workers, "START_S", 0.0)
    heard, add = [], TIME_SPENT.add
    monkeypatch.setattr(TIME_SPENT, "add", lambda each: heard.append(list(each)) or add(each))
    words = ["validate", str(planned / "grasps.json"), "-v", "--jobs", str(jobs)]
    assert main([*words, "--out", str(planned / "out")]) == Exit.GOOD
    line = capsys.readouterr().err.splitlines()[-1]
    assert re.sub(r"\d+\.\d\d", "?", line) == (
        "time: ? s of processor: planning ?, analysis ?, scenes ?, stepping ?, files ?"
    )
    total, *parts = map(float, re.findall(r"\d+\.\d\d", line))
    assert total == pytest.approx(sum(parts), abs=0.005 * (1 + len(parts)))
    assert (list(spent) in heard) == (jobs == 2), "what another process spent is added"
    assert jobs == 2 or min(spent["scenes"], spent["stepping"]) > 0.0
    assert "processor" not in (planned / "out" / "verdicts.json").read_text()
