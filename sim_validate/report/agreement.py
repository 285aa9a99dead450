"""Compares verdicts with the analysis: pairs of predicted and simulated numbers, counts of trials.

A trial that was predicted to hold and did not, or the reverse, contradicts the analysis or the
simulation. As in `validate`, neither is counted for loads within `AGREEMENT` of their limit and for
trials that prove nothing, such as those that diverged.

How a grasp ended is said in words here, too.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim_validate.closure.controls import ControlTrial
from sim_validate.closure.verdict import AGREEMENT, Verdict, WrenchVerdict
from sim_validate.engine.traces import LET_GO, Outcome
from sim_validate.execution.verdict import ExecutedGrasp, Executions

Record = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Agreement:
    """Predicted and simulated values of one quantity, such as the critical friction."""

    quantity: str
    pairs: tuple[tuple[float, float], ...]
    below: int = 0
    """Number of grasps that held even at the least friction tried, so no value was found."""

    def differ(self) -> tuple[bool, ...]:
        """Whether each pair differs by more than is allowed."""
        return tuple(abs(two - one) > AGREEMENT * one for one, two in self.pairs)

    @property
    def worst(self) -> float:
        """Largest relative difference between prediction and simulation; 0 without pairs."""
        shares = [abs(two - one) / one if one > 0.0 else math.inf for one, two in self.pairs]
        return max(shares, default=0.0)


@dataclass(frozen=True, slots=True)
class Quadrants:
    """Numbers of trials, counted by what was predicted and what happened."""

    resisted_held: int = 0
    resisted_let_go: int = 0
    not_resisted_held: int = 0
    not_resisted_let_go: int = 0
    neither: int = 0


def frictions_in(verdicts: Iterable[Verdict]) -> Agreement:
    """Compare critical frictions; a simulated zero means that the least one tried sufficed."""
    found = [verdict.critical_friction for verdict in verdicts]
    measured = [(each.predicted, each.simulated) for each in found if each.simulated is not None]
    pairs = tuple(pair for pair in measured if pair[1])
    return Agreement("critical friction", pairs, len(measured) - len(pairs))


def limits_in(verdicts: Iterable[Verdict]) -> Agreement:
    """Compare the sizes of the largest wrenches that were resisted."""
    pairs = tuple(
        (size * trial.predicted_limit, size * trial.simulated_limit)
        for verdict in verdicts
        for trial in verdict.wrenches
        if trial.simulated_limit is not None and math.isfinite(trial.predicted_limit)
        for size in [wrench_size(verdict, trial)]
    )
    return Agreement("largest wrench [N], torques over grasp size", pairs)


def wrench_size(verdict: Verdict, trial: WrenchVerdict) -> float:
    """Compute the size of a trial's wrench [N], with torques divided by the grasp's size."""
    force, torque = np.reshape(trial.wrench, (2, 3))
    return math.hypot(*force, *(torque / verdict.scale.grasp_size_m))


def quadrants_in(verdicts: Sequence[Verdict]) -> Quadrants:
    """Count trials of grasps and of negative controls; nothing resists the loads of a control."""
    counts = Counter[str]()
    for verdict in verdicts:
        counts.update(_place(trial, resisted(trial)) for trial in verdict.wrenches)
        for control in verdict.controls:
            counts.update(_place(trial, False) for trial in control.tried)
    return Quadrants(**counts)


def resisted(trial: WrenchVerdict) -> bool | None:
    """Tell whether a load is predicted to be resisted; None if it is too near its limit."""
    limit = trial.predicted_limit
    return None if abs(limit - 1.0) <= AGREEMENT else limit > 1.0


def as_predicted(trial: WrenchVerdict) -> bool:
    """Tell whether a trial ended as predicted, or in a way that the prediction leaves open."""
    wanted = resisted(trial)
    ends = (HELD, *LET_GO) if wanted is None else (HELD,) if wanted else LET_GO
    return trial.hold.outcome in ends


def _place(trial: WrenchVerdict | ControlTrial, wanted: bool | None) -> str:
    outcome = trial.hold.outcome
    if wanted is None or outcome not in (HELD, *LET_GO):
        return "neither"
    held = "held" if outcome is HELD else "let_go"
    return f"{'resisted' if wanted else 'not_resisted'}_{held}"


HELD = Outcome.HELD
GOOD, BAD, QUIET = "good", "bad", "quiet"
FAILED, LOST = "failed", "lost"
"""Word that begins how many trials were not survived, and the one word for it."""


def said_of(verdict: Verdict | None) -> tuple[str, str]:
    """Say in words what the verdict on a grasp is, and of which kind: good, bad or quiet."""
    if verdict is None:
        return "not validated", QUIET
    outcome = verdict.outcome.value.replace("_", " ")
    if verdict.outcome not in (HELD, *LET_GO):
        return outcome, BAD
    if verdict.mismatches:
        return "contradicts the analysis", BAD
    if any(control.held for control in verdict.controls):
        return "a negative control held", BAD
    if not verdict.controls_let_go:
        return "a negative control is undecided", BAD
    return outcome, GOOD if verdict.held else BAD


def said_of_execution(found: ExecutedGrasp | None) -> tuple[str, str]:
    """Say in words how the execution of a grasp ended, with the tone: good, bad or neither."""
    if found is None:
        return "not executed", QUIET
    if found.execution is None:
        return "no squeeze", BAD
    if not found.controls_let_go:
        return "a negative control held", BAD
    if not found.execution.trials:
        return "no trial is possible", BAD
    if lost := found.execution.lost:
        return f"{FAILED} {len(lost)} of {len(found.execution.trials)} trials", BAD
    return "survived", GOOD


def said_of_both(
    verdict: Verdict | None, executions: Executions | None, found: ExecutedGrasp | None
) -> tuple[str, str]:
    """Say in words how a grasp ended in the test of its closure and, if any was, in its execution.

    Gives the words, and the tone: good, bad or neither; bad if either ending is.
    """
    closure, tone = said_of(verdict)
    if executions is None:
        return closure, tone
    ended, other = said_of_execution(found)
    tones = {tone, other}
    worst = next(each for each in (BAD, GOOD, QUIET) if each in tones)
    return f"closure: {closure}; execution: {LOST if ended.startswith(FAILED) else ended}", worst
