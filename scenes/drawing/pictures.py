"""Draws a grasp in the style of the paper's figures, or an object alone: shapes, and their picture.

The object is drawn as glass. Outside of it, each finger is a long bar. Inside of it, each contact
has its friction cone and, within that, the force cone that the construction used. Lines of force
run through the focus points. For a pencil the plane of each pair of fingers is shown too, for a
regulus the ruled surface on which the lines lie. Pictures and web pages draw these shapes.

That ruled surface is swept by the transversals of three pairwise skew lines: through each point of
the first, exactly one line meets the other two, the intersection of the planes that the point spans
with them. They sweep a hyperboloid of one sheet. Every line that depends linearly on the three,
such as the fourth line of force, meets all of them, and so lies on it too (Sudsang & Ponce 1995,
section 2.2).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from grasp_core.allowed_values import Friction, instance, path_of, value_of
from grasp_core.arrays import Array, Indices, cross
from grasp_core.cones.spanning import angles_between
from grasp_core.declared import trusted
from grasp_core.geometry.polygons import FEWEST_CORNERS
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.solvers.ties import SAME_SHARE, first_best
from grasp_core.values import Contact, Grasp
from scenes.drawing.hands import (
    WHOLE_BOX,
    PosedHand,
    hand_shapes,
    numbers_behind,
    posed_hand,
    rounded_box,
    view_of_hand,
)
from scenes.drawing.painting import (
    LOOKS,
    Camera,
    Drawable,
    Extent,
    Role,
    Window,
    approaches,
    best_view,
    feature_edges,
    painted,
)
from scenes.drawing.panels import ROW, KeyLine, Kind, keyed
from scenes.drawing.sheets import FINGER_COLOURS, NEUTRAL, Sheet, closed, format_of, numbered

RULINGS = 40
LEAST_CROSS_PRODUCT = 1e-9
"""Least length of the cross product that gives the direction of a transversal, relative to the
squared reach."""
BAR_LENGTH, BAR_RADIUS, BALL_RADIUS = 0.75, 0.04, 0.1
"""Length and radius of a finger's bar, and radius of its fingertip, in finger sizes."""
NUMBER_OFFSET = 0.12
CONE_LENGTH = 0.42
STOUT = 1.3
"""Finger size over the radius of a ball of the object's volume: compact objects have fingers in
proportion to their radius, and long or thin ones fingers in proportion to how thick they are."""
BEYOND = 0.2
"""Length by which a line is drawn past the points it connects, in object radii."""
SURFACE_REACH = 0.95
"""Radius around the object's centre within which the ruled surface of a regulus is drawn, in object
radii."""
FORCE_LINE_END = 4.0
"""Greatest length of a line of force, and greatest distance from the centre at which a focus still
has its plane drawn, in object radii; the foci of built-in objects are within three."""
SLACK_RAD = 1e-6
"""Angle by which rounding may make a force cone exceed its friction cone [rad]."""
MOST_TRIANGLES = 2500
CIRCLE = 20


PIXELS = 500
"""Width of a picture, and its height without the key [pixels]."""
NUMBER, NUMBER_SHARE = 8.0, 0.028
"""Radius of the circle around a finger's number: at least so many pixels, and such a share of the
picture's width."""
FINGER_LABELS = tuple((str(finger), colour) for finger, colour in enumerate(FINGER_COLOURS))
MOST_NUMBERED = 20
AZIMUTH_DEG, OBJECT_ELEVATION_DEG = 35.0, 28.0
"""The view of an object without fingers [deg]."""
KEY_ROLES: tuple[Role, ...] = (
    "finger", "friction cone", "force cone", "region", "line of force", "focus", "plane",
    "ruled surface", "hand",
)  # fmt: skip


def rulings(points: Array, directions: Array, center: Array, reach: float) -> tuple[Array, ...]:
    """Cut the transversals of three lines to segments in a ball, (2, 3) each, in their order."""
    segments = list[Array]()
    for along in np.linspace(-reach, reach, RULINGS):
        start = points[0] + along * directions[0]
        planes = cross(points[1:3] - start, directions[1:3])
        way = cross(planes[0], planes[1])
        length = float(np.linalg.norm(way))
        if length > LEAST_CROSS_PRODUCT * reach**2:
            way = way / length
            middle = float((center - start) @ way)
            room = reach**2 - float(np.linalg.norm(center - start - middle * way)) ** 2
            if room > 0.0:
                ends = middle - math.sqrt(room), middle + math.sqrt(room)
                segments.append(np.array([start + end * way for end in ends]))
    return tuple(segments)


def between(segments: Sequence[Array]) -> tuple[Array, ...]:
    """Make the quadrilaterals between neighbouring segments, each (4, 3)."""
    quads = list[Array]()
    for one, two in pairwise(segments):
        turned = two if (one[1] - one[0]) @ (two[1] - two[0]) > 0.0 else two[::-1]
        quads.append(np.array([one[0], one[1], turned[1], turned[0]]))
    return tuple(quads)


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """A grasp on its object, with straight fingers or in a hand, as shapes that can be drawn."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    """Coulomb coefficient of the friction cones."""
    held: PosedHand | None = None
    """The hand in the place of bars, force cones and lines; friction cones are where it touches."""

    def __post_init__(self) -> None:
        check_on_faces(self.body, self.grasp)
        value_of(Friction, self.friction, "friction")

    def shapes(self) -> tuple[Drawable, ...]:
        """List the shapes of the object and of the grasp."""
        shown = self._straight() if self.held is None else self._by_hand(self.held)
        return (*glass(self.body), *shown)

    def numbers(self) -> Array:
        """Return where the fingers' numbers are written, behind their bars or tips, (k, 3) [m]."""
        if self.held is not None:
            return numbers_behind(self.held)
        beyond = (BAR_LENGTH + NUMBER_OFFSET) * finger_size(self.body)
        return self.grasp.positions - beyond * approaches(self.grasp)

    def view(self) -> Camera:
        """Choose a view in which the grasp is seen well, or the hand in it."""
        if self.held is not None:
            return view_of_hand(self.body, self.held)
        return best_view(self.body, self.grasp)

    def sheet(self, view: Camera | None = None, *, legend: bool = False) -> Sheet:
        """Draw the grasp in the style of the paper, with the hand in it if there is one."""
        if view is not None:
            instance(view, Camera, "view", "Camera.of_angles makes one")
        value_of(bool, legend, "legend")
        name = f"Grasp {self.grasp.id} of {self.body.name}"
        if self.held is not None:
            name += f" with the hand {self.held.hand.name}"
            name += "" if self.held.stands else " where it came nearest"
        shapes, view = self.shapes(), view or self.view()
        sheet = sheet_of(shapes, self.body, view, name, numbers=self.numbers(), side=PIXELS)
        if not legend:
            return sheet
        marks, rows = keyed(_entries(shapes), 20.0, PIXELS, PIXELS - 30.0)
        return Sheet(PIXELS, PIXELS + ROW * (rows + 0.5), sheet.name, (*sheet.marks, *marks))

    def _straight(self) -> Iterator[Drawable]:
        grasp, size = self.grasp, finger_size(self.body)
        half_angle = math.atan(self.friction)
        for finger, (contact, cone, inward) in enumerate(
            zip(grasp.contacts, grasp.force_cones, approaches(grasp), strict=True)
        ):
            yield from pin(finger, contact.position, inward, size)
            yield self._friction_cone(contact, finger)
            lean = float(angles_between(cone.axis, contact.normal))
            if lean + cone.half_angle <= half_angle + SLACK_RAD:
                yield Drawable("force cone", finger, polygons=cone_sides(
                    contact.position, cone.axis, cone.half_angle, CONE_LENGTH * size
                ))  # fmt: skip
            yield from self._region(finger)
        yield from self._regulus() if grasp.family == "regulus" else self._lines_to_foci()
        yield Drawable("contact", points=grasp.positions)

    def _by_hand(self, held: PosedHand) -> Iterator[Drawable]:
        for finger, contact in enumerate(held.contacts):
            yield self._friction_cone(contact, finger)
        for finger in range(len(self.grasp.contacts)):
            yield from self._region(finger)
        yield from hand_shapes(held)
        yield Drawable("contact", points=held.positions)

    def _friction_cone(self, contact: Contact, finger: int) -> Drawable:
        tip, length = contact.position, CONE_LENGTH * finger_size(self.body)
        rim = cone_rim(tip, contact.normal, math.atan(self.friction), length)
        spokes = [np.array([tip, corner]) for corner in rim[::5]]
        return Drawable("friction cone", finger, lines=(closed(rim), *spokes))

    def _region(self, finger: int) -> Iterator[Drawable]:
        region = self.grasp.regions[finger].polygon
        if len(region) >= FEWEST_CORNERS:
            yield Drawable("region", finger, polygons=(region,))

    def _lines_to_foci(self) -> Iterator[Drawable]:
        grasp, radius, middle = self.grasp, self.body.radius, self.body.center_of_mass
        beyond, points = BEYOND * radius, grasp.focus_points
        foci = np.repeat(points, len(grasp.contacts) // len(points), axis=0)
        yield Drawable("focus", points=points)
        for finger, (start, focus) in enumerate(zip(grasp.positions, foci, strict=True)):
            length = min(float(np.linalg.norm(focus - start)) + beyond, FORCE_LINE_END * radius)
            line = np.array([start, start + length * _unit(focus - start)])
            yield Drawable("line of force", finger, lines=(line,))
        away = np.linalg.norm(points - middle, axis=1)
        if grasp.family == "pencil" and away.max() <= FORCE_LINE_END * radius:
            one, two = points
            along, x = beyond * _unit(two - one), grasp.positions
            ends = np.array([one - along, two + along])
            quads = (np.array([x[first], ends[0], x[first + 1], ends[1]]) for first in (0, 2))
            yield Drawable("plane", polygons=tuple(quads), lines=(ends,))

    def _regulus(self) -> Iterator[Drawable]:
        radius, middle = self.body.radius, self.body.center_of_mass
        starts, ways = self.grasp.positions, self.grasp.witness.directions
        ruled = rulings(starts, ways, middle, SURFACE_REACH * radius)
        yield Drawable("ruled surface", polygons=between(ruled), lines=ruled)
        for finger, (start, way) in enumerate(zip(starts, ways, strict=True)):
            ahead = max(float((middle - start) @ way), 0.0)
            line = np.array([start, start + (2.0 * ahead + BEYOND * radius) * way])
            yield Drawable("line of force", finger, lines=(line,))


def finger_size(body: Polyhedron) -> float:
    """Return the length by which bars and cones are measured [m]: at most the object's radius."""
    return float(min(body.radius, STOUT * math.cbrt(0.75 * body.volume / math.pi)))


def glass(body: Polyhedron) -> tuple[Drawable, ...]:
    """Return the shapes of the object: its surface, and the edges at which it is bent."""
    if body.patches is None:
        panes = edged = tuple(piece[::-1] for face in body.faces for piece in face.pieces)
    else:  # a fine surface keeps the edges of its own triangles
        panes = tuple(coarse(body.vertices, body.triangles))
        edged = tuple(body.vertices[body.triangles])
    return Drawable("object", polygons=panes), Drawable("edge", lines=tuple(feature_edges(edged)))


def coarse(vertices: Array, triangles: Indices) -> Array:
    """Return the triangles of a surface, (t, 3, 3) [m], fewer and larger ones if they are many."""
    # vertices are joined on a grid, each to the mean of its cell, which does not tear the surface;
    # triangles that then have no area are dropped
    if len(triangles) <= MOST_TRIANGLES:
        return vertices[triangles]
    cells = math.sqrt(MOST_TRIANGLES) / 2.0
    low = vertices.min(axis=0)
    size = float((vertices.max(axis=0) - low).max()) / cells
    places = np.floor((vertices - low) / size).astype(np.int64)
    _, owners = np.unique(places, axis=0, return_inverse=True)
    owners = owners.reshape(-1)
    counts = np.bincount(owners)
    middles = np.stack([np.bincount(owners, axis) / counts for axis in vertices.T], axis=1)
    joined = owners[triangles]
    a, b, c = joined.T
    joined = joined[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(joined, axis=1), axis=0, return_index=True)
    return middles[joined[np.sort(first)]]


def pin(finger: int, tip: Array, inward: Array, size: float) -> tuple[Drawable, ...]:
    """Return the fingertip and the bar of a finger of a given size that stands on a point."""
    middle, radius = tip - BALL_RADIUS * size * inward, BALL_RADIUS * size
    bar = tube(middle, tip - BAR_LENGTH * size * inward, BAR_RADIUS * size)
    ball = rounded_box(middle, middle, radius, WHOLE_BOX)
    # hundreds of sides, which take longer to check than to make
    return tuple(
        trusted(Drawable, role="finger", finger=finger, polygons=sides, lines=(), points=None)
        for sides in (ball, bar)
    )


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), np.finfo(np.float64).tiny)


def ring(center: Array, axis: Array, radius: float) -> Array:
    """Return points of a circle around a unit axis, (CIRCLE, 3)."""
    # The axis of the frame that is farthest from the circle's axis gives a safe cross product.
    side = cross(axis, np.eye(3)[first_best(-np.abs(axis), SAME_SHARE)])
    side /= np.linalg.norm(side)
    angles = 2.0 * np.pi * np.arange(CIRCLE) / CIRCLE
    around = np.outer(np.cos(angles), side) + np.outer(np.sin(angles), cross(axis, side))
    return center + radius * around


def tube(start: Array, end: Array, radius: float) -> tuple[Array, ...]:
    """Make the sides and the two ends of a round bar between two points."""
    axis = (end - start) / np.linalg.norm(end - start)
    low, high = ring(start, axis, radius), ring(end, axis, radius)
    sides = [np.array([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(CIRCLE)]
    return (*sides, low[::-1], high)


def cone_rim(tip: Array, axis: Array, half_angle: float, length: float) -> Array:
    """Return the circle at the wide end of a cone with sides of a given length, (CIRCLE, 3)."""
    height = length * math.cos(half_angle)
    return ring(tip + height * axis, axis, length * math.sin(half_angle))


def cone_sides(tip: Array, axis: Array, half_angle: float, length: float) -> tuple[Array, ...]:
    """Make the triangles between the tip of a cone and its rim."""
    rim = cone_rim(tip, axis, half_angle, length)
    return tuple(np.array([tip, rim[i - 1], rim[i]]) for i in range(CIRCLE))


def write_picture(
    body: Polyhedron,
    grasp: Grasp,
    path: str | Path,
    friction: float = 0.5,
    *,
    view: Camera | None = None,
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
        reach: The pose in which it stands in the grasp, as `gc.reach_with` finds it, or where it
            came nearest.

    Raises:
        InputError: The ending is unknown, the grasp does not lie on the body, the friction is out
            of range, or `reach` holds no pose of this hand in this grasp.
    """
    format_of(path_of(path, "path"))  # before the work
    return grasp_figure(body, grasp, friction, view=view, hand=hand, reach=reach).write(path)


def write_object_picture(body: Polyhedron, path: Path) -> Path:
    """Draw an object without fingers, and write the picture to a file."""
    format_of(path)
    view = Camera.of_angles(AZIMUTH_DEG, OBJECT_ELEVATION_DEG, body)
    has_numbers = body.patches is None and len(body.faces) <= MOST_NUMBERED
    towards = [
        index
        for index, face in enumerate(body.faces if has_numbers else ())
        if float(face.normal @ (view.camera - face.centroid)) < 0.0
    ]
    places = np.array([_middle(body.faces[face]) for face in towards]).reshape(-1, 3)
    labels = [(str(face), NEUTRAL) for face in towards]
    sheet = sheet_of(
        glass(body), body, view, body.name, numbers=places, side=PIXELS, labels=labels
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
    body: Polyhedron, grasp: Grasp, friction: float, *, view: Camera | None = None,
    legend: bool = True, hand: Hand | None = None, reach: HandReach | None = None,
) -> Sheet:  # fmt: skip
    """Draw a grasp as `write_picture` does, as a sheet that a notebook shows.

    Raises:
        InputError: As for `write_picture`.
    """
    drawing = Drawing(body, grasp, friction, posed_hand(hand, reach, grasp))
    return drawing.sheet(view, legend=legend)


def sheet_of(
    shapes: Sequence[Drawable], extent: Extent, view: Camera, name: str, *, side: int,
    numbers: Array | None = None, labels: Sequence[tuple[str, str]] = FINGER_LABELS,
) -> Sheet:  # fmt: skip
    """Draw shapes on a square sheet, with labels at the places of numbers, (k, 3) [m]."""
    places = np.empty((0, 3)) if numbers is None else numbers
    window = Window.around(shapes, places, extent, view, side)
    radius = max(NUMBER, NUMBER_SHARE * side)
    marks = [
        mark
        for (text, colour), middle in zip(labels, window.seen(places)[0], strict=False)
        for mark in numbered(middle, radius, text, colour)
    ]
    return Sheet(side, side, name, (*painted(shapes, window), *marks))


def _entries(shapes: Sequence[Drawable]) -> list[KeyLine]:
    found = {shape.role: shape for shape in reversed(shapes)}
    return [
        KeyLine(role, LOOKS[role].colour if found[role].finger is None else NEUTRAL, _kind(role))
        for role in KEY_ROLES if role in found
    ]  # fmt: skip


def _kind(role: Role) -> Kind:
    """Return how a key shows what shapes of a role look like."""
    look = LOOKS[role]
    if look.dot:
        return "disc"
    if look.fill:
        return "square" if look.solid else "area"
    return "dashes" if look.dashed else "line"
