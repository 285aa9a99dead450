"""Fits lengths, springs, masses and forces that suit objects of some centimetres to smaller ones.

What robots do to an object of a decimetre makes no sense with one of some millimetres: off by two
millimetres it lies beside the fingers, and between springs that are longer than the object no
pushes are stable. Let s be the object's radius over `SMALL_M`, if that is below one. Lengths are
multiplied by s, so that they stay the same shares of the radius, and forces by s^2, for the same
pressure. So springs have s times the stiffness. With s^2 times the mass of fingertips, the springs'
periods are multiplied by the root of s, as those of falling through such lengths are.
"""

SMALL_M = 0.025
"""Radius of objects below which usual numbers are fitted [m]: the 5 mm that springs give, and that
an object may move, are a fifth of it."""


def fitted(usual: float, radius_m: float, power: int = 1) -> float:
    """Return a usual number as it suits an object; large ones leave it as it is."""
    if radius_m >= SMALL_M:
        return usual
    return float(f"{usual * (radius_m / SMALL_M) ** power:.3g}")
