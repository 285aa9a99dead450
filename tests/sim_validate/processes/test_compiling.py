"""Loops are compiled in two processes before a plan needs them."""

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.planning import plan as plan_command
from sim_validate.processes import compiling


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
