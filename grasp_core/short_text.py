"""How values of many numbers are shown in a line: a name, and what tells them apart."""

from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.checked import shown

NOTHING = 1e-12
"""Share of a vector's largest number that counts as zero where people read it."""


def summary(kind: str, *said: str, **figures: object) -> str:
    """`Kind(words, name=figure, ..)`, in the style of constructors but not one.

    Args:
        kind: Name of the class.
        said: Words, as they are.
        figures: Numbers and vectors to six digits, anything else as in messages.
    """
    parts = [*said, *(f"{name}={_figure(value)}" for name, value in figures.items())]
    return f"{kind}({', '.join(parts)})"


def counted(number: int, thing: str) -> str:
    """`1 hole`, `2 holes`."""
    return f"{number} {thing}" if number == 1 else f"{number} {_plural(thing)}"


def _plural(thing: str) -> str:
    irregular = {"vertex": "vertices", "patch": "patches"}
    return irregular.get(thing, thing + "s")


def _figure(value: object) -> str:
    if isinstance(value, np.ndarray):
        return vector(cast("Array", value))
    return f"{value:.6g}" if isinstance(value, float) else shown(value)


def vector(value: ArrayLike) -> str:
    """The numbers of a vector to six digits; what is rounding beside the largest is zero."""
    numbers = np.array(value, dtype=np.float64)
    numbers[np.abs(numbers) < NOTHING * np.abs(numbers).max(initial=0.0)] = 0.0
    return f"({', '.join(f'{x:.6g}' for x in numbers.tolist())})"
