"""Turns a drawing into a page, or its numbers, on which a reader can rotate it.

Lengths are whole thousandths of the object's radius from its centre of mass. That is finer than a
screen shows, and takes a tenth of the text of full numbers.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import path_of
from grasp_core.declared import ByValue
from grasp_core.files.text_files import write_parts
from grasp_core.hands.hand import Hand
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.drawing.drawings import drawing_of, drawing_with_hand, glass
from scenes.drawing.hands import PosedHand, numbers_behind, view_of_hand
from scenes.drawing.pages import filled, number, text_of
from scenes.drawing.painting import SOLIDS
from scenes.drawing.pictures import check_drawn, held_by, number_places
from scenes.drawing.shapes import LOOKS, Role, Shape, colour_of
from scenes.drawing.views import best_view

if TYPE_CHECKING:
    from grasp_core.hands.reach import HandReach

UNITS = 1000.0
"""Number of units of length in one object radius."""
MILLI = 1e3
WIDTH, HEIGHT = 900, 640
Fact: TypeAlias = tuple[str, str, str]
"""Name, value and meaning of a figure on a page."""
DISC = "radius of the largest disc that fits each region: there every finger may stand anywhere"
CRITICAL = "least coefficient with which the contacts are in force closure; 0: none is needed"
MARGIN = "how far inside their friction cones balanced forces can be, with normal parts of sum 1"
QUALITY = (
    "largest wrench resisted in every direction, with normal forces of sum 1 N; torques over the "
    "object's radius"
)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Turntable(ByValue):
    """A drawing of a grasp that a reader can turn, in a notebook or in a browser."""

    object: str
    """Name of the object."""
    grasp: str
    """Id of the grasp."""
    page: str
    """Text of a web page that needs no other file."""

    def write(self, path: str | Path) -> Path:
        """Write the page to a file, which a browser opens from disk.

        Raises:
            InputError: The value is not a path.
            OSError: The file cannot be written.
        """
        return write_parts(path_of(path, "path"), [self.page.encode()])

    def _repr_html_(self) -> str:
        """Return the page in a frame of its own, whose scripts cannot reach the notebook."""
        return (
            f'<iframe sandbox="allow-scripts" width="{WIDTH}" height="{HEIGHT}" '
            f'style="border:0;max-width:100%" srcdoc="{escape(self.page)}"></iframe>'
        )


def show(
    body: Polyhedron, grasp: Grasp, friction: float = 0.5, *, hand: Hand | None = None,
    reach: "HandReach | None" = None,
) -> Turntable:  # fmt: skip
    """Draw a grasp on its object, or with a hand, so that it can be turned with the mouse.

    A notebook shows the drawing at the end of a cell; elsewhere `show(...).write("grasp.html")`
    writes it as a page.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        friction: Coulomb coefficient of the friction cones.
        hand: A hand to draw in place of straight fingers, with `reach`.
        reach: The pose in which it stands in the grasp, as `gc.reach_with` finds it.

    Raises:
        InputError: The grasp does not lie on the body, the friction is out of range, or `reach`
            holds no pose of this hand in this grasp.
    """
    check_drawn(body, grasp, friction, None)
    held = held_by(hand, reach, grasp)
    return Turntable(body.name, grasp.id, turntable_page(body, grasp, friction, held))


def object_data(body: Polyhedron) -> list[dict[str, Any]]:
    """Return the drawing of an object, which all of its grasps share."""
    return [_shape(shape, body) for shape in glass(body)]


def grasp_data(
    body: Polyhedron, grasp: Grasp, friction: float, held: PosedHand | None = None
) -> dict[str, Any]:
    """Return the drawing of a grasp without the object, and the view in which it is first seen.

    With a hand, the reader first sees what the picture with the hand shows, and can have the bars
    and lines of the paper's picture shown, too.
    """
    plain = len(glass(body))
    planned = drawing_of(body, grasp, friction)[plain:]
    if held is None:
        view, numbers = best_view(body, grasp), number_places(body, grasp)
        shapes, hidden = planned, set[Role]()
    else:
        view, numbers = view_of_hand(body, held), numbers_behind(held)
        shown = drawing_with_hand(body, grasp, friction, held)[plain:]
        seen = {shape.role for shape in shown}
        more = [shape for shape in planned if shape.role not in seen]
        shapes, hidden = (*shown, *more), {shape.role for shape in more}
    return {
        "shapes": [_shape(shape, body) for shape in shapes],
        "numbers": _whole(numbers, body),
        "axes": np.round(view.axes, 4).tolist(),
        "middle": _whole(view.center, body),
        "distance": round(UNITS * view.distance / body.radius),
        "hidden": sorted(hidden),
    }


def turntable_page(
    body: Polyhedron, grasp: Grasp, friction: float, held: PosedHand | None = None
) -> str:
    """Write a page that needs no other file and on which a reader can rotate a grasp."""
    return filled(
        "turntable.html",
        id=grasp.id,
        object=body.name,
        family=grasp.family,
        friction=friction,
        facts=[*grasp_facts(body, grasp), *([] if held is None else [
            (f"Fingers of {held.hand.name}", ", ".join(held.finger_names),
             "that touch, by finger of the grasp"),
        ])],
        style=text_of("style.css"),
        script=text_of("turntable.js"),
        object_drawing=as_text(object_data(body)),
        drawing=as_text(grasp_data(body, grasp, friction, held)),
    )  # fmt: skip


def grasp_facts(
    body: Polyhedron, grasp: Grasp, *, at_plan: str = "", in_simulation: str = ""
) -> Iterator[Fact]:
    """Yield the figures of a grasp; `at_plan` says at which friction most of them are."""
    yield (
        "Faces" if body.patches is None else "Patches",
        ", ".join(map(str, grasp.faces)), "numbers of those that the fingers stand on, by finger",
    )  # fmt: skip
    disc = f"{number(MILLI * grasp.radius)} mm{at_plan}" if grasp.radius else "none is claimed"
    yield "Smallest independent disc", disc, DISC
    yield "Critical friction", f"{number(grasp.critical_friction)}{in_simulation}", CRITICAL
    yield "Margin of closure", f"{number(grasp.closure_margin)}{at_plan}", MARGIN
    lower, upper = map(number, grasp.ferrari_canny)
    between = lower if lower == upper else f"{lower} to {upper}"
    yield "Ferrari-Canny quality", f"{between} N{at_plan}", QUALITY


def as_text(data: object) -> str:
    """Write JSON that can stand inside a page: no HTML tag can begin in it."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


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
        "solid": shape.role in SOLIDS,
        "polygons": [_whole(polygon, body) for polygon in shape.polygons] if look.fill else [],
        "lines": [_whole(line, body) for line in shape.lines] if look.line else [],
        "points": _whole(points, body),
    }


def _whole(points: Array, body: Polyhedron) -> Any:
    """Write points in units of the drawing, as lists of any depth."""
    return np.rint(UNITS / body.radius * (points - body.center_of_mass)).astype(int).tolist()
