"""Describes shapes in space, places the camera, and paints them flat, the farthest first.

Lines are cut into pieces, so that one order by depth holds for everything: a finger in front of a
line of force hides it, and glass in front of the line lets it show through. Solid bodies are
covered by their outline first, so that nothing shines through between their sides.

Edges between parts that are nearly in one plane belong to how a curved surface is cut into parts,
not to its shape, so they are not drawn. Where such an edge lies between a part that faces the
viewer and one that does not, it is the outline of the surface from there, and is drawn.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from typing import Annotated, Literal, Self, TypeAlias

import numpy as np

from grasp_core.allowed_values import Quantity, number
from grasp_core.arrays import Array, Indices, Point, Polygon, cross
from grasp_core.arrays import Shape as ArrayShape
from grasp_core.declared import Declared, declared
from grasp_core.geometry.polygons import FEWEST_CORNERS, convex_hull
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.shells import sampled
from grasp_core.objects.surface import Mesh
from grasp_core.solvers.ties import first_best
from grasp_core.values import Grasp
from scenes.drawing.panels import thinned
from scenes.drawing.sheets import (
    FINGER_COLOURS,
    FOCUS_HEX,
    GLASS,
    HAND,
    INK_HEX,
    SURFACE_HEX,
    TOUCHING,
    Area,
    Dots,
    Line,
    Mark,
    closed,
    hexed,
    rgb,
)

VIEW_RADII = 9.0
"""Distance of the camera, in object radii: perspective is visible, and distortion is small."""
AZIMUTHS, VIEW_ELEVATIONS = range(5, 360, 10), (18, 28, 40)
EDGE_ON_COSINE = 0.12
"""Cosine of the angle between a face's normal and the line of sight below which the face is seen
nearly as a line."""
SAME_VIEW_MERIT = 1e-6
"""Largest difference of merit at which two views count as equally good; the first one is then
taken."""
FORESHORTENED = 0.8
"""Cosine of the angle to the line of sight above which a finger points at the viewer."""


@dataclass(frozen=True, slots=True, eq=False)
class Alone:
    """The extent of what is drawn beside an object, as a ball around it."""

    center_of_mass: Array
    radius: float


Extent: TypeAlias = Polyhedron | Alone
"""The place and size of what is drawn: of an object, or of a grasp or hand beside it."""


@declared
class Camera(Declared):
    """A camera that looks at a point, with z of the object's frame upwards."""

    axes: Annotated[Array, ArrayShape(3, 3)]
    """Unit vectors to the right, up and towards the viewer, (3, 3), rows."""
    center: Point
    distance: Quantity

    @classmethod
    def of_angles(cls, azimuth_deg: float, elevation_deg: float, body: Extent) -> Self:
        """Place a camera by its azimuth and elevation [deg] as seen from the object."""
        number(azimuth_deg, "azimuth_deg")
        number(elevation_deg, "elevation_deg")
        axes = _axes(math.radians(azimuth_deg), math.radians(elevation_deg))
        return cls(axes, body.center_of_mass, VIEW_RADII * body.radius)

    @property
    def camera(self) -> Array:
        """The place of the camera, (3,) [m]."""
        return self.center + self.distance * self.axes[2]

    def seen(self, points: Array) -> tuple[Array, Array]:
        """Project points (n, 3) to the picture, (n, 2) [m], with their nearness, (n,) [m]."""
        turned = (points - self.center) @ self.axes.T
        nearness = turned[:, 2]
        return turned[:, :2] * _enlarged(nearness, self.distance)[:, None], nearness


def _axes(azimuth: float, elevation: float) -> Array:
    flat = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    towards = math.cos(elevation) * flat + math.sin(elevation) * up
    right = cross(up, flat)
    return np.array([right, cross(towards, right), towards])


def approaches(grasp: Grasp) -> Array:
    """Return the directions in which the fingers of a grasp come in, (4, 3)."""
    return grasp.normals if grasp.approach_directions is None else grasp.approach_directions


def best_view(body: Polyhedron, grasp: Grasp) -> Camera:
    """Choose a view that keeps contacts and fingers apart and shows few faces edge-on."""
    outward = -approaches(grasp)
    ends = grasp.positions + body.radius * outward
    angles, axes = views_at(VIEW_ELEVATIONS)
    fingers = axes[:, 2] @ outward.T
    apart = least_gaps(axes, np.vstack([grasp.positions, ends]), body) / body.radius
    pointing = np.maximum(np.abs(fingers) - FORESHORTENED, 0.0).sum(axis=1)
    in_front = (fingers > SAME_VIEW_MERIT).mean(axis=1)
    merits = apart + 0.1 * in_front - 2.0 * pointing - 0.5 * edge_on(body, axes)
    return Camera.of_angles(*angles[first_best(merits, SAME_VIEW_MERIT)], body)


def edge_on(body: Polyhedron, axes: Array) -> Array:
    """Return the share of an object's surface that is seen nearly as lines in each view, (n,)."""
    _, normals, areas = panes_of(body)
    return (np.abs(axes[:, 2] @ normals.T) < EDGE_ON_COSINE) @ areas / areas.sum()


def panes_of(body: Polyhedron) -> tuple[Array, Array, Array]:
    """Return middles [m] and inward normals, (n, 3) each, and areas, (n,) [m^2], of faces.

    Triangles that stand for equal shares of the surface take their place where there are none.
    """
    if body.faces:
        middles, areas = zip(*((face.centroid, face.area) for face in body.faces), strict=True)
        return np.array(middles), body.normals, np.array(areas)
    surface = Mesh(body.vertices, body.triangles)
    some = sampled(surface.areas)
    return surface.corners[some].mean(axis=1), -surface.normals[some], np.ones(len(some))


@cache
def views_at(elevations: tuple[int, ...]) -> tuple[list[tuple[int, int]], Array]:
    """Return the angles of views from all around at elevations [deg], and their axes, (n, 3, 3)."""
    angles = [(azimuth, elevation) for elevation in elevations for azimuth in AZIMUTHS]
    axes = [_axes(math.radians(azimuth), math.radians(elevation)) for azimuth, elevation in angles]
    return angles, np.array(axes)


def least_gaps(axes: Array, points: Array, body: Extent) -> Array:
    """Return the smallest distance between any two points (p, 3) in each picture, (n,) [m]."""
    turned = (points - body.center_of_mass) @ axes.transpose(0, 2, 1)
    flat = turned[..., :2] * _enlarged(turned[..., 2], VIEW_RADII * body.radius)[..., None]
    first, second = np.triu_indices(len(points), 1)
    return np.linalg.norm(flat[:, first] - flat[:, second], axis=2).min(axis=1)


def _enlarged(nearness: Array, distance: float) -> Array:
    """Return by which factor perspective enlarges what is at some nearness [m], of any shape."""
    return distance / np.maximum(distance - nearness, 0.1 * distance)


Role: TypeAlias = Literal[
    "object", "edge", "finger", "friction cone", "force cone", "region", "line of force", "focus",
    "plane", "ruled surface", "contact", "hand", "fingertip", "link in contact",
]  # fmt: skip
Near: TypeAlias = tuple[float, Mark]
SMOOTH_DEG = 20.0
"""Angle between the normals of two parts up to which their common edge is not drawn [deg]."""
MOST_DRAWN_EDGES = 1500
MERGED_CORNERS = 1e-6
LIGHT_DIRECTION = np.array([-0.4, 0.7, 0.6]) / np.linalg.norm([-0.4, 0.7, 0.6])
"""Direction towards the light, as (right, up, towards the viewer): from the left, above and in
front."""
DARKEST = 0.55
DASHES_PER_WIDTH = 24
"""Number of parts, every other one drawn, in a dashed line as long as the picture is wide."""
PIECES = 8
"""Number of parts in a solid line as long as the picture is wide; each part has its own depth."""
FEW_POLYGONS = 100
"""Number of polygons of a surface up to which each has its own depth; of more, those that are
equally bright and on the same side are joined."""
SHADES = 7
"""Number of shades of joined surfaces and of round bars: hardly fewer than eight bits tell apart in
clear glass."""
SHORT_LINED: tuple[Role, ...] = ("friction cone",)
EMPTY_MARGIN = 0.04
CUT_RADII = 2.0
NEVER_CUT: tuple[Role, ...] = ("hand", "fingertip", "link in contact")
MANY_CORNERS = 60


@declared
class Drawable(Declared):
    """One thing to draw: polygons, lines and points in the object's frame, with a role."""

    role: Role
    finger: int | None = None
    polygons: tuple[Polygon, ...] = ()
    """Flat or nearly flat polygons, corners in order, each (k, 3) [m]."""
    lines: tuple[Polygon, ...] = ()
    points: Polygon | None = None
    """Single points, (k, 3) [m]; None if the shape has none."""

    def vertices(self) -> Array:
        """Return all points of the shape, (n, 3) [m]."""
        alone = [] if self.points is None else [self.points]
        return np.vstack([np.empty((0, 3)), *self.polygons, *self.lines, *alone])


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """The square of what a view shows that is drawn on a sheet."""

    view: Camera
    low: Array
    """Lower left corner of the square in the view, (2,) [m]."""
    width: float
    """Width of the square in the view [m]."""
    side: float
    """Width of the square on the sheet [pixels]."""

    @classmethod
    def around(
        cls, shapes: Sequence[Drawable], numbers: Array, body: Extent, view: Camera, side: float
    ) -> Self:
        """Choose the square around shapes, and around the places of numbers, (k, 3) [m]."""
        every = [shape.vertices() for shape in shapes]
        points = np.vstack([*every, numbers])
        distances = np.linalg.norm(points - body.center_of_mass, axis=1)
        kept = [shape.role in NEVER_CUT for shape in shapes]
        hand = np.repeat([*kept, any(kept)], [*map(len, every), len(numbers)])
        flat, _ = view.seen(points[(distances <= CUT_RADII * body.radius) | hand])
        low, high = flat.min(axis=0), flat.max(axis=0)
        half = 0.5 * (1.0 + 2.0 * EMPTY_MARGIN) * float((high - low).max())
        middle = 0.5 * (low + high)
        low, high = middle - half, middle + half
        return cls(view, low, float(high[0] - low[0]), side)

    def place(self, flat: Array) -> Array:
        """Find where places in the view [m] are on the sheet, (.., 2) [pixels]."""
        scale = self.side / self.width
        return np.array([0.0, self.side]) + np.array([scale, -scale]) * (flat - self.low)

    def seen(self, points: Array) -> tuple[Array, Array]:
        """Project points (n, 3) to the sheet, (n, 2) [pixels], with their nearness, (n,) [m]."""
        flat, near = self.view.seen(points)
        return self.place(flat), near


@dataclass(frozen=True, slots=True)
class RoleLook:
    """How shapes of one role, such as force cones, are drawn."""

    colour: str = INK_HEX
    """Colour of shapes that are no finger's."""
    fill: float = 0.0
    """Opacity of polygons, from 0 to 1."""
    line: float = 0.0
    """Width of lines, in hundredths of the picture's width."""
    dot: float = 0.0
    """Diameter of points, in hundredths of the picture's width."""
    opacity: float = 1.0
    """Opacity of lines and points."""
    shaded: bool = False
    """Whether polygons are darker where they face away from the light."""
    dashed: bool = False
    solid: bool = False
    """Whether shapes are convex bodies that nothing shines through."""


LOOKS: dict[Role, RoleLook] = {
    "object": RoleLook(GLASS, fill=0.13, shaded=True),
    "edge": RoleLook(line=0.18, opacity=0.75),
    "finger": RoleLook(fill=1.0, shaded=True, solid=True),
    "friction cone": RoleLook(line=0.16, opacity=0.9),
    "force cone": RoleLook(fill=0.28),
    "region": RoleLook(fill=0.6),
    "line of force": RoleLook(line=0.3, dashed=True),
    "focus": RoleLook(FOCUS_HEX, dot=1.9),
    "plane": RoleLook(SURFACE_HEX, fill=0.16, line=0.3),
    "ruled surface": RoleLook(SURFACE_HEX, fill=0.1, line=0.1, opacity=0.5),
    "contact": RoleLook(dot=1.2),
    "hand": RoleLook(HAND, fill=1.0, shaded=True, solid=True),
    "fingertip": RoleLook(HAND, fill=1.0, shaded=True, solid=True),
    "link in contact": RoleLook(TOUCHING, fill=1.0, shaded=True, solid=True),
}


def look_of(shape: Drawable) -> RoleLook:
    """Return how a shape is drawn: as others of its role, in the colour of its finger."""
    look = LOOKS[shape.role]
    return look if shape.finger is None else replace(look, colour=FINGER_COLOURS[shape.finger])


@dataclass(frozen=True, slots=True, eq=False)
class DrawnSurface:
    """Polygons of a closed surface, corners counter-clockwise as seen from outside."""

    corners: Array
    """Corners of all polygons, one polygon after the other, (n, 3) [m]."""
    names: Indices
    """Number of the point at each corner, (n,); polygons that meet share numbers."""
    owners: Indices
    """Polygon of each corner, (n,)."""
    following: Indices
    """Place of the next corner of the same polygon for each corner, (n,)."""
    normals: Array
    """Unit normals, outwards, (polygons, 3); zero for polygons without area."""

    @classmethod
    def of(cls, polygons: Sequence[Array]) -> "DrawnSurface":
        """Number the corners of polygons, and measure their normals."""
        corners = np.vstack(polygons)
        counts = np.array([len(polygon) for polygon in polygons])
        size = float(np.ptp(corners, axis=0).max())
        places = np.rint(corners / (MERGED_CORNERS * size)).astype(np.int64)
        names = np.unique(places, axis=0, return_inverse=True)[1].reshape(-1)
        ends, following = np.cumsum(counts), np.arange(1, len(corners) + 1)
        following[ends - 1] = ends - counts
        normals = np.add.reduceat(cross(corners, corners[following]), ends - counts)
        lengths = np.linalg.norm(normals, axis=1)
        normals = normals / np.where(lengths > 0.0, lengths, np.inf)[:, None]
        return cls(corners, names, np.repeat(np.arange(len(polygons)), counts), following, normals)

    def edges(self) -> tuple[Indices, Indices, Array]:
        """Pair the edges of polygons that meet: first corners in one and, reversed, in another.

        Gives also the angles between the normals on both sides, (k,) [rad].
        """
        first, second = self.names, self.names[self.following]
        count = int(self.names.max()) + 1
        ahead, back = first * count + second, second * count + first
        order = np.argsort(ahead)
        other = order[np.minimum(np.searchsorted(ahead, back, sorter=order), len(ahead) - 1)]
        one = np.flatnonzero((ahead[other] == back) & (first < second))
        sides = self.normals[self.owners[one]], self.normals[self.owners[other[one]]]
        return one, other[one], np.arccos(np.clip(np.einsum("ij,ij->i", *sides), -1.0, 1.0))

    def facing(self, camera: Array) -> Array:
        """Tell which polygons face a point, (polygons,)."""
        firsts = np.flatnonzero(np.diff(self.owners, prepend=-1))
        return np.einsum("ij,ij->i", self.normals, camera - self.corners[firsts]) > 0.0

    def segments(self, places: Indices) -> Array:
        """Return the edges that begin at corners, (k, 2, 3) [m]."""
        return np.stack([self.corners[places], self.corners[self.following[places]]], axis=1)


def feature_edges(polygons: Sequence[Array]) -> Array:
    """Find the edges at which a surface is bent, the sharpest first, (k, 2, 3) [m]."""
    surface = DrawnSurface.of(polygons)
    places, _, angles = surface.edges()
    order = np.argsort(-angles, kind="stable")[:MOST_DRAWN_EDGES]
    return surface.segments(places[order[angles[order] > math.radians(SMOOTH_DEG)]])


def outline(surface: DrawnSurface, camera: Array) -> Array:
    """Find the smooth edges between polygons that face the camera and others, (k, 2, 3) [m]."""
    one, two, angles = surface.edges()
    front = surface.facing(camera)
    between = front[surface.owners[one]] != front[surface.owners[two]]
    return surface.segments(one[between & (angles <= math.radians(SMOOTH_DEG))])


def joined(surface: DrawnSurface, chosen: Array) -> tuple[Array, ...]:
    """Join polygons of a surface that meet, and return the loops around them, each (k, 3) [m]."""
    places = np.flatnonzero(chosen[surface.owners])
    first, second = surface.names[places], surface.names[surface.following[places]]
    count = int(surface.names.max()) + 1
    alone = ~np.isin(second * count + first, first * count + second)
    ways = defaultdict[int, list[tuple[int, int]]](list)
    for start, end, place in zip(
        first[alone].tolist(), second[alone].tolist(), places[alone].tolist(), strict=True
    ):
        ways[start].append((end, place))
    loops = list[Array]()
    for start in list(ways):
        while ways[start]:
            at, loop = start, list[int]()
            while ways.get(at):
                at, place = ways[at].pop()
                loop.append(place)
            loops.append(surface.corners[loop])
    return tuple(loops)


def painted(shapes: Iterable[Drawable], window: Window) -> Iterator[Mark]:
    """Yield the marks of a picture, in the order to draw them; lines that look alike are joined."""
    parts = [part for shape in shapes for part in _parts(shape, window)]
    marks = [mark for _, mark in sorted(parts, key=lambda each: each[0])]
    for look, alike in groupby(
        marks, key=lambda mark: (mark.colour, mark.width, mark.opacity)
        if isinstance(mark, Line) else None
    ):  # fmt: skip
        if look is None:
            yield from alike
        else:
            lines = tuple(line for mark in alike if isinstance(mark, Line) for line in mark.lines)
            yield Line(lines, *look)


def _parts(shape: Drawable, window: Window) -> Iterator[Near]:
    look = look_of(shape)
    if look.fill and shape.polygons:
        paint = _solid if look.solid else FILLED.get(shape.role, _each)
        yield from paint(shape, look, window)
    if shape.role == "object" and shape.polygons:
        for line in outline(DrawnSurface.of(shape.polygons), window.view.camera):
            yield from _line(line, LOOKS["edge"], window)
    for line in shape.lines if look.line else ():
        if shape.role in SHORT_LINED:
            flat, near = window.seen(line)
            yield float(near.mean()), Line((flat,), look.colour, _thick(look, window), look.opacity)
        else:
            yield from _line(line, look, window)
    for point in () if shape.points is None else shape.points:
        place, (near,) = window.seen(point[None])
        # A dot is drawn in front of what it marks.
        dot = Dots(place, look.colour, 0.005 * look.dot * window.side, look.opacity)
        yield float(near) + 0.02 * window.width, dot


def _thick(look: RoleLook, window: Window) -> float:
    return round(0.01 * look.line * window.side, 3)


def _area(loops: Sequence[Array], colour: str, opacity: float) -> Area:
    """Fill loops on the sheet, without corners that would not be seen."""
    if sum(map(len, loops)) > MANY_CORNERS:
        loops = [thinned(closed(loop))[:-1] for loop in loops]
    return Area(tuple(loop for loop in loops if len(loop) >= FEWEST_CORNERS), colour, opacity)


def _each(shape: Drawable, look: RoleLook, window: Window) -> Iterator[Near]:
    bright = _brightness(_normals(shape.polygons), window.view).tolist()
    for polygon, shade in zip(shape.polygons, bright, strict=True):
        flat, near = window.seen(polygon)
        colour = _shaded(look.colour, shade) if look.shaded else look.colour
        yield float(near.mean()), _area([flat], colour, look.fill)


def _glass(shape: Drawable, look: RoleLook, window: Window) -> Iterator[Near]:
    """Draw a clear surface; of many polygons, those that look alike are joined."""
    if len(shape.polygons) <= FEW_POLYGONS:
        yield from _each(shape, look, window)
        return
    surface, view = DrawnSurface.of(shape.polygons), window.view
    front = surface.facing(view.camera)
    levels = _levels(_brightness(surface.normals, view))
    nearness = view.seen(surface.corners)[1]
    for side in (False, True):
        near = nearness[(front == side)[surface.owners]]
        depth = float(near.mean()) if len(near) else 0.0
        for level in np.unique(levels[front == side]).tolist():
            loops = joined(surface, (front == side) & (levels == level))
            flats = [window.seen(loop)[0] for loop in loops]
            yield depth, _area(flats, _shaded(look.colour, _shade(level)), look.fill)


def _solid(shape: Drawable, look: RoleLook, window: Window) -> Iterator[Near]:
    """Draw a convex body: its outline, and on it the sides that face the viewer."""
    corners, view = shape.vertices(), window.view
    flat, near = view.seen(corners)
    depth, placed = float(near.mean()), window.place(flat)
    counts = np.array([len(polygon) for polygon in shape.polygons])
    ends = counts.cumsum()
    middles = np.add.reduceat(corners, ends - counts) / counts[:, None]
    normals = _normals(shape.polygons)
    inward = np.einsum("ij,ij->i", normals, middles - corners.mean(axis=0)) <= 0.0
    normals[inward] *= -1.0
    sights = view.camera - corners[ends - counts]
    facing = np.flatnonzero(np.einsum("ij,ij->i", normals, sights) > 0.0)
    levels = _levels(_brightness(normals[facing], view))
    mean = round(float(levels.mean())) if len(levels) else SHADES - 1
    hull = window.place(convex_hull(flat))
    yield depth, _area([hull], _shaded(look.colour, _shade(mean)), look.fill)
    for level in sorted({*levels.tolist()} - {mean}):
        alike: list[int] = facing[levels == level].tolist()
        loops = [placed[ends[side] - counts[side] : ends[side]] for side in alike]
        yield depth, _area(loops, _shaded(look.colour, _shade(level)), look.fill)


def _cone(shape: Drawable, look: RoleLook, window: Window) -> Iterator[Near]:
    rim = np.array([polygon[1] for polygon in shape.polygons])
    flat, near = window.view.seen(shape.vertices())
    for part in (convex_hull(flat), window.view.seen(rim)[0]):
        yield float(near.mean()), _area([window.place(part)], look.colour, look.fill)


FILLED: dict[Role, Callable[[Drawable, RoleLook, Window], Iterator[Near]]] = {
    "object": _glass, "force cone": _cone,
}  # fmt: skip


def _normals(polygons: Sequence[Array]) -> Array:
    """Return unit normals of flat polygons, (k, 3); zero where first corners are in line."""
    corners = np.array([polygon[:3] for polygon in polygons])
    normals = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.maximum(lengths, np.finfo(np.float64).tiny)


def _brightness(normals: Array, view: Camera) -> Array:
    """Compute the brightness of flat sides from their angle to the light, `DARKEST` to 1, (k,)."""
    seen = normals @ view.axes.T
    facing = np.where(seen[:, 2] > 0.0, 1.0, -1.0) * (seen @ LIGHT_DIRECTION)
    bright = DARKEST + (1.0 - DARKEST) * np.maximum(facing, 0.0)
    return np.where(seen.any(axis=1), bright, 1.0)


def _levels(bright: Array) -> Indices:
    """Round brightnesses to shades, from 0 to SHADES - 1, of any shape."""
    return np.rint((bright - DARKEST) / (1.0 - DARKEST) * (SHADES - 1)).astype(np.int64)


def _shade(level: int) -> float:
    return DARKEST + (1.0 - DARKEST) * level / (SHADES - 1)


def _shaded(colour: str, shade: float) -> str:
    return colour if shade >= 1.0 else hexed(tuple(shade * part for part in rgb(colour)))


def _line(line: Array, look: RoleLook, window: Window) -> Iterator[Near]:
    flat, near = window.view.seen(line)
    nearer, thick = 0.005 * look.line * window.width, _thick(look, window)
    for start, end, first, last in zip(flat, flat[1:], near, near[1:], strict=False):
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            spans = np.array(_spans(length / window.width, look))
            places = window.place(start + spans[..., None] * (end - start))
            depths = first + spans.mean(axis=1) * (last - first) + nearer
            for depth, ends in zip(depths.tolist(), places, strict=True):
                yield depth, Line((ends,), look.colour, thick, look.opacity)


def _spans(length: float, look: RoleLook) -> Sequence[tuple[float, float]]:
    """Return which parts of a line are drawn, each as two shares of the line's length."""
    if look.dashed:
        count = 2 * max(round(0.5 * DASHES_PER_WIDTH * length), 1) + 1
        return [(part / count, (part + 1) / count) for part in range(0, count, 2)]
    count = max(round(PIECES * length), 1)
    return [(part / count, (part + 1) / count) for part in range(count)]
