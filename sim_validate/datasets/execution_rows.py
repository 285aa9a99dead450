"""Turns the execution of a grasp into cells of its row, and into one row per trial."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from typing import Any, TypeAlias

from grasp_core.values import FINGERS
from sim_validate.execution.settings import ExecutionSettings, TrialKind
from sim_validate.execution.verdict import ExecutedGrasp, Execution

Executed: TypeAlias = ExecutedGrasp | str | None
"""An execution, the reason why it was refused, or None where none is asked for."""


MISPLACED: TrialKind = "misplaced"


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
        "predicted_loss": finite(found.least_predicted_loss) if trials else None,
        "payload_kg": found.payload_kg,
        "executed_trials": len(trials),
        "execution_mismatches": sum(not each.let_go for each in found.controls),
    }


def finite(value: float) -> float | None:
    """Return a number, or None where it is not finite."""
    return value if math.isfinite(value) else None


def executed_by(
    execute: Callable[[ExecutionSettings], ExecutedGrasp], settings: ExecutionSettings,
    seeds: Sequence[int],
) -> ExecutedGrasp:  # fmt: skip
    """Execute contacts, and once more for each seed with objects misplaced by it."""
    first = execute(settings)
    if first.execution is None or MISPLACED not in settings.trials:
        return first
    trials = list(first.execution.trials)
    for place, seed in enumerate(seeds, start=1):
        more = execute(replace(settings, trials=(MISPLACED,), seed=seed)).execution
        of_seed = () if more is None else more.trials
        trials += [
            replace(trial, name=f"{MISPLACED} {place * settings.misplacements + number}")
            for number, trial in enumerate(of_seed)
        ]
    return replace(first, execution=replace(first.execution, trials=tuple(trials)))


def execution_rows(
    name: str, executed: Executed, seeds: Sequence[int] = (), misplacements: int = 1
) -> Iterator[dict[str, Any]]:
    """Yield a row for each trial of an execution."""
    found = executed.execution if isinstance(executed, ExecutedGrasp) else None
    yield from _rows(name, found, seeds, misplacements) if found is not None else ()


def _rows(
    name: str, found: Execution, seeds: Sequence[int], misplacements: int
) -> Iterator[dict[str, Any]]:
    misplaced = 0
    for number, trial in enumerate(found.trials):
        seed = None
        if trial.kind == MISPLACED:
            seed = seeds[misplaced // misplacements] if seeds else None
            misplaced += 1
        yield {"grasp_id": name, "trial": number, **asdict(trial), "seed": seed}


def for_fingers(values: Iterable[Any], missing: Any) -> list[Any]:
    """Pad a list to four fingers, as contact sets may have fewer."""
    listed = list(values)
    return listed + [missing] * (FINGERS - len(listed))
