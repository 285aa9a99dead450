"""Sets how shapes of each role, such as force cones, look."""

from dataclasses import dataclass

from scenes.drawing.colours import FINGERS, FOCUS, GLASS, HAND, INK, SURFACE
from scenes.drawing.shapes import Role, Shape


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


LOOKS: dict[Role, Look] = {
    "object": Look(fill=0.13, shaded=True),
    "edge": Look(line=0.18, opacity=0.75),
    "finger": Look(fill=1.0, shaded=True),
    "friction cone": Look(line=0.16, opacity=0.9),
    "force cone": Look(fill=0.28),
    "region": Look(fill=0.6),
    "line of force": Look(line=0.3, dashed=True),
    "focus": Look(dot=1.9),
    "plane": Look(fill=0.16, line=0.3),
    "ruled surface": Look(fill=0.1, line=0.1, opacity=0.5),
    "contact": Look(dot=1.2),
    "hand": Look(fill=1.0, shaded=True),
    "fingertip": Look(fill=1.0, shaded=True),
}
OF_ROLES: dict[Role, str] = {
    "object": GLASS, "edge": INK, "focus": FOCUS, "plane": SURFACE, "ruled surface": SURFACE,
    "contact": INK, "hand": HAND, "fingertip": HAND,
}  # fmt: skip


def colour_of(shape: Shape) -> str:
    """Return the colour of a shape, written as #rrggbb."""
    return OF_ROLES.get(shape.role, INK) if shape.finger is None else FINGERS[shape.finger]
