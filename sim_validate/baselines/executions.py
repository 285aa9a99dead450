"""Executes grasps for baselines and tests, and summarises each execution as an entry keeps it."""

import math
from collections.abc import Iterator
from typing import Annotated

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from grasp_core.errors import InputError
from sim_validate.execution.jobs import ExecutionJob, executed_grasp
from sim_validate.execution.verdict import ExecutedGrasp, held_controls_in_words, losses_in_words

DIGITS = 12
"""Number of decimal digits to which a baseline keeps numbers."""
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
Count = Annotated[int, Field(ge=0)]
Size = Annotated[float, Field(ge=0.0)]


@dataclass(frozen=True, slots=True, config=STRICT)
class ExecutionEntry:
    """Summary of the execution of one grasp; None stands for what could not be measured."""

    reason: str | None
    """Why nothing was executed: no squeeze carries the weight; None if trials were run."""
    trials: Count
    lost: tuple[str, ...]
    """Names of the trials that were not survived, in order."""
    controls: Count
    """Number of the execution's negative controls, which must slip."""
    controls_let_go: Count
    """Number of these controls that slipped, as they must."""
    load_multiple: Size | None
    """Multiple of the object's weight, in any direction, that the squeeze is certified for."""
    predicted_first_slip: Size | None
    """Least multiple of a trial's load at which a contact slips, by analysis; None if none does."""
    simulated_first_slip: Size | None
    """Least multiple of a trial's load at which a contact slips, simulated; None if none does."""
    slip_m: Size | None
    """Farthest that a point of contact slid on the object [m]."""
    displacement_m: Size | None
    """Largest displacement of the object against the palm [m]."""
    turn_rad: Size | None
    """Largest turn of the object against the palm [rad]."""

    def __post_init__(self) -> None:
        """Refuse an entry whose numbers contradict each other."""
        if len(self.lost) > self.trials or self.controls_let_go > self.controls:
            raise ValueError(
                "`lost` or `controls_let_go` counts more than `trials` or `controls` of the "
                "execution"
            )

    @property
    def survived(self) -> bool:
        """Whether the object survived every trial, of at least one."""
        return self.trials > 0 and not self.lost


def execution_entry(grasp: ExecutedGrasp) -> ExecutionEntry:
    """Summarise an execution."""
    found = grasp.execution
    trials = () if found is None else found.trials
    controls = () if found is None else found.controls

    def largest(values: Iterator[float]) -> float | None:
        return rounded(max(values, default=None))

    def least(values: Iterator[float]) -> float | None:
        return rounded(min(values, default=None))

    return ExecutionEntry(
        reason=grasp.reason,
        trials=len(trials),
        lost=tuple(trial.name for trial in trials if not trial.survived),
        controls=len(controls),
        controls_let_go=sum(control.let_go for control in controls),
        load_multiple=None if found is None else rounded(found.load_multiple),
        predicted_first_slip=least(trial.predicted_first_slip for trial in trials),
        simulated_first_slip=least(trial.simulated_first_slip for trial in trials),
        slip_m=largest(trial.slip_m for trial in trials),
        displacement_m=largest(trial.displacement_m for trial in trials),
        turn_rad=largest(trial.turn_rad for trial in trials),
    )


def rounded(value: float | None) -> float | None:
    """Round a number to the digits that are kept; None for a number that no file can hold."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}")


def tried_execution(job: ExecutionJob) -> ExecutedGrasp | str:
    """Execute one grasp, or say why it is refused."""
    try:
        return executed_grasp(job)
    except InputError as error:
        return f"the execution is refused: {error}"


def not_survived(grasp: ExecutedGrasp) -> str:
    """Say why a grasp does not survive its execution: trials, numbers, predictions.

    Gives lines about the grasp; empty if it survived every trial and every control slipped.
    """
    found = grasp.execution
    if found is None:
        return f"{grasp.id} was not executed: {grasp.reason}"
    lines = [*losses_in_words(found), *held_controls_in_words(found)]
    if not lines:
        return ""
    lost = sum(not trial.survived for trial in found.trials)
    head = (
        f"{grasp.id} with {found.mass_kg:g} kg: {lost} of {len(found.trials)} trials lost; its "
        f"squeeze is certified for {found.load_multiple:.4g} times the weight in any direction"
    )
    return "\n  ".join([head, *lines])
