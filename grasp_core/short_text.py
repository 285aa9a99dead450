"""Shows values of many numbers in one line: a name, and the figures that tell them apart."""

from collections.abc import Mapping, Sized
from dataclasses import MISSING, Field, fields
from textwrap import shorten
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.checked import shown

MOST = 300
"""Largest number of characters of a value's text: two lines and a half."""
SHORT_VECTOR = 6
"""Largest number of components of a vector that is written in full."""
NOTHING = 1e-12
"""Share of a vector's largest number below which a number is shown as zero."""


def summary(kind: str, *said: str, **figures: object) -> str:
    """Write `Kind(words, name=figure, ..)`, like a constructor call but not meant as code."""
    parts = [*said, *(f"{name}={_figure(value)}" for name, value in figures.items())]
    return f"{kind}({', '.join(parts)})"


def short(kind: str, figures: Mapping[str, object]) -> str:
    """Write `Kind(name=figure, ..)` in at most `MOST` characters, longer things by their size."""
    parts = [f"{name}={_size(value)}" for name, value in figures.items()]
    return shorten(f"{kind}({', '.join(parts)})", MOST, placeholder=" ...)")


def changed(settings: Any) -> str:
    """Write settings by those that differ from the usual ones, in at most `MOST` characters."""
    parts = [
        f"{field.name}={value!r}"
        for field in fields(settings)
        if (value := getattr(settings, field.name)) != _usual(field)
    ]
    return shorten(f"{type(settings).__name__}({', '.join(parts)})", MOST, placeholder=" ...)")


def _usual(field: Field[Any]) -> object:
    """Return the default of a field; `MISSING` where there is none."""
    made = field.default_factory
    return field.default if made is MISSING else made()


def _size(value: object) -> str:
    """Write a number, a short vector or a short text; else what the value is and its size."""
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        if array.ndim == 1 and array.size <= SHORT_VECTOR and array.dtype.kind == "f":
            return vector(array)
        return f"array {array.shape}"
    if isinstance(value, tuple | list | Mapping):
        things = cast("Sized", value)
        return counted(len(things), "item")
    plain = value is None or isinstance(value, str | bool | int | float)
    return _figure(value) if plain else type(value).__name__


def counted(number: int, thing: str) -> str:
    """Write a number with its noun, such as `1 hole` or `2 holes`."""
    return f"{number} {thing}" if number == 1 else f"{number} {_plural(thing)}"


def _plural(thing: str) -> str:
    irregular = {"vertex": "vertices", "patch": "patches"}
    return irregular.get(thing, thing + "s")


def _figure(value: object) -> str:
    if isinstance(value, np.ndarray):
        return vector(cast("NDArray[Any]", value))
    return f"{value:.6g}" if isinstance(value, float) else shown(value)


def vector(value: ArrayLike) -> str:
    """Write a vector to six digits; a number that is rounding beside the largest is zero."""
    numbers = np.array(value, dtype=np.float64)
    numbers[np.abs(numbers) < NOTHING * np.abs(numbers).max(initial=0.0)] = 0.0
    return f"({', '.join(f'{x:.6g}' for x in numbers.tolist())})"
