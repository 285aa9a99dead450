"""Writes sheets as SVG text.

Colours that a dark screen needs otherwise have a class beside the colour; `night_style` gives the
rules. Where no rules are, as in notebooks, the drawing looks as by day. Coordinates are whole
quarters of pixels, relative to one another, which takes a third of the text of full numbers, and in
files a look that comes again stands once.
"""

from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Mapping
from html import escape
from itertools import groupby
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.colours import INK, NIGHT
from scenes.drawing.flat.png import png_of
from scenes.drawing.flat.sheets import Area, Dots, Image, Line, Mark, Sheet, Words

PARTS = 4
"""Number of parts of a pixel in which places are written."""
BASELINE = 0.35
"""Distance of the baseline of letters below their middle, in letter sizes."""
FONT = "system-ui,sans-serif"
DASHES = "20 16"
"""Lengths of dashes and of the gaps between them [parts of pixels]."""
Look: TypeAlias = tuple[tuple[str, str], ...]
"""Names and values of presentation attributes."""


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
    width, height = f"{sheet.width:g}", f"{sheet.height:g}"
    kind = ' xmlns="http://www.w3.org/2000/svg"' if alone or paper else ""  # pages know it
    ground = ' style="background:#fff"' if paper else ""
    return (
        f'<svg{kind} class="sheet" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img" aria-label="{escape(sheet.name)}"{ground} '
        f'font-family="{FONT}" fill="none" stroke-linejoin="round">'
        f"{_style(names) if alone else ''}{inside}</svg>"
    )


def night_style() -> str:
    """Return the CSS rules for drawings on dark screens."""
    rules = "".join(
        f".f{place}{{fill:{colour}}}.s{place}{{stroke:{colour}}}"
        for place, colour in enumerate(NIGHT.values())
    )
    return f"@media(prefers-color-scheme:dark){{{rules}}}"


def _style(names: Mapping[Look, str]) -> str:
    """Write the rules of a file: its looks that have names, and what is other on dark screens."""
    rules = "".join(
        f".{name}{{{';'.join(f'{key}:{value}' for key, value in look if key != 'class')}}}"
        for look, name in names.items()
    )
    return f"<style>{rules}{night_style()}</style>"


def _names(runs: Iterable[tuple[bool, list[Mark]]]) -> dict[Look, str]:
    """Name the looks that come again."""
    counts = Counter(
        look for plain, marks in runs if not plain for look, _ in groupby(marks, key=_look)
    )
    again = [look for look, count in counts.items() if count > 1]
    return {look: f"k{place}" for place, look in enumerate(again)}


def _drawn(marks: Iterable[Mark], names: Mapping[Look, str]) -> str:
    """Write areas, lines and dots; neighbours that look alike share a group."""
    return "".join(
        _alike(_attributes(look, names), [_path(mark) for mark in alike])
        for look, alike in groupby(marks, key=_look)
    )


def _alike(attributes: str, paths: list[str]) -> str:
    if len(paths) == 1:
        return f'<path{attributes} d="{paths[0]}"/>'
    inside = "".join(f'<path d="{path}"/>' for path in paths)
    return f"<g{attributes}>{inside}</g>"


def _attributes(look: Look, names: Mapping[Look, str]) -> str:
    if look in names:
        night = "".join(f" {value}" for key, value in look if key == "class")
        return f' class="{names[look]}{night}"'
    return "".join(f' {key}="{value}"' for key, value in look)


def _look(mark: Mark) -> Look:
    match mark:
        case Area():
            return _paint("fill", mark.fill, mark.opacity)
        case Line():
            dashes = (("stroke-dasharray", DASHES),) if mark.dashed else ()
            return (*_paint("stroke", mark.colour, mark.opacity), _width(mark.width), *dashes)
        case Dots():
            look = _paint("stroke", mark.colour, mark.opacity)
            return (*look, _width(2.0 * mark.radius), ("stroke-linecap", "round"))
        case Words() | Image():
            return ()


def _paint(kind: str, colour: str, opacity: float) -> Look:
    name = (("class", f"{kind[0]}{list(NIGHT).index(colour)}"),) if colour in NIGHT else ()
    faint = () if opacity >= 1.0 else ((f"{kind}-opacity", f"{opacity:.2g}".lstrip("0")),)
    return (*name, (kind, colour), *faint)


def _width(width: float) -> tuple[str, str]:
    return "stroke-width", f"{PARTS * width:.3g}"


def _path(mark: Mark) -> str:
    match mark:
        case Area():
            return "".join(_steps(loop) + "z" for loop in mark.loops)
        case Line():
            return "".join(map(_steps, mark.lines))
        case Dots():
            places = np.rint(PARTS * mark.points).astype(int).tolist()
            return "".join(f"M{x} {y}h0" for x, y in places)
        case Words() | Image():
            return ""


def _steps(points: Array) -> str:
    """Write a line as a path: its first point, and the steps to the others."""
    whole = np.rint(PARTS * points).astype(int)
    steps = np.diff(whole, axis=0)
    x, y = whole[0].tolist()
    kept = steps[steps.any(axis=1)].ravel().tolist() or [0, 0]
    return f"M{x} {y}l{' '.join(map(str, kept))}".replace(" -", "-")


def _plain(mark: Mark) -> str:
    """Write words or an image."""
    if isinstance(mark, Image):
        data = b64encode(png_of(mark.levels)).decode()
        return (
            f'<image x="{mark.left:g}" y="{mark.top:g}" width="{mark.width:g}" '
            f'height="{mark.height:g}" preserveAspectRatio="none" '
            f'href="data:image/png;base64,{data}"/>'
        )
    if not isinstance(mark, Words):
        return ""
    low = BASELINE * mark.size
    x, y = (mark.x + low, mark.y) if mark.upwards else (mark.x, mark.y + low)
    turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if mark.upwards else ""
    anchor = "" if mark.anchor == "start" else f' text-anchor="{mark.anchor}"'
    bold = ' font-weight="bold"' if mark.bold else ""
    ink = _attributes(_paint("fill", INK, 1.0), {})
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{mark.size:.3g}"{anchor}{bold}{turned}{ink}>'
        f"{escape(mark.text)}</text>"
    )
