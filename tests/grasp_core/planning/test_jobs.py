"""Plans of several processes: the same for any number, number by number."""

import io
import os
import signal
import subprocess
import sys

import pytest

import grasp_core as gc
from grasp_core.planning import plan_search
from grasp_core.planning.plan_search import PlanSearch
from grasp_core.processes import receive, send, unpacked
from scenes.example_objects import example_object
from tests.patience import HANGING_S

COMPLETE = gc.PlanSettings(0.3, complete=True)


@pytest.mark.parametrize(
    ("name", "keywords"),
    [
        ("random-7-7", {}),
        pytest.param("prism", {"settings": COMPLETE}, marks=pytest.mark.slow),
        pytest.param("octahedron", {"limit": 5, "rank_by": "diverse"}, marks=pytest.mark.slow),
    ],
)
def test_any_number_of_processes_gives_the_same_plan(name, keywords, monkeypatch):
    monkeypatch.setattr(plan_search, "QUADRUPLES_PER_PROCESS", 1)
    body = example_object(name)
    one, other = (gc.plan(body, **keywords, jobs=jobs) for jobs in (1, 2))
    assert one.grasps
    assert other == one


@pytest.mark.parametrize("name", ["random-7-7", pytest.param("box", marks=pytest.mark.slow)])
def test_parts_that_another_process_finds_are_the_same(name, monkeypatch):
    """Every part is searched on another copy of the object, and sent as between processes."""
    body, seen = example_object(name), []

    def sent(value):
        pipe = io.BytesIO()
        send(pipe, value)
        pipe.seek(0)
        return unpacked(receive(pipe))

    def elsewhere(work, parts):
        other = sent(work)
        for part in parts:
            seen.append(part)
            yield sent(other.found_elsewhere(sent(part)))

    here = gc.plan(body, 0.3)
    monkeypatch.setattr(PlanSearch, "each_found", elsewhere)
    assert gc.plan(body, 0.3) == here
    assert {type(part).__name__ for part in seen} == {"Block", "Batch"}


def test_an_error_of_a_part_reaches_the_caller_with_its_own_type(monkeypatch):
    monkeypatch.setattr(plan_search, "QUADRUPLES_PER_PROCESS", 1)

    def fails(_, part):  # in this process, which takes the first part or one after it
        raise gc.SolverError(f"no answer on {part}")

    monkeypatch.setattr(PlanSearch, "found_at_once", fails)
    with pytest.raises(gc.SolverError, match="no answer on"):
        gc.plan(example_object("random-14-7"), jobs=2)


INTERRUPTED = """
import signal

import grasp_core as gc
from grasp_core.planning import plan_search
from scenes.example_objects import example_object

# a shell starts what runs in its background with interrupts ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
# loops are loaded before: where numba calls Python meanwhile, an interrupt is swallowed
gc.plan(example_object("random-11-1"), 0.3)
plan_search.QUADRUPLES_PER_PROCESS = 1
seen = []
def told(*numbers):
    seen or print("planning", flush=True)
    seen.append(numbers)
gc.plan(example_object("random-24-1"), 0.3, jobs=2, progress=told)
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="interrupts are sent in another way on Windows")
def test_an_interrupt_ends_a_plan_and_its_processes():
    """The test ends only when the process has: it waits for the other one and for all threads."""
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "planning\n"
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=HANGING_S)
    assert process.returncode == -signal.SIGINT
    assert "KeyboardInterrupt" in told
