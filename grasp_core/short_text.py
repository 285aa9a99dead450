"""Shows values of many numbers in one line: a name, and the figures that tell them apart."""

from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.checked import shown

NOTHING = 1e-12
"""Share of a vector's largest number below which a number is shown as zero."""


def summary(kind: str, *said: str, **figures: object) -> str:
    """Write `Kind(words, name=figure, ..)`, like a constructor call but not meant as code.

    Args:
        kind: Name of the class.
        said: Words that are shown as they are.
        figures: Numbers and vectors to six digits; anything else as in error messages.
    """
    parts = [*said, *(f"{name}={_figure(value)}" for name, value in figures.items())]
    return f"{kind}({', '.join(parts)})"


def counted(number: int, thing: str) -> str:
    """Write a number with its noun, such as `1 hole` or `2 holes`."""
    return f"{number} {thing}" if number == 1 else f"{number} {_plural(thing)}"


def _plural(thing: str) -> str:
    irregular = {"vertex": "vertices", "patch": "patches"}
    return irregular.get(thing, thing + "s")


def _figure(value: object) -> str:
    if isinstance(value, np.ndarray):
        return vector(cast("Array", value))
    return f"{value:.6g}" if isinstance(value, float) else shown(value)


def vector(value: ArrayLike) -> str:
    """Write a vector to six digits; a number that is rounding beside the largest is zero."""
    numbers = np.array(value, dtype=np.float64)
    numbers[np.abs(numbers) < NOTHING * np.abs(numbers).max(initial=0.0)] = 0.0
    return f"({', '.join(f'{x:.6g}' for x in numbers.tolist())})"
