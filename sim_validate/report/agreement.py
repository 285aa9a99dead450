"""Compares verdicts with the analysis: pairs of predicted and simulated numbers, counts of trials.

A trial that was predicted to hold and did not, or the reverse, contradicts the analysis or the
simulation. As in `validate`, neither is counted for loads within `AGREEMENT` of their limit and for
trials that prove nothing, such as those that diverged.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim_validate.closure.verdict import AGREEMENT
from sim_validate.closure.verdicts_json import let_go
from sim_validate.engine.traces import LET_GO, Outcome

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


def frictions_in(verdicts: Iterable[Record]) -> Agreement:
    """Compare critical frictions; a simulated zero means that the least one tried sufficed."""
    found = [verdict["critical_friction"] for verdict in verdicts]
    measured = [each for each in found if each["simulated"] is not None]
    pairs = tuple((each["predicted"], each["simulated"]) for each in measured if each["simulated"])
    return Agreement("critical friction", pairs, len(measured) - len(pairs))


def limits_in(verdicts: Iterable[Record]) -> Agreement:
    """Compare the sizes of the largest wrenches that were resisted."""
    pairs = tuple(
        (size * trial["predicted_limit"], size * trial["simulated_limit"])
        for verdict in verdicts
        for trial in verdict["wrenches"]
        if None not in (trial["predicted_limit"], trial["simulated_limit"])
        for size in [wrench_size(verdict, trial)]
    )
    return Agreement("largest wrench [N], torques over grasp size", pairs)


def wrench_size(verdict: Record, trial: Record) -> float:
    """Compute the size of a trial's wrench [N], with torques divided by the grasp's size."""
    force, torque = np.reshape(trial["wrench"], (2, 3))
    return math.hypot(*force, *(torque / verdict["settings"]["grasp_size_m"]))


def quadrants_in(verdicts: Sequence[Record]) -> Quadrants:
    """Count trials of grasps and of negative controls; nothing resists the loads of a control."""
    counts = Counter[str]()
    for verdict in verdicts:
        counts.update(_place(trial, resisted(trial)) for trial in verdict["wrenches"])
        for control in verdict["controls"].values():
            counts.update(_place(trial, False) for trial in control["wrenches"])
    return Quadrants(**counts)


def resisted(trial: Record) -> bool | None:
    """Tell whether a load is predicted to be resisted; None if it is too near its limit."""
    limit = trial["predicted_limit"]
    if limit is not None and abs(limit - 1.0) <= AGREEMENT:
        return None
    return limit is not None and limit > 1.0


def as_predicted(trial: Record) -> bool:
    """Tell whether a trial ended as predicted, or in a way that the prediction leaves open."""
    wanted = resisted(trial)
    ends = (HELD, *GONE) if wanted is None else (HELD,) if wanted else GONE
    return trial["outcome"] in ends


def _place(trial: Record, wanted: bool | None) -> str:
    if wanted is None or trial["outcome"] not in (HELD, *GONE):
        return "neither"
    held = "held" if trial["outcome"] == HELD else "let_go"
    return f"{'resisted' if wanted else 'not_resisted'}_{held}"


HELD = Outcome.HELD.value
GONE = tuple(outcome.value for outcome in LET_GO)
GOOD, BAD, QUIET = "good", "bad", "quiet"


def said_of(verdict: Record | None) -> tuple[str, str]:
    """Say in words what the verdict on a grasp is, and of which kind: good, bad or quiet."""
    if verdict is None:
        return "not validated", QUIET
    outcome, controls = str(verdict["outcome"]), verdict["controls"].values()
    if outcome not in (HELD, *GONE):
        return outcome.replace("_", " "), BAD
    if verdict["mismatches"]:
        return "contradicts the analysis", BAD
    if any(control["held"] for control in controls):
        return "a negative control held", BAD
    if not all(map(let_go, controls)):
        return "a negative control is undecided", BAD
    return outcome.replace("_", " "), GOOD if verdict["held"] else BAD
