"""Runs units of work in processes of this machine.

Results do not depend on the number of processes: a unit sees only its own arguments.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

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
