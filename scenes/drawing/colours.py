"""Sets the colours of drawings by day and by night.

Those of the fingers are by Okabe and Ito; colour-blind people can tell them apart. The ramp from
small to large values is cividis, whose colours differ in brightness, too.

Sources:
    Okabe & Ito, "Color Universal Design", 2008.
    Nunez, Anderton & Renslow, "Optimizing colormaps with consideration for color vision
    deficiency", PLOS ONE 13(7), 2018.
"""

import numpy as np

from grasp_core.arrays import Array, Indices

FINGERS = ("#E69F00", "#56B4E9", "#009E73", "#CC79A7")
"""Colour of each finger, which its cones, region, line of force and curves share."""
INK, GLASS, FOCUS, SURFACE = "#30363d", "#8296ab", "#D55E00", "#0072B2"
HAND = "#b9b0a4"
"""Colour of a hand's links: warm and muted, so that it is neither a finger's nor the object's."""
GOOD, BAD, NEUTRAL = "#0072B2", "#D55E00", "#686e77"
PAPER = "#ffffff"
NIGHT = {
    INK: "#dfe4ea", GOOD: "#56aee8", NEUTRAL: "#a3adb8", PAPER: "#14181d", BAD: "#ff8a4c",
}  # fmt: skip
"""Colours that take the place of others where the reader's screen is dark."""
RAMP = ("#00224e", "#434e6c", "#7d7c78", "#bcaf6f", "#fee838")
LEVELS = 64


def rgb(colour: str) -> tuple[float, float, float]:
    """Convert a colour written as #rrggbb to red, green and blue from 0 to 1."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue


def hexed(colour: tuple[float, ...]) -> str:
    """Convert red, green and blue from 0 to 1 to a colour written as #rrggbb."""
    return "#" + "".join(f"{round(255.0 * part):02x}" for part in colour[:3])


def ramp_bytes() -> Indices:
    """Return the colours of the ramp, (LEVELS, 3), from 0 to 255."""
    knots = np.array([rgb(colour) for colour in RAMP])
    places = np.linspace(0.0, len(RAMP) - 1.0, LEVELS)
    low = np.minimum(places.astype(np.int64), len(RAMP) - 2)
    share = (places - low)[:, None]
    mixed = (1.0 - share) * knots[low] + share * knots[low + 1]
    return np.rint(255.0 * mixed).astype(np.int64)


def levels_of(values: Array, low: float, high: float) -> Indices:
    """Find the level of the ramp for each value of a range, of any shape."""
    span = max(high - low, np.finfo(np.float64).tiny)
    return np.clip(LEVELS * (values - low) / span, 0, LEVELS - 1).astype(np.int64)
