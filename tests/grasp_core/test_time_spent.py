"""Time counts once, for the innermost mark, and other processes hand theirs over."""

import re
import time

import pytest

from grasp_core.processes import local_processes
from grasp_core.time_spent import TIME_SPENT, TimeSpent, in_words
from tests.grasp_core import tasks_to_do as tasks
from tests.patience import HANGING_S


class Clock:
    """A clock that a test moves on, and how often it was looked at."""

    now, looks = 0.0, 0

    def __call__(self):
        self.looks += 1
        return self.now


@pytest.fixture
def clock():
    return Clock()


def test_time_in_a_mark_within_another_counts_there_alone(clock):
    spent = TimeSpent(clock)
    clock.now = 1.0
    with spent.on("planning"):
        clock.now = 3.0
        with spent.on("files"):
            clock.now = 7.0
        clock.now = 15.0
    clock.now = 31.0
    usual = {"planning": 10.0, "analysis": 17.0, "scenes": 0.0, "stepping": 0.0, "files": 4.0}
    assert spent.taken() == usual
    assert in_words(usual) == (
        "time: 31.00 s of processor: planning 10.00, analysis 17.00, scenes 0.00, stepping 0.00, "
        "files 4.00"
    )
    clock.now = 32.0
    assert spent.taken() == dict.fromkeys(usual, 0.0) | {"analysis": 1.0}


def test_a_function_that_fails_or_calls_itself_counts_too(clock):
    spent = TimeSpent(clock)

    @spent.on("stepping")
    def step(depth):
        clock.now += 1.0
        if not depth:
            raise ZeroDivisionError
        step(depth - 1)

    with pytest.raises(ZeroDivisionError):
        step(2)
    clock.now += 8.0
    spent.add({"stepping": 16.0, "scenes": 32.0})
    found = spent.taken()
    assert (found["stepping"], found["analysis"], found["scenes"]) == (19.0, 8.0, 32.0)
    assert clock.looks == 7


def test_another_process_hands_over_the_time_of_tasks_that_succeed_and_that_fail():
    TIME_SPENT.taken()
    begun = time.process_time()
    with local_processes(1) as other:
        for fails in (False, True):
            failure = other.submit(tasks.step_for, (0.3, fails)).exception(HANGING_S)
            assert (failure is not None) == fails
    own = time.process_time() - begun
    found = TIME_SPENT.taken()
    assert 0.6 <= found["stepping"] < 1.0
    assert sum(found.values()) >= own + 0.6
    words = in_words(found)
    total, *parts = map(float, re.findall(r"\d+\.\d+", words))
    assert total == pytest.approx(sum(parts), abs=0.03)
