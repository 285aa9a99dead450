"""Makes figures, fills them with polygons and writes them; only this module uses matplotlib.

Figures are made without `pyplot`, so that no figure stays in memory and no display is needed.
"""

# pyright: basic
# Matplotlib's types are incomplete; only this module sees them.

import importlib
import io
import logging
import os
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.files.whole_files import replacing, write_parts
from scenes.drawing.palette import INK

Given = ParamSpec("Given")
Made = TypeVar("Made")

FORMATS = ("png", "svg", "pdf", "webp", "jpg")
LETTERS = 9.0
"""Size of text in figures [points]."""
STYLE = {
    "font.size": LETTERS, "font.family": "DejaVu Sans", "axes.spines.top": False,
    "axes.spines.right": False, "axes.edgecolor": INK, "axes.labelcolor": INK, "text.color": INK,
    "xtick.color": INK, "ytick.color": INK, "axes.titlesize": LETTERS, "legend.frameon": False,
    "legend.fontsize": LETTERS - 1.0, "svg.hashsalt": "graspproof", "svg.fonttype": "path",
    "lines.linewidth": 1.4, "hatch.linewidth": 0.8,
}  # fmt: skip
INTERVALS = 4
"""Largest number of intervals between ticks of an axis; ticks are the slowest part of drawing."""
DOTS_PER_INCH = 100.0
OPTIONS: dict[str, dict[str, Any]] = {
    "webp": {"quality": 70, "method": 2},
    "jpg": {"quality": 90},
}
"""Compression options of each picture format: lines keep their colours, and files stay small."""


_IN_STYLE = ContextVar("_IN_STYLE", default=False)
"""Whether the style of this module is set already."""
_REUSED = ContextVar("_REUSED", default=False)
"""Whether figures that were written are used again."""
_MAKER: ContextVar[object] = ContextVar("_MAKER", default=None)
"""The function that makes a figure; only figures of the same function are used again for it, so
that scales and labels stay."""
_SHEETS: dict[tuple[object, ...], list[tuple[Any, list[Any]]]] = {}
"""Figures to use again, with their axes, by maker, size and panels."""
_PANELS: "WeakKeyDictionary[Any, tuple[tuple[object, ...], list[Any]]]" = WeakKeyDictionary()
"""Maker, size and panels of each figure that is in use, with its axes."""


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
        token = _MAKER.set(make)
        try:
            with own_style():
                return make(*args, **kwargs)
        finally:
            _MAKER.reset(token)

    return styled


@contextmanager
def own_style() -> Generator[None]:
    """Hide users' own style settings from figures made in a `with` block.

    A block inside another one changes nothing. Setting the style takes as long as a small chart,
    so that code that draws several figures sets it once for all of them.
    """
    if _IN_STYLE.get():
        yield
        return
    style: Any = _part("style")
    with style.context(["default", STYLE]):
        token = _IN_STYLE.set(True)
        try:
            yield
        finally:
            _IN_STYLE.reset(token)


@contextmanager
def own_style_and_sheets() -> Generator[None]:
    """Set the style for a `with` block in which each figure is given up once it is written.

    `write_figure` then keeps the figure, and the next one of the same size and panels is drawn into
    its axes: making axes and ticks anew takes as long as drawing a chart. Nobody may use a figure
    after it is written in such a block.
    """
    token = _REUSED.set(True)
    try:
        with own_style():
            yield
    finally:
        _REUSED.reset(token)


@dataclass(frozen=True, slots=True)
class Around:
    """Margins around the panels of a figure and between them, as shares of figure and panel."""

    left: float = 0.075
    right: float = 0.01
    below: float = 0.17
    above: float = 0.09
    between: float = 0.3


def figure_with_panels(
    width_in: float, height_in: float, count: int, *, around: Around = Around(),
    widths: tuple[float, ...] | None = None,
) -> tuple[Any, list[Any]]:  # fmt: skip
    """Make a figure with axes side by side at given places.

    An automatic layout would take twice as long.

    Args:
        width_in: Width of the figure [inches].
        height_in: Its height [inches].
        count: Number of axes.
        around: Margins around the axes and between them.
        widths: Relative width of each of the axes; equal ones if None.

    Returns:
        The figure, and its axes from left to right.
    """
    kind = _MAKER.get(), width_in, height_in, count, around, widths
    if _REUSED.get() and (kept := _SHEETS.get(kind)):
        figure, found = kept.pop()
        for axes in found:
            _cleared(axes)
    else:
        figure = new_figure(width_in, height_in)
        room = {"left": around.left, "right": 1.0 - around.right, "bottom": around.below,
                "top": 1.0 - around.above, "wspace": around.between}  # fmt: skip
        found = list(
            figure.subplots(1, count, squeeze=False, width_ratios=widths, gridspec_kw=room)[0]
        )
        for axes in found:
            axes.locator_params(nbins=INTERVALS)
    _PANELS[figure] = kind, found
    return figure, found


def _cleared(axes: Any) -> None:
    """Remove from axes what was drawn into them, and let the next drawing choose their range."""
    for artist in axes.get_children():
        if artist not in (axes.title, axes.patch, axes.xaxis, axes.yaxis, *axes.spines.values()):
            with suppress(NotImplementedError):  # the titles at the sides stay, and are empty
                artist.remove()
    axes.dataLim.set_points(np.array([[np.inf, np.inf], [-np.inf, -np.inf]]))
    axes.ignore_existing_data_limits = True
    axes.set_prop_cycle(None)
    axes.autoscale(True)


def new_figure(width_in: float, height_in: float) -> Any:
    """Make an empty figure of a size in inches."""
    figure: Any = _part("figure")
    return figure.Figure(figsize=(width_in, height_in), dpi=DOTS_PER_INCH, layout=None)


def entitle(axes: Any, title: str) -> None:
    """Give axes a title at a fixed place; an automatic place takes longer than all the rest."""
    axes.set_title(title, fontsize=LETTERS, y=1.0)


def add_polygons(
    axes: Any, polygons: Sequence[Array], colours: Sequence[tuple[float, ...]],
    smooth: Sequence[bool],
) -> None:  # fmt: skip
    """Add filled polygons to axes in the given order; later ones cover earlier ones."""
    collections: Any = _part("collections")
    axes.add_collection(
        collections.PolyCollection(
            polygons, facecolors=colours, linewidths=0.0, antialiaseds=np.array(smooth)
        ),
        autolim=False,
    )


def legend_patch(colour: str, label: str, opacity: float = 1.0) -> Any:
    """Make a coloured box for a legend."""
    patches: Any = _part("patches")
    return patches.Patch(facecolor=colour, alpha=opacity, edgecolor="none", label=label)


def legend_line(colour: str, label: str, *, style: str = "-", marker: str = "") -> Any:
    """Make a line or a marker for a legend."""
    lines: Any = _part("lines")
    return lines.Line2D([], [], color=colour, linestyle=style, marker=marker, label=label)


@in_style
def encoded(figure: Any, form: str) -> bytes:
    """Encode a figure as the bytes of a picture file; equal figures give equal bytes.

    Args:
        figure: A figure from `new_figure`.
        form: A format from `FORMATS`.
    """
    stream = io.BytesIO()
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    options = {"pil_kwargs": OPTIONS[form]} if form in OPTIONS else {}
    figure.savefig(stream, format=form, metadata=undated.get(form), facecolor="white", **options)
    return stream.getvalue()


def write_frames(
    figure: Any, draw: Callable[[int], None], count: int, rate: float, path: Path
) -> Path:
    """Write an animated picture, frame by frame.

    Args:
        figure: A figure from `new_figure`.
        draw: Draws the frame of a given number into the figure.
        count: Number of frames.
        rate: Frames per second.
        path: File to write, gif or webp.
    """
    animation: Any = _part("animation")
    writer = animation.PillowWriter(fps=rate)
    with replacing(path) as temporary, writer.saving(figure, str(temporary), dpi=DOTS_PER_INCH):
        for frame in range(count):
            draw(frame)
            writer.grab_frame(facecolor="white")
    return path


def write_figure(figure: Any, path: Path) -> Path:
    """Write a figure to a file; the ending of the file's name selects the format.

    Raises:
        InputError: The ending is unknown.
    """
    written = write_parts(path, [encoded(figure, format_of(path))])
    if _REUSED.get() and figure in _PANELS:
        kind, axes = _PANELS.pop(figure)
        _SHEETS.setdefault(kind, []).append((figure, axes))
    return written


def format_of(path: Path) -> str:
    """Return the picture format that the ending of a file's name stands for.

    Raises:
        InputError: The ending is unknown.
    """
    form = path.suffix.lower().removeprefix(".").replace("jpeg", "jpg")
    if form not in FORMATS:
        raise InputError(f"{path}: a picture's name must end in .{', .'.join(FORMATS)}")
    return form
