"""Starts what runs units of work: processes of this machine, or a Ray or Dask cluster.

Neither cluster repeats a unit by itself, because one place decides for all engines when to give up
on a unit. Without `address`, Ray and Dask start workers on this machine and stop them afterwards.
"""

import importlib
import os
import socket
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.processes import Processes, local_processes

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


@dataclass(slots=True)
class Cluster:
    """The worker processes of a cluster."""

    workers: int
    ended: tuple[str, ...]
    """Names of the errors which say that a worker process died while it computed."""
    submit: Callable[[Callable[[Any], Any], Any], "Future[Any]"]
    """Calls a function with a unit on a worker process; the future fails if that process dies."""


def workers_of(
    engine: str, jobs: int, address: str | None
) -> AbstractContextManager[Processes | Cluster]:
    """Start processes of this machine, or start or join a cluster."""
    if engine != "local":
        start = ray_workers if engine == "ray" else dask_workers
        return start(jobs, address)
    if address is not None:
        raise InputError(
            "--address names a Ray or Dask cluster: give --engine ray or --engine dask too, or "
            "leave it out"
        )
    return local_processes(jobs)


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
