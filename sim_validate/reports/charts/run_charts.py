"""Draws what a whole run shows: simulated over predicted values, and survival by acceleration.

Points of simulated over predicted values should lie on the line of equal values.

A squeeze that is certified for s times the weight in any direction carries the weight while the
palm accelerates by up to (s - 1) g in any direction, as |g + a| <= g + |a|. The certificate is for
forces through the centre of mass that come slowly: springs that overshoot, and the torques of
knocks and of shakes about an axis, can put marks below the curve.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.colours import BAD, FINGERS, GOOD, INK, NEUTRAL
from scenes.drawing.panels import (
    ROW,
    SMALL,
    Entry,
    Panel,
    Scale,
    Shape,
    keyed,
    marker,
    ticks_between,
)
from scenes.drawing.sheets import Area, Dots, Line, Mark, Sheet, Words
from sim_validate.execution.enough import accelerations_g
from sim_validate.execution.verdict import ExecutedGrasp, ExecutionTrial
from sim_validate.records.executions import Executions
from sim_validate.reports.agreement import Agreement
from sim_validate.validation.verdict import AGREEMENT

FIDELITY_WIDTH, FIDELITY_HEIGHT = 360.0, 388.0
FIDELITY_PLACE = (70.0, 28.0, 280.0, 280.0)
"""Left and upper border of what a panel draws in, its width and its height [pixels]."""
LEAST_SHOWN = 0.5
"""Place of zero on a logarithmic axis, relative to the least value above zero."""
SURVIVAL_WIDTH = 400.0
SURVIVAL_PLACE = (70.0, 28.0, 306.0, 230.0)
"""Left and upper border of what the chart draws in, its width and its height [pixels]."""
BELOW = 44.0
LOOKS: dict[str, tuple[Shape, str]] = {
    "weight": ("square", INK), "misplaced": ("cross", NEUTRAL), "lift": ("up", FINGERS[2]),
    "shake along": ("disc", FINGERS[1]), "shake about": ("diamond", FINGERS[3]),
    "stop": ("down", FINGERS[0]), "knock": ("plus", BAD),
}  # fmt: skip
"""Marker and colour of each kind of trial."""
FILLED = ("filled: survived in simulation", "hollow: predicted not to slip")
"""Explanation of the marks, which stands above the chart's key."""
STRAIGHT = ("lift", "shake along", "stop")
"""Kinds of trials in which the palm accelerates without turning."""
TICKS_G = (0.0, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
"""Round accelerations at which the axis may have ticks [9.80665 m/s^2]."""
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
NARROWEST, WIDEST = 2.0, 1001.0
"""Least and largest multiple of the weight at which the axis may end."""
BEYOND = 1.1
APART = 0.08
"""Least distance between ticks, relative to the length of the axis."""
SAME = 9
"""Number of decimals to which two accelerations must agree to count as equal [g]."""


def fidelity_panels(agreements: Sequence[Agreement]) -> tuple[Sheet, ...]:
    """Draw simulated over predicted values on logarithmic axes, a panel for each quantity."""
    return tuple(_fidelity_panel(agreement) for agreement in agreements)


def _fidelity_panel(agreement: Agreement) -> Sheet:
    name = f"{agreement.quantity}: simulated over predicted"
    pairs = np.array(agreement.pairs).reshape(-1, 2)
    if not (pairs > 0.0).any():
        panel = Panel(*FIDELITY_PLACE, Scale(0.0, 1.0), Scale(0.0, 1.0))
        left, top, wide, high = FIDELITY_PLACE
        nothing = Words(left + 0.5 * wide, top + 0.5 * high, "none measured", "middle")
        labels = panel.named(agreement.quantity, "predicted", "simulated")
        return Sheet(
            FIDELITY_WIDTH, FIDELITY_HEIGHT, name, (*panel.frame([], []), *labels, nothing)
        )
    pairs = np.maximum(pairs, LEAST_SHOWN * pairs[pairs > 0.0].min())
    ends = np.array([0.7 * pairs.min(), 1.4 * pairs.max()])
    scale = Scale(float(ends[0]), float(ends[1]), log=True)
    panel = Panel(*FIDELITY_PLACE, scale, scale)
    labels = [(tick, f"{tick:g}") for tick in ticks_between(scale.low, scale.high)]
    low, high = (1.0 - AGREEMENT) * ends, (1.0 + AGREEMENT) * ends
    band = np.vstack([panel.at(ends, low), panel.at(ends, high)[::-1]])
    marks: list[Mark] = [*panel.frame(labels, labels), Area((band,), NEUTRAL, 0.3)]
    marks.append(Line((panel.at(ends, ends),), NEUTRAL, 1.0))
    key = [Entry("identity", NEUTRAL), Entry(f"within {AGREEMENT:.0%}", NEUTRAL, "area")]
    off = np.array(agreement.differ())
    if (~off).any():
        marks.append(Dots(_pairs_on_sheet(panel, pairs[~off]), GOOD, 3.0))
        key.append(Entry(f"{int((~off).sum())} agree", GOOD, "disc"))
    if off.any():
        marks += [marker("cross", place, 5.0, BAD) for place in _pairs_on_sheet(panel, pairs[off])]
        key.append(Entry(f"{int(off.sum())} differ", BAD, "cross"))
    below, _ = keyed(key, 8.0, FIDELITY_HEIGHT - 2.0 * ROW, FIDELITY_WIDTH - 8.0)
    names = panel.named(agreement.quantity, "predicted", "simulated")
    return Sheet(FIDELITY_WIDTH, FIDELITY_HEIGHT, name, (*marks, *names, *below))


def _pairs_on_sheet(panel: Panel, pairs: Array) -> Array:
    """Find where pairs are on the sheet, those within half a pixel of one another once, (k, 2)."""
    return np.unique(np.rint(2.0 * panel.at(*pairs.T)), axis=0) / 2.0


@dataclass(frozen=True, slots=True)
class Survival:
    """How many grasps survived all of their trials of one kind."""

    kind: str
    acceleration_g: float
    """Largest acceleration of the trials [9.80665 m/s^2]."""
    grasps: int
    """Number of grasps that went through such trials, or have no squeeze and are lost; those of
    which a negative control held do not count."""
    survived: int
    predicted: int
    """Number of grasps for which no slip is predicted in any of the trials."""


def certified_multiples(executed: Iterable[Executions]) -> Array:
    """List the certified multiple of the weight of each grasp, (n,); 0 stands for no squeeze."""
    return np.array([
        0.0 if each.execution is None else each.execution.load_multiple
        for one in executed
        for each in one.grasps
    ])  # fmt: skip


def survivals(executed: Iterable[Executions]) -> list[Survival]:
    """Count the grasps that survived each kind of trial, kinds in the order of `LOOKS`."""
    found = defaultdict[tuple[str, float], list[tuple[bool, bool]]](list)
    for one in executed:
        accelerations = accelerations_g(one.settings)
        lost = sum(each.execution is None for each in one.grasps)
        for kind, ends in _ends_by_kind(one.grasps).items():
            found[kind, round(accelerations[kind], SAME)] += ends + [(False, False)] * lost
    order = list(LOOKS)
    return [
        Survival(
            kind, acceleration, len(ends), sum(held for held, _ in ends),
            sum(predicted for _, predicted in ends),
        )
        for (kind, acceleration), ends in sorted(
            found.items(), key=lambda item: (order.index(item[0][0]), item[0][1])
        )
    ]  # fmt: skip


def _ends_by_kind(grasps: Iterable[ExecutedGrasp]) -> dict[str, list[tuple[bool, bool]]]:
    """List, for each kind of trial, whether grasps survived it and were predicted not to slip."""
    ends = defaultdict[str, list[tuple[bool, bool]]](list)
    for each in grasps:
        if each.execution is None or not each.controls_let_go:
            continue
        for kind, trials in _by_kind(each.execution.trials).items():
            survived = all(trial.survived for trial in trials)
            ends[kind].append((survived, all(trial.predicted_first_slip > 1.0 for trial in trials)))
    return ends


def _by_kind(trials: Iterable[ExecutionTrial]) -> dict[str, list[ExecutionTrial]]:
    """Group trials by kind; shakes along and about axes are two kinds."""
    found = defaultdict[str, list[ExecutionTrial]](list)
    for trial in trials:
        about = "about" if trial.name.startswith("shake about") else "along"
        found[f"shake {about}" if trial.kind == "shake" else trial.kind].append(trial)
    return found


def survival_sentence(executed: Sequence[Executions]) -> str:
    """Say in one sentence what the chart shows, at the hardest motion of the palm."""
    multiples = certified_multiples(executed)
    marks = survivals(executed)
    straight = [mark for mark in marks if mark.kind in STRAIGHT] or [
        mark for mark in marks if mark.acceleration_g == 0.0
    ]
    if not straight:
        certified = int((multiples >= 1.0).sum())
        return f"{certified} of {len(multiples)} grasps are certified to carry the weight."
    hardest = max(straight, key=lambda mark: mark.acceleration_g)
    certified = int((multiples >= 1.0 + hardest.acceleration_g).sum())
    return (
        f"{certified} of {len(multiples)} grasps are certified to carry the weight while the palm "
        f"accelerates by {hardest.acceleration_g:.3g} g in any direction, and in simulation "
        f"{hardest.survived} of {hardest.grasps} survived every trial of the kind "
        f"“{hardest.kind}”, which reaches that acceleration."
    )


def survival_sheet(executed: Sequence[Executions]) -> Sheet:
    """Draw the share of grasps that survives, by the acceleration of the palm."""
    multiples, found = certified_multiples(executed), survivals(executed)
    ends = [NARROWEST, *multiples, *(1.0 + mark.acceleration_g for mark in found)]
    end = min(BEYOND * max(ends), WIDEST)
    panel = Panel(*SURVIVAL_PLACE, Scale(1.0, end, log=True), Scale(0.0, 1.03))
    marks = [
        *panel.frame([(1.0 + tick, f"{tick:g}") for tick in ticks_up_to(end)],
                     [(share, f"{share:.0%}") for share in SHARES]),
        *_certified_curve(panel, multiples, end),
        *(mark for each in found for mark in _survival_marks(panel, each)),
        *panel.named("survival", "acceleration beside the weight [g]",
                     "share of grasps that survives"),
    ]  # fmt: skip
    key = [Entry("certified in any direction", GOOD)] + [
        Entry(f"{each.kind}, {each.acceleration_g:.3g} g: {each.survived} of {each.grasps}",
              LOOKS[each.kind][1], LOOKS[each.kind][0])
        for each in found
    ]  # fmt: skip
    top = SURVIVAL_PLACE[1] + SURVIVAL_PLACE[3] + BELOW
    marks += [Words(8.0, top + (place + 0.5) * ROW, line, size=SMALL)
              for place, line in enumerate(FILLED)]  # fmt: skip
    below, rows = keyed(key, 8.0, top + (len(FILLED) + 0.3) * ROW, SURVIVAL_WIDTH - 8.0)
    height = top + (len(FILLED) + rows + 0.5) * ROW
    return Sheet(SURVIVAL_WIDTH, height, "Share of grasps that survives", (*marks, *below))


def _certified_curve(panel: Panel, multiples: Array, end: float) -> Iterator[Mark]:
    steps, shares = certified_steps(multiples, end)
    x = np.append(np.repeat(steps, 2)[1:], end)
    line = panel.at(x, np.repeat(shares, 2))
    feet = panel.at(np.array([end, 1.0]), np.zeros(2))
    yield Area((np.vstack([line, feet]),), GOOD, 0.15)
    yield Line((line,), GOOD)


def certified_steps(multiples: Array, end: float) -> tuple[Array, Array]:
    """Find where the share of certified grasps drops, and the share from there on, (n,) each."""
    steps = np.concatenate([[1.0], np.sort(multiples[(multiples >= 1.0) & (multiples < end)])])
    shares = (multiples[None] > steps[:, None]).mean(axis=1)
    shares[0] = (multiples >= 1.0).mean()
    return steps, shares


def _survival_marks(panel: Panel, mark: Survival) -> Iterator[Mark]:
    shape, colour = LOOKS[mark.kind]
    shares = np.array([mark.predicted, mark.survived]) / mark.grasps
    places = panel.at(np.full(2, 1.0 + mark.acceleration_g), shares)
    yield marker(shape, places[0], 6.5, colour, hollow=True)
    yield marker(shape, places[1], 3.5, colour)


def ticks_up_to(end: float) -> list[float]:
    """List round accelerations for an axis up to a multiple of the weight, not too close [g]."""
    found = [0.0]
    for tick in TICKS_G:
        if 1.0 + tick <= end and math.log((1.0 + tick) / (1.0 + found[-1])) > APART * math.log(end):
            found.append(tick)
    return found
