"""Makes the shapes that show an object and a grasp, in the style of the paper's figures.

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
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.cones.spanning import angles_between
from grasp_core.kinds import Friction, instance, value_of
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import SAME_SHARE, first_best
from grasp_core.values import Contact, Grasp
from scenes.drawing.hands import PosedHand, hand_shapes, numbers_behind, view_of_hand
from scenes.drawing.painting import Shape, feature_edges
from scenes.drawing.sheets import closed
from scenes.drawing.views import Extent, View, approaches, best_view

RULINGS = 40
PARALLEL = 1e-9
"""Least length of the cross product that gives the direction of a transversal, relative to the
squared reach."""
BAR_LENGTH, BAR_RADIUS = 0.75, 0.05
"""Length and radius of a finger's bar, in finger sizes."""
NUMBER_BEYOND = 0.12
"""Distance of a finger's number from the end of its bar, in finger sizes."""
CONE_LENGTH = 0.42
"""Length of a cone's sides, in finger sizes."""
STOUT = 1.3
"""Finger size over the radius of a ball of the object's volume: compact objects have fingers in
proportion to their radius, and long or thin ones fingers in proportion to how thick they are."""
BEYOND = 0.2
"""Length by which a line is drawn past the points it connects, in object radii."""
REACH = 0.95
"""Radius around the object's centre within which the ruled surface of a regulus is drawn, in object
radii."""
FARTHEST = 4.0
"""Greatest length of a line of force, and greatest distance from the centre at which a focus still
has its plane drawn, in object radii; the foci of built-in objects are within three."""
SLACK_RAD = 1e-6
"""Angle by which rounding may make a force cone exceed its friction cone [rad]."""
POLYGON = 3
MOST_TRIANGLES = 2500
"""Largest number of triangles drawn for the object; finer surfaces are simplified first."""
SIDES = 20
"""Number of corners of the polygons that replace circles."""


def rulings(points: Array, directions: Array, center: Array, reach: float) -> tuple[Array, ...]:
    """Cut the transversals of three lines to segments in a ball, (2, 3) each, in their order."""
    segments = list[Array]()
    for along in np.linspace(-reach, reach, RULINGS):
        start = points[0] + along * directions[0]
        planes = np.cross(points[1:3] - start, directions[1:3])
        way = np.cross(planes[0], planes[1])
        length = float(np.linalg.norm(way))
        if length > PARALLEL * reach**2:
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


def check_drawn(body: Polyhedron, grasp: Grasp, friction: float, view: View | None = None) -> None:
    """Refuse an object, grasp, friction or view that cannot be drawn."""
    check_on_faces(body, grasp)
    value_of(Friction, friction, "friction")
    if view is not None:
        instance(view, View, "view", "View.of_angles makes one")


def drawing_of(
    body: Polyhedron, grasp: Grasp, friction: float, held: PosedHand | None = None
) -> tuple[Shape, ...]:
    """List the shapes that show an object with a grasp.

    A hand takes the place of bars, force cones and lines; friction cones are where it touches.
    """
    check_drawn(body, grasp, friction)
    half_angle, fingers = math.atan(friction), range(len(grasp.contacts))
    shapes = [*glass(body)]
    if held is None:
        for finger in fingers:
            shapes += _finger(body, grasp, finger, half_angle)
        return (*shapes, *_family(body, grasp), Shape("contact", points=grasp.positions))
    for finger, contact in enumerate(held.contacts):
        shapes.append(_friction_cone(body, contact, finger, half_angle))
    for finger in fingers:
        shapes += _region(grasp, finger)
    return (*shapes, *hand_shapes(held), Shape("contact", points=held.positions))


def numbers_of(body: Extent, grasp: Grasp, held: PosedHand | None = None) -> Array:
    """Return where the fingers' numbers are written, behind their bars or tips, (k, 3) [m]."""
    if held is not None:
        return numbers_behind(held)
    beyond = (BAR_LENGTH + NUMBER_BEYOND) * finger_size(body)
    return grasp.positions - beyond * approaches(grasp)


def view_of(body: Polyhedron, grasp: Grasp, held: PosedHand | None = None) -> View:
    """Choose a view in which a grasp is seen well, or the hand in it."""
    return best_view(body, grasp) if held is None else view_of_hand(body, held)


def finger_size(body: Extent) -> float:
    """Return the length by which bars and cones are measured [m]: at most the object's radius."""
    volume = body.volume if isinstance(body, Polyhedron) else math.inf
    return float(min(body.radius, STOUT * math.cbrt(0.75 * volume / math.pi)))


def glass(body: Polyhedron) -> tuple[Shape, ...]:
    """Return the shapes of the object: its surface, and the edges at which it is bent."""
    if body.patches is None:
        panes = edged = tuple(piece[::-1] for face in body.faces for piece in face.pieces)
    else:  # a fine surface keeps the edges of its own triangles
        panes = tuple(coarse(body.vertices, body.triangles))
        edged = tuple(body.vertices[body.triangles])
    return Shape("object", polygons=panes), Shape("edge", lines=tuple(feature_edges(edged)))


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


def _finger(body: Extent, grasp: Grasp, finger: int, half_angle: float) -> list[Shape]:
    contact, cone = grasp.contacts[finger], grasp.force_cones[finger]
    tip, inward, size = contact.position, approaches(grasp)[finger], finger_size(body)
    shapes = [
        Shape("finger", finger, polygons=bar(tip, inward, size)),
        _friction_cone(body, contact, finger, half_angle),
    ]
    lean = float(angles_between(cone.axis, contact.normal))
    if lean + cone.half_angle <= half_angle + SLACK_RAD:
        sides = cone_sides(tip, cone.axis, cone.half_angle, CONE_LENGTH * size)
        shapes.append(Shape("force cone", finger, polygons=sides))
    return [*shapes, *_region(grasp, finger)]


def _friction_cone(body: Extent, contact: Contact, finger: int, half_angle: float) -> Shape:
    tip = contact.position
    rim = cone_rim(tip, contact.normal, half_angle, CONE_LENGTH * finger_size(body))
    spokes = [np.array([tip, corner]) for corner in rim[::5]]
    return Shape("friction cone", finger, lines=(closed(rim), *spokes))


def _region(grasp: Grasp, finger: int) -> list[Shape]:
    region = grasp.regions[finger].polygon
    return [Shape("region", finger, polygons=(region,))] if len(region) >= POLYGON else []


def bar(tip: Array, inward: Array, size: float) -> tuple[Array, ...]:
    """Return the polygons of a finger of a given size that stands on a point."""
    return tube(tip, tip - BAR_LENGTH * size * inward, BAR_RADIUS * size)


def _family(body: Extent, grasp: Grasp) -> list[Shape]:
    if grasp.family == "regulus":
        return _regulus(body, grasp)
    beyond = BEYOND * body.radius
    foci = np.repeat(grasp.focus_points, len(grasp.contacts) // len(grasp.focus_points), axis=0)
    shapes = [Shape("focus", points=grasp.focus_points)]
    for finger, (start, focus) in enumerate(zip(grasp.positions, foci, strict=True)):
        length = min(float(np.linalg.norm(focus - start)) + beyond, FARTHEST * body.radius)
        line = np.array([start, start + length * _unit(focus - start)])
        shapes.append(Shape("line of force", finger, lines=(line,)))
    away = np.linalg.norm(grasp.focus_points - body.center_of_mass, axis=1)
    if grasp.family == "pencil" and away.max() <= FARTHEST * body.radius:
        one, two = grasp.focus_points
        along, x = beyond * _unit(two - one), grasp.positions
        ends = np.array([one - along, two + along])
        quads = (np.array([x[first], ends[0], x[first + 1], ends[1]]) for first in (0, 2))
        shapes.append(Shape("plane", polygons=tuple(quads), lines=(ends,)))
    return shapes


def _regulus(body: Extent, grasp: Grasp) -> list[Shape]:
    reach, beyond = REACH * body.radius, BEYOND * body.radius
    ways = grasp.witness.directions
    ruled = rulings(grasp.positions, ways, body.center_of_mass, reach)
    shapes = [Shape("ruled surface", polygons=between(ruled), lines=ruled)]
    for finger, (start, way) in enumerate(zip(grasp.positions, ways, strict=True)):
        ahead = max(float((body.center_of_mass - start) @ way), 0.0)
        line = np.array([start, start + (2.0 * ahead + beyond) * way])
        shapes.append(Shape("line of force", finger, lines=(line,)))
    return shapes


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), np.finfo(np.float64).tiny)


def ring(center: Array, axis: Array, radius: float) -> Array:
    """Return points of a circle around a unit axis, (SIDES, 3)."""
    # The axis of the frame that is farthest from the circle's axis gives a safe cross product.
    side = np.cross(axis, np.eye(3)[first_best(-np.abs(axis), SAME_SHARE)])
    side /= np.linalg.norm(side)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = np.outer(np.cos(angles), side) + np.outer(np.sin(angles), np.cross(axis, side))
    return center + radius * around


def tube(start: Array, end: Array, radius: float) -> tuple[Array, ...]:
    """Make the sides and the two ends of a round bar between two points."""
    axis = (end - start) / np.linalg.norm(end - start)
    low, high = ring(start, axis, radius), ring(end, axis, radius)
    sides = [np.array([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(SIDES)]
    return (*sides, low[::-1], high)


def cone_rim(tip: Array, axis: Array, half_angle: float, length: float) -> Array:
    """Return the circle at the wide end of a cone with sides of a given length, (SIDES, 3)."""
    height = length * math.cos(half_angle)
    return ring(tip + height * axis, axis, length * math.sin(half_angle))


def cone_sides(tip: Array, axis: Array, half_angle: float, length: float) -> tuple[Array, ...]:
    """Make the triangles between the tip of a cone and its rim."""
    rim = cone_rim(tip, axis, half_angle, length)
    return tuple(np.array([tip, rim[i - 1], rim[i]]) for i in range(SIDES))
