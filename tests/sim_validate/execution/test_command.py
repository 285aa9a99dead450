"""The commands `execute` and `run --execute`: what they print, write and end with."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.errors import UnfaithfulError
from scenes.mujoco.fingertip_room import fitting_radius
from sim_validate import run
from sim_validate.commands.exit_codes import Exit
from sim_validate.execution import execute as jobs
from sim_validate.execution.execute import executed_grasp, execution_of
from sim_validate.main import main

QUICK = ["--trials", "knock"]
IDS = ("c-0-1-2-7", "p-0-7-1-5")


@pytest.fixture(autouse=True)
def here(wedge_plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grasps.json").write_text(wedge_plan.read_text())
    return tmp_path


def test_grasps_that_survive_are_shown_and_written(here, capsys):
    words = ["execute", "grasps.json", "--mass-kg", "0.3", "--out", "e"]
    assert main([*words, "--trials", "weight,lift,knock"]) == Exit.GOOD
    shown = capsys.readouterr().out
    for part in (
        "wrote e/executions.json", "0.834", "2.75/2.75", "no lift for 2 of 2 grasps: a fingertip",
        "2 of 2 grasps survived every trial with 0.3 kg at friction 0.5; 14 of 14 trials were",
        "6 of 6 negative controls let go",
    ):  # fmt: skip
        assert part in shown, shown
    found = sv.load_executions(here / "e" / "executions.json")
    assert [grasp.id for grasp in found.grasps] == list(IDS)
    assert found.complete
    for grasp in found.grasps:
        assert grasp.survived
        assert grasp.controls_let_go
        assert grasp.execution.survival("knock") == (6, 6)
        assert [each.kind for each in grasp.execution.skipped] == ["lift"]
        assert grasp.execution.load_multiple > 1.0
    assert found.settings.trials == ("weight", "lift", "knock")


def test_a_grasp_that_does_not_survive_is_a_result(capsys):
    words = ["execute", "grasps.json", "--mass-kg", "1.3", "--limit", "1", "--trials", "weight"]
    assert main([*words, "--out", "."]) == Exit.NEGATIVE
    said = capsys.readouterr()
    assert "0 of 1 grasps survived every trial with 1.3 kg" in said.out
    assert "a knock of" not in said.err
    assert re.search(
        r"^c-0-1-2-7: weight: (.*too far after a slip|dropped), moved [\d.e+]+ mm", said.err, re.M
    )
    found = sv.load_executions("executions.json")
    (grasp,) = found.grasps
    assert not grasp.survived
    assert f"c-0-1-2-7: lost in 1 of 1 trials; {grasp.enough}\n" in said.err
    assert "enough: the least --push-n, with the --tip-stiffness" in said.out
    assert grasp.execution.enough == grasp.enough
    planned = gc.load_grasps("grasps.json").grasps[0]
    usual = fitting_radius(scenes.example_object("wedge"), planned.positions, planned.normals)
    assert found.settings.tip_radius_m is None
    assert grasp.execution.tip_radius_m == pytest.approx(np.full(4, usual))
    again = [*words, "--push-n", repr(grasp.enough.push_n)]
    again += ["--tip-stiffness-n-per-m", repr(grasp.enough.stiffness_n_per_m)]
    assert main([*again, "--out", "again"]) == Exit.GOOD
    (trial,) = grasp.execution.trials
    assert trial.fate in {"slipped", "dropped"}
    assert trial.predicted_first_slip == pytest.approx(grasp.execution.load_multiple, rel=0.05)


def test_a_grasp_without_a_squeeze_is_a_result_with_its_reason(capsys):
    words = ["execute", "grasps.json", "--friction", "0.03", "--mass-kg", "0.3", *QUICK]
    assert main([*words, "--limit", "1", "--out", "."]) == Exit.NEGATIVE
    found = sv.load_executions("executions.json")
    (first,) = found.grasps
    assert found.friction == 0.03
    assert first.execution is None
    assert first.enough.push_n is None
    assert str(first.enough) in first.reason
    assert first.reason.startswith("no squeeze carries any part of the weight")
    assert not first.survived
    assert f"c-0-1-2-7: not executed: {first.reason}" in capsys.readouterr().err


def test_a_control_that_holds_is_a_fault_of_the_simulator(capsys, monkeypatch):
    def kept(*given, **more):
        found = execution_of(*given, **more)
        held = tuple(replace(each, let_go=False) for each in found.controls[:1])
        return replace(found, controls=held + found.controls[1:])

    monkeypatch.setattr(jobs, "execution_of", kept)
    words = ["execute", "grasps.json", "--limit", "1", *QUICK, "--out", "."]
    assert main(words) == Exit.INTERNAL
    assert "control friction 0.9 did not slip, though it must" in capsys.readouterr().err
    found = sv.load_executions("executions.json")
    (grasp,) = found.grasps
    assert grasp.survived
    assert not grasp.controls_let_go
    volume = scenes.example_object("wedge").volume  # without a mass, that of water
    assert found.settings.mass_kg == pytest.approx(1000.0 * volume, rel=1e-8)


def test_what_was_done_is_kept_where_the_simulator_fails(capsys, monkeypatch):
    def failing(job):
        if job.grasp.id == IDS[1]:
            raise UnfaithfulError("knock +x: a number is not finite")
        return executed_grasp(job)

    monkeypatch.setattr(jobs, "executed_grasp", failing)
    words = ["execute", "grasps.json", "--mass-kg", "0.3", *QUICK, "--out", "."]
    assert main(words) == Exit.INTERNAL
    said = capsys.readouterr()
    assert "wrote what is done to executions.json" in said.out
    assert "a number is not finite" in said.err
    found = sv.load_executions("executions.json")
    assert not found.complete
    assert [each.id for each in found.grasps] == [IDS[0]]


def settings_of(here, *flags, code=Exit.GOOD):
    assert main(["execute", "grasps.json", "--limit", "1", "--out", ".", "-q", *flags]) == code
    return sv.load_executions(here / "executions.json").settings


def test_a_file_of_flags_and_a_file_of_physics(here):
    volume = scenes.example_object("wedge").volume
    (here / "flags.toml").write_text(
        'trials = ["knock", "weight"]\ndensity_kg_m3 = 1500\npush_n = 11\n'
    )
    (here / "physics.toml").write_text("[physics]\ntimestep = 0.001\n")
    found = settings_of(here, "--config", "flags.toml", "--setup", "physics.toml")
    assert (found.trials, found.push_n) == (("weight", "knock"), 11.0)
    assert found.mass_kg == pytest.approx(1500.0 * volume, rel=1e-8)
    document = json.loads((here / "executions.json").read_text())
    (execution,) = document["executions"]
    assert execution["physics"]["timestep"] == 0.001
    assert execution["physics"]["impratio"] == 300.0


REFUSED = {
    "--mass-kg 1 --density-kg-m3 1000": (Exit.USAGE, "exclude each other"),
    "--setup fingers.toml": (Exit.INPUT, "no setting is named 'fingers'; choose from physics"),
    "--setup gravity.toml": (Exit.INPUT, "give its direction with --down"),
}


@pytest.mark.parametrize("flags", REFUSED)
def test_flags_that_make_no_sense_are_refused_before_anything_runs(here, capsys, flags):
    (here / "fingers.toml").write_text("[fingers]\nfingertip_radius_m = 0.01\n")
    (here / "gravity.toml").write_text("[physics]\ngravity = [0, 0, 0]\n")
    code, said = REFUSED[flags]
    assert main(["execute", "grasps.json", "--out", "e", *flags.split()]) == code
    assert said in capsys.readouterr().err
    assert not (here / "e" / "executions.json").exists()


RUN = ["run", "tetrahedron", "--limit", "1", "--no-report", "--out", "r"]


def test_run_executes_grasps_too_and_a_run_without_removes_the_file(here, answer):
    flags = ["--execute", "--mass-kg", "0.1", "--trials", "stop", "--seed", "3"]
    document = answer(*RUN, *flags)
    written = json.loads((here / "r" / "executions.json").read_text())
    assert document.pop("executions") == written
    assert document == json.loads((here / "r" / "verdicts.json").read_text())
    assert written["settings"]["trials"] == ["stop"]
    assert written["settings"]["seed"] == 3
    assert [each["id"] for each in written["executions"]] == [
        each["id"] for each in document["verdicts"]
    ]
    assert main([*RUN, "-q"]) == Exit.GOOD
    assert not (here / "r" / "executions.json").exists()


@pytest.mark.slow
def test_a_run_has_a_report_where_executions_are_refused(here, capsys, monkeypatch):
    def refuse(*_args, **_more):
        raise UnfaithfulError("the simulator fails")

    monkeypatch.setattr(run, "execute_grasps", refuse)
    words = [word for word in RUN if word != "--no-report"]
    assert main([*words, "--execute", "--mass-kg", "0.1", "-q"]) == Exit.INTERNAL
    assert "the simulator fails" in capsys.readouterr().err
    assert (here / "r" / "report" / "index.html").is_file()


def test_run_refuses_flags_of_executions_without_any(here):
    for flags in (["--mass-kg", "1"], ["--trials", "lift"]):
        assert main([*RUN, *flags]) == Exit.USAGE
    assert not (here / "r").exists()
