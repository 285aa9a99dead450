"""Turns a drawing into the numbers of a page on which a reader can rotate it.

Lengths are whole thousandths of the object's radius from its centre of mass. That is finer than a
screen shows, and takes a tenth of the text of full numbers.
"""

import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.drawing.drawings import drawing_of, glass
from scenes.drawing.palette import LOOKS, colour_of
from scenes.drawing.pictures import number_places
from scenes.drawing.shapes import Shape
from scenes.drawing.views import best_view
from sim_validate.reports.pages import asset, page

UNITS = 1000.0
"""Number of units of length in one object radius."""


def object_data(body: Polyhedron) -> list[dict[str, Any]]:
    """Return the drawing of an object, which all of its grasps share."""
    return _data(glass(body), body)


def grasp_data(body: Polyhedron, grasp: Grasp, friction: float) -> dict[str, Any]:
    """Return the drawing of a grasp without the object, and the view in which it is first seen."""
    beyond = drawing_of(body, grasp, friction)[len(glass(body)) :]
    return {
        "shapes": _data(beyond, body),
        "numbers": _whole(number_places(body, grasp), body),
        "axes": np.round(best_view(body, grasp).axes, 4).tolist(),
    }


def turntable_page(body: Polyhedron, grasp: Grasp, friction: float) -> str:
    """Write a page that needs no other file and on which a reader can rotate a grasp."""
    return page(
        "turntable.html",
        id=grasp.id,
        object=body.name,
        family=grasp.family,
        friction=friction,
        style=asset("style.css"),
        script=asset("turntable.js"),
        object_drawing=as_text(object_data(body)),
        drawing=as_text(grasp_data(body, grasp, friction)),
    )


def as_text(data: object) -> str:
    """Write JSON that can stand inside a page: no HTML tag can begin in it."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _data(shapes: Iterable[Shape], body: Polyhedron) -> list[dict[str, Any]]:
    return [_shape(shape, body) for shape in shapes]


def _shape(shape: Shape, body: Polyhedron) -> dict[str, Any]:
    look = LOOKS[shape.role]
    points = np.empty((0, 3)) if shape.points is None else shape.points
    return {
        "role": shape.role,
        "finger": shape.finger,
        "colour": colour_of(shape),
        "fill": look.fill,
        "line": look.line,
        "dot": look.dot,
        "opacity": look.opacity,
        "shaded": look.shaded,
        "dashed": look.dashed,
        "polygons": [_whole(polygon, body) for polygon in shape.polygons] if look.fill else [],
        "lines": [_whole(line, body) for line in shape.lines] if look.line else [],
        "points": _whole(points, body),
    }


def _whole(points: Array, body: Polyhedron) -> list[list[int]]:
    return np.rint(UNITS / body.radius * (points - body.center_of_mass)).astype(int).tolist()
