"""Contacts as arrays of positions, inward normals and friction coefficients, checked."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, frozen, frozen_each, frozen_units
from grasp_core.checked import LARGEST_FRICTION, shown
from grasp_core.errors import InputError
from grasp_core.values import Contact, Grasp


def stacked(contacts: Iterable[Contact]) -> tuple[Array, Array]:
    """Positions and inward normals of contacts, each (k, 3)."""
    listed = tuple(contacts)
    positions = np.array([contact.position for contact in listed])
    return positions, np.array([contact.normal for contact in listed])


def contact_arrays(positions: ArrayLike | Grasp, normals: ArrayLike | None) -> tuple[Array, Array]:
    """Positions and inward normals, each (k, 3), from a grasp or from two arrays.

    Raises:
        InputError: Shapes differ, a normal is not a unit vector, or fewer than two contacts.
    """
    if isinstance(positions, Grasp):
        if normals is not None:
            raise InputError(f"normals must be None where a Grasp is given, got {shown(normals)}")
        return positions.positions, positions.normals
    if normals is None:
        raise InputError("normals are missing: pass positions and normals, or a Grasp")
    points = frozen(positions, (None, 3), "positions")
    if len(points) < 2:  # noqa: PLR2004 - one contact alone can balance nothing
        raise InputError(f"positions: at least two contacts are needed, got {len(points)}")
    check_spread(np.ptp(points, axis=0))
    return points, frozen_units(normals, (len(points), 3), "normals")


def check_spread(extents: Array, name: str = "positions") -> None:
    """Refuse contacts so close together, but not in one place, that squares of lengths vanish.

    Args:
        extents: Of each set along each axis, (..., 3) [m].
        name: What to call the contacts in a message.

    Raises:
        InputError: They are.
    """
    sizes: Array = extents.max(axis=-1)
    tiny = (sizes > 0.0) & (sizes < SMALLEST_SIZE)
    if tiny.any():
        raise InputError(
            f"{name} must spread over at least {SMALLEST_SIZE:g} m, got "
            f"{float(sizes[tiny].min()):.3g}; use other units"
        )


def contact_frictions(friction: ArrayLike, count: int) -> Array:
    """One checked Coulomb coefficient per contact, (count,), from one for all or one each."""
    mu = frozen_each(friction, count, "friction")
    if (mu < 0.0).any():
        raise InputError(f"friction must not be negative, got {float(mu.min()):.6g}")
    if (mu > LARGEST_FRICTION).any():
        raise InputError(
            f"friction must be at most {LARGEST_FRICTION:g}, got {float(mu.max()):.6g}"
        )
    return mu
