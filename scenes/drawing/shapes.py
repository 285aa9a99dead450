"""Describes shapes to draw: polygons, lines and points in space, and the look of each role."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array, frozen
from grasp_core.solvers.ties import SAME_SHARE, first_best
from scenes.drawing.colours import FINGERS, FOCUS, GLASS, HAND, INK, SURFACE

Role: TypeAlias = Literal[
    "object", "edge", "finger", "friction cone", "force cone", "region", "line of force", "focus",
    "plane", "ruled surface", "contact", "hand", "fingertip",
]  # fmt: skip
SIDES = 20
"""Number of corners of the polygons that replace circles."""


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """One thing to draw: polygons, lines and points in the object's frame, with a role."""

    role: Role
    finger: int | None = None
    polygons: tuple[Array, ...] = ()
    """Flat or nearly flat polygons, corners in order, each (k, 3) [m]."""
    lines: tuple[Array, ...] = ()
    points: Array | None = None
    """Single points, (k, 3) [m]; None if the shape has none."""

    def __post_init__(self) -> None:
        for name in ("polygons", "lines"):
            parts = tuple(frozen(part, (None, 3), name) for part in getattr(self, name))
            object.__setattr__(self, name, parts)
        if self.points is not None:
            object.__setattr__(self, "points", frozen(self.points, (None, 3), "points"))

    def vertices(self) -> Array:
        """Return all points of the shape, (n, 3) [m]."""
        alone = [] if self.points is None else [self.points]
        return np.vstack([np.empty((0, 3)), *self.polygons, *self.lines, *alone])


def extent_of(shapes: Iterable[Shape]) -> Array:
    """Return all points of several shapes, (n, 3) [m]."""
    return np.vstack([shape.vertices() for shape in shapes])


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


@dataclass(frozen=True, slots=True)
class Look:
    """How shapes of one role, such as force cones, are drawn."""

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
    colour: str = INK
    """Colour of shapes that are no finger's."""


LOOKS: dict[Role, Look] = {
    "object": Look(fill=0.13, shaded=True, colour=GLASS),
    "edge": Look(line=0.18, opacity=0.75),
    "finger": Look(fill=1.0, shaded=True),
    "friction cone": Look(line=0.16, opacity=0.9),
    "force cone": Look(fill=0.28),
    "region": Look(fill=0.6),
    "line of force": Look(line=0.3, dashed=True),
    "focus": Look(dot=1.9, colour=FOCUS),
    "plane": Look(fill=0.16, line=0.3, colour=SURFACE),
    "ruled surface": Look(fill=0.1, line=0.1, opacity=0.5, colour=SURFACE),
    "contact": Look(dot=1.2),
    "hand": Look(fill=1.0, shaded=True, colour=HAND),
    "fingertip": Look(fill=1.0, shaded=True, colour=HAND),
}


def colour_of(shape: Shape) -> str:
    """Return the colour of a shape, written as #rrggbb."""
    return LOOKS[shape.role].colour if shape.finger is None else FINGERS[shape.finger]
