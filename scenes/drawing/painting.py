"""Projects shapes to flat coloured polygons, sorted so that the farthest is drawn first.

Lines and points become polygons too, so that one order by depth holds for everything: a finger in
front of a line of force hides it, and glass in front of the line lets it show through.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.palette import LOOKS, Look, colour_of, rgb
from scenes.drawing.shapes import SIDES, Shape
from scenes.drawing.views import View

LIGHT = np.array([-0.4, 0.7, 0.6]) / np.linalg.norm([-0.4, 0.7, 0.6])
"""Direction towards the light, as (right, up, towards the viewer): from the left, above and in
front."""
DARKEST = 0.55
"""Brightness of a side that faces away from the light, as a share of its colour."""
DASHES = 24
"""Number of parts, every other one drawn, in a dashed line as long as the picture is wide."""
SEAMS = 0.5
"""Opacity up to which polygons are drawn without smoothed borders, which would show as lines."""
PIECES = 12
"""Number of parts in a solid line as long as the picture is wide; each part has its own depth."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """One flat polygon of a picture, with its depth and colour."""

    polygon: Array
    """Corners in the picture, (k, 2) [m]."""
    nearness: float
    """Position along the line of sight [m]; larger values are nearer to the viewer."""
    colour: tuple[float, float, float, float]
    """Red, green, blue and opacity, from 0 to 1."""
    smooth: bool
    """Whether the border of the polygon is smoothed; False where polygons share a border, because
    smoothing would make that border visible."""


def painted(shapes: Iterable[Shape], view: View, width: float) -> tuple[Patch, ...]:
    """Return the polygons of a picture of a given width [m], in the order to draw them."""
    patches = [patch for shape in shapes for patch in _patches(shape, view, width)]
    return tuple(sorted(patches, key=lambda patch: patch.nearness))


def _patches(shape: Shape, view: View, width: float) -> Iterator[Patch]:
    look, colour = LOOKS[shape.role], rgb(colour_of(shape))
    if look.fill:
        for polygon in shape.polygons:
            yield _filled(polygon, look, colour, view)
    solid = (*colour, look.opacity)
    for line in shape.lines if look.line else ():
        yield from _line(line, look, solid, view, width)
    for point in () if shape.points is None else shape.points:
        (place,), (near,) = view.seen(point[None])
        angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
        around = 0.005 * look.dot * width * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        # A dot is drawn in front of what it marks.
        yield Patch(place + around, float(near) + 0.02 * width, solid, smooth=True)


def _filled(polygon: Array, look: Look, colour: tuple[float, float, float], view: View) -> Patch:
    flat, near = view.seen(polygon)
    shade = _brightness(polygon, view) if look.shaded else 1.0
    red, green, blue = (shade * part for part in colour)
    return Patch(flat, float(near.mean()), (red, green, blue, look.fill), smooth=look.fill > SEAMS)


def _brightness(polygon: Array, view: View) -> float:
    """Compute the brightness of a flat side from its angle to the light, `DARKEST` to 1."""
    one, two = (polygon[1] - polygon[0]).tolist(), (polygon[2] - polygon[1]).tolist()
    # written out, because NumPy's function takes twenty times as long for one pair
    normal = view.axes @ np.array([
        one[1] * two[2] - one[2] * two[1],
        one[2] * two[0] - one[0] * two[2],
        one[0] * two[1] - one[1] * two[0],
    ])  # fmt: skip
    length = float(np.linalg.norm(normal))
    if length == 0.0:
        return 1.0
    facing = float(normal @ LIGHT) / length
    facing = facing if normal[2] > 0.0 else -facing
    return DARKEST + (1.0 - DARKEST) * max(facing, 0.0)


def _line(
    line: Array, look: Look, colour: tuple[float, float, float, float], view: View, width: float
) -> Iterator[Patch]:
    flat, near = view.seen(line)
    half = 0.005 * look.line * width
    for start, end, first, last in zip(flat, flat[1:], near, near[1:], strict=False):
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            across = half * np.array([start[1] - end[1], end[0] - start[0]]) / length
            for low, high in _spans(length / width, look):
                a, b = start + low * (end - start), start + high * (end - start)
                depth = float(first + 0.5 * (low + high) * (last - first)) + half
                yield Patch(np.array([a - across, b - across, b + across, a + across]), depth,
                            colour, smooth=True)  # fmt: skip


def _spans(length: float, look: Look) -> Sequence[tuple[float, float]]:
    """Return which parts of a line are drawn, each as two shares of the line's length."""
    if look.dashed:
        count = 2 * max(round(0.5 * DASHES * length), 1) + 1
        return [(part / count, (part + 1) / count) for part in range(0, count, 2)]
    count = max(round(PIECES * length), 1)
    return [(part / count, (part + 1) / count) for part in range(count)]
