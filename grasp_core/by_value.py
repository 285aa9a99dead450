"""Values that are compared by their fields and shown in a line, also where fields are arrays.

Two values are equal if they are of one class and all their fields are equal: arrays entry by entry,
tuples and mappings item by item, numbers exactly; two NaN count as equal, so that a copy equals its
original. Fields that are declared with `compare=False` do not count.
"""

from collections.abc import Mapping, Sized
from dataclasses import fields
from textwrap import shorten
from typing import Any, cast

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from grasp_core.messages import shown

HASHED_KINDS = (str, int, bool)
HASHED_ENTRIES = 3
"""Number of entries of an array that a hash is made from: a point tells contacts apart when they
are looked up in a cache, without looking at each entry of a large mesh."""
MOST_TEXT = 300
"""Largest number of characters of a value's text: two lines and a half."""
SHORT_VECTOR = 6
SHOWN_AS_ZERO = 1e-12


class ByValue:
    """Base of frozen dataclasses that are compared by their fields, also where these are arrays."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        compared = (field.name for field in fields(cast("Any", self)) if field.compare)
        return all(same(getattr(self, name), getattr(other, name)) for name in compared)

    def __hash__(self) -> int:
        """Return a hash of the texts, whole numbers and first entries of arrays in the fields."""
        named = (field for field in fields(cast("Any", self)) if field.compare)
        kinds = (_hashed(self, field.name) for field in named)
        return hash((type(self).__name__, *kinds))

    def __repr__(self) -> str:
        """Return at most `MOST_TEXT` characters: figures that are short, and sizes of others."""
        told = (field.name for field in fields(cast("Any", self)) if field.repr)
        parts = (f"{name}={_size(getattr(self, name))}" for name in told)
        return shorten(f"{type(self).__name__}({', '.join(parts)})", MOST_TEXT, placeholder=" ...)")

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.is_instance_schema(cls)


def kept(value: object, name: str) -> Any:
    """Return a field as it is; None where it would have to be computed first."""
    try:
        return object.__getattribute__(value, name)
    except AttributeError:
        return None


def same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, arrays in them entry by entry, and NaN to NaN."""
    if one is other:
        return True
    if is_array(one) and is_array(other):
        import numpy as np

        return np.array_equal(one, other, equal_nan="f" in one.dtype.kind + other.dtype.kind)
    if is_array(one) or is_array(other):
        return False
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        ours, theirs = cast("tuple[Any, ...]", one), cast("tuple[Any, ...]", other)
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        mine, its = cast("Mapping[Any, Any]", one), cast("Mapping[Any, Any]", other)
        return mine.keys() == its.keys() and all(same(mine[key], its[key]) for key in mine)
    return bool(one == other) or (_is_nan(one) and _is_nan(other))


def is_array(value: Any) -> bool:
    """Return whether a value is an array of numpy, which need not be imported."""
    return hasattr(value, "dtype") and hasattr(value, "flat")


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and value != value  # noqa: PLR0124 - only NaN differs from itself


def _hashed(value: object, name: str) -> object:
    known = kept(value, name)
    if is_array(known):
        first = known.flat[:HASHED_ENTRIES].tolist()
        return (known.shape, *(0.0 if _is_nan(entry) else entry for entry in first))
    return known if isinstance(known, HASHED_KINDS) else None


def summary(kind: str, *said: str, **figures: object) -> str:
    """Write `Kind(words, name=figure, ..)`, like a constructor call but not meant as code."""
    parts = [*said, *(f"{name}={_figure(value)}" for name, value in figures.items())]
    return f"{kind}({', '.join(parts)})"


def _size(value: Any) -> str:
    """Write a number, a short vector or a short text; else what the value is and its size."""
    if is_array(value):
        if value.ndim == 1 and value.size <= SHORT_VECTOR and value.dtype.kind == "f":
            return vector(value)
        return f"array {value.shape}"
    if isinstance(value, tuple | list | Mapping):
        return counted(len(cast("Sized", value)), "item")
    plain = value is None or isinstance(value, str | bool | int | float)
    return _figure(value) if plain else type(value).__name__


def counted(number: int, thing: str) -> str:
    """Write a number with its noun, such as `1 hole` or `2 holes`."""
    irregular = {"vertex": "vertices", "patch": "patches"}
    return f"{number} {thing if number == 1 else irregular.get(thing, thing + 's')}"


def _figure(value: Any) -> str:
    if is_array(value):
        return vector(value)
    return f"{value:.6g}" if isinstance(value, float) else shown(value)


def vector(value: Any) -> str:
    """Write a vector to six digits; a number that is rounding beside the largest is zero."""
    sizes = [float(x) for x in value]
    nothing = SHOWN_AS_ZERO * max(map(abs, sizes), default=0.0)
    return f"({', '.join(f'{0.0 if abs(x) < nothing else x:.6g}' for x in sizes)})"
