"""One work unit in a worker: the worker is checked, limits are enforced, rows are kept.

A worker must run the code and the packages of the driver, or its rows would not be those of the
driver. The system enforces the limits, whatever a unit does: a timer ends a process in which a unit
takes too long, also inside a call that never comes back, and memory beyond the limit is refused.
"""

import errno
import importlib
import os
import signal
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from grasp_core.errors import GraspError
from sim_validate.datasets.building.make_unit import made_of
from sim_validate.datasets.building.staging import Staging
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.units import WorkerError, WorkUnit, body_of, provenance, units_of


@dataclass(frozen=True, slots=True)
class Limits:
    """Time and memory that one unit may use."""

    timeout_s: float
    memory_bytes: int | None = None
    """Address space beyond what a process needs to start; None for no limit."""


Work: TypeAlias = Callable[[WorkUnit, Staging], None]


def do_unit(unit: WorkUnit, staging: Staging) -> None:
    """Make the rows of a unit and keep them, or the reason why there are none.

    Raises:
        WorkerError: The worker cannot see the unit's mesh.
        OSError: Nothing can be written.
    """
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
    """A unit as it is sent to a worker."""

    unit: WorkUnit
    staging: Staging
    provenance: Mapping[str, str]
    """Versions and code hash of the driver."""
    limits: Limits | None = None
    """Limits of the unit; None where the worker is the driver's own process."""
    work: Work = do_unit


def do_task(task: Task) -> None:
    """Compute a unit in a worker.

    Raises:
        WorkerError: The worker's packages are not the driver's, or it cannot see the driver's
            folder.
    """
    _check_worker(task)
    if task.limits is None:
        task.work(task.unit, task.staging)
        return
    with _kept(task.limits):
        task.work(task.unit, task.staging)


def _check_worker(task: Task) -> None:
    own = provenance()
    for name, wanted in task.provenance.items():
        if own.get(name) != wanted:
            raise WorkerError(
                f"a worker has another {name} than this driver: {own.get(name)} instead of "
                f"{wanted}; install the same on both"
            )
    if not task.staging.folder.is_dir():
        raise WorkerError(
            f"{task.staging.folder}: a worker cannot see this folder; --out must be on a file "
            "system that driver and workers share"
        )


@contextmanager
def _kept(limits: Limits) -> Generator[None]:
    signal.setitimer(signal.ITIMER_REAL, limits.timeout_s)
    try:
        with _memory_kept(limits.memory_bytes):
            yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


@contextmanager
def _memory_kept(more: int | None) -> Generator[None]:
    if more is None:
        yield
        return
    _load()  # a library that runs out of memory while it starts can hang
    resource: Any = importlib.import_module("resource")
    before, most = resource.getrlimit(resource.RLIMIT_AS)
    set_before = [limit for limit in (before, most) if limit != resource.RLIM_INFINITY]
    wanted = min([_address_space() + more, *set_before])
    resource.setrlimit(resource.RLIMIT_AS, (wanted, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (before, most))


@cache
def _load() -> None:
    """Compute a small unit, so that everything that units need is loaded."""
    config = DatasetConfig(objects=("tetrahedron",), families=("concurrent",), limit=1)
    (unit,) = units_of(config)
    made_of(unit, body_of(unit))


def _address_space() -> int:
    """Size of this process's address space in bytes; 0 where the system does not say."""
    sizes = Path("/proc/self/statm")
    if not sizes.is_file():
        return 0
    return int(sizes.read_text(encoding="ascii").split()[0]) * int(os.sysconf("SC_PAGE_SIZE"))
