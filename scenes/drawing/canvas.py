"""The door to matplotlib: figures, their files, and polygons in them.

Figures are made without `pyplot`, so that none outlives its use and no display is looked for.
"""

# pyright: basic
# matplotlib's types at their door.

import importlib
import io
import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.files.whole_files import replacing, write_parts
from scenes.drawing.palette import INK

Given = ParamSpec("Given")
Made = TypeVar("Made")

FORMATS = ("png", "svg", "pdf", "webp", "jpg")
LETTERS = 9.0
"""Of text in figures [points]."""
STYLE = {
    "font.size": LETTERS, "font.family": "DejaVu Sans", "axes.spines.top": False,
    "axes.spines.right": False, "axes.edgecolor": INK, "axes.labelcolor": INK, "text.color": INK,
    "xtick.color": INK, "ytick.color": INK, "axes.titlesize": LETTERS, "legend.frameon": False,
    "legend.fontsize": LETTERS - 1.0, "svg.hashsalt": "graspproof", "svg.fonttype": "path",
    "lines.linewidth": 1.4, "hatch.linewidth": 0.8,
}  # fmt: skip
INTERVALS = 4
"""Between ticks of an axis; ticks are what takes longest to draw."""
DOTS_PER_INCH = 100.0
OPTIONS: dict[str, dict[str, Any]] = {
    "webp": {"quality": 70, "method": 3},
    "jpg": {"quality": 90},
}
"""How pictures are packed: lines keep their colours, files stay small."""


def _part(name: str) -> Any:
    """A module of matplotlib.

    No display is looked for, so that a user's choice of one is none of its business; nor is where
    it keeps its notes on fonts, for which it finds another place by itself.
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
    """A function that makes figures, in the style of all figures here, whatever users have set."""

    @wraps(make)
    def styled(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        style: Any = _part("style")
        with style.context(["default", STYLE]):
            return make(*args, **kwargs)

    return styled


@dataclass(frozen=True, slots=True)
class Around:
    """Room around the panels of a figure, as shares of it, and between them, of a panel."""

    left: float = 0.075
    right: float = 0.01
    below: float = 0.17
    above: float = 0.09
    between: float = 0.3


def new_figure(width_in: float, height_in: float) -> Any:
    """An empty figure of a size in inches."""
    figure: Any = _part("figure")
    return figure.Figure(figsize=(width_in, height_in), dpi=DOTS_PER_INCH, layout=None)


def panels(figure: Any, count: int, *, around: Around = Around()) -> list[Any]:
    """Axes side by side, where a figure says: to find room for labels would take as long again."""
    room = {"left": around.left, "right": 1.0 - around.right, "bottom": around.below,
            "top": 1.0 - around.above, "wspace": around.between}  # fmt: skip
    found = list(figure.subplots(1, count, squeeze=False, gridspec_kw=room)[0])
    for axes in found:
        axes.locator_params(nbins=INTERVALS)
    return found


def entitle(axes: Any, title: str) -> None:
    """Give axes a title, at a fixed place: to look for a free one takes as long as all the rest."""
    axes.set_title(title, fontsize=LETTERS, y=1.0)


def add_polygons(
    axes: Any, polygons: Sequence[Array], colours: Sequence[tuple[float, ...]],
    smooth: Sequence[bool],
) -> None:  # fmt: skip
    """Filled polygons, in the order given."""
    collections: Any = _part("collections")
    axes.add_collection(
        collections.PolyCollection(
            polygons, facecolors=colours, linewidths=0.0, antialiaseds=np.array(smooth)
        ),
        autolim=False,
    )


def legend_patch(colour: str, label: str, opacity: float = 1.0) -> Any:
    """A coloured box for a legend."""
    patches: Any = _part("patches")
    return patches.Patch(facecolor=colour, alpha=opacity, edgecolor="none", label=label)


def legend_line(colour: str, label: str, *, style: str = "-", marker: str = "") -> Any:
    """A line or a marker for a legend."""
    lines: Any = _part("lines")
    return lines.Line2D([], [], color=colour, linestyle=style, marker=marker, label=label)


@in_style
def encoded(figure: Any, form: str) -> bytes:
    """A figure as the bytes of a file, the same for the same figure.

    Args:
        figure: From `new_figure`.
        form: One of `FORMATS`.
    """
    stream = io.BytesIO()
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    options = {"pil_kwargs": OPTIONS[form]} if form in OPTIONS else {}
    figure.savefig(stream, format=form, metadata=undated.get(form), facecolor="white", **options)
    return stream.getvalue()


def write_frames(
    figure: Any, draw: Callable[[int], None], count: int, rate: float, path: Path
) -> Path:
    """Write an animated picture.

    Args:
        figure: From `new_figure`.
        draw: Draws one frame into the figure.
        count: How many frames there are.
        rate: Frames per second.
        path: Of the file, gif or webp.
    """
    animation: Any = _part("animation")
    writer = animation.PillowWriter(fps=rate)
    with replacing(path) as temporary, writer.saving(figure, str(temporary), dpi=DOTS_PER_INCH):
        for frame in range(count):
            draw(frame)
            writer.grab_frame(facecolor="white")
    return path


def write_figure(figure: Any, path: Path) -> Path:
    """Write a figure to a file whose ending says the format.

    Raises:
        InputError: The ending is none of the known ones.
    """
    return write_parts(path, [encoded(figure, format_of(path))])


def format_of(path: Path) -> str:
    """The format that the ending of a picture's name says.

    Raises:
        InputError: It is none of the known ones.
    """
    form = path.suffix.lower().removeprefix(".").replace("jpeg", "jpg")
    if form not in FORMATS:
        raise InputError(f"{path}: pictures end in {', '.join('.' + name for name in FORMATS)}")
    return form
