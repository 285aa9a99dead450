"""Converts angles to degrees for files, and back so that an angle read is the one that was written.

Two neighbouring numbers of radians may become the same degrees. One of them stands for both: every
angle of a plan is such a number, so a file keeps it exactly.
"""

import math


def radians_of(degrees: float) -> float:
    """Return the angle [rad] that `math.degrees` turns into these degrees exactly.

    Degrees that no angle becomes exactly are converted as by `math.radians`.
    """
    nearest = math.radians(degrees)
    beside = (math.nextafter(nearest, math.inf), math.nextafter(nearest, -math.inf))
    exact = (angle for angle in (nearest, *beside) if math.degrees(angle) == degrees)
    return next(exact, nearest)


def kept_angle(radians: float) -> float:
    """Return the angle that files keep for one: the same, or its neighbour in the last digit."""
    return radians_of(math.degrees(radians))
