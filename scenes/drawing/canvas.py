"""Draws sheets as figures and writes them; only this module uses matplotlib.

Figures are made without `pyplot`, so that no figure stays in memory and no display is needed.
"""

# pyright: basic
# Matplotlib's types are incomplete; only this module sees them.

import importlib
import io
import logging
import os
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from grasp_core.errors import InputError
from grasp_core.files.text_files import replacing, write_parts
from scenes.drawing.flat.colours import INK, LEVELS, ramp_bytes
from scenes.drawing.flat.sheets import Area, Dots, Image, Line, Mark, Sheet, Words, closed
from scenes.drawing.flat.svg import svg_of

Given = ParamSpec("Given")
Made = TypeVar("Made")

FORMATS = ("png", "svg", "pdf", "webp", "jpg")
STYLE = {
    "font.family": "DejaVu Sans", "text.color": INK, "svg.hashsalt": "graspproof",
    "svg.fonttype": "path", "lines.solid_capstyle": "butt",
}  # fmt: skip
ANCHORS = {"start": "left", "middle": "center", "end": "right"}
SHORT = 2
"""Number of letters up to which words may be bold: the widths of bold letters depend so much on how
fonts are hinted that longer words would end at other places."""
POINTS = 0.72
"""Points in a pixel."""
DOTS_PER_INCH = 100.0
OPTIONS: dict[str, dict[str, Any]] = {
    "webp": {"quality": 70, "method": 2},
    "jpg": {"quality": 90},
}
"""Compression options of each picture format: lines keep their colours, and files stay small."""


def _part(name: str) -> Any:
    """Import a module of matplotlib.

    The import must not look for a display, so the user's choice of a matplotlib backend is hidden
    from it. Matplotlib's warning about the folder of its font cache is hidden too, because
    matplotlib finds another folder by itself.
    """
    backend, logger = os.environ.pop("MPLBACKEND", None), logging.getLogger("matplotlib")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        return importlib.import_module(f"matplotlib.{name}")
    finally:
        logger.setLevel(level)
        if backend is not None:
            os.environ["MPLBACKEND"] = backend


def in_style(make: Callable[Given, Made]) -> Callable[Given, Made]:
    """Decorate a function that makes figures so that users' own style settings do not matter."""

    @wraps(make)
    def styled(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        style: Any = _part("style")
        with style.context(["default", STYLE]):
            return make(*args, **kwargs)

    return styled


def figure_of(sheet: Sheet) -> Any:
    """Draw a sheet as a matplotlib figure of the same size."""
    figure = new_figure(sheet.width, sheet.height)
    draw_sheet(figure, sheet)
    return figure


def new_figure(width: float, height: float) -> Any:
    """Make an empty figure of a size in pixels."""
    figure: Any = _part("figure")
    size = (width / DOTS_PER_INCH, height / DOTS_PER_INCH)
    return figure.Figure(figsize=size, dpi=DOTS_PER_INCH, layout=None)


@in_style
def draw_sheet(figure: Any, sheet: Sheet) -> None:
    """Draw a sheet into a figure, in place of what was drawn there."""
    figure.clear()
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(0.0, sheet.width), ylim=(sheet.height, 0.0), aspect="equal")
    axes.set_autoscale_on(False)
    for height, mark in enumerate(sheet.marks):
        _draw(axes, mark, height)


def _draw(axes: Any, mark: Mark, zorder: int) -> None:
    """Draw a mark in front of those that are lower."""
    match mark:
        case Area():
            paths, patches = _part("path"), _part("patches")
            loops = [paths.Path(loop, closed=True) for loop in map(closed, mark.loops)]
            whole = paths.Path.make_compound_path(*loops)
            axes.add_patch(
                patches.PathPatch(
                    whole, facecolor=mark.fill, alpha=mark.opacity, linewidth=0.0, zorder=zorder
                )
            )
        case Line():
            collections: Any = _part("collections")
            dashes = (0.0, (3.0, 2.4)) if mark.dashed else "solid"
            axes.add_collection(
                collections.LineCollection(
                    mark.lines, colors=mark.colour, linewidths=POINTS * mark.width,
                    alpha=mark.opacity, linestyles=[dashes], zorder=zorder,
                ),
                autolim=False,
            )  # fmt: skip
        case Dots():
            axes.plot(*mark.points.T, "o", color=mark.colour, ms=2.0 * POINTS * mark.radius,
                      mew=0.0, alpha=mark.opacity, zorder=zorder)  # fmt: skip
        case Words():
            axes.text(
                mark.x, mark.y, mark.text, ha=ANCHORS[mark.anchor], zorder=zorder,
                va="center_baseline" if not mark.upwards else "center",
                rotation=90.0 if mark.upwards else 0.0, fontsize=POINTS * mark.size,
                weight="bold" if mark.bold and len(mark.text) <= SHORT else "normal",
            )  # fmt: skip
        case Image():
            colours: Any = _part("colors").ListedColormap(ramp_bytes() / 255.0)
            ends = (mark.left, mark.left + mark.width, mark.top + mark.height, mark.top)
            levels = np.ma.masked_less(mark.levels, 0)
            axes.imshow(levels, cmap=colours, vmin=0, vmax=LEVELS, extent=ends, zorder=zorder,
                        aspect="auto", interpolation="nearest")  # fmt: skip


@in_style
def encoded(figure: Any, form: str) -> bytes:
    """Encode a figure as the bytes of a picture file; equal figures give equal bytes."""
    stream = io.BytesIO()
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    options = {"pil_kwargs": OPTIONS[form]} if form in OPTIONS else {}
    figure.savefig(stream, format=form, metadata=undated.get(form), facecolor="white", **options)
    return stream.getvalue()


def write_frames(
    figure: Any, draw: Callable[[int], None], count: int, rate: float, path: Path
) -> Path:
    """Write an animated picture, frame by frame."""
    animation: Any = _part("animation")
    writer = animation.PillowWriter(fps=rate)
    with replacing(path) as temporary, writer.saving(figure, str(temporary), dpi=DOTS_PER_INCH):
        for frame in range(count):
            draw(frame)
            writer.grab_frame(facecolor="white")
    return path


def write_figure(figure: Any, path: Path) -> Path:
    """Write a figure to a file; the ending of the file's name selects the format."""
    return write_parts(path, [encoded(figure, format_of(path))])


def write_sheet(sheet: Sheet, path: Path) -> Path:
    """Write a sheet on white ground to a file; the ending of the file's name selects the format."""
    if format_of(path) == "svg":
        return write_parts(path, [svg_of(sheet, paper=True).encode()])
    return write_figure(figure_of(sheet), path)


def format_of(path: Path) -> str:
    """Return the picture format that the ending of a file's name stands for."""
    form = path.suffix.lower().removeprefix(".").replace("jpeg", "jpg")
    if form not in FORMATS:
        raise InputError(f"{path}: a picture's name must end in .{', .'.join(FORMATS)}")
    return form
