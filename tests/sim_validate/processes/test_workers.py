"""Units in other processes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

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
