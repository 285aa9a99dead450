"""Charts of simulation: a trial over time, and simulated over predicted values.

A trial's charts show how far object and fingers moved, and how hard fingers pushed. Points of
simulated over predicted values should lie on the line of equal values.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.panels import ROW, Entry, Panel, Scale, marker, ticks_between, ticks_in
from scenes.drawing.sheets import (
    BAD,
    FINGERS,
    GOOD,
    INK,
    NEUTRAL,
    Area,
    Dots,
    Line,
    Mark,
    Sheet,
    Words,
)
from sim_validate.closure.replaying import Replayed
from sim_validate.closure.verdict import AGREEMENT
from sim_validate.report.agreement import Agreement

SIZE = 300.0, 316.0
"""Width and height of a panel of motion [pixels]."""
TIME = "time since friction was lowered [s]"
PLACE = (50.0, 28.0, 236.0, 180.0)
"""Left and upper border of what a panel draws in, its width and its height [pixels]."""
KEY = 3.0 * ROW + 6.0
"""Height of the key below a panel [pixels]."""
SLIPS = (1.0, "slips")
"""Share of its friction that a finger uses when it slips, and its name."""
MOST_SHARE = 1.15
"""Upper end of an axis, relative to the limit on it."""
MICRO = 1e6
LEAST_UM = 1e-4
"""Displacement at which the chart's logarithmic axis begins [um]."""
LEAST_PUSH = 1e-3
"""Share of a finger's largest push below which its use of friction is not shown."""
PAIRS_SIZE = 360.0, 388.0
PAIRS_PLACE = (70.0, 28.0, 280.0, 280.0)
"""Left and upper border of what a panel draws in, its width and its height [pixels]."""
LEAST_SHOWN = 0.5
"""Place of zero on a logarithmic axis, relative to the least value above zero."""


def motion_panels(found: Replayed, threshold_m: float) -> tuple[Sheet, Sheet, Sheet]:
    """Draw displacement, normal forces and use of friction over the time of one trial."""
    watched = found.watched
    share = friction_used(watched.pushes_n, watched.friction)
    return (
        _moved(found, threshold_m),
        _of_fingers("normal force [N]", watched.times_s, watched.pushes_n[..., 0], None),
        _of_fingers("share of friction used", watched.times_s, share, SLIPS),
    )


def _moved(found: Replayed, threshold_m: float) -> Sheet:
    trace = found.watched.trace
    finite = trace.displacements_m[np.isfinite(trace.displacements_m)]
    highest = 2.0 * MICRO * max(threshold_m, float(finite.max(initial=0.0)))
    panel = _panel(trace.times_s, Scale(LEAST_UM, highest, log=True))
    steps = 10.0 ** np.arange(-4, math.log10(highest), 2)
    slips = list(zip(FINGERS, trace.slips_m.T, strict=False))
    marks = [
        *panel.frame(ticks_in(panel.x.low, panel.x.high, 4), steps.tolist()),
        *(panel.curve(trace.times_s, MICRO * slip, colour) for colour, slip in slips),
        panel.curve(trace.times_s, MICRO * trace.displacements_m, INK, 1.8),
        panel.level(MICRO * threshold_m, BAD),
    ]
    key = [
        Entry("object", INK), Entry("counts as moved", BAD, "dashes"),
        *(Entry(f"{place} slid", colour) for place, (colour, _) in enumerate(slips)),
    ]  # fmt: skip
    return panel.sheet(SIZE, ("displacement [µm]", TIME, ""), marks, key, key_height=KEY)


def _of_fingers(title: str, times: Array, values: Array, limit: tuple[float, str] | None) -> Sheet:
    finite = values[np.isfinite(values)]
    top = max(1.1 * float(finite.max(initial=0.0)), 1e-9)
    low = min(0.0, float(finite.min(initial=0.0)))
    panel = _panel(times, Scale(low, top if limit is None else MOST_SHARE * limit[0]))
    curves = list(zip(FINGERS, values.T, strict=False))
    marks = [
        *panel.frame(ticks_in(panel.x.low, panel.x.high, 4), ticks_in(panel.y.low, panel.y.high)),
        *(panel.curve(times, np.where(np.isfinite(each), each, np.nan), colour)
          for colour, each in curves),
        panel.upright(0.0, NEUTRAL, dashed=True),
    ]  # fmt: skip
    key = [Entry(f"finger {place}", colour) for place, (colour, _) in enumerate(curves)]
    if limit is not None:
        marks.append(panel.level(limit[0], BAD))
        key.append(Entry(limit[1], BAD, "dashes"))
    return panel.sheet(SIZE, (title, TIME, ""), marks, key, key_height=KEY)


def _panel(times: Array, y: Scale) -> Panel:
    low, high = float(times.min(initial=0.0)), float(times.max(initial=0.0))
    return Panel(*PLACE, Scale(low, high if high > low else low + 1.0), y)


def friction_used(pushes: Array, friction: Array) -> Array:
    """Compute tangential over normal force, over friction, (n, k); NaN if fingers hardly push."""
    normal = pushes[..., 0]
    tangential = np.hypot(pushes[..., 1], pushes[..., 2])
    pushing = normal > LEAST_PUSH * max(float(normal.max(initial=0.0)), 1e-12)
    safe = np.where(pushing, normal, 1.0) * friction[:, None]
    return np.where(pushing, tangential / safe, np.nan)


def fidelity_panel(agreement: Agreement) -> Sheet:
    """Draw simulated over predicted values of a quantity on logarithmic axes."""
    name = f"{agreement.quantity}: simulated over predicted"
    names = agreement.quantity, "predicted", "simulated"
    pairs = np.array(agreement.pairs).reshape(-1, 2)
    if not (pairs > 0.0).any():
        panel = Panel(*PAIRS_PLACE, Scale(0.0, 1.0), Scale(0.0, 1.0))
        left, top, wide, high = PAIRS_PLACE
        nothing = Words(left + 0.5 * wide, top + 0.5 * high, "none measured", "middle")
        return Sheet(*PAIRS_SIZE, name, (*panel.frame([], []), *panel.named(*names), nothing))
    pairs = np.maximum(pairs, LEAST_SHOWN * pairs[pairs > 0.0].min())
    ends = np.array([0.7 * pairs.min(), 1.4 * pairs.max()])
    scale = Scale(float(ends[0]), float(ends[1]), log=True)
    panel = Panel(*PAIRS_PLACE, scale, scale)
    ticks = ticks_between(scale.low, scale.high)
    low, high = (1.0 - AGREEMENT) * ends, (1.0 + AGREEMENT) * ends
    band = np.vstack([panel.at(ends, low), panel.at(ends, high)[::-1]])
    marks: list[Mark] = [*panel.frame(ticks, ticks), Area((band,), NEUTRAL, 0.3)]
    marks.append(Line((panel.at(ends, ends),), NEUTRAL, 1.0))
    key = [Entry("identity", NEUTRAL), Entry(f"within {AGREEMENT:.0%}", NEUTRAL, "area")]
    off = np.array(agreement.differ())
    if (~off).any():
        marks.append(Dots(_pairs_on_sheet(panel, pairs[~off]), GOOD, 3.0))
        key.append(Entry(f"{int((~off).sum())} agree", GOOD, "disc"))
    if off.any():
        marks += [marker("cross", place, 5.0, BAD) for place in _pairs_on_sheet(panel, pairs[off])]
        key.append(Entry(f"{int(off.sum())} differ", BAD, "cross"))
    return panel.sheet(PAIRS_SIZE, names, marks, key, name=name)


def _pairs_on_sheet(panel: Panel, pairs: Array) -> Array:
    """Find where pairs are on the sheet, those within half a pixel of one another once, (k, 2)."""
    return np.unique(np.rint(2.0 * panel.at(*pairs.T)), axis=0) / 2.0
