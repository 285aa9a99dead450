"""Writes the polygons of a picture as SVG text that stands inside a page."""

from collections.abc import Iterable
from itertools import groupby

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.painting import Patch
from scenes.drawing.palette import FINGERS, INK

LETTER = 11
"""Size of a finger's number [pixels]."""
CIRCLE = 8
"""Radius of the circle around a finger's number [pixels]."""


def svg_of(
    patches: Iterable[Patch], corners: tuple[Array, Array], side: int, numbers: Array
) -> str:
    """Write a square picture as an SVG element.

    Args:
        patches: The polygons, the farthest first.
        corners: Two opposite corners of the square, (2,) each [m].
        side: Width and height of the picture [pixels].
        numbers: Where the number of each finger is written, (k, 2) [m].
    """
    low, high = corners
    scale = side / float(high[0] - low[0])

    def place(points: Array) -> list[list[float]]:
        x, y = np.round(scale * (points - low), 1).T
        return np.column_stack([x, side - y]).tolist()  # y points downwards in SVG

    groups = groupby(patches, key=lambda patch: patch.colour)
    shapes = "".join(
        f"<g {_fill(colour)}>{''.join(_path(place(patch.polygon)) for patch in alike)}</g>"
        for colour, alike in groups
    )
    labels = "".join(_label(x, y, finger) for finger, (x, y) in enumerate(place(numbers)))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{side}" height="{side}" '
        f'viewBox="0 0 {side} {side}" style="background:#fff">{shapes}{labels}</svg>'
    )


def _fill(colour: tuple[float, float, float, float]) -> str:
    red, green, blue, opacity = colour
    parts = "".join(f"{round(255.0 * part):02x}" for part in (red, green, blue))
    return f'fill="#{parts}" fill-opacity="{opacity:.2g}"'


def _path(corners: list[list[float]]) -> str:
    return f'<path d="M{"L".join(f"{x:g} {y:g}" for x, y in corners)}z"/>'


def _label(x: float, y: float, finger: int) -> str:
    return (
        f'<circle cx="{x:g}" cy="{y:g}" r="{CIRCLE}" fill="#fff" stroke="{FINGERS[finger]}"/>'
        f'<text x="{x:g}" y="{y:g}" font-size="{LETTER}" font-family="sans-serif" fill="{INK}" '
        f'text-anchor="middle" dominant-baseline="central">{finger}</text>'
    )
