"""Describes flat drawings: marks on a sheet, in pixels from its upper left corner."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from scenes.drawing.colours import INK, PAPER

LETTER = 12.0
"""Size of letters [pixels]."""
ROUND = 48
"""Number of corners of a polygon that replaces a circle."""
Anchor: TypeAlias = Literal["start", "middle", "end"]


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A filled area, bounded by loops that run around it in one direction."""

    loops: tuple[Array, ...]
    """Corners of each loop, (k, 2)."""
    fill: str
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """Lines of one colour and width."""

    lines: tuple[Array, ...]
    """Points of each line, (k, 2)."""
    colour: str
    width: float = 1.4
    opacity: float = 1.0
    dashed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """Round dots of one colour and size."""

    points: Array
    """Their middles, (k, 2)."""
    colour: str
    radius: float = 2.5
    opacity: float = 1.0


@dataclass(frozen=True, slots=True)
class Words:
    """A line of text; its middle is at the height of its point."""

    x: float
    y: float
    text: str
    anchor: Anchor = "start"
    size: float = LETTER
    bold: bool = False
    upwards: bool = False
    """Whether the text runs upwards, as the name of an upright axis does."""


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """Small squares with colours of the ramp, smoothed where they are shown larger."""

    left: float
    top: float
    width: float
    height: float
    levels: Indices
    """Level of the ramp of each square, (rows, columns), from the top; -1 leaves it clear."""


Mark: TypeAlias = Area | Line | Dots | Words | Image


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A flat drawing: marks, of which later ones cover earlier ones."""

    width: float
    height: float
    name: str
    """What the drawing shows, for readers who do not see it."""
    marks: tuple[Mark, ...]

    def words(self) -> Iterator[Words]:
        """Yield all texts of the sheet."""
        yield from (mark for mark in self.marks if isinstance(mark, Words))


def moved(mark: Mark, by: Array) -> Mark:
    """Shift a mark, (2,)."""
    match mark:
        case Area():
            return replace(mark, loops=tuple(loop + by for loop in mark.loops))
        case Line():
            return replace(mark, lines=tuple(line + by for line in mark.lines))
        case Dots():
            return replace(mark, points=mark.points + by)
        case Words():
            return replace(mark, x=mark.x + float(by[0]), y=mark.y + float(by[1]))
        case Image():
            return replace(mark, left=mark.left + float(by[0]), top=mark.top + float(by[1]))


def beside(sheets: Sequence[Sheet], apart: float = 0.0) -> Sheet:
    """Put sheets side by side, from left to right."""
    marks, left = list[Mark](), 0.0
    for sheet in sheets:
        marks += [moved(mark, np.array([left, 0.0])) for mark in sheet.marks]
        left += sheet.width + apart
    height = max(sheet.height for sheet in sheets)
    return Sheet(left - apart, height, "; ".join(each.name for each in sheets), tuple(marks))


def circle(center: Array, radius: float) -> Array:
    """Return the corners of a polygon that looks like a circle, (ROUND, 2)."""
    angles = 2.0 * np.pi * np.arange(ROUND) / ROUND
    return center + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def closed(loop: Array) -> Array:
    """Repeat the first corner of a polygon at its end, to draw its border as a line, (k + 1, d)."""
    return np.vstack([loop, loop[:1]])


def outlined(loops: Iterable[Array], colour: str, width: float = 1.4) -> Line:
    """Draw the borders of loops, each closed."""
    return Line(tuple(map(closed, loops)), colour, width)


def numbered(center: Array, radius: float, text: str, colour: str) -> tuple[Mark, ...]:
    """Draw a number in a circle."""
    rim = circle(center, radius)
    x, y = center.tolist()
    return (
        Area((rim,), PAPER),
        outlined([rim], colour, 1.2),
        Words(x, y, text, "middle", 1.4 * radius, bold=True),
    )


def ink_line(points: Sequence[tuple[float, float]], width: float = 1.0) -> Line:
    """Draw a line in ink through points."""
    return Line((np.array(points),), INK, width)
