"""Writes the small pictures with figures by which notebooks show objects, plans and scenes.

A picture takes some hundredths of a second. Figures that a grasp has put off are left out, because
the first of them may take seconds; `repr` shows them.
"""

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.result import Plan
from scenes.drawing.drawings import bar, coarse, drawing_of, glass
from scenes.drawing.pictures import AZIMUTH_DEG, ELEVATION_DEG, number_places, sheet_of
from scenes.drawing.shapes import Shape
from scenes.drawing.sheets import svg_of
from scenes.drawing.views import Alone, Extent, View, best_view
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.layout import Layout

SIDE = 260
MOST_CORNERS = 20_000
"""Largest number of points that are drawn: they take a third of a second, and a megabyte."""
ROWS = 5
COLUMNS = 4
MM, CM3 = 1e3, 1e6
Row = Sequence[str]


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
        ("radius", f"{MM * value.radius:.4g} mm"),
        ("volume" if value.surface.closed else "volume of the hull",
         f"{CM3 * value.volume:.4g} cm³"),
    ])  # fmt: skip


def card(drawing: str, title: str, rows: Iterable[Row]) -> str:
    """Put a title and a table beside a drawing."""
    cells = "".join(f"<tr>{_cells(row)}</tr>" for row in rows)
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:1em;align-items:center">'
        f"{drawing}<div><b>{escape(title)}</b><table>{cells}</table></div></div>"
    )


def _cells(row: Row) -> str:
    if len(row) == 1:
        return f'<td colspan="{COLUMNS}" style="text-align:left">{escape(row[0])}</td>'
    return "".join(f"<td>{escape(cell)}</td>" for cell in row)


def picture(
    shapes: Sequence[Shape], extent: Extent, view: View, numbers: Array | None = None
) -> str:
    """Draw shapes as a small SVG element; nothing where there are too many of them."""
    if sum(len(shape.vertices()) for shape in shapes) > MOST_CORNERS:
        return ""
    return svg_of(sheet_of(shapes, extent, view, "picture", numbers=numbers, side=SIDE), paper=True)


def placed(layout: Layout) -> str:
    """Draw the object of a scene with the bars of its fingers as a small SVG element."""
    size, inward = layout.radius_m, layout.frames[:, :, 0]
    extent = Alone(np.zeros(3), size)
    bars = [
        Shape("finger", finger, polygons=bar(tip, way, size))
        for finger, (tip, way) in enumerate(zip(layout.contacts, inward, strict=True))
    ]
    surface = Shape("object", polygons=tuple(coarse(layout.vertices, layout.triangles)))
    view = View.of_angles(AZIMUTH_DEG, ELEVATION_DEG, extent)
    return picture([surface, *bars, Shape("contact", points=layout.contacts)], extent, view)


def _alone(body: Polyhedron) -> str:
    return picture(glass(body), body, View.of_angles(AZIMUTH_DEG, ELEVATION_DEG, body))


def _plan(plan: Plan) -> str:
    body, drawing = plan.body, ""
    if len(plan):
        shapes, numbers = drawing_of(body, plan[0], plan.friction), number_places(body, plan[0])
        drawing = picture(shapes, body, best_view(body, plan[0]), numbers)
    count = f"{len(plan)} grasp{'' if len(plan) == 1 else 's'}"
    title = f"{count} of {plan.body.name} at friction {plan.friction:g}"
    if not len(plan):
        return card(_alone(body), title, [(plan.absence or "",)])
    rows: list[Row] = [("grasp", "family", "radius", "closure margin")]
    rows += [
        (g.id, g.family, f"{MM * g.radius:.3g} mm" if g.radius else "-", f"{g.closure_margin:.4g}")
        for g in plan[:ROWS]
    ]
    return card(drawing, title, [*rows, ("...",)] if len(plan) > ROWS else rows)
