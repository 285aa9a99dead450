"""Tasks done by other processes and this one: results in order, errors in place, no one left."""

import io
import os
import time
from threading import enumerate as threads

import numpy as np
import pytest

from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.processes import process, workers
from grasp_core.processes.messages import receive, send, unpacked
from tests.grasp_core.processes.tasks_to_do import doing
from tests.patience import HANGING_S


@pytest.fixture
def two():
    """Another process beside this one."""
    with workers.working(1, doing, os.getpid()) as found:
        assert found is not None
        yield found


def test_results_come_in_the_order_of_the_tasks(two):
    numbers = range(100)
    done = two.in_order((("square", number) for number in numbers), doing(os.getpid()))
    assert list(done) == [number * number for number in numbers]


def test_two_processes_work_at_the_same_time(two, tmp_path):
    one, other = str(tmp_path / "one"), str(tmp_path / "other")
    tasks = [("meet", one, other), ("meet", other, one)]
    did = list(two.in_order(tasks, doing(os.getpid())))
    assert os.getpid() in did
    assert len(set(did)) == len(tasks)


def test_an_error_is_raised_with_its_own_type_in_the_place_of_its_result(two):
    tasks = [("square", 3), ("refuse",), ("square", 4)]
    done = two.in_order(tasks * 20, doing(os.getpid()))
    assert next(done) == 9
    with pytest.raises(MeshError, match="close the mesh") as raised:
        next(done)
    assert raised.value.reason is MeshRefusal.OPEN


def test_an_error_of_another_process_is_raised_here(two, tmp_path):
    """One of two tasks that wait for each other is done by the other process, which refuses."""
    one, other = str(tmp_path / "one"), str(tmp_path / "other")
    tasks = [("refuse elsewhere", one, other), ("refuse elsewhere", other, one)]
    with pytest.raises(MeshError, match="close the mesh"):
        list(two.in_order(tasks, doing(os.getpid())))


def test_what_a_process_leaves_behind_is_done_here(two):
    tasks = [("end",)] * 30
    assert set(two.in_order(tasks, doing(os.getpid()))) == {"done here"}


@pytest.mark.timeout(HANGING_S)
def test_a_task_that_cannot_be_sent_is_done_here(two):
    tasks = [("square", 2), ("take", lambda: None)] * 20
    results = list(two.in_order(tasks, lambda task: "done here" if task[0] == "take" else 4))
    assert results == [4, "done here"] * 20


def test_a_program_that_holds_python_is_not_started_again(monkeypatch):
    monkeypatch.setattr(process.sys, "frozen", True, raising=False)
    with workers.working(2, doing, os.getpid()) as found:
        assert found is None


def test_where_no_process_starts_all_is_done_here(monkeypatch):
    monkeypatch.setattr(process.sys, "executable", "/no/such/program")
    with workers.working(2, doing, os.getpid()) as found:
        assert list(found.in_order([("end",)] * 30, doing(os.getpid()))) == ["done here"] * 30


@pytest.mark.timeout(HANGING_S)
def test_no_process_starts_for_the_task_that_is_done_here():
    """This process does its only task until all threads have decided to start nothing."""
    with workers.working(3, doing, os.getpid(), patience_s=0.1) as team:

        def until_all_have_decided(_):
            while any(thread.is_alive() for thread in team._serving):
                time.sleep(0.01)

        list(team.in_order([("square", 2)], until_all_have_decided))
        assert team._processes == []


@pytest.mark.timeout(HANGING_S)
def test_a_process_starts_where_tasks_are_left():
    """The first thread that looks sees all other tasks open, whenever it looks."""
    with workers.working(3, doing, os.getpid(), patience_s=0.1) as team:

        def until_one_has_started(_):
            while not team._processes:
                time.sleep(0.01)

        list(team.in_order([("square", 2)] * 30, until_one_has_started, ahead=30))
        assert len(team._processes) >= 1


@pytest.mark.timeout(HANGING_S)
def test_work_that_is_short_starts_no_process():
    with workers.working(2, doing, os.getpid(), patience_s=HANGING_S) as team:
        assert len(list(team.in_order([("square", 2)] * 30, doing(os.getpid())))) == 30
    assert team._processes == []


def test_the_end_of_the_block_ends_processes_and_threads():
    before = len(threads())
    with workers.working(2, doing, os.getpid()) as found:
        assert len(threads()) == before + 2
        done = found.in_order([("square", 2)] * 50, doing(os.getpid()))
        assert next(done) == 4
    assert len(threads()) == before
    assert all(each.program.returncode is not None for each in found._processes)


def test_a_process_ends_with_the_one_that_asks_whatever_it_does(tmp_path):
    """It waits for another that never comes; the end of its input ends it all the same."""
    with workers.working(1, doing, os.getpid()) as found:
        alone = str(tmp_path / "alone")
        place = workers._Place(("meet", alone, str(tmp_path / "never")))
        with found._changed:
            found._open.append(place)
            found._changed.notify_all()
        while not (tmp_path / "alone").exists():
            time.sleep(0.01)
        (other,) = found._processes
        other.tasks.close()
        assert other.program.wait(HANGING_S) == 0


def test_arrays_keep_their_bits_and_stay_read_only():
    pipe, array = io.BytesIO(), np.array([0.1, -0.0, np.nan, 1e-310])
    array.setflags(write=False)
    send(pipe, [array, array.copy()])
    pipe.seek(0)
    fixed, free = unpacked(receive(pipe))
    assert fixed.tobytes() == free.tobytes() == array.tobytes()
    assert not fixed.flags.writeable
    assert free.flags.writeable
