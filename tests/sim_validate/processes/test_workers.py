"""Units in other processes, loops compiled for them, clusters and interrupts."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets import clusters
from sim_validate.main import main
from sim_validate.planning import plan as plan_command
from sim_validate.processes import compiling
from sim_validate.processes.interrupts import check_interrupted, interrupts_noted
from sim_validate.processes.workers import each
from tests.grasp_core.tasks_to_do import meet
from tests.patience import HANGING_S

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_units(jobs):
    assert list(each(abs, range(-20, 0), jobs=jobs)) == list(range(20, 0, -1))
    with pytest.raises(TypeError):
        list(each(abs, [None] * 20, jobs=jobs))


@pytest.mark.timeout(HANGING_S)
def test_two_long_units_are_done_at_the_same_time(tmp_path):
    one, other = str(tmp_path / "one"), str(tmp_path / "other")
    assert len(set(each(meet, [(one, other), (other, one)], jobs=2))) == 2


SCRIPT = """
import os, sys
import sim_validate as sv
from scenes import example_object
import grasp_core as gc
from sim_validate.processes import workers

print("begun")
workers.UNITS_PER_PROCESS, workers.START_S = 1, 0.0
body = example_object("tetrahedron")
plan = gc.plan(body, limit=2)
os.rmdir(os.getcwd())
print(len(sv.validate_all(body, plan, jobs=2, agenda=sv.Agenda(controls=False))))
"""


@pytest.mark.slow
def test_a_script_needs_no_guard_and_no_working_folder(tmp_path):
    (tmp_path / "gone").mkdir()
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, tmp_path / "script.py"], cwd=tmp_path / "gone", check=False, text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("begun\n2\n", "")


@pytest.mark.parametrize("jobs", [1, 2])
def test_calls_are_made_in_two_processes_or_in_one(jobs, tmp_path):
    """Each call leaves a file; some may fail, and the rest is done all the same."""
    calls = ((tmp_path / "one").touch, broken, (tmp_path / "two").touch)
    compiling.compile_loops(compiling.Loops((), calls), jobs)
    assert {path.name for path in tmp_path.iterdir()} == {"one", "two"}


def broken():
    raise ValueError("no such loop")


@pytest.mark.parametrize(("kept", "jobs", "said"), [(False, 2, 1), (True, 2, 0), (False, 1, 0)])
def test_a_plan_compiles_first_what_is_not_kept_if_two_processes_may(
    kept, jobs, said, tmp_path, capsys, monkeypatch
):
    made = []
    monkeypatch.setattr(compiling, "is_kept", lambda _: kept)
    monkeypatch.setattr(plan_command, "compile_loops", made.append)
    words = ["plan", "tetrahedron", "--limit", "1", "--jobs", str(jobs), "--out", str(tmp_path)]
    assert main(words) == Exit.GOOD
    assert made == said * [compiling.PLANNING]
    assert capsys.readouterr().out.count("compiling inner loops once") == said


def test_settings_of_ray_are_set_while_it_runs_and_those_of_the_caller_stay(monkeypatch):
    own, other, *_ = clusters.RAY_SETTINGS
    monkeypatch.delenv(own, raising=False)
    monkeypatch.setenv(other, "mine")
    ray = SimpleNamespace(
        init=lambda **_: None, cluster_resources=lambda: {"CPU": 3.0}, shutdown=lambda: None
    )
    monkeypatch.setattr(clusters, "_imported", lambda *_: ray)
    before = dict(os.environ)
    with clusters.ray_workers(2, None) as started:
        assert started.workers == 3
        assert os.environ[own] == clusters.RAY_SETTINGS[own]
        assert os.environ[other] == "mine"
    assert dict(os.environ) == before


def swallow():
    """An interrupt, raised where somebody clears errors that are not theirs."""
    try:
        os.kill(os.getpid(), signal.SIGINT)
        signal.sigtimedwait([], 1.0)  # lets Python run its handler
    except KeyboardInterrupt:
        return
    pytest.fail("nothing was raised")


def test_a_swallowed_interrupt_is_raised_at_the_next_step():
    before = signal.getsignal(signal.SIGINT)
    with interrupts_noted():
        check_interrupted()
        swallow()
        with pytest.raises(KeyboardInterrupt), Reporter(True, False, False).progress("x") as steps:
            steps.update(1, 2)
        check_interrupted()  # raised once
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupts_from_before_do_not_count():
    with interrupts_noted():
        swallow()
    with interrupts_noted():
        check_interrupted()


class Swallowing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        signal.sigtimedwait([], 1.0)


def test_a_request_to_end_is_an_interrupt_and_where_it_is_swallowed_says_nothing(capsys):
    before = signal.getsignal(signal.SIGTERM), sys.unraisablehook
    with interrupts_noted():
        Swallowing()
        with pytest.raises(KeyboardInterrupt):
            check_interrupted()
    assert capsys.readouterr().err == ""
    assert (signal.getsignal(signal.SIGTERM), sys.unraisablehook) == before


def fail_without_what_was_swallowed():
    swallow()
    raise RuntimeError("what was swallowed is missing")


def test_an_error_after_a_swallowed_interrupt_is_that_interrupt():
    with pytest.raises(KeyboardInterrupt), interrupts_noted():
        fail_without_what_was_swallowed()
    with pytest.raises(RuntimeError), interrupts_noted():
        raise RuntimeError("nothing was swallowed")
