"""Tasks done by other processes and this one: results in order, errors in place, no one left."""

import io
import os
import signal
import time
from threading import enumerate as threads

import numpy as np
import pytest

from grasp_core import processes as module
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.processes import ProcessEndedError, local_processes, receive, send, unpacked
from tests.grasp_core import tasks_to_do as tasks
from tests.patience import HANGING_S


@pytest.fixture
def other():
    """Another process beside this one."""
    with local_processes(1) as found:
        yield found


@pytest.fixture
def names(tmp_path):
    """Two files by which two tasks know of each other, in both orders."""
    one, two = str(tmp_path / "one"), str(tmp_path / "two")
    return [(one, two), (two, one)]


def test_results_come_in_the_order_of_the_tasks(other):
    numbers = range(100)
    assert list(other.in_order(tasks.square, iter(numbers))) == [n * n for n in numbers]


def test_a_function_is_sent_once_with_all_that_it_holds(other):
    one, two = tasks.Counter(), tasks.Counter()
    assert [other.submit(one, n).result() for n in range(3)] == [1, 2, 3]
    assert other.submit(two, 0).result() == 1
    assert other.submit(one, 0).result() == 1
    assert one.calls == two.calls == 0


def test_code_that_reads_input_finds_none_and_takes_no_task(other):
    assert other.submit(tasks.all_input, None).result(HANGING_S) == ""
    assert other.submit(abs, -2).result() == 2


def test_an_error_is_raised_with_its_own_type_in_the_place_of_its_result(other):
    done = other.in_order(tasks.three_or_refusal, [2, 3, 4] * 20)
    assert next(done) == 4
    with pytest.raises(MeshError, match="close the mesh") as raised:
        next(done)
    assert raised.value.reason is MeshRefusal.OPEN


def test_an_error_of_another_process_is_raised_here(other, names):
    """One of two tasks that wait for each other is done by the other process, which refuses."""
    with pytest.raises(MeshError, match="close the mesh"):
        list(other.in_order(tasks.meet_and_refuse, [(*each, os.getpid()) for each in names]))


def test_what_a_process_leaves_behind_is_done_here(other):
    assert set(other.in_order(tasks.end_elsewhere, [os.getpid()] * 30)) == {"done here"}


@pytest.mark.timeout(HANGING_S)
def test_a_task_that_cannot_be_sent_is_done_here(other):
    given = [2, lambda: None] * 20
    results = list(other.in_order(abs, given, here=lambda task: 2 if task == 2 else "done here"))
    assert results == [2, "done here"] * 20


@pytest.mark.parametrize(("name", "value"), [("frozen", True), ("executable", "/no/such/program")])
def test_where_no_process_starts_all_is_done_here(name, value, monkeypatch):
    monkeypatch.setattr(module.sys, name, value, raising=False)
    with local_processes(2) as found:
        done = list(found.in_order(tasks.end_elsewhere, [os.getpid()] * 30))
        assert done == ["done here"] * 30
        with pytest.raises(ProcessEndedError):
            found.submit(abs, -1).result()


@pytest.mark.timeout(HANGING_S)
def test_no_process_starts_for_the_task_that_is_done_here():
    """This process does its only task until all threads have decided to start nothing."""
    with local_processes(3, patience_s=0.1) as found:

        def until_all_have_decided(_):
            while any(thread.is_alive() for thread in found._threads):
                time.sleep(0.01)

        list(found.in_order(tasks.square, [2], here=until_all_have_decided))
        assert not found._running


@pytest.mark.timeout(HANGING_S)
def test_a_process_starts_where_tasks_are_left():
    """The first thread that looks sees all other tasks open, whenever it looks."""
    with local_processes(3, patience_s=0.1) as found:

        def until_one_has_started(_):
            while not found._running:
                time.sleep(0.01)

        list(found.in_order(tasks.square, [2] * 30, here=until_one_has_started, ahead=30))
        assert found._running


def test_the_end_of_the_block_ends_processes_and_threads():
    before = len(threads())
    with local_processes(2) as found:
        assert len(threads()) == before + 2
        done = found.in_order(tasks.square, [2] * 50)
        assert next(done) == 4
        begun = list(found._running)
    assert len(threads()) == before
    assert not found._running
    assert all(each.program.returncode is not None for each in begun)


@pytest.mark.timeout(HANGING_S)
def test_the_end_of_a_process_fails_its_task_alone_and_another_starts(other):
    assert other.submit(abs, -2).result() == 2
    (process,) = other._running
    with pytest.raises(TypeError):
        other.submit(abs, None).result()
    assert other._running == {process}
    process.program.send_signal(signal.SIGKILL)
    process.program.wait()
    with pytest.raises(ProcessEndedError):
        other.submit(abs, -3).result()
    assert other.submit(abs, -4).result() == 4


def test_a_process_ends_with_the_one_that_asks_whatever_it_does(other, names, tmp_path):
    """It waits for another that never comes; the end of its input ends it all the same."""
    other.submit(tasks.meet, names[0])
    while not (tmp_path / "one").exists():
        time.sleep(0.01)
    (process,) = other._running
    process.program.stdin.close()
    assert process.program.wait(HANGING_S) == 0


def test_arrays_keep_their_bits_and_stay_read_only():
    pipe, array = io.BytesIO(), np.array([0.1, -0.0, np.nan, 1e-310])
    array.setflags(write=False)
    send(pipe, [array, array.copy()])
    pipe.seek(0)
    fixed, free = unpacked(receive(pipe))
    assert fixed.tobytes() == free.tobytes() == array.tobytes()
    assert not fixed.flags.writeable
    assert free.flags.writeable


def test_nobody_waits_for_another_process_once_told_to_stop(other, monkeypatch):
    monkeypatch.setattr(other, "_unclaimed", lambda: None)  # this process does nothing itself
    looks = iter([False, True])
    assert list(other.in_order(time.sleep, [HANGING_S], stop=lambda: next(looks))) == []
