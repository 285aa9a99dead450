"""Runs units of work in processes of this machine.

Results do not depend on the number of processes: a unit sees only its own arguments.
"""

import importlib
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

Unit = TypeVar("Unit")
Result = TypeVar("Result")

SHARE = Path("/sys/fs/cgroup/cpu.max")
"""The Linux file that limits a container's processor time: microseconds of use per period."""
UNITS_PER_PROCESS = 8
"""Number of units for which one more process is worth starting: the start takes about a second, as
long as eight validations."""


def available_cores() -> int:
    """Count the cores that this process may use, limited by the share of its container."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        share, period = SHARE.read_text().split()
        return max(1, min(own or 1, int(share) // int(period)))
    except (OSError, ValueError):  # not in a container, or in one without a limit
        return own or 1


def processes(units: int, jobs: int) -> int:
    """Compute how many processes are worth starting for a number of units, at least one."""
    return max(1, min(jobs, units // UNITS_PER_PROCESS))


def each(
    function: Callable[[Unit], Result], units: Sequence[Unit], *, jobs: int
) -> Iterator[Result]:
    """Yield the results of a function on each unit, in order, as they become ready.

    Args:
        function: A function that can be imported by name and depends only on its argument.
        units: The arguments, one for each call.
        jobs: Largest number of processes.
    """
    workers = processes(len(units), jobs)
    if workers <= 1:
        yield from map(function, units)
        return
    with _pool(workers) as pool:
        future = pool.map(function, units)
        try:
            yield from future.result()
        finally:
            future.cancel()


class Processes:
    """Processes of this machine, each of which computes one task at a time."""

    ended = ("ProcessExpired",)

    def __init__(self, pool: Any, workers: int) -> None:
        self.workers = workers
        self._pool = pool

    def submit(self, function: Callable[[Unit], Result], unit: Unit, /) -> "Future[Result]":
        """Call a function in a process; the future fails if that process dies."""
        return self._pool.schedule(function, args=[unit])


@contextmanager
def local_processes(workers: int) -> Generator[Processes]:
    """Start processes on this machine, and stop them at the end, whatever they do."""
    with _pool(workers) as pool:
        yield Processes(pool, workers)


@contextmanager
def _pool(workers: int) -> Generator[Any]:
    pebble: Any = importlib.import_module("pebble")
    context = importlib.import_module("multiprocessing").get_context("spawn")
    pool = pebble.ProcessPool(max_workers=workers, context=context)
    try:
        yield pool
    finally:
        pool.stop()
        pool.join()
