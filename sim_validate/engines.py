"""Work units on one or more processes of this machine, in order or one by one; the door to pebble.

Results do not depend on the number of processes: a unit sees only its own arguments.
"""

import importlib
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, TypeVar

Unit = TypeVar("Unit")
Result = TypeVar("Result")

UNITS_PER_PROCESS = 8
"""A process takes about a second to start, as long as eight validations: with fewer units for
each, starting it does not pay."""


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
    pebble: Any = importlib.import_module("pebble")
    context = importlib.import_module("multiprocessing").get_context("spawn")
    with pebble.ProcessPool(max_workers=workers, context=context) as pool:
        future = pool.map(function, units)
        try:
            yield from future.result()
        finally:
            future.cancel()
            pool.stop()


class Processes:
    """Processes that do single tasks, with limits of time and memory."""

    def __init__(self, workers: int, timeout_s: float, memory_bytes: int | None) -> None:
        pebble: Any = importlib.import_module("pebble")
        context = importlib.import_module("multiprocessing").get_context("spawn")
        self.workers = workers
        self._timeout_s = timeout_s
        self._pool = pebble.ProcessPool(
            max_workers=workers, context=context, initializer=_limit_memory, initargs=[memory_bytes]
        )

    def submit(self, function: Callable[..., Result], /, *args: object) -> "Future[Result]":
        """Have a function called; its future fails with `TimeoutError` where it takes too long."""
        return self._pool.schedule(function, args=list(args), timeout=self._timeout_s)

    def close(self) -> None:
        """Stop all processes, whatever they do."""
        self._pool.stop()
        self._pool.join()


@contextmanager
def started(
    workers: int, timeout_s: float, memory_bytes: int | None = None
) -> Generator[Processes]:
    """Processes for single tasks, gone afterwards.

    Args:
        workers: How many.
        timeout_s: How long each task may take.
        memory_bytes: What each process may ask for; no limit if not given.
    """
    engine = Processes(workers, timeout_s, memory_bytes)
    try:
        yield engine
    finally:
        engine.close()


def _limit_memory(most: int | None) -> None:
    if most is not None:
        resource: Any = importlib.import_module("resource")
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
