"""Writes a page with some rows of a dataset, each with a picture of its contacts."""

import hashlib
import heapq
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.errors import GraspError
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import Seated, seat
from grasp_core.values import FINGERS, Contact, ContactRegion, ForceCone, Grasp, Witness, four
from scenes.drawing.drawings import drawing_of
from scenes.drawing.pages import number
from scenes.drawing.pictures import SIDE, number_places, sheet_of
from scenes.drawing.sheets import svg_of
from scenes.drawing.views import best_view
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.open_dataset import Selection
from sim_validate.reports.pages import page, style

PAGE = "index.html"
SHOWN = (
    "label", "kind", "friction", "force_closed", "closure_margin", "critical_friction",
    "ferrari_canny_lower_n", "held", "outcome", "survived", "predicted_loss", "mass_kg",
)  # fmt: skip
"""Columns of grasps that the page shows where the dataset has them."""
OF_FORCES = ("line of force", "ruled surface")
"""Roles of shapes that need the forces of a grasp, which tables do not hold."""
DIGITS = 4
Row = Mapping[str, Any]


def drawn_rows(chosen: Selection, count: int, seed: int) -> list[Row]:
    """Draw rows of the table of grasps, every row as likely; the seed alone decides which."""

    def place(row: Row) -> bytes:
        return hashlib.sha256(f"{seed} {row['grasp_id']}".encode()).digest()

    found = heapq.nsmallest(count, chosen.rows("grasps"), key=place)
    return sorted(found, key=lambda row: row["grasp_id"])


def write_sample(folder: Path, chosen: Selection, title: str, count: int, seed: int) -> int:
    """Write a page with some rows of a dataset.

    Gives number of rows on the page.
    """
    rows = drawn_rows(chosen, count, seed)
    text = page("sample.html", style=style(), title=title, rows=list(_shown(chosen, rows)))
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / PAGE, text)
    return len(rows)


def _shown(chosen: Selection, rows: list[Row]) -> Iterator[dict[str, Any]]:
    names = {row["object_id"]: row["source_name"] for row in chosen.rows("objects")}
    faces, bodies = chosen.config().faces, dict[str, Polyhedron]()
    for row in rows:
        name = row["object_id"]
        if name not in bodies:
            bodies = {name: stored_body(chosen.folder, name, names[name], faces)}
        yield {
            "id": row["grasp_id"],
            "object": names[name],
            "picture": picture_of(bodies[name], row),
            "cells": [(each, _said(row[each])) for each in SHOWN if each in row],
        }


def _said(value: object) -> str:
    if isinstance(value, float):
        return number(value, DIGITS)
    return "-" if value is None else str(value)


def picture_of(body: Polyhedron, row: Row) -> str:
    """Draw a row's contacts as SVG text; empty where they are not four, or not on the object."""
    if row["contacts"] != FINGERS:
        return ""
    points, normals = row["contact_points_m"], row["contact_normals"]
    try:
        seated = seat(body, points, normals)
        grasp = _drawable(seated, row)
        shapes = drawing_of(seated.body, grasp, row["friction"])
        shown = [shape for shape in shapes if shape.role not in OF_FORCES]
        sheet = sheet_of(
            shown, seated.body, best_view(seated.body, grasp), row["grasp_id"],
            numbers=number_places(seated.body, grasp), side=SIDE,
        )  # fmt: skip
        return svg_of(sheet)
    except GraspError:  # such as a finger that pulls
        return ""


def _drawable(seated: Seated, row: Row) -> Grasp:
    """Make a grasp to be drawn, whatever its contacts hold."""
    contacts = four(seated.contacts)
    theta = math.atan(row["friction"])
    normals = np.array([contact.normal for contact in contacts])
    points = np.array([contact.position for contact in contacts])
    return Grasp(
        id=str(row["name"]), family="regulus", faces=seated.faces, contacts=contacts,
        focus_points=np.empty((0, 3)),
        force_cones=four(ForceCone(normal, theta) for normal in normals),
        regions=four(_point(contact) for contact in contacts), radius=0.0, span_angle=0.0,
        critical_friction=0.0, closure_margin=0.0, ferrari_canny=(0.0, 0.0),
        witness=Witness(points, normals / FINGERS),
    )  # fmt: skip


def _point(contact: Contact) -> ContactRegion:
    return ContactRegion("point", contact.position[None], 0.0)
