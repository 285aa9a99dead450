"""Draws a grasp in the style of the paper, as a matplotlib figure or a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import coefficient, instance, path_of, switch
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.drawing.canvas import (
    Around,
    add_polygons,
    figure_with_panels,
    format_of,
    in_style,
    legend_line,
    legend_patch,
    write_figure,
)
from scenes.drawing.drawings import BAR_LENGTH, drawing_of
from scenes.drawing.painting import painted
from scenes.drawing.palette import FINGERS, INK, LOOKS, NEUTRAL, colour_of
from scenes.drawing.shapes import Role, Shape, extent_of
from scenes.drawing.views import Extent, View, best_view

SIDE_IN = 5.0
"""Width of a picture, and its height without the legend [inches]."""
LEGEND_IN = 0.5
"""Height of the legend [inches]."""
MARGIN = 0.04
"""Width of the empty margin, as a share of the picture's width."""
FARTHEST = 2.0
"""Distance from the object's centre beyond which points may be cut off, in object radii."""
NUMBER_BEYOND = 0.12
"""Distance of a finger's number from the end of its bar, in object radii."""
EXPLAINED: tuple[Role, ...] = (
    "finger", "friction cone", "force cone", "region", "line of force", "focus", "plane",
    "ruled surface",
)  # fmt: skip


def write_picture(
    body: Polyhedron,
    grasp: Grasp,
    path: str | Path,
    friction: float = 0.5,
    *,
    view: View | None = None,
) -> Path:
    """Draw a grasp in the style of the paper, and write the picture to a file.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        path: Path of the picture; its ending (png, svg, pdf, webp, jpg) says the format.
        friction: Coulomb coefficient of the friction cones.
        view: The view to draw from; None chooses the best one.

    Raises:
        InputError: The ending is unknown, the grasp does not lie on the body, or the friction is
            out of range.
    """
    path = path_of(path, "path")
    format_of(path)
    figure = grasp_figure(body, grasp, friction, view=view)
    return write_figure(figure, path)


@in_style
def grasp_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None,
    legend: bool = True,
) -> Any:  # fmt: skip
    """Draw a grasp in the style of the paper, as a matplotlib figure.

    Raises:
        InputError: The grasp does not lie on the body, or the friction is out of range.
    """
    check_drawn(body, grasp, friction, view)
    switch(legend, "legend")
    figure, axes = empty_picture(legend=legend)
    shapes = draw_grasp(axes, body, grasp, friction, view or best_view(body, grasp))
    if legend:
        figure.legend(
            handles=_legend(shapes), loc="lower center", ncols=4, handlelength=1.4,
            columnspacing=1.2,
        )  # fmt: skip
    return figure


def check_drawn(body: Polyhedron, grasp: Grasp, friction: float, view: View | None) -> None:
    """Refuse an object, grasp, friction or view that cannot be drawn.

    Raises:
        InputError: The grasp does not lie on the body, the friction is out of range, or `view` is
            no view.
    """
    check_on_faces(body, grasp)
    coefficient(friction)
    if view is not None:
        instance(view, View, "view", "View.of_angles makes one")


def empty_picture(*, legend: bool = False) -> tuple[Any, Any]:
    """Make a figure for a grasp, perhaps with a legend, and return it with its axes."""
    height = SIDE_IN + (LEGEND_IN if legend else 0.0)
    below = LEGEND_IN / (SIDE_IN + LEGEND_IN) if legend else 0.0
    around = Around(0.0, 0.0, below, 0.0)
    figure, (axes,) = figure_with_panels(SIDE_IN, height, 1, around=around)
    return figure, axes


def draw_grasp(
    axes: Any, body: Polyhedron, grasp: Grasp, friction: float, view: View, *, steady: bool = False
) -> tuple[Shape, ...]:  # fmt: skip
    """Draw a grasp into square axes.

    Args:
        axes: Axes of a matplotlib figure.
        body: The object.
        grasp: A grasp on the faces of `body`.
        friction: Coulomb coefficient of the friction cones.
        view: The view to draw from.
        steady: Whether to choose a scale that suits every view, as clips that turn need.

    Returns:
        The shapes that were drawn.
    """
    shapes = drawing_of(body, grasp, friction)
    numbers = number_places(body, grasp)
    low, high = frame_around(shapes, numbers, body, None if steady else view)
    patches = painted(shapes, view, float(high[0] - low[0]))
    add_polygons(
        axes,
        [patch.polygon for patch in patches],
        [patch.colour for patch in patches],
        [patch.smooth for patch in patches],
    )
    for finger, (x, y) in enumerate(view.seen(numbers)[0]):
        axes.text(x, y, str(finger), ha="center", va="center", weight="bold", color=INK,
                  bbox={"boxstyle": "circle,pad=0.18", "fc": "white", "ec": FINGERS[finger]},
                  zorder=10)  # fmt: skip
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_axis_off()
    return shapes


def number_places(body: Extent, grasp: Grasp) -> Array:
    """Return where the fingers' numbers are written, behind their bars, (4, 3) [m]."""
    ways = grasp.normals if grasp.approach_directions is None else grasp.approach_directions
    return grasp.positions - (BAR_LENGTH + NUMBER_BEYOND) * body.radius * ways


def frame_around(
    shapes: Sequence[Shape], numbers: Array, body: Extent, view: View | None
) -> tuple[Array, Array]:
    """Return two opposite corners of a square around the drawing, (2,) each [m].

    The square suits the given view or, if that is None, every view.
    """
    points = np.vstack([extent_of(shapes), numbers])
    distances = np.linalg.norm(points - body.center_of_mass, axis=1)
    near = distances <= FARTHEST * body.radius
    if view is None:
        half = (1.0 + 2.0 * MARGIN) * float(distances[near].max())
        return np.full(2, -half), np.full(2, half)
    flat, _ = view.seen(points[near])
    low, high = flat.min(axis=0), flat.max(axis=0)
    half = 0.5 * (1.0 + 2.0 * MARGIN) * float((high - low).max())
    middle = 0.5 * (low + high)
    return middle - half, middle + half


def _legend(shapes: Sequence[Shape]) -> list[Any]:
    """Make a legend entry for each role that occurs among the shapes."""
    found = {shape.role: shape for shape in reversed(shapes)}
    handles = list[Any]()
    for role in EXPLAINED:
        if role not in found:
            continue
        look, shape = LOOKS[role], found[role]
        colour = NEUTRAL if shape.finger is not None else colour_of(shape)
        if look.dot:
            handles.append(legend_line(colour, role, style="", marker="o"))
        elif look.fill:
            handles.append(legend_patch(colour, role, max(look.fill, 0.3)))
        else:
            handles.append(legend_line(colour, role, style="--" if look.dashed else "-"))
    return handles
