"""Runs units of work in processes of this machine.

Results do not depend on the number of processes: a unit sees only its own arguments.
"""

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar

from grasp_core.processes.messages import unpacked
from grasp_core.processes.process import Process
from grasp_core.processes.workers import working

Unit = TypeVar("Unit")
Result = TypeVar("Result")

SHARE = Path("/sys/fs/cgroup/cpu.max")
"""The Linux file that limits a container's processor time: microseconds of use per period."""
START_S = 1.0
"""Time in which a process starts [s]; work that takes less is done without others."""
UNITS_PER_PROCESS = 8
"""Number of simulated grasps for which a process is better than threads of the simulator: its start
takes as long as eight validations."""


def available_cores() -> int:
    """Count the cores that this process may use, limited by the share of its container."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        share, period = SHARE.read_text().split()
        return max(1, min(own or 1, int(share) // int(period)))
    except (OSError, ValueError):  # not in a container, or in one without a limit
        return own or 1


def processes(units: int, jobs: int) -> int:
    """Compute how many processes to use, at least one, where threads take the other cores."""
    return max(1, min(jobs, units // UNITS_PER_PROCESS))


def each(
    function: Callable[[Unit], Result], units: Sequence[Unit], *, jobs: int
) -> Iterator[Result]:
    """Yield the results of a function on each unit, in order, as they become ready.

    This process works with the others, which start where there is work for them for longer than a
    start takes.
    """
    others = min(jobs, len(units)) - 1
    with working(others, _itself, function, patience_s=START_S) as workers:
        if workers is None:
            yield from map(function, units)
        else:
            yield from workers.in_order(units, function, ahead=len(units))


def _itself(function: Callable[[Unit], Result]) -> Callable[[Unit], Result]:
    return function


class ProcessEndedError(Exception):
    """A process has ended while it did a task."""


class Processes:
    """Processes of this machine, each of which computes one task at a time."""

    ended = ("ProcessEndedError",)

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._threads = ThreadPoolExecutor(workers)
        self._lock, self._closed = Lock(), False
        self._running, self._idle = set[Process](), list[Process]()

    def submit(self, function: Callable[[Unit], Result], unit: Unit, /) -> "Future[Result]":
        """Call a function in a process; the future fails if that process dies."""
        return self._threads.submit(self._call, function, unit)

    def _call(self, function: Callable[[Unit], Result], unit: Unit) -> Result:
        process = self._free()
        try:
            answer = process.ask((function, unit))
        except (EOFError, OSError) as error:
            self._end(process)
            raise ProcessEndedError("a process has ended while it did a task") from error
        except Exception:  # the task cannot be sent
            self._end(process)
            raise
        with self._lock:
            self._idle.append(process)
        result, error = unpacked(answer)
        if error is not None:
            raise error
        return result

    def _free(self) -> Process:
        with self._lock:
            if self._closed:
                raise ProcessEndedError("the processes are closed")
            if self._idle:
                return self._idle.pop()
            process = Process(_calling)
            self._running.add(process)
            return process

    def _end(self, process: Process) -> None:
        process.end()
        process.close()
        with self._lock:
            self._running.discard(process)

    def close(self) -> None:
        """End the processes, whatever they do."""
        with self._lock:
            self._closed = True
            for process in self._running:
                process.end()
        self._threads.shutdown(cancel_futures=True)
        for process in list(self._running):
            self._end(process)


def _calling() -> Callable[[tuple[Callable[[Any], Any], Any]], Any]:
    return _called


def _called(task: tuple[Callable[[Any], Any], Any]) -> Any:
    function, unit = task
    return function(unit)


@contextmanager
def local_processes(workers: int) -> Generator[Processes]:
    """Start processes on this machine, and stop them at the end, whatever they do."""
    started = Processes(workers)
    try:
        yield started
    finally:
        started.close()
