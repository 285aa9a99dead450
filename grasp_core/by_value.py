"""Gives frozen values an equality by their fields and a short text, and makes trusted ones.

Two values are equal if they are of one class and all their fields are equal: arrays of the same
shape entry by entry, tuples and mappings item by item, numbers exactly. Two NaN count as equal, so
that a copy equals its original. Fields that are declared with `compare=False` do not count.
"""

from collections.abc import Mapping, Sized
from dataclasses import fields
from textwrap import shorten
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.checked import shown

HASHED = (str, int, bool)
"""Classes of the fields that a hash is made from."""
HASHED_ENTRIES = 3
"""Number of entries of an array that a hash is made from: a point tells contacts apart when they
are looked up in a cache, without looking at each entry of a large mesh."""
Item = TypeVar("Item")


class ByValue:
    """Base of frozen dataclasses that are compared by their fields, also where these are arrays."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        compared = (field.name for field in fields(cast("Any", self)) if field.compare)
        return all(_same(getattr(self, name), getattr(other, name)) for name in compared)

    def __hash__(self) -> int:
        """Return a hash of the texts, whole numbers and first entries of arrays in the fields."""
        named = (field for field in fields(cast("Any", self)) if field.compare)
        kinds = (_hashed(self, field.name) for field in named)
        return hash((type(self).__name__, *kinds))

    def __repr__(self) -> str:
        """Return a line with the figures that are short; longer fields are only counted."""
        told = (field.name for field in fields(cast("Any", self)) if field.repr)
        return short(type(self).__name__, {name: getattr(self, name) for name in told})


def _same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
            return False
        mine, its = cast("NDArray[Any]", one), cast("NDArray[Any]", other)
        return np.array_equal(mine, its, equal_nan="f" in mine.dtype.kind + its.dtype.kind)
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        ours, theirs = cast("tuple[Any, ...]", one), cast("tuple[Any, ...]", other)
        return len(ours) == len(theirs) and all(map(_same, ours, theirs))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        mine, its = cast("Mapping[Any, Any]", one), cast("Mapping[Any, Any]", other)
        return mine.keys() == its.keys() and all(_same(mine[key], its[key]) for key in mine)
    return bool(one == other) or (_is_nan(one) and _is_nan(other))


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and value != value  # noqa: PLR0124 - only NaN differs from itself


def _hashed(value: object, name: str) -> object:
    known = kept(value, name)
    if isinstance(known, np.ndarray):
        entries = cast("NDArray[Any]", known)
        first = entries.flat[:HASHED_ENTRIES].tolist()
        return (entries.shape, *(0.0 if _is_nan(entry) else entry for entry in first))
    return known if isinstance(known, HASHED) else None


def kept(value: object, name: str) -> Any:
    """Return a field as it is; None where it would have to be computed first."""
    try:
        return object.__getattribute__(value, name)
    except AttributeError:
        return None


def trusted(kind: type[Item], /, **given: Any) -> Item:
    """Make a frozen value of fields that were checked before, unchecked and uncopied."""
    made, put = object.__new__(kind), object.__setattr__
    for name in given:
        put(made, name, given[name])
    return made


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
    irregular = {"vertex": "vertices", "patch": "patches"}
    return f"{number} {thing if number == 1 else irregular.get(thing, thing + 's')}"


def _figure(value: object) -> str:
    if isinstance(value, np.ndarray):
        return vector(cast("NDArray[Any]", value))
    return f"{value:.6g}" if isinstance(value, float) else shown(value)


def vector(value: ArrayLike) -> str:
    """Write a vector to six digits; a number that is rounding beside the largest is zero."""
    numbers = np.array(value, dtype=np.float64)
    numbers[np.abs(numbers) < NOTHING * np.abs(numbers).max(initial=0.0)] = 0.0
    return f"({', '.join(f'{x:.6g}' for x in numbers.tolist())})"
