"""Draws a hand as its file has it, at an object, with contacts.

Every shape that collides is drawn, meshes as the convex hulls with which MuJoCo collides. Contacts
and their normals are drawn over everything else, because links hide most places where they touch.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from scenes.drawing.hands import (
    WHOLE_BOX,
    HandParts,
    extent_with,
    rounded_box,
    solids_of,
    view_of_parts,
)
from scenes.drawing.painting import Drawable, Role, Window, painted
from scenes.drawing.pictures import finger_size, glass, ring
from scenes.drawing.sheets import BAD_HEX, INK_HEX, PAPER, Dots, Line, Mark, Sheet, moved
from scenes.mujoco.hand_contacts import LinkContact
from scenes.mujoco.placed_shapes import PlacedShape

SIDE, EDGE = 440, 12.0
"""Width of a picture, and height of the empty border above and below [pixels]."""
NORMAL_LENGTH = 0.3
"""Length of a normal, in finger sizes of the object."""
DOT, RIM, NORMAL_WIDTH = 3.6, 1.3, 1.8
"""Radius of a contact's dot, width of the rim around dots and normals, and width of a normal
[pixels]."""
DEEP_M = 1e-3
"""Depth of a contact from which it is marked [m]: that from which DexGraspNet drops grasps."""
LEAST_PIECE = 0.12
"""Least length of a piece of a long part, in object radii."""


def filed_hand_sheet(
    shapes: Sequence[PlacedShape], touching: Sequence[LinkContact], body: Polyhedron, name: str
) -> Sheet:
    """Draw a hand at an object: links that touch in one colour, all others in another.

    Args:
        shapes: Shapes of the hand, in the object's frame.
        touching: Contacts of its links with the object.
        body: The object.
        name: What the picture shows, for readers who do not see it.
    """
    parts = parts_of_shapes(shapes, [each.link for each in touching])
    points = np.array([each.contact.position for each in touching]).reshape(-1, 3)
    inward = np.array([each.contact.normal for each in touching]).reshape(-1, 3)
    ends = points + NORMAL_LENGTH * finger_size(body) * inward
    seen, others = (points, ends) if touching else (body.center_of_mass[None], parts.middles[:1])
    view = view_of_parts(body, parts, seen, others)
    drawn = (*glass(body), *filed_hand_shapes(parts, body))
    window = Window.around(drawn, ends, extent_with(body, parts), view, SIDE)
    deep = np.array([each.distance_m < -DEEP_M for each in touching], dtype=bool)
    marks = [*painted(drawn, window), *_marks(window.seen(points)[0], window.seen(ends)[0], deep)]
    heights = window.seen(np.vstack([ends, *(each.vertices() for each in drawn)]))[0][:, 1]
    top, low = math.floor(heights.min() - EDGE), math.ceil(heights.max() + EDGE)
    return Sheet(SIDE, low - top, name, tuple(moved(mark, np.array([0.0, -top])) for mark in marks))


def filed_hand_shapes(parts: HandParts, body: Polyhedron) -> tuple[Drawable, ...]:
    """Return what is drawn of a hand at an object."""
    shapes = list[Drawable]()
    for contact, polygons in solids_of(parts, LEAST_PIECE * body.radius):
        role: Role = "hand" if contact is None else "link in contact"
        shapes.append(Drawable(role, polygons=polygons))
    return tuple(shapes)


def _marks(points: Array, ends: Array, deep: NDArray[np.bool_]) -> Iterator[Mark]:
    """Yield contacts and normals, each on a light rim, what is deep in its own colour."""
    if not len(points):
        return
    lines = np.stack([points, ends], axis=1)
    yield Line(tuple(lines), PAPER, NORMAL_WIDTH + 2.0 * RIM)
    yield Dots(points, PAPER, DOT + RIM)
    for colour, chosen in ((INK_HEX, ~deep), (BAD_HEX, deep)):
        if chosen.any():
            yield Line(tuple(lines[chosen]), colour, NORMAL_WIDTH)
            yield Dots(points[chosen], colour, DOT)


def parts_of_shapes(shapes: Sequence[PlacedShape], links: Sequence[str]) -> HandParts:
    """Take the shapes of a hand as rounded boxes or blocks, with the first contact of each link."""
    boxes = [_box(each) for each in shapes]
    return HandParts(
        np.array([each.position + each.rotation @ middle
                  for each, (middle, *_) in zip(shapes, boxes, strict=True)]),
        np.array([each.rotation for each in shapes]),
        np.array([half for _, half, _, _ in boxes]),
        np.array([radius for _, _, radius, _ in boxes]),
        tuple(links.index(each.link) if each.link in links else None for each in shapes),
        tuple(
            None if corners is None else each.position + corners @ each.rotation.T
            for each, (*_, corners) in zip(shapes, boxes, strict=True)
        ),
    )  # fmt: skip


def _box(shape: PlacedShape) -> tuple[Array, Array, float, Array | None]:
    """Return the rounded box of a shape in its frame: middle, half sizes and radius.

    Of shapes that are none, the box is the least around them, and their corners follow.
    """
    size, origin = shape.size, np.zeros(3)
    along = np.array([0.0, 0.0, size[1]])
    match shape.kind:
        case "box":
            return origin, size, 0.0, None
        case "sphere" | "capsule":
            half = origin if shape.kind == "sphere" else along
            return origin, half, float(size[0]), None
        case "cylinder":
            axis = np.array([0.0, 0.0, 1.0])
            corners = np.vstack([ring(end, axis, float(size[0])) for end in (-along, along)])
        case "ellipsoid":
            corners = size * np.vstack(rounded_box(origin, origin, 1.0, WHOLE_BOX))
        case _:
            corners = shape.corners
    low, high = corners.min(axis=0), corners.max(axis=0)
    return 0.5 * (low + high), 0.5 * (high - low), 0.0, corners
