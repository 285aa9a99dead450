"""Has units of work computed by worker processes, and deals with those that fail.

An engine submits a unit of work to a worker process and returns a future. A unit whose worker dies,
or that takes too long, is tried once more when nothing else is under way; then it is quarantined:
left out, with the reason recorded. A unit that fails with an error of this project is quarantined
at once, because it would fail again. A failure that would befall every unit - a full disk, a worker
with other packages - ends the build. A worker process must run the same code and packages as the
process that started it, or its rows could differ. A timer beside Python ends a process in which a
unit takes too long, also inside a call that never comes back.
"""

import errno
import faulthandler
import os
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import TIMEOUT_MAX
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

from grasp_core.errors import GraspError
from grasp_core.processes import Processes
from grasp_core.time_spent import TIME_SPENT, Seconds
from sim_validate.datasets.clusters import Cluster
from sim_validate.datasets.making_rows import compute_rows
from sim_validate.datasets.work_units import WorkerError, WorkUnit, body_of, provenance
from sim_validate.processes.interrupts import check_interrupted

Engine: TypeAlias = Processes | Cluster
UNITS_AHEAD = 3
"""Number of units submitted per worker process, so that no worker waits for the next unit."""
INTERRUPT_LOOK_S = 1.0


Unit = TypeVar("Unit")
Kept = TypeVar("Kept", contravariant=True)


class UnitStaging(Protocol[Kept]):
    """What keeps the results of units until all of them are there."""

    @property
    def folder(self) -> Path:
        """The folder of all units."""
        ...

    def of(self, unit: Kept) -> Path:
        """Return the file or folder that is there once a unit is finished or quarantined."""
        ...

    def write(self, unit: Kept, made: Any) -> None:
        """Keep what was computed of a unit."""
        ...

    def quarantine(self, unit: Kept, reason: str) -> None:
        """Record that a unit cannot be computed, with the reason."""
        ...


ComputeUnit: TypeAlias = Callable[[Unit, UnitStaging[Unit]], None]


def compute_unit(unit: WorkUnit, staging: UnitStaging[WorkUnit]) -> None:
    """Compute the rows of a unit and keep them, or the reason why there are none."""
    keep_result(unit, staging, lambda unit: compute_rows(unit, body_of(unit)))


def keep_result(unit: Unit, staging: UnitStaging[Unit], work: Callable[[Unit], object]) -> None:
    """Keep what a function makes of a unit, or the reason why it makes nothing."""
    try:
        staging.write(unit, work(unit))
    except WorkerError:
        raise
    except GraspError as error:
        staging.quarantine(unit, str(error))
    except (MemoryError, OSError) as error:
        if isinstance(error, OSError) and error.errno != errno.ENOMEM:
            raise
        staging.quarantine(unit, "out of memory")
    except Exception as error:  # a bug that one object triggers must not stop the others
        staging.quarantine(unit, f"internal error: {type(error).__name__}: {error}")


@dataclass(frozen=True, slots=True)
class UnitTask(Generic[Unit]):
    """A unit of work, with all that a worker process needs to compute it."""

    unit: Unit
    staging: UnitStaging[Unit]
    provenance: Mapping[str, str]
    """Versions of packages, and the hash of the code, that the worker process must have, too."""
    timeout_s: float | None
    """Time that the unit may take [s]; None for no limit."""
    compute: ComputeUnit[Unit]


def compute_in_worker(task: UnitTask[Any]) -> Seconds:
    """Compute a unit in a worker process, and keep its rows; return the time that it took."""
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
    with _ending_after(task.timeout_s):
        task.compute(task.unit, task.staging)
    return TIME_SPENT.taken()


@contextmanager
def _ending_after(timeout_s: float | None) -> Generator[None]:
    if timeout_s is None:
        yield
        return
    with Path(os.devnull).open("w") as unread:
        # a thread that needs nothing of Python: also calls that never give it back are ended
        faulthandler.dump_traceback_later(min(timeout_s, TIMEOUT_MAX), exit=True, file=unread)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def compute_all(
    units: Sequence[Unit],
    staging: UnitStaging[Unit],
    engine: Engine,
    report: Callable[[int, int], None],
    timeout_s: float | None,
    compute: ComputeUnit[Unit],
) -> None:
    """Have all units computed; each one is kept or quarantined in the end.

    Takes `report` (finished, total).
    """
    own, finished, again = dict(provenance()), 0, list[UnitTask[Unit]]()
    tasks = [UnitTask(unit, staging, own, timeout_s, compute) for unit in units]
    report(finished, len(units))
    for task, good in _ended(tasks, engine, UNITS_AHEAD * engine.workers):
        again += [] if good else [task]
        finished += good
        report(finished, len(units))
    for task in again:  # with no other unit under way
        began = time.monotonic()
        ((_, good),) = _ended([task], engine, 1)
        if not good:
            late = timeout_s is not None and time.monotonic() - began >= timeout_s
            reason = "took too long, twice" if late else "its worker ended, twice"
            staging.quarantine(task.unit, reason)
        finished += 1
        report(finished, len(units))


def _ended(
    tasks: Sequence[UnitTask[Unit]], engine: Engine, ahead: int
) -> Iterator[tuple[UnitTask[Unit], bool]]:
    """Yield each task when it has ended, with whether it is done or its worker process has died."""
    waiting, under_way = deque(tasks), dict[Future[Seconds], UnitTask[Unit]]()
    while waiting or under_way:
        while waiting and len(under_way) < ahead:
            task = waiting.popleft()
            under_way[engine.submit(compute_in_worker, task)] = task
        for future in wait(under_way, timeout=INTERRUPT_LOOK_S, return_when=FIRST_COMPLETED).done:
            task = under_way.pop(future)
            yield task, _succeeded(future, task, engine)
        check_interrupted()


def _succeeded(future: "Future[Seconds]", task: UnitTask[Any], engine: Engine) -> bool:
    error = future.exception()
    if error is None:
        TIME_SPENT.add(future.result())
        if task.staging.of(task.unit).exists():
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
