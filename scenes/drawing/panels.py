"""Lays out the panel of a chart: scales and ticks of its axes, their names, curves, and a key."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.sheets import LETTER, NEUTRAL, Area, Dots, Line, Mark, Sheet, Words, ink_line

NARROW_LETTERS, WIDE = set("ijl.,:;|'!fItr()[] -"), set("mwMW@%+=<>≤")
NARROW_WIDTH, USUAL_WIDTH, WIDE_WIDTH = 0.42, 0.66, 1.0
"""Widths of letters in DejaVu Sans, the widest of common fonts, in letter sizes."""
LONG_RANGE = 300.0
NICE = (1.0, 2.0, 5.0, 10.0)
PANEL_EDGE = 8.0
TICK_WAY = 4.0
SMALL_TYPE = 11.0
ROW, SAMPLE = 16.0, 18.0
CURVE_TOLERANCE = 0.2
Marker: TypeAlias = Literal["disc", "square", "cross"]
Kind: TypeAlias = Literal["line", "dashes", "area"] | Marker
MARKER_CORNERS: dict[str, tuple[tuple[float, float], ...]] = {
    "square": ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
    "cross": ((-0.5, 0.0), (-1.0, -0.5), (-0.5, -1.0), (0.0, -0.5), (0.5, -1.0), (1.0, -0.5),
              (0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5), (-0.5, 1.0), (-1.0, 0.5)),
}  # fmt: skip


def width_of(text: str, size: float) -> float:
    """Return a width that the text does not exceed in fonts that readers may have [pixels]."""
    return size * sum(
        NARROW_WIDTH if letter in NARROW_LETTERS else WIDE_WIDTH if letter in WIDE else USUAL_WIDTH
        for letter in text
    )


@dataclass(frozen=True, slots=True)
class Axis:
    """The range of an axis."""

    low: float
    high: float
    log: bool = False

    def shares(self, values: Array) -> Array:
        """Find how far along the axis values are, from 0 to 1; those beyond it are at its ends."""
        low, high, along = self.low, self.high, np.asarray(values)
        if self.log:
            low, high = math.log(low), math.log(high)
            along = np.log(np.maximum(along, self.low))
        return np.clip((along - low) / (high - low), 0.0, 1.0)

    def ticks(self, most: int = 5) -> list[float]:
        """List round numbers along the axis, if they are at equal steps at most `most` of them."""
        low, high = self.low, self.high
        if self.log:
            powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
            steps = (1.0, 2.0, 5.0) if high < LONG_RANGE * low else (1.0,)
            found = [step * 10.0**power for power in powers for step in steps]
            return [value for value in found if low <= value <= high]
        rough = (high - low) / most
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(nice * power for nice in NICE if nice * power >= rough * (1.0 - 1e-9))
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        return [step * count for count in range(first, last + 1)]


@dataclass(frozen=True, slots=True)
class KeyLine:
    """A line of a key: what a colour stands for."""

    text: str
    colour: str
    kind: Kind = "line"


@dataclass(frozen=True, slots=True)
class Panel:
    """The rectangle of a chart in which curves are drawn [pixels], and its two axes."""

    left: float
    top: float
    width: float
    height: float
    x: Axis
    y: Axis

    def at(self, x: Array, y: Array) -> Array:
        """Find where points are on the sheet, (k, 2); those beyond an axis are at its end."""
        across = self.left + self.width * self.x.shares(x)
        return np.stack([across, self.top + self.height * (1.0 - self.y.shares(y))], axis=-1)

    def curve(self, x: Array, y: Array, colour: str, width: float = 1.4) -> Line:
        """Draw a curve through points; NaN interrupts it."""
        known = np.isfinite(x) & ~np.isnan(y)
        points = self.at(np.where(known, x, self.x.low), np.where(known, y, self.y.low))
        cuts = np.flatnonzero(np.diff(known.astype(int))) + 1
        pieces = np.split(np.arange(len(x)), cuts)
        kept = tuple(thinned(points[piece]) for piece in pieces if len(piece) and known[piece[0]])
        return Line(kept, colour, width)

    def level(self, y: float, colour: str) -> Line:
        """Draw a dashed line across the panel at a height."""
        ends = self.at(np.array([self.x.low, self.x.high]), np.array([y, y]))
        return Line((ends,), colour, 1.2, dashed=True)

    def upright(self, x: float, colour: str, *, dashed: bool = False) -> Line:
        """Draw a line from the bottom to the top of the panel."""
        ends = self.at(np.array([x, x]), np.array([self.y.low, self.y.high]))
        return Line((ends,), colour, 1.2, dashed=dashed)

    def frame(
        self, x_ticks: Iterable[float], y_ticks: Iterable[float], y_form: str = "g"
    ) -> Iterator[Mark]:
        """Draw both axes with ticks and their numbers."""
        low, left, right = self.top + self.height, self.left, self.left + self.width
        yield ink_line([(left, self.top), (left, low), (right, low)])
        faint = list[Array]()
        for value in x_ticks:
            x = left + self.width * float(self.x.shares(np.array(value)))
            yield ink_line([(x, low), (x, low + TICK_WAY)])
            yield Words(x, low + TICK_WAY + 0.8 * SMALL_TYPE, f"{value:g}", "middle", SMALL_TYPE)
        for value in y_ticks:
            y = low - self.height * float(self.y.shares(np.array(value)))
            yield ink_line([(left - TICK_WAY, y), (left, y)])
            yield Words(left - TICK_WAY - 2.0, y, f"{value:{y_form}}", "end", SMALL_TYPE)
            faint.append(np.array([[left, y], [right, y]]))
        yield Line(tuple(faint), NEUTRAL, 0.5, 0.35)

    def named(self, title: str, across: str, up: str) -> Iterator[Words]:
        """Write the title of the panel, and the names of its axes."""
        middle = self.left + 0.5 * self.width
        yield Words(PANEL_EDGE, self.top - LETTER, title, bold=True)
        if across:
            low = self.top + self.height + TICK_WAY + 2.4 * SMALL_TYPE
            yield Words(middle, low, across, "middle", SMALL_TYPE)
        if up:
            yield Words(
                SMALL_TYPE, self.top + 0.5 * self.height, up, "middle", SMALL_TYPE, upwards=True
            )

    def sheet(
        self, size: tuple[float, float], names: tuple[str, str, str], marks: Iterable[Mark],
        entries: Sequence[KeyLine], *, key_height: float = 2.0 * ROW, name: str = "",
    ) -> Sheet:  # fmt: skip
        """Put marks, names and a key at the bottom on a sheet [pixels], called as the panel is."""
        width, height = size
        key, _ = keyed(entries, 8.0, height - key_height, width - 8.0)
        return Sheet(width, height, name or names[0], (*marks, *self.named(*names), *key))


def keyed(
    entries: Sequence[KeyLine], left: float, top: float, wide: float
) -> tuple[list[Mark], int]:
    """Lay out a key in rows that are at most so wide; return its marks and the number of rows."""
    marks, x, row = list[Mark](), left, 0
    for entry in entries:
        long = SAMPLE + 6.0 + width_of(entry.text, SMALL_TYPE) + 10.0
        if x > left and x + long - 10.0 > left + wide:
            x, row = left, row + 1
        y = top + (row + 0.5) * ROW
        marks += [*_sample(entry, x, y), Words(x + SAMPLE + 6.0, y, entry.text, size=SMALL_TYPE)]
        x += long
    return marks, row + 1


def _sample(entry: KeyLine, x: float, y: float) -> Iterable[Mark]:
    if entry.kind == "area":
        box = [(x, y - 5.0), (x + SAMPLE, y - 5.0), (x + SAMPLE, y + 5.0), (x, y + 5.0)]
        return [Area((np.array(box),), entry.colour, 0.3)]
    if entry.kind == "line" or entry.kind == "dashes":  # noqa: PLR1714 - so that types are known
        ends = np.array([(x, y), (x + SAMPLE, y)])
        return [Line((ends,), entry.colour, 2.0, dashed=entry.kind == "dashes")]
    return [marker(entry.kind, np.array([x + 0.5 * SAMPLE, y]), 4.0, entry.colour)]


def marker(kind: Marker, center: Array, size: float, colour: str) -> Mark:
    """Draw a marker of a shape."""
    if kind == "disc":
        return Dots(center[None], colour, size)
    return Area((center + size * np.array(MARKER_CORNERS[kind]),), colour)


def thinned(points: Array) -> Array:
    """Leave out points of a line that lie on the line through the others, to a fifth of a pixel.

    Source:
        Douglas & Peucker, "Algorithms for the reduction of the number of points required to
        represent a digitized line or its caricature", Cartographica 10(2), 1973.
    """
    kept, open_ends = {0, len(points) - 1}, [(0, len(points) - 1)]
    while open_ends:
        first, last = open_ends.pop()
        if last - first <= 1:
            continue
        along = points[last] - points[first]
        arms = points[first + 1 : last] - points[first]
        length = float(np.hypot(*along))
        away = np.abs(arms[:, 0] * along[1] - arms[:, 1] * along[0]) / length if length else (
            np.hypot(*arms.T)
        )  # fmt: skip
        worst = int(away.argmax())
        if away[worst] > CURVE_TOLERANCE:
            middle = first + 1 + worst
            kept.add(middle)
            open_ends += [(first, middle), (middle, last)]
    return points[sorted(kept)]
