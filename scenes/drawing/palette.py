"""Sets the colours of drawings, after Okabe and Ito, which colour-blind people can tell apart.

Source: Okabe & Ito, "Color Universal Design", 2008.
"""

from dataclasses import dataclass

from scenes.drawing.shapes import Role, Shape

FINGERS = ("#E69F00", "#56B4E9", "#009E73", "#CC79A7")
"""Colour of each finger, which its cones, region, line of force and curves share."""
INK, GLASS, FOCUS, SURFACE = "#30363d", "#8296ab", "#D55E00", "#0072B2"
GOOD, BAD, NEUTRAL = "#0072B2", "#D55E00", "#767c85"


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
    "finger": Look(fill=0.95, shaded=True),
    "friction cone": Look(line=0.16, opacity=0.9),
    "force cone": Look(fill=0.28),
    "region": Look(fill=0.6),
    "line of force": Look(line=0.3, dashed=True),
    "focus": Look(dot=1.9),
    "plane": Look(fill=0.16, line=0.3),
    "ruled surface": Look(fill=0.1, line=0.1, opacity=0.5),
    "contact": Look(dot=1.2),
}
OF_ROLES: dict[Role, str] = {
    "object": GLASS, "edge": INK, "focus": FOCUS, "plane": SURFACE, "ruled surface": SURFACE,
    "contact": INK,
}  # fmt: skip


def colour_of(shape: Shape) -> str:
    """Return the colour of a shape, written as #rrggbb."""
    return OF_ROLES.get(shape.role, INK) if shape.finger is None else FINGERS[shape.finger]


def rgb(colour: str) -> tuple[float, float, float]:
    """Convert a colour written as #rrggbb to red, green and blue from 0 to 1."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue
