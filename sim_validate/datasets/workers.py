"""Distributes units of work to worker processes, and records how each unit ended.

An engine submits a unit to a worker process and returns a future. A unit whose worker dies, or that
takes too long, is tried once more when nothing else is under way; then it is quarantined: left out,
with the reason recorded. A unit that fails with an error of this project is quarantined at once,
because it would fail again. A failure that would befall every unit - a full disk, a worker with
other packages - ends the build.

A worker process must run the same code and packages as the process that started it, or its rows
could differ. A timer of the system ends a process in which a unit takes too long, also inside a
call that never comes back.

Finished units are kept in a staging folder: one subfolder per unit, renamed in one step. A unit
that was killed leaves only a temporary folder, which is removed when it is computed again. So every
subfolder is complete, and a resumed build repeats only the units that were under way.
"""

import errno
import os
import re
import shutil
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from grasp_core.errors import GraspError, InputError
from grasp_core.files.records import RecordFile
from grasp_core.kinds import FieldError, shown
from grasp_core.processes import Processes
from sim_validate.datasets.columns import parquet_bytes
from sim_validate.datasets.config import Name, SplitName
from sim_validate.datasets.open_dataset import Listed, listed
from sim_validate.datasets.rows import dataset_tables
from sim_validate.datasets.units import Making, WorkerError, WorkUnit, body_of, made_of, provenance
from sim_validate.kit.files import whole_folder
from sim_validate.kit.processes import Cluster, check_interrupted

HASH = re.compile(r"[0-9a-f]{64}")
OTHERS = "others"
"""Subfolder for those files of a unit that are not tables."""


@dataclass(frozen=True, slots=True)
class UnitRecord(RecordFile):
    """Record of a finished unit of work: where its rows belong, or why it has none."""

    FILE = "unit.json"
    SCHEMA = 2

    object: str
    friction: float
    files: tuple[Listed, ...]
    """Files of the unit's folder."""
    object_id: str | None = None
    """Hash of the object's mesh, in whose table its row is; None if there are no rows."""
    split: SplitName | None = None
    reason: str | None = None
    """Why there are no rows; None if there are."""

    def _check_together(self) -> None:
        there = (self.object_id is not None, self.split is not None, self.reason is None)
        if len(set(there)) > 1:
            raise InputError(
                "expected an object_id and a split, or else a reason for having no rows; remove "
                "the folder and build again"
            )
        if self.object_id is not None and not HASH.fullmatch(self.object_id):
            raise FieldError("object_id", f"must be a SHA-256 hash, got {shown(self.object_id)}")


@dataclass(frozen=True, slots=True)
class Staging:
    """The folder that holds finished units of work until the dataset is complete."""

    folder: Path

    def remove(self) -> None:
        """Remove the whole staging folder, once a finished dataset holds its contents."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, unit: WorkUnit, made: Making) -> None:
        """Keep the rows and files of a finished unit."""
        kinds = dataset_tables(unit.config.groups)
        tables = {
            _file(name): parquet_bytes(name, made.rows.cells(name, columns), kinds)
            for name, columns in kinds.items()
        }
        others = {f"{OTHERS}/{path}": text.encode() for path, text in made.files.items()}
        (row,) = made.rows.objects
        self._put(unit, {**tables, **others}, object_id=row.object_id, split=row.split)

    def quarantine(self, unit: WorkUnit, reason: str) -> None:
        """Record that a unit cannot be computed, with the reason."""
        self._put(unit, {}, reason=reason)

    def record(self, unit: WorkUnit) -> UnitRecord:
        """Look up how a unit ended: with its object and split, or with a reason for no rows."""
        return UnitRecord.read(self._of(unit) / UnitRecord.FILE)

    def done(self, unit: WorkUnit) -> bool:
        """Tell whether a unit is finished or quarantined, and all its files are as written."""
        try:
            return not any(each.fault(self._of(unit)) for each in self.record(unit).files)
        except (OSError, InputError):
            return False

    def finished(self, unit: WorkUnit) -> bool:
        """Tell whether a unit has a folder, with its rows or the reason why it has none."""
        return self._of(unit).is_dir()

    def table(self, unit: WorkUnit, name: Name) -> Path:
        """Return the path of a finished unit's rows in one of the tables."""
        return self._of(unit) / _file(name)

    def copy_files(self, unit: WorkUnit, folder: Path) -> None:
        """Copy the files that a finished unit made besides its rows into the dataset."""
        shutil.copytree(self._of(unit) / OTHERS, folder, dirs_exist_ok=True)

    def forget(self, unit: WorkUnit) -> None:
        """Remove the results of a unit whose files are damaged."""
        shutil.rmtree(self._of(unit), ignore_errors=True)

    def _of(self, unit: WorkUnit) -> Path:
        return self.folder / unit.id

    def _put(self, unit: WorkUnit, files: Mapping[str, bytes], **more: Any) -> None:
        try:
            with whole_folder(self._of(unit)) as made:
                kept = tuple(listed(made, _kept(made / name, data)) for name, data in files.items())
                record = UnitRecord(unit.object, unit.friction, kept, **more)
                _kept(made / record.FILE, record.text().encode())
        except (OSError, InputError):
            if not self.done(unit):  # otherwise another attempt was faster and wrote the same rows
                raise


def _file(name: Name) -> str:
    return f"{name}.parquet"


def _kept(path: Path, data: bytes) -> Path:
    """Write a file so that it outlasts a loss of power."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    return path


Engine: TypeAlias = Processes | Cluster
"""What computes units of work: processes of this machine, or a Ray or Dask cluster."""
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
    except (MemoryError, OSError) as error:
        if isinstance(error, OSError) and error.errno != errno.ENOMEM:
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
    signal.setitimer(signal.ITIMER_REAL, task.timeout_s or 0.0)  # none for zero
    try:
        task.work(task.unit, task.staging)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


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
    own, finished, again = dict(provenance()), 0, list[Task]()
    tasks = [Task(unit, staging, own, timeout_s, work) for unit in units]
    report(finished, len(units))
    for task, good in _ended(tasks, engine, AHEAD * engine.workers):
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


def _ended(tasks: Sequence[Task], engine: Engine, ahead: int) -> Iterator[tuple[Task, bool]]:
    """Yield each task when it has ended, with whether it is done or its worker process has died."""
    waiting, under_way = deque(tasks), dict[Future[None], Task]()
    while waiting or under_way:
        while waiting and len(under_way) < ahead:
            task = waiting.popleft()
            under_way[engine.submit(do_task, task)] = task
        for future in wait(under_way, timeout=LOOK_S, return_when=FIRST_COMPLETED).done:
            task = under_way.pop(future)
            yield task, _succeeded(future, task, engine)
        check_interrupted()


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
