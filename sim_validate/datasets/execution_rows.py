"""Turns the execution of a grasp into cells of its row, and into one row per trial."""

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any, TypeAlias

from grasp_core.values import FINGERS
from sim_validate.execution.jobs import ExecutedGrasp
from sim_validate.execution.verdict import Execution

Executed: TypeAlias = ExecutedGrasp | str | None
"""An execution, the reason why it was refused, or None where none is asked for."""


def execution_cells(executed: Executed) -> dict[str, Any]:
    """Return the cells of a grasp's row that are about its execution, by column.

    Where no squeeze holds the object, the grasp did not survive. Where the execution was refused,
    or no trial is possible, it is not known whether the grasp survives.
    """
    if executed is None:
        return {}
    if isinstance(executed, str):
        return {"executed": False, "execution_note": executed}
    found = executed.execution
    if found is None:
        return {"executed": False, "survived": False, "execution_note": executed.reason}
    trials = found.trials
    return {
        "executed": True,
        "survived": found.survived if trials else None,
        "execution_note": "; ".join(f"{each.kind}: {each.reason}" for each in found.skipped),
        "mass_kg": found.mass_kg,
        "squeeze_n": for_fingers(found.squeeze.tolist(), [None] * 3),
        "load_multiple": found.load_multiple,
        "predicted_first_slip": min((each.predicted_first_slip for each in trials), default=None),
        "simulated_first_slip": min((each.simulated_first_slip for each in trials), default=None),
        "executed_trials": len(trials),
        "execution_mismatches": sum(not each.let_go for each in found.controls),
    }


def execution_rows(name: str, executed: Executed) -> Iterator[dict[str, Any]]:
    """Yield a row for each trial of an execution.

    Args:
        name: Name of the grasp's row.
        executed: What was executed, if anything was.
    """
    found = executed.execution if isinstance(executed, ExecutedGrasp) else None
    yield from _rows(name, found) if found is not None else ()


def _rows(name: str, found: Execution) -> Iterator[dict[str, Any]]:
    for number, trial in enumerate(found.trials):
        yield {"grasp_id": name, "trial": number, **asdict(trial)}


def for_fingers(values: Iterable[Any], missing: Any) -> list[Any]:
    """Pad a list to four fingers, as contact sets may have fewer."""
    listed = list(values)
    return listed + [missing] * (FINGERS - len(listed))
