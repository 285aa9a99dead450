"""Runs units of work in processes of this machine.

Results do not depend on the number of processes: a unit sees only its own arguments.
"""

import os
import pickle
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Generic, TypeVar

Unit = TypeVar("Unit")
Result = TypeVar("Result")
Value = TypeVar("Value")

SHARE = Path("/sys/fs/cgroup/cpu.max")
"""The Linux file that limits a container's processor time: microseconds of use per period."""
START_S = 1.0
"""Time in which a process starts [s]; work that takes less is done without others."""
UNITS_PER_PROCESS = 8
"""Number of simulated grasps for which a process is better than threads of the simulator: its start
takes as long as eight validations."""
KEPT = 4
"""Number of shared values that a process keeps."""


def available_cores() -> int:
    """Count the cores that this process may use, limited by the share of its container."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        share, period = SHARE.read_text().split()
        return max(1, min(own or 1, int(share) // int(period)))
    except (OSError, ValueError):  # not in a container, or in one without a limit
        return own or 1


def processes(units: int, jobs: int) -> int:
    """Compute how many processes to use, at least one, where threads take the other cores."""
    return max(1, min(jobs, units // UNITS_PER_PROCESS))


def each(
    function: Callable[[Unit], Result], units: Sequence[Unit], *, jobs: int
) -> Iterator[Result]:
    """Yield the results of a function on each unit, in order, as they become ready.

    This process works with the others, which start where there is work for them for longer than a
    start takes.
    """
    # commands' flags count cores, and need not wait for this
    from grasp_core.processes import local_processes

    others = min(jobs, len(units)) - 1
    if others < 1:
        yield from map(function, units)
        return
    with local_processes(others, START_S) as workers:
        yield from workers.in_order(function, units, ahead=len(units))


class Shared(Generic[Value]):
    """A hashable value that arrives in another process as the one that arrived there before.

    Otherwise each unit would bring its own copy of, say, an object, and what is kept for that
    object from one unit to the next would be computed again for each copy.
    """

    def __init__(self, value: Value) -> None:
        self.value = value

    def __reduce__(self) -> tuple[Callable[[bytes], "Shared[Any]"], tuple[bytes]]:
        """Pickle the value by itself, so that equal bytes tell that it is the same."""
        return _arrived, (_packed(self.value),)


@lru_cache(maxsize=KEPT)
def _packed(value: object) -> bytes:
    return pickle.dumps(value)


@lru_cache(maxsize=KEPT)
def _arrived(data: bytes) -> Shared[Any]:
    return Shared(pickle.loads(data))  # noqa: S301 - the process that started this one packed it
