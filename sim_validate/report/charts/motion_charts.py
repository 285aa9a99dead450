"""Charts of one trial over time: how far object and fingers moved, and how hard fingers pushed."""

import math
from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.colours import BAD, FINGERS, INK, NEUTRAL
from scenes.drawing.panels import ROW, Entry, Panel, Scale, keyed, ticks_in
from scenes.drawing.sheets import Mark, Sheet
from sim_validate.closure.replaying import Replayed

WIDTH, HEIGHT = 300.0, 316.0
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
        *panel.frame(_seconds(panel.x), [(step, f"{step:g}") for step in steps.tolist()]),
        *(panel.curve(trace.times_s, MICRO * slip, colour) for colour, slip in slips),
        panel.curve(trace.times_s, MICRO * trace.displacements_m, INK, 1.8),
        panel.level(MICRO * threshold_m, BAD),
    ]
    key = [
        Entry("object", INK), Entry("counts as moved", BAD, "dashes"),
        *(Entry(f"{place} slid", colour) for place, (colour, _) in enumerate(slips)),
    ]  # fmt: skip
    return _sheet(panel, "displacement [µm]", marks, key)


def _of_fingers(title: str, times: Array, values: Array, limit: tuple[float, str] | None) -> Sheet:
    finite = values[np.isfinite(values)]
    top = max(1.1 * float(finite.max(initial=0.0)), 1e-9)
    low = min(0.0, float(finite.min(initial=0.0)))
    panel = _panel(times, Scale(low, top if limit is None else MOST_SHARE * limit[0]))
    ticks = [(tick, f"{tick:g}") for tick in ticks_in(panel.y.low, panel.y.high)]
    curves = list(zip(FINGERS, values.T, strict=False))
    marks = [
        *panel.frame(_seconds(panel.x), ticks),
        *(panel.curve(times, np.where(np.isfinite(each), each, np.nan), colour)
          for colour, each in curves),
        panel.upright(0.0, NEUTRAL, dashed=True),
    ]  # fmt: skip
    key = [Entry(f"finger {place}", colour) for place, (colour, _) in enumerate(curves)]
    if limit is not None:
        marks.append(panel.level(limit[0], BAD))
        key.append(Entry(limit[1], BAD, "dashes"))
    return _sheet(panel, title, marks, key)


def _panel(times: Array, y: Scale) -> Panel:
    low, high = float(times.min(initial=0.0)), float(times.max(initial=0.0))
    return Panel(*PLACE, Scale(low, high if high > low else low + 1.0), y)


def _seconds(x: Scale) -> list[tuple[float, str]]:
    return [(tick, f"{tick:g}") for tick in ticks_in(x.low, x.high, 4)]


def _sheet(panel: Panel, title: str, marks: Sequence[Mark], entries: Sequence[Entry]) -> Sheet:
    below, _ = keyed(entries, 8.0, HEIGHT - KEY, WIDTH - 8.0)
    names = panel.named(title, "time since friction was lowered [s]", "")
    return Sheet(WIDTH, HEIGHT, title, (*marks, *names, *below))


def friction_used(pushes: Array, friction: Array) -> Array:
    """Compute tangential over normal force, over friction, (n, k); NaN if fingers hardly push.

    Takes `pushes` (normal, tangent, tangent) or (n, k, 3) [N]; `friction` (n,).
    """
    normal = pushes[..., 0]
    tangential = np.hypot(pushes[..., 1], pushes[..., 2])
    pushing = normal > LEAST_PUSH * max(float(normal.max(initial=0.0)), 1e-12)
    safe = np.where(pushing, normal, 1.0) * friction[:, None]
    return np.where(pushing, tangential / safe, np.nan)
