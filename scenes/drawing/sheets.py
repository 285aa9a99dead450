"""Describes flat drawings and writes them as SVG and as PNG; the only module that uses resvg.

A drawing is a sheet of marks, in pixels from its upper left corner: areas, lines, dots, words and
small images. Pages and notebooks take the sheet as SVG text.

Colours of fingers are by Okabe and Ito; colour-blind people can tell them apart. The ramp from
small to large values is cividis, whose colours differ in brightness, too. Colours that a dark
screen needs otherwise have a class beside the colour; `night_style` gives the rules. Coordinates
are whole quarters of pixels, relative to one another, and in files a look that comes again stands
once, which takes a third of the text.

Sources:
    Okabe & Ito, "Color Universal Design", 2008.
    Nunez, Anderton & Renslow, "Optimizing colormaps with consideration for color vision
    deficiency", PLOS ONE 13(7), 2018.
"""

import importlib
import struct
import zlib
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from grasp_core.allowed_values import path_of
from grasp_core.arrays import Array, Indices
from grasp_core.by_value import ByValue
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts

FINGER_COLOURS = ("#E69F00", "#56B4E9", "#009E73", "#CC79A7")
"""Colour of each finger, which its cones, region, line of force and curves share."""
INK_HEX, GLASS, FOCUS_HEX, SURFACE_HEX = "#30363d", "#8296ab", "#D55E00", "#0072B2"
HAND = "#b9b0a4"
"""Colour of a hand's links: warm and muted, so that it is neither a finger's nor the object's."""
TOUCHING = FINGER_COLOURS[1]
"""Colour of links that touch, where contacts have no colours of their own."""
GOOD_HEX, BAD_HEX, NEUTRAL = "#0072B2", "#D55E00", "#686e77"
PAPER = "#ffffff"
NIGHT = {
    INK_HEX: "#dfe4ea", GOOD_HEX: "#56aee8", NEUTRAL: "#a3adb8", PAPER: "#14181d",
    BAD_HEX: "#ff8a4c",
}  # fmt: skip
"""Colours that take the place of others where the reader's screen is dark."""
RAMP = ("#00224e", "#434e6c", "#7d7c78", "#bcaf6f", "#fee838")
LEVELS = 64


def rgb(colour: str) -> tuple[float, float, float]:
    """Convert a colour written as #rrggbb to red, green and blue from 0 to 1."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue


def hexed(colour: tuple[float, ...]) -> str:
    """Convert red, green and blue from 0 to 1 to a colour written as #rrggbb."""
    return "#" + "".join(f"{round(255.0 * part):02x}" for part in colour[:3])


def ramp_bytes() -> Indices:
    """Return the colours of the ramp, (LEVELS, 3), from 0 to 255."""
    knots = np.array([rgb(colour) for colour in RAMP])
    places = np.linspace(0.0, len(RAMP) - 1.0, LEVELS)
    mixed = [np.interp(places, np.arange(len(RAMP)), knots[:, part]) for part in range(3)]
    return np.rint(255.0 * np.stack(mixed, axis=1)).astype(np.int64)


def levels_of(values: Array, low: float, high: float) -> Indices:
    """Find the level of the ramp for each value of a range, of any shape."""
    span = max(high - low, np.finfo(np.float64).tiny)
    return np.clip(LEVELS * (values - low) / span, 0, LEVELS - 1).astype(np.int64)


PICTURE_FORMATS = ("svg", "png")
ASSETS = Path(__file__).parent / "assets"
FONT_FAMILY, FONT_FILES = "DejaVu Sans", ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf")
"""The letters of PNG files: Latin and Greek ones and signs of DejaVu Sans 2.37."""
LETTER = 12.0
ROUND_CORNERS = 48
Anchor: TypeAlias = Literal["start", "middle", "end"]
SIGNATURE = b"\x89PNG\r\n\x1a\n"
PALETTE, BITS = 3, 8
"""PNG's number for pixels that name a colour of a palette, and the bits of such a name."""
PARTS_PER_PIXEL = 4
BASELINE_DROP = 0.35
FONT = "system-ui,sans-serif"
DASH_LENGTHS = "20 16"
SvgAttributes: TypeAlias = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Area(ByValue):
    """A filled area, bounded by loops that run around it in one direction."""

    loops: tuple[Array, ...]
    fill: str
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Line(ByValue):
    """Lines of one colour and width."""

    lines: tuple[Array, ...]
    colour: str
    width: float = 1.4
    opacity: float = 1.0
    dashed: bool = False


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Dots(ByValue):
    """Round dots of one colour and size."""

    points: Array
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Image(ByValue):
    """Small squares with colours of the ramp, smoothed where they are shown larger."""

    left: float
    top: float
    width: float
    height: float
    levels: Indices
    """Level of the ramp of each square, (rows, columns), from the top; -1 leaves it clear."""


Mark: TypeAlias = Area | Line | Dots | Words | Image


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sheet(ByValue):
    """A flat drawing, which a notebook shows and `write` puts into a file."""

    width: float
    """Width of the drawing [pixels], and its height below."""
    height: float
    name: str
    """What the drawing shows, for readers who do not see it."""
    marks: tuple[Mark, ...]
    """Areas, lines, dots, words and images, of which later ones cover earlier ones."""

    def words(self) -> Iterator[Words]:
        """Yield all texts of the sheet."""
        yield from (mark for mark in self.marks if isinstance(mark, Words))

    def write(self, path: str | Path) -> Path:
        """Write the drawing on white ground as SVG or PNG, by the ending of the file's name.

        Raises:
            InputError: The value is not a path, or has another ending.
            OSError: The file cannot be written.
        """
        path = path_of(path, "path")
        form = format_of(path)
        return write_parts(path, [png_of(self) if form == "png" else self._repr_svg_().encode()])

    def _repr_svg_(self) -> str:
        """Return the drawing on white ground as SVG text."""
        return svg_of(self, paper=True)


def format_of(path: Path) -> str:
    """Return the picture format that the ending of a file's name stands for."""
    form = path.suffix.lower().removeprefix(".")
    if form not in PICTURE_FORMATS:
        raise InputError(f"{path}: a picture's name must end in .{' or .'.join(PICTURE_FORMATS)}")
    return form


def png_of(sheet: Sheet) -> bytes:
    """Draw a sheet on white ground as the bytes of a PNG file; equal sheets give equal bytes.

    Letters are those of the fonts in this package, so that a machine needs none.
    """
    resvg: Any = importlib.import_module("resvg_py")
    return resvg.svg_to_bytes(
        svg_string=svg_of(sheet, paper=True), background="white", skip_system_fonts=True,
        font_files=[str(ASSETS / name) for name in FONT_FILES], sans_serif_family=FONT_FAMILY,
    )  # fmt: skip


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


def beside(sheets: Sequence[Sheet]) -> Sheet:
    """Put sheets side by side, from left to right."""
    marks, left = list[Mark](), 0.0
    for sheet in sheets:
        marks += [moved(mark, np.array([left, 0.0])) for mark in sheet.marks]
        left += sheet.width
    height = max(sheet.height for sheet in sheets)
    return Sheet(left, height, "; ".join(each.name for each in sheets), tuple(marks))


def circle(center: Array, radius: float) -> Array:
    """Return the corners of a polygon that looks like a circle, (ROUND_CORNERS, 2)."""
    angles = 2.0 * np.pi * np.arange(ROUND_CORNERS) / ROUND_CORNERS
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


def ink_line(points: Sequence[tuple[float, float]]) -> Line:
    """Draw a thin line in ink through points."""
    return Line((np.array(points),), INK_HEX, 1.0)


def _image_png(levels: Indices) -> bytes:
    """Write an image (rows, columns) with the colours of the ramp as PNG bytes (ISO/IEC 15948)."""
    rows, columns = levels.shape
    names = np.where(levels < 0, LEVELS, levels).astype(np.uint8)
    lines = np.column_stack([np.zeros(rows, np.uint8), names])  # a line begins with its filter
    header = struct.pack(">IIBBBBB", columns, rows, BITS, PALETTE, 0, 0, 0)
    return SIGNATURE + b"".join([
        _chunk(b"IHDR", header),
        _chunk(b"PLTE", ramp_bytes().astype(np.uint8).tobytes() + b"\x00\x00\x00"),
        _chunk(b"tRNS", b"\xff" * LEVELS + b"\x00"),
        _chunk(b"IDAT", zlib.compress(lines.tobytes(), 9)),
        _chunk(b"IEND", b""),
    ])  # fmt: skip


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def svg_of(sheet: Sheet, *, alone: bool = False, paper: bool = False) -> str:
    """Write a sheet as an SVG element."""
    runs = [
        (plain, list(marks))
        for plain, marks in groupby(sheet.marks, key=lambda mark: isinstance(mark, Words | Image))
    ]
    names = _names(runs) if alone else {}
    inside = "".join(
        "".join(map(_plain, marks)) if plain else f'<g transform="scale(.25)">'
        f"{_drawn(marks, names)}</g>" for plain, marks in runs
    )  # fmt: skip
    rules = "".join(
        f".{name}{{{';'.join(f'{key}:{value}' for key, value in look if key != 'class')}}}"
        for look, name in names.items()
    )
    style = f"<style>{rules}{night_style()}</style>" if alone else ""
    width, height = f"{sheet.width:g}", f"{sheet.height:g}"
    kind = ' xmlns="http://www.w3.org/2000/svg"' if alone or paper else ""  # pages know it
    ground = ' style="background:#fff"' if paper else ""
    return (
        f'<svg{kind} class="sheet" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img" aria-label="{escape(sheet.name)}"{ground} '
        f'font-family="{FONT}" fill="none" stroke-linejoin="round">'
        f"{style}{inside}</svg>"
    )


def night_style() -> str:
    """Return the CSS rules for drawings on dark screens."""
    rules = "".join(
        f".f{place}{{fill:{colour}}}.s{place}{{stroke:{colour}}}"
        for place, colour in enumerate(NIGHT.values())
    )
    return f"@media(prefers-color-scheme:dark){{{rules}}}"


def _names(runs: Iterable[tuple[bool, list[Mark]]]) -> dict[SvgAttributes, str]:
    counts = Counter(
        look for plain, marks in runs if not plain for look, _ in groupby(marks, key=_look)
    )
    again = [look for look, count in counts.items() if count > 1]
    return {look: f"k{place}" for place, look in enumerate(again)}


def _drawn(marks: Iterable[Mark], names: Mapping[SvgAttributes, str]) -> str:
    groups = list[str]()
    for look, alike in groupby(marks, key=_look):
        attributes, paths = _attributes(look, names), [_path(mark) for mark in alike]
        if len(paths) == 1:
            groups.append(f'<path{attributes} d="{paths[0]}"/>')
        else:
            inside = "".join(f'<path d="{path}"/>' for path in paths)
            groups.append(f"<g{attributes}>{inside}</g>")
    return "".join(groups)


def _attributes(look: SvgAttributes, names: Mapping[SvgAttributes, str]) -> str:
    if look in names:
        night = "".join(f" {value}" for key, value in look if key == "class")
        return f' class="{names[look]}{night}"'
    return "".join(f' {key}="{value}"' for key, value in look)


def _look(mark: Mark) -> SvgAttributes:
    match mark:
        case Area():
            return _paint("fill", mark.fill, mark.opacity)
        case Line():
            dashes = (("stroke-dasharray", DASH_LENGTHS),) if mark.dashed else ()
            return (*_paint("stroke", mark.colour, mark.opacity), _width(mark.width), *dashes)
        case Dots():
            look = _paint("stroke", mark.colour, mark.opacity)
            return (*look, _width(2.0 * mark.radius), ("stroke-linecap", "round"))
        case Words() | Image():
            return ()


def _paint(kind: str, colour: str, opacity: float) -> SvgAttributes:
    name = (("class", f"{kind[0]}{list(NIGHT).index(colour)}"),) if colour in NIGHT else ()
    faint = () if opacity >= 1.0 else ((f"{kind}-opacity", f"{opacity:.2g}".lstrip("0")),)
    return (*name, (kind, colour), *faint)


def _width(width: float) -> tuple[str, str]:
    return "stroke-width", f"{PARTS_PER_PIXEL * width:.3g}"


def _path(mark: Mark) -> str:
    match mark:
        case Area():
            return "".join(_steps(loop) + "z" for loop in mark.loops)
        case Line():
            return "".join(map(_steps, mark.lines))
        case Dots():
            places = np.rint(PARTS_PER_PIXEL * mark.points).astype(int).tolist()
            return "".join(f"M{x} {y}h0" for x, y in places)
        case Words() | Image():
            return ""


def _steps(points: Array) -> str:
    """Write a line as a path: its first point, and the steps to the others."""
    whole: list[list[int]] = np.rint(PARTS_PER_PIXEL * points).astype(int).tolist()
    x, y = whole[0]
    steps = [(u - s, v - t) for (s, t), (u, v) in pairwise(whole) if u != s or v != t] or [(0, 0)]
    return f"M{x} {y}l{' '.join([f'{u} {v}' for u, v in steps])}".replace(" -", "-")


def _plain(mark: Mark) -> str:
    if isinstance(mark, Image):
        data = b64encode(_image_png(mark.levels)).decode()
        return (
            f'<image x="{mark.left:g}" y="{mark.top:g}" width="{mark.width:g}" '
            f'height="{mark.height:g}" preserveAspectRatio="none" '
            f'href="data:image/png;base64,{data}"/>'
        )
    if not isinstance(mark, Words):
        return ""
    low = BASELINE_DROP * mark.size
    x, y = (mark.x + low, mark.y) if mark.upwards else (mark.x, mark.y + low)
    turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if mark.upwards else ""
    anchor = "" if mark.anchor == "start" else f' text-anchor="{mark.anchor}"'
    bold = ' font-weight="bold"' if mark.bold else ""
    ink = _attributes(_paint("fill", INK_HEX, 1.0), {})
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{mark.size:.3g}"{anchor}{bold}{turned}{ink}>'
        f"{escape(mark.text)}</text>"
    )
