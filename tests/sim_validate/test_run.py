"""`graspproof run`, ended early: what is done is kept, and says that it is not all."""

import json

import pytest

import grasp_core as gc
from sim_validate import run
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from tests.sim_validate.interrupts import interrupt_once

ASKED = ["run", "wedge", "--limit", "3", "--no-report", "--jobs", "1", "--out", "r"]


def test_an_interrupt_of_planning_keeps_the_plan_and_simulates_nothing(here, monkeypatch):
    interrupt_once(monkeypatch)
    assert main(ASKED) == Exit.INTERRUPTED
    assert gc.load_grasps(here / "r" / "grasps.json").ended == "interrupt"
    assert not (here / "r" / "verdicts.json").exists()


@pytest.mark.usefixtures("here")
def test_a_run_without_time_finds_nothing_and_says_that_this_proves_nothing(capsys):
    assert main([*ASKED, "--time-limit-s", "0"]) == Exit.PARTIAL
    assert "which proves nothing" in capsys.readouterr().out


def test_trials_end_with_the_time_limit(here, monkeypatch, capsys):
    simulate = run.simulate_grasps

    def late(*given, stop, **named):
        stop.reserve(1000.0)
        return simulate(*given, stop=stop, **named)

    monkeypatch.setattr(run, "simulate_grasps", late)
    assert main([*ASKED, "--time-limit-s", "1000"]) == Exit.PARTIAL
    assert "the time limit ended the trials" in capsys.readouterr().err
    assert len(json.loads((here / "r" / "grasps.json").read_text())["grasps"]) == 3
