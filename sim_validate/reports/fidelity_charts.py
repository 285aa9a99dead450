"""Charts of simulated over predicted values; points should lie on the line of equal values."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.canvas import Around, entitle, figure_with_panels, in_style
from scenes.drawing.palette import BAD, GOOD, NEUTRAL
from sim_validate.reports.agreement import Agreement
from sim_validate.validation.wrench_verdict import AGREEMENT

LONG_RANGE = 300.0
"""Ratio of an axis's ends above which the axis shows only powers of ten."""
LEAST_SHOWN = 0.5
"""Place of zero on a logarithmic axis, relative to the least value above zero."""


@in_style
def fidelity_figure(agreements: Sequence[Agreement]) -> Any:
    """Draw simulated over predicted values on logarithmic axes.

    Args:
        agreements: Predicted and simulated values; each quantity gets a panel.

    Returns:
        A matplotlib figure.
    """
    around = Around(left=0.2 / len(agreements), below=0.14, between=0.3)
    width = 4.2 * len(agreements)
    figure, places = figure_with_panels(width, 3.7, len(agreements), around=around)
    for axes, agreement in zip(places, agreements, strict=True):
        _panel(axes, agreement)
    return figure


def _panel(axes: Any, agreement: Agreement) -> None:
    entitle(axes, agreement.quantity)
    axes.set_xlabel("predicted")
    axes.set_ylabel("simulated")
    pairs = np.array(agreement.pairs).reshape(-1, 2)
    if not (pairs > 0.0).any():
        axes.text(0.5, 0.5, "none measured", ha="center", transform=axes.transAxes)
        return
    pairs = np.maximum(pairs, LEAST_SHOWN * pairs[pairs > 0.0].min())
    ends = np.array([0.7 * pairs.min(), 1.4 * pairs.max()])
    axes.plot(ends, ends, color=NEUTRAL, linewidth=1.0, label="identity")
    axes.fill_between(ends, (1.0 - AGREEMENT) * ends, (1.0 + AGREEMENT) * ends, color=NEUTRAL,
                      alpha=0.25, linewidth=0.0, label=f"within {AGREEMENT:.0%}")  # fmt: skip
    off = np.array(agreement.differ())
    for chosen, colour, marker, name in ((~off, GOOD, "o", "agree"), (off, BAD, "X", "differ")):
        if chosen.any():
            axes.plot(*pairs[chosen].T, marker, color=colour, ms=5, mec="white", mew=0.5,
                      linestyle="", label=f"{int(chosen.sum())} {name}")  # fmt: skip
    _scale(axes, ends)
    axes.legend(loc="upper left")


def _scale(axes: Any, ends: Array) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_ticks(ticks_between(*ends))
        axis.set_ticks([], minor=True)
    axes.set_xlim(*ends)
    axes.set_ylim(*ends)
    axes.set_aspect("equal")


def ticks_between(low: float, high: float) -> list[float]:
    """List 1, 2 and 5 times powers of ten in a range, or only powers of ten in a long range."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1.0, 2.0, 5.0) if high < LONG_RANGE * low else (1.0,)
    found = [step * 10.0**power for power in powers for step in steps]
    return [value for value in found if low <= value <= high]
