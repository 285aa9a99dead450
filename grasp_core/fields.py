"""Checks fields of a certificate, and answers True or False where others would raise errors.

A certificate may come from anywhere, so its `verify` answers False to a bad field, never an error.

Checks compute with a certificate's arrays as they are. So real ones must be float64, and whole ones
int64, as this package makes them: narrower types wrap or overflow in the sums of a check, unsigned
ones in its differences, and subclasses of arrays may hide entries. To check arrays of other types,
convert them first, `array.astype(np.float64)`.
"""

from numbers import Real
from typing import Any, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import LARGEST_ENTRY, UNIT_SLACK, Array, Indices
from grasp_core.checked import LARGEST_FRICTION


def is_a(value: Any, kind: type) -> bool:
    """Return whether a value is an instance of a class, whatever type is declared for it."""
    return isinstance(value, kind)


def is_tuple_of(value: Any, kind: type, count: int | None = None) -> bool:
    """Return whether a value is a tuple of instances of a class, `count` of them if given."""
    if not isinstance(value, tuple):
        return False
    things = cast("tuple[Any, ...]", value)
    fits = count is None or len(things) == count
    return fits and all(isinstance(thing, kind) for thing in things)


def is_number(value: Any, *, least: float = -LARGEST_ENTRY, most: float = LARGEST_ENTRY) -> bool:
    """Return whether a value is a single real number in a range, and not NaN."""
    real = isinstance(value, Real) and not is_a(value, bool)
    return real and least <= cast("float", value) <= most


def is_array(value: Any, *shape: int | None) -> TypeGuard[Array]:
    """Return whether a value is a float64 array of finite numbers; None is any length."""
    if not _fits(value, np.float64, shape):
        return False
    return bool((np.abs(cast("Array", value)) <= LARGEST_ENTRY).all())


def is_indices(value: Any, *shape: int | None) -> TypeGuard[Indices]:
    """Return whether a value is an int64 array of a shape; None is any length."""
    return _fits(value, np.int64, shape)


def _fits(value: Any, kind: type, shape: tuple[int | None, ...]) -> bool:
    """Return whether a value is a plain array of a type of entries and a shape."""
    if type(value) is not np.ndarray:
        return False
    array: NDArray[Any] = value
    return (
        array.dtype == kind
        and array.ndim == len(shape)
        and all(want in (None, got) for want, got in zip(shape, array.shape, strict=True))
    )


def are_units(value: Any, *shape: int | None, slack: float = UNIT_SLACK) -> bool:
    """Return whether a value is an array of unit vectors along its last axis."""
    return is_array(value, *shape) and bool(
        (np.abs(np.linalg.norm(value, axis=-1) - 1.0) <= slack).all()
    )


def are_frictions(value: Any, count: int) -> bool:
    """Return whether a value holds one Coulomb coefficient per contact, (count,)."""
    return is_array(value, count) and bool(((value >= 0.0) & (value <= LARGEST_FRICTION)).all())
