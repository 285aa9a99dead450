"""Draws simulated over predicted values; their points should lie on the line of equal values."""

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.colours import BAD, GOOD, NEUTRAL
from scenes.drawing.panels import ROW, Entry, Panel, Scale, keyed, marker, ticks_between
from scenes.drawing.sheets import Area, Dots, Line, Mark, Sheet, Words
from sim_validate.closure.verdict import AGREEMENT
from sim_validate.report.agreement import Agreement

WIDTH, HEIGHT = 360.0, 388.0
PLACE = (70.0, 28.0, 280.0, 280.0)
"""Left and upper border of what a panel draws in, its width and its height [pixels]."""
LEAST_SHOWN = 0.5
"""Place of zero on a logarithmic axis, relative to the least value above zero."""


def fidelity_panel(agreement: Agreement) -> Sheet:
    """Draw simulated over predicted values of a quantity on logarithmic axes."""
    name = f"{agreement.quantity}: simulated over predicted"
    pairs = np.array(agreement.pairs).reshape(-1, 2)
    if not (pairs > 0.0).any():
        panel = Panel(*PLACE, Scale(0.0, 1.0), Scale(0.0, 1.0))
        left, top, wide, high = PLACE
        nothing = Words(left + 0.5 * wide, top + 0.5 * high, "none measured", "middle")
        labels = panel.named(agreement.quantity, "predicted", "simulated")
        return Sheet(WIDTH, HEIGHT, name, (*panel.frame([], []), *labels, nothing))
    pairs = np.maximum(pairs, LEAST_SHOWN * pairs[pairs > 0.0].min())
    ends = np.array([0.7 * pairs.min(), 1.4 * pairs.max()])
    scale = Scale(float(ends[0]), float(ends[1]), log=True)
    panel = Panel(*PLACE, scale, scale)
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
    below, _ = keyed(key, 8.0, HEIGHT - 2.0 * ROW, WIDTH - 8.0)
    names = panel.named(agreement.quantity, "predicted", "simulated")
    return Sheet(WIDTH, HEIGHT, name, (*marks, *names, *below))


def _pairs_on_sheet(panel: Panel, pairs: Array) -> Array:
    """Find where pairs are on the sheet, those within half a pixel of one another once, (k, 2)."""
    return np.unique(np.rint(2.0 * panel.at(*pairs.T)), axis=0) / 2.0
