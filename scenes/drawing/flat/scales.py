"""Places numbers along the axis of a chart, and chooses its ticks."""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array

LONG_RANGE = 300.0
"""Ratio of an axis's ends above which the axis shows only powers of ten."""
NICE = (1.0, 2.0, 5.0, 10.0)
"""Steps between ticks, times powers of ten."""


@dataclass(frozen=True, slots=True)
class Scale:
    """The range of an axis."""

    low: float
    high: float
    log: bool = False

    def shares(self, values: Array) -> Array:
        """Find how far along the axis values are, from 0 to 1; those beyond it are at its ends."""
        low, high, along = self.low, self.high, np.asarray(values)
        if self.log:
            low, high = math.log(low), math.log(high)
            along = np.log(np.maximum(along, self.low))
        return np.clip((along - low) / (high - low), 0.0, 1.0)


def ticks_in(low: float, high: float, most: int = 5) -> list[float]:
    """List round numbers in a range, at equal steps, at most `most` of them."""
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(nice * power for nice in NICE if nice * power >= rough * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [step * count for count in range(first, last + 1)]


def ticks_between(low: float, high: float) -> list[float]:
    """List 1, 2 and 5 times powers of ten in a range, or only powers of ten in a long range."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1.0, 2.0, 5.0) if high < LONG_RANGE * low else (1.0,)
    found = [step * 10.0**power for power in powers for step in steps]
    return [value for value in found if low <= value <= high]
