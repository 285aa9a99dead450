"""One loop that has work units done by an engine, some at a time, and notes what became of each.

An engine submits a unit and returns a future. A unit that ends its worker, or takes too long, is
tried once more when nothing else is under way; then it is quarantined with its reason. What fails
with an error of ours is quarantined at once, by the worker: it would come out the same again.
"""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Protocol

from grasp_core.errors import GraspError
from sim_validate import interrupts
from sim_validate.datasets.rows import rows_of
from sim_validate.datasets.staging import Staging
from sim_validate.datasets.units import WorkUnit

AHEAD = 3
"""Units under way for each worker, so that none waits for the driver."""
LOOK_S = 1.0
"""How often the driver looks whether it was interrupted [s]."""
Work = Callable[[WorkUnit, Staging], None]


class Engine(Protocol):
    """Where units are done."""

    workers: int

    def submit(self, function: Work, unit: WorkUnit, staging: Staging, /) -> "Future[None]":
        """Have a unit done; its future fails with `TimeoutError` where it takes too long."""
        ...


def do_unit(unit: WorkUnit, staging: Staging) -> None:
    """Make the rows of a unit and keep them, or the reason why there are none."""
    try:
        rows = rows_of(unit)
    except GraspError as error:
        staging.quarantine(unit, str(error))
    except MemoryError:
        staging.quarantine(unit, "out of memory")
    else:
        staging.write(unit, rows)


def drive(
    units: Sequence[WorkUnit],
    staging: Staging,
    engine: Engine,
    report: Callable[[int, int], None],
    work: Work = do_unit,
) -> None:
    """Have units done, each kept or quarantined in the end.

    Args:
        units: Those that are not done.
        staging: Where they are kept.
        engine: Where they are done.
        report: Told how many are finished, and of how many.
        work: What is done.
    """
    waiting, again = deque(units), list[WorkUnit]()
    under_way: dict[Future[None], WorkUnit] = {}
    finished = 0
    while waiting or under_way:
        while waiting and len(under_way) < AHEAD * engine.workers:
            unit = waiting.popleft()
            under_way[engine.submit(work, unit, staging)] = unit
        done, _ = wait(under_way, timeout=LOOK_S, return_when=FIRST_COMPLETED)
        for future in done:
            unit = under_way.pop(future)
            if future.exception() is None:
                finished += 1
            else:
                again.append(unit)
        interrupts.check()
        report(finished, len(units))
    for unit in again:
        future = engine.submit(work, unit, staging)
        while not wait([future], timeout=LOOK_S).done:
            interrupts.check()
        if (error := future.exception()) is not None:
            staging.quarantine(unit, _why(error))
        finished += 1
        report(finished, len(units))


def _why(error: BaseException) -> str:
    if isinstance(error, TimeoutError):
        return "took too long, twice"
    return f"its worker ended, twice: {type(error).__name__}: {error}"
