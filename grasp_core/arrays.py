"""Checks arrays once when they are passed in, and fields of certificates whenever they are used.

Arrays that users pass are copied and made read-only, or refused with an error. A certificate may
come from anywhere, so its `verify` answers False to a bad field (see `Declared.is_sound`), never an
error. Its real arrays must be float64, and whole ones int64, as its constructor makes them:
narrower types wrap or overflow in the sums of a check, unsigned ones in its differences, and
subclasses of arrays may hide entries.
"""

import math
from dataclasses import dataclass
from itertools import chain
from typing import Annotated, Any, TypeAlias, cast

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike, NDArray
from pydantic_core import CoreSchema, core_schema

from grasp_core.allowed_values import LARGEST_FRICTION, MOST_COUNT
from grasp_core.errors import InputError
from grasp_core.messages import UnfitError, shown

Array: TypeAlias = NDArray[np.float64]
"""Float array of any shape; the docstring of each value or argument gives its shape."""
Indices: TypeAlias = NDArray[np.int64]
"""Integer array of indices, of any shape."""

KEPT_DIGITS = 9
"""Digits kept by `to_digits`: a thousand times finer than results need, far above noise."""
SHIFT = 0.5 * (math.sqrt(5.0) - 1.0)
"""Offset, in cells, of the grids on which numbers are rounded or compared: the golden section is
the number that fractions approximate worst, so the numbers of regular objects are far from the
borders of cells."""
NEXT, AFTER_NEXT = np.array([1, 2, 0]), np.array([2, 0, 1])
"""For each axis, the one after it and the one after that."""
DECADE_SHIFT = 0.05
"""Shift of the decimal logarithm that keeps round numbers, such as the 1.0 of a unit vector, away
from the sizes at which one digit more is kept."""
LARGEST_ENTRY = 1e50
"""Largest size of an array entry: the product of three such numbers has a finite square."""
SMALLEST_SIZE = 1e-50
"""Smallest length above zero: the square of a smaller one would vanish."""
FLOAT_BYTES = 8
"""Number of bytes of a float; those of extended precision have more."""
REAL = "iuf"
"""Numpy's letters for kinds of integers and floats; no other entries are accepted."""
UNIT_SLACK = 1e-9
"""How far the length of a unit vector may be from 1: the rounding of a file with ten digits."""
ROUNDED_UNIT = 1e-6
"""How far it may be where it is set to 1: the rounding of single precision, and of seven digits."""


def frozen(
    value: ArrayLike, shape: tuple[int | None, ...], name: str, *, most: float = LARGEST_ENTRY
) -> Array:
    """Copy `value` into a read-only float array of the given shape."""
    array = real_array(value, name)
    if not _has_shape(array, shape):
        wanted = tuple("any" if n is None else n for n in shape)
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, got NaN or infinity")
    largest = float(np.abs(array).max(initial=0.0))
    if largest > most:
        raise InputError(
            f"{name} must not exceed {most:g} in size, got {largest:.6g}; use other units"
        )
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Shape:
    """The rule that a value is an array of a shape: None is free, equal letters are equal."""

    shape: tuple[int | str | None, ...]
    units: bool = False  # whether vectors along the last axis have length one
    slack: float = UNIT_SLACK
    """How far a length may be from one in an array that is not taken but looked at."""
    whole: bool = False  # whether entries are whole numbers from 0 up
    least: float = -LARGEST_ENTRY
    most: float = LARGEST_ENTRY
    nan: bool = False
    """Whether entries may be NaN, where a simulation diverged or a finger is missing; null in
    files."""

    _lengths: tuple[int | None, ...] = ()

    def __init__(self, *shape: int | str | None, **rules: Any) -> None:
        lengths = tuple(None if isinstance(n, str) else n for n in shape)
        for name, value in {"shape": shape, "_lengths": lengths, **rules}.items():
            object.__setattr__(self, name, value)

    def take(self, value: Any) -> NDArray[Any]:
        """Return a read-only copy of a value, or itself if it is read-only and owns its entries."""
        if self.fits(value):
            array = value if value.base is None and not value.flags.writeable else np.array(value)
            array.setflags(write=False)
        else:
            make = frozen_indices if self.whole else frozen_units if self.units else frozen
            try:
                if self.nan:
                    return self._with_nan(value)
                array = make(value, self._lengths, "")
            except InputError as error:
                raise UnfitError(str(error).strip()) from None
        if not self.in_range(array):
            raise UnfitError(
                f"must hold numbers from {self.least:g} to {self.most:g}, got "
                f"{float(array.min()):.6g} to {float(array.max()):.6g}"
            )
        return array

    def _with_nan(self, value: Any) -> Array:
        """Return a copy whose entries may be NaN, for which lists have None."""
        listed: Any = value.tolist() if hasattr(value, "tolist") else value
        try:
            array = np.array(listed, dtype=np.float64) if _is_rows(listed) else None
        except ValueError:  # its rows differ in length
            array = None
        array = real_array(value, "") if array is None else array
        frozen(np.nan_to_num(array), self._lengths, "")
        array.setflags(write=False)
        return array

    def __get_pydantic_core_schema__(self, *_: Any) -> CoreSchema:
        """Take arrays with `take`, and write them as lists in which null stands for NaN."""
        written = core_schema.plain_serializer_function_ser_schema(self._listed)
        return core_schema.with_info_plain_validator_function(self._given, serialization=written)

    def __get_pydantic_json_schema__(self, *_: Any) -> dict[str, Any]:
        """Return the JSON schema of nested lists."""
        entry: dict[str, Any] = {"type": "integer" if self.whole else "number"}
        free = self.least == -LARGEST_ENTRY and self.most == LARGEST_ENTRY
        entry |= {} if free else {"minimum": self.least, "maximum": self.most}
        entry = {"anyOf": [entry, {"type": "null"}]} if self.nan else entry
        for length in reversed(self.shape):
            fixed = isinstance(length, int)
            entry = {"type": "array", "items": entry}
            entry |= {"minItems": length, "maxItems": length} if fixed else {}
        return entry

    def _given(self, value: Any, info: core_schema.ValidationInfo[Any]) -> NDArray[Any]:
        return self.take(self._of_lists(value) if info.context else value)

    def _of_lists(self, value: Any) -> Any:
        """Refuse true and false in a file, which arrays would take for 1 and 0."""
        if isinstance(value, list) and not value and not isinstance(self.shape[0], int):
            return np.empty((0, *(size for size in self.shape[1:] if isinstance(size, int))))
        items: list[Any] = [value]
        while (found := set(map(type, items))) == {list}:
            items = [*chain.from_iterable(items)]
        if bool in found:
            raise UnfitError("must hold numbers, got true or false among them")
        if self.nan and any(isinstance(x, float) and not math.isfinite(x) for x in items):
            raise UnfitError("must hold finite numbers, got NaN or infinity")
        return cast("Any", value)

    def _listed(self, array: NDArray[Any]) -> Any:
        if not self.nan:
            return array.tolist()
        whole = array.astype(object)
        whole[np.isnan(array)] = None
        return whole.tolist()

    def fits(self, value: Any) -> bool:
        """Return whether a value is an array of this shape and type, with entries as must be."""
        if type(value) is not np.ndarray or value.dtype != (np.int64 if self.whole else np.float64):
            return False
        array: NDArray[Any] = value
        if not _has_shape(array, self._lengths):
            return False
        if self.whole:
            return bool(0 <= array.min(initial=0) <= array.max(initial=0) <= MOST_COUNT)
        if not np.abs(array).max(initial=0.0) <= LARGEST_ENTRY:
            return False
        if not self.units:
            return True
        lengths = np.sqrt((array * array).sum(axis=-1))
        return bool((np.abs(lengths - 1.0) <= self.slack).all())

    def in_range(self, array: NDArray[Any]) -> bool:
        """Return whether all entries are from `least` to `most`."""
        free = self.least == -LARGEST_ENTRY and self.most == LARGEST_ENTRY
        return free or not array.size or self.least <= array.min() <= array.max() <= self.most

    def __str__(self) -> str:
        lengths = ", ".join("any" if n is None else str(n) for n in self.shape)
        entries = "whole numbers" if self.whole else "unit vectors" if self.units else "numbers"
        return f"an array of {entries} of shape ({lengths}{',' * (len(self.shape) == 1)})"


def _is_rows(listed: Any) -> bool:
    """Return whether lists hold only numbers, None and further such lists."""
    if isinstance(listed, list | tuple):
        return all(map(_is_rows, cast("list[Any]", listed)))
    number = type(listed) is not bool and isinstance(listed, int | float | np.number)
    return listed is None or number


Point = Annotated[Array, Shape(3)]
"""A point or a vector, (3,)."""
UnitVector = Annotated[Array, Shape(3, units=True)]
Wrench = Annotated[Array, Shape(6)]
"""A force [N], then a torque [N m], (6,)."""
Points = Annotated[Array, Shape("k", 3)]
"""A point or a vector for each of k contacts, (k, 3)."""
UnitVectors = Annotated[Array, Shape("k", 3, units=True)]
Frictions = Annotated[Array, Shape("k", least=0.0, most=LARGEST_FRICTION)]
"""A Coulomb coefficient for each of k contacts, (k,)."""
Polygon = Annotated[Array, Shape(None, 3)]
"""Any number of points in space, (n, 3) [m], such as the corners of a polygon in order."""
ProofNumber = Annotated[float, Interval(ge=-LARGEST_ENTRY, le=LARGEST_ENTRY)]
"""A number that a proof may square."""
Amount = Annotated[float, Interval(ge=0.0, le=LARGEST_ENTRY)]
"""How much there is of something, that a proof may square."""
Triangles = Annotated[Indices, Shape(None, 3, whole=True)]
"""Places of the corners of triangles among points, (t, 3)."""


def frozen_copy(values: Array) -> Array:
    """Copy an array that needs no check, and make the copy read-only."""
    kept = np.array(values, dtype=np.float64)
    kept.setflags(write=False)
    return kept


def real_array(value: ArrayLike, name: str) -> Array:
    """Copy a value into a new float array; strings and truth values are refused, not converted."""
    try:
        given: NDArray[Any] = np.asarray(value)
    except (TypeError, ValueError) as error:  # rows of different lengths
        raise InputError(
            f"{name} must be an array of numbers; numpy refuses it: {error}"
        ) from error
    if given.dtype.kind not in REAL:
        got = shown(value) if given.ndim == 0 else f"entries of type {given.dtype}"
        raise InputError(f"{name} must be an array of numbers, got {got}")
    if given.dtype.itemsize <= FLOAT_BYTES:
        return np.array(given, dtype=np.float64)
    with np.errstate(over="ignore"):  # extended precision may exceed doubles; `frozen` refuses that
        return np.array(given, dtype=np.float64)


def frozen_units(value: ArrayLike, shape: tuple[int | None, ...], name: str) -> Array:
    """Copy `value` into a read-only array of unit vectors along the last axis (see `frozen`).

    Vectors that are of unit length but for the rounding of single precision are divided by it.
    """
    array = frozen(value, shape, name)
    lengths = np.linalg.norm(array, axis=-1)
    off = np.abs(lengths - 1.0)
    if (off > ROUNDED_UNIT).any():
        worst = float(lengths.flat[int(np.argmax(off))])
        raise InputError(f"{name} must have length 1, got {worst:.12g}; divide it by its length")
    if (off > UNIT_SLACK).any():
        array = array / np.where(off > UNIT_SLACK, lengths, 1.0)[..., None]
        array.flags.writeable = False
    return array


def frozen_each(value: ArrayLike, count: int, name: str) -> Array:
    """Copy one number for all of `count` items, or one each, into a read-only array, (count,)."""
    given = real_array(value, name)
    return frozen(np.full(count, given) if given.ndim == 0 else given, (count,), name)


def frozen_indices(value: Any, shape: tuple[int | None, ...], name: str) -> Indices:
    """Copy `value` into a read-only array of non-negative whole numbers (see `frozen`)."""
    numbers = frozen(value, shape, name)
    if ((numbers != np.floor(numbers)) | (numbers < 0) | (numbers > MOST_COUNT)).any():
        raise InputError(f"{name} must hold whole numbers from 0 to {MOST_COUNT}")
    indices = numbers.astype(np.int64)
    indices.setflags(write=False)
    return indices


def cross(a: Array, b: Array) -> Array:
    """Multiply vectors, (..., 3), as `np.cross` does, which takes longer where they are few."""
    ahead = a.take(NEXT, -1) * b.take(AFTER_NEXT, -1)
    return ahead - a.take(AFTER_NEXT, -1) * b.take(NEXT, -1)


def of_order_one(*arrays: Array) -> list[Array]:
    """Multiply arrays by one power of two, exactly, so that their largest entry is from 0.5 to 1.

    Proofs whose length means nothing are checked at this size: squares of very small numbers vanish
    and the smallest ones have few digits, so that rounding could prove anything. Zeros stay zeros.
    """
    largest = max(float(np.abs(array).max(initial=0.0)) for array in arrays)
    return [np.ldexp(array, -math.frexp(largest)[1]) for array in arrays]


def to_digits(values: Array, size: float = 0.0) -> Array:
    """Round values to some digits of the largest, so that no last bits of a solver show."""
    largest = max(float(np.abs(values).max(initial=0.0)), size)
    if largest == 0.0:
        return values
    scale = 10.0 ** (KEPT_DIGITS - 1 - math.floor(math.log10(largest) + DECADE_SHIFT))
    return np.floor(values * scale + SHIFT) / scale


def rounded(value: float) -> float:
    """Round a number as `to_digits` rounds an array of it alone."""
    return float(to_digits(np.array(value, dtype=np.float64)))


def is_array(value: Any, *shape: int | None, **rules: Any) -> bool:
    """Return whether a value is an array as it must be by the rules of `Shape`."""
    wanted = Shape(*shape, **rules)
    return wanted.fits(value) and wanted.in_range(value)


def _has_shape(array: NDArray[Any], shape: tuple[int | None, ...]) -> bool:
    """Return whether an array is of a shape; None is any length."""
    return array.ndim == len(shape) and all(
        want in (None, got) for want, got in zip(shape, array.shape, strict=True)
    )
