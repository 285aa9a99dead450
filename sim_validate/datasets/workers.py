"""Distributes units of work to worker processes, and records how each unit ended.

An engine submits a unit to a worker process and returns a future. A unit whose worker dies, or that
takes too long, is tried once more when nothing else is under way; then it is quarantined: left out,
with the reason recorded. A unit that fails with an error of this project is quarantined at once,
because it would fail again. A failure that would befall every unit - a full disk, a worker with
other packages - ends the build.

A worker process must run the same code and packages as the process that started it, or its rows
could differ. A timer of the system ends a process in which a unit takes too long, also inside a
call that never comes back.
"""

import errno
import signal
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from grasp_core.errors import GraspError
from sim_validate.datasets.make_unit import made_of
from sim_validate.datasets.staging import Staging
from sim_validate.datasets.units import WorkerError, WorkUnit, body_of, provenance
from sim_validate.kit.processes import check_interrupted

AHEAD = 3
"""Number of units submitted per worker process, so that no worker waits for the next unit."""
LOOK_S = 1.0
"""Time between two checks for an interrupt [s]."""


Work: TypeAlias = Callable[[WorkUnit, Staging], None]


def do_unit(unit: WorkUnit, staging: Staging) -> None:
    """Compute the rows of a unit and keep them, or the reason why there are none."""
    try:
        staging.write(unit, made_of(unit, body_of(unit)))
    except WorkerError:
        raise
    except GraspError as error:
        staging.quarantine(unit, str(error))
    except MemoryError:
        staging.quarantine(unit, "out of memory")
    except OSError as error:
        if error.errno != errno.ENOMEM:
            raise
        staging.quarantine(unit, "out of memory")
    except Exception as error:  # a bug that one object triggers must not stop the others
        staging.quarantine(unit, f"internal error: {type(error).__name__}: {error}")


@dataclass(frozen=True, slots=True)
class Task:
    """A unit of work, with all that a worker process needs to compute it."""

    unit: WorkUnit
    staging: Staging
    provenance: Mapping[str, str]
    """Versions of packages, and the hash of the code, that the worker process must have, too."""
    timeout_s: float | None = None
    """Time that the unit may take [s]; None where the process that runs the build computes it."""
    work: Work = do_unit


def do_task(task: Task) -> None:
    """Compute a unit in a worker process, and keep its rows."""
    own = provenance()
    for name, wanted in task.provenance.items():
        if own.get(name) != wanted:
            raise WorkerError(
                f"a worker process has another version of {name}: {own.get(name)} instead of "
                f"{wanted}; install the same version everywhere"
            )
    if not task.staging.folder.is_dir():
        raise WorkerError(
            f"{task.staging.folder}: a worker process cannot see this folder; --out must be on a "
            "file system that all processes share"
        )
    if task.timeout_s is None:
        task.work(task.unit, task.staging)
        return
    signal.setitimer(signal.ITIMER_REAL, task.timeout_s)
    try:
        task.work(task.unit, task.staging)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


class Engine(Protocol):
    """What computes units of work: processes of this machine, or a Ray or Dask cluster."""

    workers: int

    @property
    def ended(self) -> tuple[str, ...]:
        """Names of the errors which say that a worker process died while it computed."""
        ...

    def submit(self, function: Callable[[Task], None], task: Task, /) -> "Future[None]":
        """Start a task on a worker process."""
        ...


def drive(
    units: Sequence[WorkUnit],
    staging: Staging,
    engine: Engine,
    report: Callable[[int, int], None],
    timeout_s: float | None = None,
    work: Work = do_unit,
) -> None:
    """Have all units computed; each one is kept or quarantined in the end.

    Takes `report` (finished, total).
    """
    own = dict(provenance())
    told = -1
    waiting = deque(Task(unit, staging, own, timeout_s, work) for unit in units)
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
        check_interrupted()
        if finished > told:
            told = finished
            report(finished, len(units))
    for task in again:
        _try_alone(task, engine)
        finished += 1
        report(finished, len(units))


def _try_alone(task: Task, engine: Engine) -> None:
    """Try a unit once more with no other unit under way; quarantine it if it fails again."""
    began = time.monotonic()
    future = engine.submit(do_task, task)
    while not wait([future], timeout=LOOK_S).done:
        check_interrupted()
    if _succeeded(future, task, engine):
        return
    took_s = time.monotonic() - began
    late = task.timeout_s is not None and took_s >= task.timeout_s
    reason = "took too long, twice" if late else "its worker ended, twice"
    task.staging.quarantine(task.unit, reason)


def _succeeded(future: "Future[None]", task: Task, engine: Engine) -> bool:
    error = future.exception()
    if error is None:
        if task.staging.finished(task.unit):
            return True
        raise WorkerError(
            f"{task.staging.folder}: a worker process has computed rows that do not appear here; "
            "--out must be on a file system that all processes share"
        )
    if type(error).__name__ in engine.ended:
        return False
    if isinstance(error, WorkerError | OSError | KeyboardInterrupt):
        raise error
    name = type(error).__name__
    raise WorkerError(
        f"a worker process cannot compute units of work ({name}: {error}); check that all worker "
        "processes have the same packages"
    ) from error
