"""What the flags of `validate` and `run` put into a verdict."""

import json

import numpy as np
import pytest

from sim_validate.kit.exit_codes import Exit
from sim_validate.main import main

TASK = '{"wrenches": [{"name": "lift", "force_n": [0, 0, -3], "torque_n_m": [0, 0.01, 0]}]}'


@pytest.fixture
def planned(tmp_path, monkeypatch):
    """A folder with the plan of one grasp, and a task."""
    monkeypatch.chdir(tmp_path)
    assert main(["plan", "wedge", "--limit", "1", "--out", ".", "-q"]) == Exit.GOOD
    (tmp_path / "task.json").write_text(TASK)
    return tmp_path


@pytest.fixture
def verdict(planned, capsys):
    """Validates with flags; answers with the one verdict."""

    def validated(*flags, code=Exit.GOOD):
        assert main(["validate", str(planned / "grasps.json"), *flags, "--json"]) == code
        (found,) = json.loads(capsys.readouterr().out)["verdicts"]
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
    command = ["validate", "grasps.json", "--traces", "--out", "v", "-q"]
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


def test_settings_of_a_file_are_in_force_and_in_the_record(planned, verdict):
    text = "[hold]\nload_share = 0.5\n[fingers]\nfingertip_radius_m = 0.004\n"
    (planned / "setup.toml").write_text(text)
    settings = verdict("--setup", "setup.toml")["setup"]
    assert settings["hold"]["load_share"] == 0.5
    assert settings["fingers"]["fingertip_radius_m"] == 0.004


@pytest.mark.parametrize(
    ("flags", "code", "words"),
    [
        (["--weight-down", "0", "0", "-1"], Exit.USAGE, "give the weight with --weight-n too"),
        (["--traces"], Exit.USAGE, "with --out DIR too"),
        (["--weight-n", "1", "--weight-down", "0", "0", "0"], Exit.USAGE, "zero"),
    ],
)
@pytest.mark.usefixtures("planned")
def test_flags_that_make_no_sense_are_refused_before_anything_runs(capsys, flags, code, words):
    assert main(["validate", "grasps.json", *flags]) == code
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("flags", [["--weight-down", "0", "0", "-1"], ["--setup", "pyramids.toml"]])
def test_a_run_that_is_refused_leaves_earlier_results(planned, flags):
    (planned / "pyramids.toml").write_text('[physics]\ncone = "pyramidal"\n')
    assert main(["run", "tetrahedron", "--out", "r", "-q", "--no-report"]) == Exit.GOOD
    before = (planned / "r" / "verdicts.json").read_text()
    assert main(["run", "tetrahedron", "--out", "r", "-q", "--no-report", *flags]) in {
        Exit.USAGE,
        Exit.INTERNAL,
    }
    assert (planned / "r" / "verdicts.json").read_text() == before


def test_the_scenes_of_a_run_are_those_that_were_simulated(planned):
    (planned / "setup.toml").write_text(
        "[physics]\ntimestep = 0.001\n[fingers]\nfingertip_radius_m = 0.004\n"
    )
    command = ["run", "tetrahedron", "--out", "r", "-q", "--no-report", "--setup", "setup.toml"]
    assert main(command) == Exit.GOOD
    for path in (planned / "r" / "scenes").iterdir():
        text = path.read_text()
        assert 'timestep="0.001"' in text
        assert 'size="0.004"' in text


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
