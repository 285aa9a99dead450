"""Whether the fields of a certificate are what they should be: `checked` and `arrays` as questions.

Certificates may come from anywhere. What `verify` asks here it answers with False, never an error.
"""

from numbers import Real
from typing import Any, TypeGuard

import numpy as np

from grasp_core.arrays import LARGEST_ENTRY, REAL, UNIT_SLACK, Array, Indices
from grasp_core.checked import LARGEST_FRICTION


def is_number(value: Any, *, least: float = -LARGEST_ENTRY, most: float = LARGEST_ENTRY) -> bool:
    """Whether a value is one real number in a range, and not NaN."""
    return isinstance(value, Real) and not isinstance(value, bool) and least <= value <= most


def is_array(value: Any, *shape: int | None) -> TypeGuard[Array]:
    """Whether a value is an array of finite real numbers of a shape; None leaves an axis free."""
    return (
        isinstance(value, np.ndarray)
        and value.dtype.kind in REAL
        and len(value.shape) == len(shape)
        and all(want is None or want == got for want, got in zip(shape, value.shape, strict=True))
        and bool((np.abs(value) <= LARGEST_ENTRY).all())
    )


def is_indices(value: Any, *shape: int | None) -> TypeGuard[Indices]:
    """Whether a value is an array of whole numbers of a shape."""
    return is_array(value, *shape) and value.dtype.kind in "iu"


def are_units(value: Any, *shape: int | None, slack: float = UNIT_SLACK) -> TypeGuard[Array]:
    """Whether a value is an array of unit vectors along its last axis."""
    return is_array(value, *shape) and bool(
        (np.abs(np.linalg.norm(value, axis=-1) - 1.0) <= slack).all()
    )


def are_frictions(value: Any, count: int) -> TypeGuard[Array]:
    """Whether a value holds one Coulomb coefficient per contact, (count,)."""
    return is_array(value, count) and bool(((value >= 0.0) & (value <= LARGEST_FRICTION)).all())
