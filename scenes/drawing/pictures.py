"""Draws a grasp in the style of the paper, or an object alone."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.errors import InputError
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.kinds import path_of, value_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.values import Grasp
from scenes.drawing.drawings import check_drawn, drawing_of, glass, numbers_of, view_of
from scenes.drawing.hands import PosedHand, posed_hand
from scenes.drawing.painting import LOOKS, Part, Role, Shape, extent_of, painted
from scenes.drawing.panels import ROW, Entry, Kind, keyed, thinned
from scenes.drawing.sheets import (
    FINGERS,
    NEUTRAL,
    Area,
    Dots,
    Line,
    Mark,
    Sheet,
    closed,
    format_of,
    numbered,
)
from scenes.drawing.views import Extent, View

SIDE = 500
"""Width of a picture, and its height without the key [pixels]."""
NUMBER, NUMBER_SHARE = 8.0, 0.028
"""Radius of the circle around a finger's number: at least so many pixels, and such a share of the
picture's width."""
FINGER_LABELS = tuple((str(finger), colour) for finger, colour in enumerate(FINGERS))
MOST_NUMBERED = 20
"""Largest number of faces that have their numbers on a picture of the object."""
POLYGON = 3
MANY = 60
"""Number of corners of an area above which those that are not seen are left out."""
AZIMUTH_DEG, ELEVATION_DEG = 35.0, 28.0
"""The view of an object without fingers [deg]."""
MARGIN = 0.04
"""Width of the empty margin, as a share of the picture's width."""
FARTHEST = 2.0
"""Distance from the object's centre beyond which points may be cut off, in object radii."""
EXPLAINED: tuple[Role, ...] = (
    "finger", "friction cone", "force cone", "region", "line of force", "focus", "plane",
    "ruled surface", "hand",
)  # fmt: skip
WHOLE: tuple[Role, ...] = ("hand", "fingertip")
"""Roles that are drawn whole, however far from the object they are."""


def write_picture(
    body: Polyhedron,
    grasp: Grasp,
    path: str | Path,
    friction: float = 0.5,
    *,
    view: View | None = None,
    hand: Hand | None = None,
    reach: HandReach | None = None,
) -> Path:
    """Draw a grasp in the style of the paper, or with the hand in it, and write it to a file.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        path: Path of the picture; its ending (svg or png) says the format.
        friction: Coulomb coefficient of the friction cones.
        view: The view to draw from; None chooses the best one.
        hand: A hand to draw in place of straight fingers, with `reach`.
        reach: The pose in which it stands in the grasp, as `gc.reach_with` finds it.

    Raises:
        InputError: The ending is unknown, the grasp does not lie on the body, the friction is out
            of range, or `reach` holds no pose of this hand in this grasp.
    """
    format_of(path_of(path, "path"))  # before the work
    return grasp_figure(body, grasp, friction, view=view, hand=hand, reach=reach).write(path)


def write_object_picture(body: Polyhedron, path: Path) -> Path:
    """Draw an object without fingers, and write the picture to a file."""
    format_of(path)
    view = View.of_angles(AZIMUTH_DEG, ELEVATION_DEG, body)
    has_numbers = body.patches is None and len(body.faces) <= MOST_NUMBERED
    towards = [
        index
        for index, face in enumerate(body.faces if has_numbers else ())
        if float(face.normal @ (view.camera - face.centroid)) < 0.0
    ]
    places = np.array([_middle(body.faces[face]) for face in towards]).reshape(-1, 3)
    labels = [(str(face), NEUTRAL) for face in towards]
    sheet = sheet_of(
        glass(body), body, view, body.name, numbers=places, side=SIDE, labels=labels
    )  # fmt: skip
    return sheet.write(path)


def _middle(face: Face) -> Array:
    """Return the middle of the largest piece of a face, which is on it even in a bent face."""
    areas = [
        float(np.linalg.norm(cross(piece[1:-1] - piece[0], piece[2:] - piece[0]).sum(axis=0)))
        for piece in face.pieces
    ]
    return face.pieces[int(np.argmax(areas))].mean(axis=0)


def grasp_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None,
    legend: bool = True, hand: Hand | None = None, reach: HandReach | None = None,
) -> Sheet:  # fmt: skip
    """Draw a grasp as `write_picture` does, as a sheet that a notebook shows.

    Raises:
        InputError: As for `write_picture`.
    """
    held = held_by(hand, reach, grasp)
    return grasp_sheet(body, grasp, friction, view=view, legend=legend, held=held)


def grasp_sheet(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None,
    legend: bool = False, held: PosedHand | None = None,
) -> Sheet:  # fmt: skip
    """Draw a grasp in the style of the paper, or with the hand in it."""
    check_drawn(body, grasp, friction, view)
    value_of(bool, legend, "legend")
    name = f"Grasp {grasp.id} of {body.name}"
    if held is not None:
        name += f" with the hand {held.hand.name}"
    shapes, numbers = drawing_of(body, grasp, friction, held), numbers_of(body, grasp, held)
    view = view or view_of(body, grasp, held)
    sheet = sheet_of(shapes, body, view, name, numbers=numbers, side=SIDE)
    if not legend:
        return sheet
    marks, rows = keyed(_entries(shapes), 20.0, SIDE, SIDE - 30.0)
    return Sheet(SIDE, SIDE + ROW * (rows + 0.5), sheet.name, (*sheet.marks, *marks))


def sheet_of(
    shapes: Sequence[Shape], extent: Extent, view: View, name: str, *,
    numbers: Array | None = None, side: int,
    labels: Sequence[tuple[str, str]] = FINGER_LABELS,
) -> Sheet:  # fmt: skip
    """Draw shapes on a square sheet, with labels at the places of numbers, (k, 3) [m]."""
    places = np.empty((0, 3)) if numbers is None else numbers
    low, high = frame_around(shapes, places, extent, view)
    scale = side / float(high[0] - low[0])
    parts = painted(shapes, view, float(high[0] - low[0]))

    def place(points: Array) -> Array:
        return np.array([0.0, side]) + np.array([scale, -scale]) * (points - low)

    radius = max(NUMBER, NUMBER_SHARE * side)
    marks = [
        mark
        for (text, colour), middle in zip(labels, place(view.seen(places)[0]), strict=False)
        for mark in numbered(middle, radius, text, colour)
    ]
    drawn = _together(_on_sheet(part, place, scale) for part in parts)
    return Sheet(side, side, name, (*drawn, *marks))


def _on_sheet(part: Part, place: Callable[[Array], Array], scale: float) -> Mark:
    match part:
        case Dots():
            return replace(part, points=place(part.points), radius=scale * part.radius)
        case Line():
            width = round(scale * part.width, 3)
            return replace(part, lines=tuple(map(place, part.lines)), width=width)
        case Area():
            loops = tuple(map(place, part.loops))
            if sum(map(len, loops)) > MANY:
                loops = tuple(thinned(closed(loop))[:-1] for loop in loops)
            return replace(part, loops=tuple(loop for loop in loops if len(loop) >= POLYGON))


def _together(marks: Iterable[Mark]) -> Iterable[Mark]:
    """Join lines that follow one another and look alike."""
    for look, alike in groupby(
        marks, key=lambda mark: (mark.colour, mark.width, mark.opacity)
        if isinstance(mark, Line) else None
    ):  # fmt: skip
        if look is None:
            yield from alike
        else:
            lines = tuple(line for mark in alike if isinstance(mark, Line) for line in mark.lines)
            yield Line(lines, *look)


def held_by(hand: Hand | None, reach: HandReach | None, grasp: Grasp) -> PosedHand | None:
    """Take a hand in its pose from what a user gave; None if nothing was given."""
    if hand is None and reach is None:
        return None
    if hand is None or reach is None:
        missing = "hand" if hand is None else "reach"
        raise InputError(
            f"hand and reach must be given together, got no {missing}: "
            "reach = gc.reach_with(hand, body, grasp, friction)"
        )
    return posed_hand(hand, reach, grasp)


def frame_around(
    shapes: Sequence[Shape], numbers: Array, body: Extent, view: View
) -> tuple[Array, Array]:
    """Return two opposite corners of a square around the drawing in a view, (2,) each [m]."""
    points = np.vstack([extent_of(shapes), numbers])
    distances = np.linalg.norm(points - body.center_of_mass, axis=1)
    whole = [np.full(len(shape.vertices()), shape.role in WHOLE) for shape in shapes]
    hand = np.concatenate([*whole, np.full(len(numbers), any(each.any() for each in whole))])
    near = (distances <= FARTHEST * body.radius) | hand
    flat, _ = view.seen(points[near])
    low, high = flat.min(axis=0), flat.max(axis=0)
    half = 0.5 * (1.0 + 2.0 * MARGIN) * float((high - low).max())
    middle = 0.5 * (low + high)
    return middle - half, middle + half


def _entries(shapes: Sequence[Shape]) -> list[Entry]:
    found = {shape.role: shape for shape in reversed(shapes)}
    return [
        Entry(role, LOOKS[role].colour if found[role].finger is None else NEUTRAL, _kind(role))
        for role in EXPLAINED if role in found
    ]  # fmt: skip


def _kind(role: Role) -> Kind:
    """Return how a key shows what shapes of a role look like."""
    look = LOOKS[role]
    if look.dot:
        return "disc"
    if look.fill:
        return "square" if look.solid else "area"
    return "dashes" if look.dashed else "line"
