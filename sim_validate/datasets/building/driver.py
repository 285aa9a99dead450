"""One loop that has work units done by an engine, some at a time, and notes what became of each.

An engine submits a task and returns a future. A unit that ends its worker, or takes too long, is
tried once more when nothing else is under way; then it is quarantined with its reason. What fails
with an error of ours is quarantined at once, by the worker: it would come out the same again. What
would befall every unit - a full disk, a worker with other packages - ends the run.
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
"""Units under way for each worker, so that none waits for the driver."""
LOOK_S = 1.0
"""How often the driver looks whether it was interrupted [s]."""


class Engine(Protocol):
    """Where units are done."""

    workers: int

    @property
    def ended(self) -> tuple[str, ...]:
        """Names of the errors that say that a worker ended, not that it could not begin."""
        ...

    def submit(self, function: Callable[[Task], None], task: Task, /) -> "Future[None]":
        """Have a task done."""
        ...


def drive(
    units: Sequence[WorkUnit],
    staging: Staging,
    engine: Engine,
    report: Callable[[int, int], None],
    limits: Limits | None = None,
    work: Work = do_unit,
) -> None:
    """Have units done, each kept or quarantined in the end.

    Args:
        units: Those that are not done.
        staging: Where they are kept.
        engine: Where they are done.
        report: Told how many are finished, and of how many.
        limits: What each unit may take.
        work: What is done with it.

    Raises:
        WorkerError: A worker cannot do units for this driver.
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
    """Try a unit once more; what fails now is at fault itself."""
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
    """Whether a unit was done; false if its worker ended, or was ended.

    Raises:
        WorkerError: The worker cannot do units for this driver.
        OSError: Its rows could not be written.
    """
    error = future.exception()
    if error is None:
        if task.staging.finished(task.unit):
            return True
        raise WorkerError(
            f"{task.staging.folder}: a unit was done, but its rows are not here; --out must be on "
            "a file system that driver and workers share"
        )
    if type(error).__name__ in engine.ended:
        return False
    if isinstance(error, WorkerError | OSError | KeyboardInterrupt):
        raise error
    name = type(error).__name__
    raise WorkerError(f"a worker cannot do units: {name}: {error}") from error
