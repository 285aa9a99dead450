"""Arrays checked once on the way in, and read-only ever after."""

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.errors import InputError

Array: TypeAlias = NDArray[np.float64]
"""Any float array; its shape is said in words where it is used."""
Indices: TypeAlias = NDArray[np.int64]
"""Any integer array of indices."""

DIGITS = 9
"""Digits kept by `to_digits`: a thousand times more than any result needs, a million times fewer
than solvers' noise reaches."""
UNIT_SLACK = 1e-9
"""How far the length of a unit vector may be from 1: rounding of a file with ten digits."""


def frozen(value: ArrayLike, shape: tuple[int | None, ...], name: str) -> Array:
    """Copy `value` into a read-only float array of the given shape.

    Args:
        value: Anything numpy reads as numbers.
        shape: Expected length along each axis; None leaves that axis free.
        name: What to call the value in an error message.

    Raises:
        InputError: The shape differs, or an entry is not a finite number.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be an array of numbers: {error}") from error
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = tuple("any" if n is None else n for n in shape)
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, got NaN or infinity")
    array.setflags(write=False)
    return array


def frozen_units(value: ArrayLike, shape: tuple[int | None, ...], name: str) -> Array:
    """Like `frozen`, for unit vectors along the last axis.

    Raises:
        InputError: As `frozen`, or a vector's length is not 1.
    """
    array = frozen(value, shape, name)
    lengths = np.linalg.norm(array, axis=-1)
    if (np.abs(lengths - 1.0) > UNIT_SLACK).any():
        worst = float(lengths.flat[int(np.argmax(np.abs(lengths - 1.0)))])
        raise InputError(f"{name} must have length 1, got {worst:.12g}; divide by its length first")
    return array


def frozen_indices(value: Any, shape: tuple[int | None, ...], name: str) -> Indices:
    """Like `frozen`, for non-negative whole numbers."""
    numbers = frozen(value, shape, name)
    if (numbers != np.floor(numbers)).any() or (numbers < 0).any():
        raise InputError(f"{name} must hold whole numbers from 0 on")
    indices = numbers.astype(np.int64)
    indices.setflags(write=False)
    return indices


def positive(value: float, name: str) -> float:
    """A positive finite number.

    Raises:
        InputError: It is not.
    """
    number = float(value)
    if not (math.isfinite(number) and number > 0.0):
        raise InputError(f"{name} must be positive, got {value}")
    return number


def to_digits(values: Array) -> Array:
    """Values rounded to `DIGITS` digits of the largest of them.

    The last bits of solvers' and factorisations' answers depend on where their numbers lie in
    memory; what is simulated or written must not.
    """
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0:
        return values
    return np.round(values, DIGITS - 1 - math.floor(math.log10(largest)))
