"""Runs units of work in processes of this machine, or on a Ray or Dask cluster.

Results do not depend on the number of processes: a unit sees only its own arguments.

Some compiled libraries clear errors that are not their own, keyboard interrupts too, and the
program would run on: interrupts are noted, and raised again at the next step. A request to end
(SIGTERM) counts as one.

Neither cluster repeats a unit by itself, because one place decides for all engines when to give up
on a unit. Without `address`, Ray and Dask start workers on this machine and stop them afterwards.
"""

import importlib
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

from grasp_core.errors import InputError
from grasp_core.stopping import Stop

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
    allowed: Callable[[int], set[int]] | None = getattr(os, "sched_getaffinity", None)  # on Linux
    own = os.cpu_count() if allowed is None else len(allowed(0))
    try:
        share, period = SHARE.read_text().split()
        return max(1, min(own or 1, int(share) // int(period)))
    except (OSError, ValueError):  # not in a container, or in one without a limit
        return own or 1


def processes(units: int, jobs: int) -> int:
    """Compute how many processes to use, at least one, where threads take the other cores."""
    return max(1, min(jobs, units // UNITS_PER_PROCESS))


def each(
    function: Callable[[Unit], Result], units: Sequence[Unit], *, jobs: int,
    stop: Callable[[], bool] | None = None,
) -> Iterator[Result]:  # fmt: skip
    """Yield the results of a function on each unit, in order, as they become ready.

    What units have in common is sent once to each process if the function holds it. This process
    works with the others, which start where there is work for them for longer than a
    start takes. Results that other processes have not ready when `stop` says so are dropped.
    """
    # commands' flags count cores, and need not wait for this
    from grasp_core.processes import local_processes

    others = min(jobs, len(units)) - 1
    if others < 1:
        yield from map(function, units)
        return
    with local_processes(others, START_S) as workers:
        yield from workers.in_order(function, units, ahead=len(units), stop=stop)


SIGNALS = (signal.SIGINT, signal.SIGTERM)

_noted = threading.Event()


@contextmanager
def interrupts_noted() -> Generator[None, None, None]:
    """Record interrupts, besides raising them, while the context is open."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python handles signals in its main thread only
        return
    _noted.clear()
    before = {number: signal.signal(number, _note) for number in SIGNALS}
    told = sys.unraisablehook
    # reports errors that cannot be raised where they occur, but interrupts, which are recorded
    sys.unraisablehook = lambda e: None if e.exc_type is KeyboardInterrupt else told(e)
    try:
        yield
    except Exception as error:
        if _noted.is_set():
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, handler)


def _note(_: int, __: FrameType | None) -> None:
    _noted.set()
    raise KeyboardInterrupt


@contextmanager
def interrupts_end(stop: Stop) -> Generator[None, None, None]:
    """Have the first interrupt end work in order, with what is done; the next one is raised."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}

    def note(_: int, __: FrameType | None) -> None:
        stop.now()
        for number, handler in before.items():
            signal.signal(number, handler)

    for number in before:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def check_interrupted() -> None:
    """Raise an interrupt that was recorded, where a library may have swallowed it."""
    if _noted.is_set():
        _noted.clear()
        raise KeyboardInterrupt


OBJECT_STORE_BYTES = 200 * 2**20
"""Size of the object store of a Ray started here; units and their rows go through files."""

RAY_SETTINGS = {
    "RAY_USAGE_STATS_ENABLED": "0", "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_worker_niceness": "0",
}  # fmt: skip
"""Settings under which Ray sends no usage statistics, hides no GPU from other programs here, and
lets workers run like any process: else units take too long beside busy processes."""

RAY_ENDED = ("WorkerCrashedError", "OutOfMemoryError", "LocalRayletDiedError", "NodeDiedError")
ANY_PORT = "127.0.0.1:0"
"""Address at which a Dask scheduler started here shows its state: for this machine only, at any
free port."""
ANSWER_S = 10.0
"""Time that a scheduler may take to answer [s]."""


@dataclass(slots=True)
class Cluster:
    """The worker processes of a cluster."""

    workers: int
    ended: tuple[str, ...]
    """Names of the errors which say that a worker process died while it computed."""
    submit: Callable[[Callable[[Any], Any], Any], "Future[Any]"]
    """Calls a function with a unit on a worker process; the future fails if that process dies."""


@contextmanager
def ray_workers(workers: int, address: str | None) -> Generator[Cluster]:
    """Start or join a Ray cluster."""
    with _environment(RAY_SETTINGS):  # read when Ray is imported, and by the programs it starts
        ray = _imported("ray", "ray")
        where: dict[str, Any] = {"address": address} if address else {
            "num_cpus": workers, "num_gpus": 0, "include_dashboard": False,
            "object_store_memory": OBJECT_STORE_BYTES,
        }  # fmt: skip
        if address is not None:
            _require_listener(address)
        try:
            ray.init(log_to_driver=False, configure_logging=False, **where)
        except (ConnectionError, ValueError, RuntimeError, TimeoutError) as error:
            raise InputError(
                f"--address {address}: no Ray cluster answers there ({error})"
            ) from error

        @cache
        def remote(function: Callable[..., Any]) -> Any:
            return ray.remote(max_retries=0, num_cpus=1)(function)

        try:
            yield Cluster(
                int(ray.cluster_resources().get("CPU", workers)),
                RAY_ENDED,
                lambda function, unit: remote(function).remote(unit).future(),
            )
        finally:
            ray.shutdown()


@contextmanager
def _environment(settings: Mapping[str, str]) -> Generator[None]:
    """Set variables of the environment that are not set, until the end of the block."""
    new = {name: value for name, value in settings.items() if name not in os.environ}
    os.environ.update(new)
    try:
        yield
    finally:
        for name in new:
            os.environ.pop(name, None)


def _require_listener(address: str) -> None:
    """Refuse a host and port where nothing listens, because Ray itself retries for minutes."""
    host, colon, port = address.split("://")[-1].rpartition(":")
    if not (colon and port.isdigit()):
        return
    try:
        socket.create_connection((host, int(port)), timeout=ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise InputError(f"--address {address}: no Ray cluster answers there ({error})") from error


@contextmanager
def dask_workers(workers: int, address: str | None) -> Generator[Cluster]:
    """Start or join a Dask cluster."""
    distributed = _imported("distributed", "dask")
    with ExitStack() as stack:
        if address is None:
            settings = {"distributed.scheduler.allowed-failures": 0}
            with importlib.import_module("dask").config.set(settings):
                cluster = stack.enter_context(distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, memory_limit=0,
                    dashboard_address=ANY_PORT, silence_logs=50,
                ))  # fmt: skip
            where = {"address": cluster}
        else:
            where = {"scheduler_file" if Path(address).is_file() else "address": address}
        try:
            client = stack.enter_context(distributed.Client(timeout=ANSWER_S, **where))
        except (OSError, ValueError) as error:
            raise InputError(f"--address {address}: no Dask scheduler answers ({error})") from error
        client.wait_for_workers(1)
        threads: dict[str, int] = client.nthreads()
        if any(count > 1 for count in threads.values()):
            raise InputError(
                "a Dask worker has several threads, but work that takes too long must end its "
                "whole process: start workers with --nthreads 1"
            )
        executor = client.get_executor(pure=False, retries=0)
        yield Cluster(max(1, len(threads)), ("KilledWorker",), executor.submit)


def _imported(module: str, extra: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"--engine {extra} needs {module}: pip install 'graspproof[{extra}]' ('.[{extra}]' in "
            "a checkout)"
        ) from error
