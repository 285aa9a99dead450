"""Work units on one or more processes of this machine, in order or one by one; the door to pebble.

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
"""Where Linux says how much of its processors a container may use: microseconds, of how many."""
UNITS_PER_PROCESS = 8
"""A process takes about a second to start, as long as eight validations: with fewer units for
each, starting it does not pay."""


def available_cores() -> int:
    """Cores that this process may use; of a container that is given a share, that share."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        share, period = SHARE.read_text().split()
        return max(1, min(own or 1, int(share) // int(period)))
    except (OSError, ValueError):  # no container, or one without a limit
        return own or 1


def processes(units: int, jobs: int) -> int:
    """How many processes so many units are worth, at least one."""
    return max(1, min(jobs, units // UNITS_PER_PROCESS))


def each(
    function: Callable[[Unit], Result], units: Sequence[Unit], *, jobs: int
) -> Iterator[Result]:
    """Results of a function on each unit, in order, as they become ready.

    Args:
        function: Importable by name; must not depend on anything but its argument.
        units: What to do.
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
    """Processes of this machine that do single tasks."""

    ended = ("ProcessExpired",)

    def __init__(self, pool: Any, workers: int) -> None:
        self.workers = workers
        self._pool = pool

    def submit(self, function: Callable[[Unit], Result], unit: Unit, /) -> "Future[Result]":
        """Have a function called; its future fails where the process ends."""
        return self._pool.schedule(function, args=[unit])


@contextmanager
def local_processes(workers: int) -> Generator[Processes]:
    """Processes of this machine, stopped afterwards, whatever they do."""
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
