"""Predicted against simulated, drawn and counted.

Four counts say how far analysis and simulation agree: whether a load was predicted to be
resisted, and whether the object held. What was predicted to hold and did not, or the other way
round, contradicts one of the two.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes.canvas import Around, entitle, new_figure, panels
from scenes.palette import BAD, GOOD, NEUTRAL

TOLERANCE = 0.02
"""Of simulated figures, as in `validate`; drawn as a band."""
LONG_RANGE = 300.0
LEAST_SHOWN = 1e-3
"""Critical frictions below this are drawn there."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Pairs of one quantity as predicted and as simulated."""

    quantity: str
    """With its unit."""
    pairs: tuple[tuple[float, float], ...]
    """(predicted, simulated)"""

    @property
    def worst(self) -> float:
        """Largest relative difference; 0 without pairs."""
        return max((abs(simulated / predicted - 1.0) for predicted, simulated in self.pairs
                    if predicted > 0.0), default=0.0)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Quadrants:
    """Trials by what was predicted and what happened."""

    resisted_held: int = 0
    resisted_let_go: int = 0
    not_resisted_held: int = 0
    not_resisted_let_go: int = 0
    neither: int = 0
    """Trials that say nothing, such as those that diverged."""

    @property
    def agree(self) -> bool:
        """Whether no trial contradicts the analysis."""
        return not self.resisted_let_go and not self.not_resisted_held


def frictions_in(verdicts: Iterable[Mapping[str, Any]]) -> Agreement:
    """Critical frictions, as verdicts in JSON say them."""
    found = [verdict["critical_friction"] for verdict in verdicts]
    pairs = [(each["predicted"], each["simulated"]) for each in found]
    return Agreement("critical friction", _complete(pairs))


def limits_in(verdicts: Iterable[Mapping[str, Any]]) -> Agreement:
    """Sizes of the largest wrenches resisted, as verdicts in JSON say them."""
    pairs = list[tuple[float, float]]()
    for verdict in verdicts:
        lever = verdict["settings"]["grasp_size_m"]
        for trial in verdict["wrenches"]:
            limits = _complete([(trial["predicted_limit"], trial["simulated_limit"])])
            force, torque = np.reshape(trial["wrench"], (2, 3))
            size = math.hypot(*force, *(torque / lever))
            pairs += [(size * one, size * two) for one, two in limits]
    return Agreement("largest wrench [N], torques over grasp size", tuple(pairs))


def _complete(pairs: Iterable[tuple[Any, Any]]) -> tuple[tuple[float, float], ...]:
    return tuple((float(one), float(two)) for one, two in pairs if None not in (one, two))


def quadrants_in(verdicts: Sequence[Mapping[str, Any]]) -> Quadrants:
    """Trials of grasps and of their controls; what controls are loaded with, nothing resists."""
    counts = Counter[str]()
    for verdict in verdicts:
        for trial in verdict["wrenches"]:
            limit = trial["predicted_limit"]
            counts[
                _place(resisted=limit is not None and limit >= 1.0, outcome=trial["outcome"])
            ] += 1
        for control in verdict["controls"].values():
            for trial in control["wrenches"]:
                counts[_place(resisted=False, outcome=trial["outcome"])] += 1
    return Quadrants(**counts)


def _place(*, resisted: bool, outcome: str) -> str:
    if outcome not in {"held", "slipped", "lost_contact"}:
        return "neither"
    return ("resisted_" if resisted else "not_resisted_") + (
        "held" if outcome == "held" else "let_go"
    )


def fidelity_figure(agreements: Sequence[Agreement]) -> Any:
    """Simulated over predicted values on logarithmic axes, with the line of identity.

    Args:
        agreements: A panel for each.

    Returns:
        A matplotlib figure.
    """
    figure = new_figure(4.2 * max(len(agreements), 1), 3.7)
    around = Around(left=0.2 / max(len(agreements), 1), below=0.14, between=0.3)
    for axes, agreement in zip(
        panels(figure, max(len(agreements), 1), around=around), agreements, strict=False
    ):
        _panel(axes, agreement)
    return figure


def _panel(axes: Any, agreement: Agreement) -> None:
    pairs = np.maximum(np.array(agreement.pairs or [(1.0, 1.0)]), LEAST_SHOWN)
    off = np.abs(pairs[:, 1] / pairs[:, 0] - 1.0) > TOLERANCE
    ends = np.array([0.7 * pairs.min(), 1.4 * pairs.max()])
    axes.plot(ends, ends, color=NEUTRAL, linewidth=1.0, label="identity")
    axes.fill_between(ends, (1.0 - TOLERANCE) * ends, (1.0 + TOLERANCE) * ends, color=NEUTRAL,
                      alpha=0.25, linewidth=0.0, label=f"within {TOLERANCE:.0%}")  # fmt: skip
    for chosen, colour, marker, name in ((~off, GOOD, "o", "agree"), (off, BAD, "X", "differ")):
        if chosen.any():
            axes.plot(*pairs[chosen].T, marker, color=colour, ms=5, mec="white", mew=0.5,
                      linestyle="", label=f"{int(chosen.sum())} {name}")  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_ticks(ticks_between(*ends))
        axis.set_ticks([], minor=True)
    axes.set_xlim(*ends)
    axes.set_ylim(*ends)
    axes.set_aspect("equal")
    axes.set_xlabel("predicted")
    axes.set_ylabel("simulated")
    entitle(axes, agreement.quantity)
    axes.legend(fontsize=8.0, frameon=False, loc="upper left")


def ticks_between(low: float, high: float) -> list[float]:
    """Numbers 1, 2 and 5 times powers of ten in a range; where it is long, powers of ten alone."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1.0, 2.0, 5.0) if high < LONG_RANGE * low else (1.0,)
    found = [step * 10.0**power for power in powers for step in steps]
    return [value for value in found if low <= value <= high]
