"""Charts of distributions: how often numbers fall into equal intervals, and shares of words."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.colours import BAD, GOOD, NEUTRAL
from scenes.drawing.panels import SMALL, Panel, Scale, ticks_in
from scenes.drawing.sheets import Area, Mark, Sheet, Words

WIDTH, HEIGHT = 360.0, 240.0
"""Size of a panel [pixels]."""
PLACE = (56.0, 28.0, 290.0, 160.0)
"""Left and upper border of what a panel draws in, its width and its height [pixels]."""
BINS = 24
OUTLYING = (0.005, 0.995)
"""Shares of the values between which the axis reaches; the others count in the first and last
interval."""
ALIKE = 1e-6
"""Share of the largest value below which differences do not make an axis of their own."""
BAR, LEFT, LETTERS = 22.0, 150.0, 22
"""Height of a bar's row, place where bars begin [pixels], and most letters of its name."""
KEY, SWATCH = 110.0, 12.0
"""Width of an entry of the key, and the side of its square [pixels]."""
SHADES = {"survived": GOOD, "lost": BAD, "not known": NEUTRAL}
"""Colours of outcomes."""


def histogram(name: str, unit: str, values: Array) -> Sheet:
    """Draw how often the values of a column, in ascending order, fall into equal intervals."""
    low, high = (float(np.quantile(values, share)) for share in OUTLYING)
    if high - low <= ALIKE * max(abs(low), abs(high)):  # all but a few are the same
        room = 0.5 * abs(low) or 1.0
        low, high = low - room, high + room
    counts, edges = np.histogram(np.clip(values, low, high), BINS, (low, high))
    panel = Panel(*PLACE, Scale(low, high), Scale(0.0, 1.05 * float(counts.max())))
    bars = tuple(
        panel.at(np.array([left, right, right, left]), np.array([0.0, 0.0, count, count]))
        for (left, right), count in zip(pairwise(edges.tolist()), counts.tolist(), strict=True)
    )
    across = [(tick, f"{tick:.4g}") for tick in ticks_in(low, high, 4)]
    up = [(tick, f"{tick:g}") for tick in ticks_in(0.0, float(counts.max()), 4) if tick % 1.0 == 0]
    named = panel.named(name, unit if unit != "1" else "", "rows")
    marks: list[Mark] = [Area(bars, GOOD, 0.7), *panel.frame(across, up), *named]
    return Sheet(WIDTH, HEIGHT, f"distribution of {name}", tuple(marks))


def shares(name: str, counts: Mapping[str, Mapping[str, int]]) -> Sheet:
    """Draw a bar for each word, divided by outcome, with a key where there are several."""
    longest = max(sum(each.values()) for each in counts.values())
    marks: list[Mark] = [Words(8.0, 14.0, name, bold=True)]
    long = WIDTH - LEFT - 60.0
    for row, (word, outcomes) in enumerate(sorted(counts.items())):
        top = 28.0 + BAR * row
        marks.append(Words(LEFT - 8.0, top + 0.5 * BAR, word[:LETTERS], "end", SMALL))
        start = LEFT
        for outcome, count in sorted(outcomes.items(), key=lambda each: list(SHADES).index(each[0])
                                     if each[0] in SHADES else 0):  # fmt: skip
            end = start + long * count / longest
            corners = np.array([(start, 3.0), (end, 3.0), (end, BAR - 3.0), (start, BAR - 3.0)])
            marks.append(Area((corners + np.array([0.0, top]),), SHADES.get(outcome, GOOD), 0.8))
            start = end
        text = " / ".join(str(outcomes[each]) for each in SHADES if each in outcomes)
        total = text or str(sum(outcomes.values()))
        marks.append(Words(start + 4.0, top + 0.5 * BAR, total, "start", SMALL))
    bottom = 36.0 + BAR * len(counts)
    known = [each for each in SHADES if any(each in outcomes for outcomes in counts.values())]
    for column, outcome in enumerate(known):
        left = 8.0 + KEY * column
        corners = np.array([(0.0, 4.0), (SWATCH, 4.0), (SWATCH, 4.0 + SWATCH), (0.0, 4.0 + SWATCH)])
        marks.append(Area((corners + np.array([left, bottom]),), SHADES[outcome], 0.8))
        middle = bottom + 4.0 + 0.5 * SWATCH
        marks.append(Words(left + SWATCH + 6.0, middle, outcome, "start", SMALL))
    height = bottom + (BAR if known else 0.0)
    return Sheet(WIDTH, height, f"shares of {name}", tuple(marks))
