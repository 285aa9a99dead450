"""The loop that has an engine compute work units, and records how each of them ended.

An engine submits a task and returns a future. A unit whose worker ends, or that takes too long, is
tried once more when nothing else is under way; then it is quarantined with its reason. A unit that
fails with an error of this project is quarantined at once, by the worker: it would fail again. A
failure that would befall every unit - a full disk, a worker with other packages - ends the run.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Protocol

from sim_validate.datasets.building.staging import Staging
from sim_validate.datasets.building.worker import Limits, Task, Work, WorkerError, do_task, do_unit
from sim_validate.datasets.units import WorkUnit, provenance
from sim_validate.parallel import interrupts

AHEAD = 3
"""Units under way per worker, so that no worker waits for the driver."""
LOOK_S = 1.0
"""Time between two checks for an interrupt [s]."""


class Engine(Protocol):
    """Something that computes units on some workers."""

    workers: int

    @property
    def ended(self) -> tuple[str, ...]:
        """Names of the errors which say that a worker ended, not that it could not begin."""
        ...

    def submit(self, function: Callable[[Task], None], task: Task, /) -> "Future[None]":
        """Start a task on a worker."""
        ...


def drive(
    units: Sequence[WorkUnit],
    staging: Staging,
    engine: Engine,
    report: Callable[[int, int], None],
    limits: Limits | None = None,
    work: Work = do_unit,
) -> None:
    """Have units computed; each is kept or quarantined in the end.

    Args:
        units: The units to compute.
        staging: The folder of finished units.
        engine: The engine that computes them.
        report: Called with (finished, total) when units finish.
        limits: Time and memory for each unit.
        work: The function that computes a unit.

    Raises:
        WorkerError: A worker cannot compute units for this driver.
        OSError: Rows cannot be written.
    """
    own = dict(provenance())
    told = -1
    waiting = deque(Task(unit, staging, own, limits, work) for unit in units)
    again, finished = list[Task](), 0
    under_way: dict[Future[None], Task] = {}
    while waiting or under_way:
        while waiting and len(under_way) < AHEAD * engine.workers:
            task = waiting.popleft()
            under_way[engine.submit(do_task, task)] = task
        done, _ = wait(under_way, timeout=LOOK_S, return_when=FIRST_COMPLETED)
        for future in done:
            task = under_way.pop(future)
            if _succeeded(future, task, engine):
                finished += 1
            else:
                again.append(task)
        interrupts.check()
        if finished > told:
            told = finished
            report(finished, len(units))
    for task in again:
        _try_alone(task, engine)
        finished += 1
        report(finished, len(units))


def _try_alone(task: Task, engine: Engine) -> None:
    """Try a unit once more by itself; a second failure is its own fault."""
    began = time.monotonic()
    future = engine.submit(do_task, task)
    while not wait([future], timeout=LOOK_S).done:
        interrupts.check()
    if _succeeded(future, task, engine):
        return
    took_s = time.monotonic() - began
    late = task.limits is not None and took_s >= task.limits.timeout_s
    reason = "took too long, twice" if late else "its worker ended, twice"
    task.staging.quarantine(task.unit, reason)


def _succeeded(future: "Future[None]", task: Task, engine: Engine) -> bool:
    """Whether a unit was computed; False if its worker ended, or was ended.

    Raises:
        WorkerError: The worker cannot compute units for this driver.
        OSError: The unit's rows could not be written.
    """
    error = future.exception()
    if error is None:
        if task.staging.finished(task.unit):
            return True
        raise WorkerError(
            f"{task.staging.folder}: a unit is finished, but its rows are missing; --out must be "
            "on a file system that driver and workers share"
        )
    if type(error).__name__ in engine.ended:
        return False
    if isinstance(error, WorkerError | OSError | KeyboardInterrupt):
        raise error
    name = type(error).__name__
    raise WorkerError(f"a worker cannot compute units: {name}: {error}") from error
