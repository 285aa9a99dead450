"""Checks fields of a certificate, and answers True or False where others would raise errors.

A certificate may come from anywhere, so its `verify` answers False to a bad field, never an error.
"""

from numbers import Real
from typing import Any, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import LARGEST_ENTRY, REAL, UNIT_SLACK, Array
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
    """Return whether a value is an array of finite reals of a shape; None leaves an axis free."""
    if not isinstance(value, np.ndarray):
        return False
    array = cast("NDArray[Any]", value)
    fits = len(array.shape) == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    numbers = fits and array.dtype.kind in REAL
    return numbers and bool((np.abs(array) <= LARGEST_ENTRY).all())


def is_indices(value: Any, *shape: int | None) -> bool:
    """Return whether a value is an array of whole numbers of a shape."""
    return is_array(value, *shape) and value.dtype.kind in "iu"


def are_units(value: Any, *shape: int | None, slack: float = UNIT_SLACK) -> bool:
    """Return whether a value is an array of unit vectors along its last axis."""
    return is_array(value, *shape) and bool(
        (np.abs(np.linalg.norm(value, axis=-1) - 1.0) <= slack).all()
    )


def are_frictions(value: Any, count: int) -> bool:
    """Return whether a value holds one Coulomb coefficient per contact, (count,)."""
    return is_array(value, count) and bool(((value >= 0.0) & (value <= LARGEST_FRICTION)).all())
