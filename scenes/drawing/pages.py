"""Writes drawings as HTML: pages on which a reader turns a grasp, and cards for notebooks.

This is the only module that uses jinja2. Values in templates are escaped and lose unprintable
characters, because names of files and objects come from anywhere.

Lengths on a page are whole thousandths of the object's radius from its centre of mass. That is
finer than a screen shows, and takes a tenth of the text of full numbers.

A card is a small picture of an object, plan or scene with its figures. It takes some hundredths of
a second. Figures that a grasp has put off are left out, because the first of them may take seconds;
`repr` shows them.
"""

import importlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from html import escape
from itertools import islice
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from grasp_core.allowed_values import path_of
from grasp_core.arrays import Array
from grasp_core.by_value import ByValue, counted
from grasp_core.figures import figures
from grasp_core.files.text_files import write_parts
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.messages import MILLI
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from scenes.drawing.hands import posed_hand
from scenes.drawing.painting import Alone, Camera, Drawable, Extent, look_of
from scenes.drawing.pictures import (
    AZIMUTH_DEG,
    OBJECT_ELEVATION_DEG,
    Drawing,
    coarse,
    glass,
    pin,
    sheet_of,
)
from scenes.drawing.sheets import ASSETS, svg_of
from scenes.mujoco.closure_scene import Layout, Scene

NO_VALUE = "-"
GOOD_TONE, BAD_TONE, QUIET_TONE = "good", "bad", "quiet"
"""Classes of the style sheet for what is said."""
MILLION = 1e6
"""Size from which numbers are written with a power of ten."""
OF_OBJECT = ("object", "edge")
PER_RADIUS = 1000.0
"""Number of units of length in one object radius."""
CM3 = 1e6
PAGE_WIDTH, PAGE_HEIGHT = 900, 640
Fact: TypeAlias = tuple[str, str, str]
DISC = "radius of the largest disc that fits each region: there every finger may stand anywhere"
CRITICAL = "least coefficient with which the contacts are in force closure; 0: none is needed"
MARGIN_SAID = (
    "how far inside their friction cones balanced forces can be, with normal parts of sum 1"
)
QUALITY = (
    "largest wrench resisted in every direction, with normal forces of sum 1 N; torques over the "
    "object's radius"
)
LEGEND = 260
MOST_DRAWN_CORNERS = 20_000
"""Largest number of points that are drawn: they take a third of a second, and a megabyte."""
LEGEND_ROWS = 5
TableRow = Sequence[str]
TemplateData: TypeAlias = Mapping[str, Any]


def filled(template: str, folder: Path = ASSETS, **values: object) -> str:
    """Fill a page template with values."""
    return str(_environment(folder).get_template(template).render(**values))


def text_of(name: str, folder: Path = ASSETS) -> str:
    """Read a style sheet or script of a folder or, if it has none of that name, of this package."""
    own = folder / name
    return (own if own.is_file() else ASSETS / name).read_text(encoding="utf-8")


@cache
def _environment(folder: Path) -> Any:
    jinja2: Any = importlib.import_module("jinja2")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([folder, ASSETS]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_printed,
    )
    environment.filters["number"] = number
    return environment


def _printed(value: object) -> object:
    if type(value) is not str or value.isprintable():
        return value
    return "".join(c if c.isprintable() or c == "\n" else " " for c in value)


def number(value: float | None, digits: int = 3) -> str:
    """Write a number for people, without powers of ten below a million; None is a dash."""
    if value is None:
        return NO_VALUE
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+0" in text and abs(value) < MILLION else text


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
            f'<iframe sandbox="allow-scripts" width="{PAGE_WIDTH}" height="{PAGE_HEIGHT}" '
            f'style="border:0;max-width:100%" srcdoc="{escape(self.page)}"></iframe>'
        )


def show(
    body: Polyhedron, grasp: Grasp, friction: float = 0.5, *, hand: Hand | None = None,
    reach: HandReach | None = None,
) -> Turntable:  # fmt: skip
    """Draw a grasp on its object, or with a hand, so that it can be turned with the mouse.

    A notebook shows the drawing at the end of a cell; elsewhere `show(...).write("grasp.html")`
    writes it as a page.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        friction: Coulomb coefficient of the friction cones.
        hand: A hand to draw in place of straight fingers, with `reach`.
        reach: The pose in which it stands in the grasp, as `gc.reach_with` finds it, or where it
            came nearest.

    Raises:
        InputError: The grasp does not lie on the body, the friction is out of range, or `reach`
            holds no pose of this hand in this grasp.
    """
    drawing = Drawing(body, grasp, friction, posed_hand(hand, reach, grasp))
    return Turntable(body.name, grasp.id, turntable_page(drawing))


def object_data(body: Polyhedron) -> list[dict[str, Any]]:
    """Return the drawing of an object, which all of its grasps share."""
    return [_shape(shape, body) for shape in glass(body)]


def grasp_data(drawing: Drawing) -> dict[str, Any]:
    """Return the drawing of a grasp without the object, and the view in which it is first seen.

    With a hand, the reader first sees what the picture with the hand shows, and can have the bars
    and lines of the paper's picture shown, too.
    """
    body, every = drawing.body, drawing.shapes()
    roles = {shape.role for shape in every}
    planned = () if drawing.held is None else replace(drawing, held=None).shapes()
    shown = [shape for shape in every if shape.role not in OF_OBJECT]
    more = [shape for shape in planned if shape.role not in roles]
    view = drawing.view()
    return {
        "shapes": [_shape(shape, body) for shape in (*shown, *more)],
        "numbers": _whole(drawing.numbers(), body),
        "axes": np.round(view.axes, 4).tolist(),
        "middle": _whole(view.center, body),
        "distance": round(PER_RADIUS * view.distance / body.radius),
        "hidden": sorted({shape.role for shape in more}),
    }


def turntable_page(drawing: Drawing) -> str:
    """Write a page that needs no other file and on which a reader can rotate a grasp."""
    body, grasp, held = drawing.body, drawing.grasp, drawing.held
    return filled(
        "turntable.html",
        id=grasp.id,
        object=body.name,
        family=grasp.family,
        friction=drawing.friction,
        facts=[*grasp_facts(body, grasp), *([] if held is None else [
            (f"Fingers of {held.hand.name}", ", ".join(held.finger_names),
             "that touch, by finger of the grasp"),
        ])],
        style=text_of("style.css"),
        script=text_of("turntable.js"),
        object_drawing=as_text(object_data(body)),
        drawing=as_text(grasp_data(drawing)),
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
    yield "Margin of closure", f"{number(grasp.closure_margin)}{at_plan}", MARGIN_SAID
    lower, upper = map(number, grasp.ferrari_canny)
    between = lower if lower == upper else f"{lower} to {upper}"
    yield "Ferrari-Canny quality", f"{between} N{at_plan}", QUALITY


def facts_of(record: object, but: Sequence[str] = ()) -> Iterable[Fact]:
    """Yield the figures that a record has, but for those that the page says in other places."""
    for each in figures(type(record)):
        if each.name not in but and each.of(record) is not None:
            yield each.shown.heading, each.cell(record), each.explained


def records_table(records: Sequence[object], kind: type) -> TemplateData:
    """Build a table of the figures of records, for the template `records.html`.

    A figure that is true is good, and one that is false is bad. Those that no record has are left
    out.
    """
    listed = [each for each in figures(kind) if any(each.of(one) is not None for one in records)]
    tones = {True: GOOD_TONE, False: BAD_TONE}
    return {
        "columns": [(figure.shown.heading, figure.explained) for figure in listed],
        "rows": [
            [
                (figure.cell(one), tones[value] if isinstance(value, bool) else "")
                for figure in listed
                for value in [figure.of(one)]
            ]
            for one in records
        ],
    }


def as_text(data: object) -> str:
    """Write JSON that can stand inside a page: no HTML tag can begin in it."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _shape(shape: Drawable, body: Polyhedron) -> dict[str, Any]:
    look, points = look_of(shape), iter(_whole(shape.vertices(), body))
    polygons, lines = (
        [list(islice(points, len(each))) for each in some] for some in (shape.polygons, shape.lines)
    )
    return {
        "role": shape.role,
        "finger": shape.finger,
        **asdict(look),
        "polygons": polygons if look.fill else [],
        "lines": lines if look.line else [],
        "points": list(points),
    }


def _whole(points: Array, body: Polyhedron) -> list[list[int]]:
    return np.rint(PER_RADIUS / body.radius * (points - body.center_of_mass)).astype(int).tolist()


def html_of(value: object) -> str | None:
    """Return a picture of a value with its figures; None for a value that has no picture."""
    if isinstance(value, Plan):
        return _plan(value)
    if isinstance(value, Scene):
        layout = value.layout
        return card(placed(layout), layout.name, [("friction", f"{layout.friction:g}")])
    if not isinstance(value, Polyhedron):
        return None
    return card(_alone(value), value.name, [
        ("faces" if value.patches is None else "patches", str(len(value.faces))),
        ("triangles", str(len(value.triangles))),
        ("radius", f"{MILLI * value.radius:.4g} mm"),
        ("volume" if value.surface.closed else "volume of the hull",
         f"{CM3 * value.volume:.4g} cm³"),
    ])  # fmt: skip


def card(drawing: str, title: str, rows: Iterable[TableRow]) -> str:
    """Put a title and a table beside a drawing."""
    return filled("card.html", drawing=drawing, title=title, rows=rows)


def picture(
    shapes: Sequence[Drawable], extent: Extent, view: Camera, numbers: Array | None = None
) -> str:
    """Draw shapes as a small SVG element; nothing where there are too many of them."""
    if sum(len(shape.vertices()) for shape in shapes) > MOST_DRAWN_CORNERS:
        return ""
    return svg_of(
        sheet_of(shapes, extent, view, "picture", numbers=numbers, side=LEGEND), paper=True
    )


def placed(layout: Layout) -> str:
    """Draw the object of a scene with the bars of its fingers as a small SVG element."""
    size, inward = layout.radius_m, layout.frames[:, :, 0]
    extent = Alone(np.zeros(3), size)
    pins = [
        shape
        for finger, (tip, way) in enumerate(zip(layout.contacts, inward, strict=True))
        for shape in pin(finger, tip, way, size)
    ]
    surface = Drawable("object", polygons=tuple(coarse(layout.vertices, layout.triangles)))
    view = Camera.of_angles(AZIMUTH_DEG, OBJECT_ELEVATION_DEG, extent)
    return picture([surface, *pins, Drawable("contact", points=layout.contacts)], extent, view)


def _alone(body: Polyhedron) -> str:
    return picture(glass(body), body, Camera.of_angles(AZIMUTH_DEG, OBJECT_ELEVATION_DEG, body))


def _plan(plan: Plan) -> str:
    body = plan.body
    title = f"{counted(len(plan), 'grasp')} of {body.name} at friction {plan.friction:g}"
    if not len(plan):
        return card(_alone(body), title, [(plan.absence or "",)])
    first = Drawing(body, plan[0], plan.friction)
    rows: list[TableRow] = [("grasp", "family", "radius", "closure margin")]
    rows += [
        (
            g.id,
            g.family,
            f"{MILLI * g.radius:.3g} mm" if g.radius else "-",
            f"{g.closure_margin:.4g}",
        )
        for g in plan[:LEGEND_ROWS]
    ]
    rows += [("...",)] if len(plan) > LEGEND_ROWS else []
    return card(picture(first.shapes(), body, first.view(), first.numbers()), title, rows)
