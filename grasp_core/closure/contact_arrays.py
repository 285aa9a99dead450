"""Turns contacts into checked arrays, one set or many sets of equal size, and into a hash."""

import hashlib
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, frozen, frozen_each, frozen_units, real_array
from grasp_core.checked import LARGEST_FRICTION, instance, several, shown
from grasp_core.errors import InputError
from grasp_core.values import FINGERS, Contact, Grasp

FEWEST = 2
"""Least number of contacts that can balance anything."""


def stacked(contacts: Iterable[Contact]) -> tuple[Array, Array]:
    """Return the positions [m] and inward normals of contacts, each (k, 3)."""
    listed = tuple(contacts)
    positions = np.array([contact.position for contact in listed])
    return positions, np.array([contact.normal for contact in listed])


def contact_arrays(
    positions: ArrayLike | Grasp | Iterable[Grasp] | Sequence[Contact], normals: ArrayLike | None,
    *, many: bool = False,
) -> tuple[Array, Array]:  # fmt: skip
    """Return checked positions and normals of one set of contacts, or of many sets.

    Takes `positions` (k, 3) or (g, k, 3) [m].
    """
    given: Any = positions
    if normals is None and many:
        return _of_grasps((given,) if isinstance(given, Grasp) else given)
    held = None if many else contacts_in(given)
    if held is not None and normals is not None:
        what = "a Grasp is" if isinstance(given, Grasp) else "Contacts are"
        raise InputError(f"normals must be left out where {what} given, got {shown(normals)}")
    if isinstance(given, Grasp):
        return given.positions, given.normals
    if held is not None:
        given, units = stacked(held)
    elif normals is not None:
        units = normals
    else:
        raise InputError(
            "normals are missing; pass positions and normals, a Grasp, or a sequence of Contacts"
        )
    points = frozen(given, (None, None, 3) if many else (None, 3), "positions")
    if points.shape[-2] < FEWEST:
        raise InputError(f"positions must hold at least two contacts, got {points.shape[-2]}")
    check_spread(np.ptp(points, axis=-2))
    return points, frozen_units(units, points.shape, "normals")


def contacts_in(given: Any) -> tuple[Contact, ...] | None:
    """Return the contacts of a Grasp or of a sequence of Contacts; None for anything else."""
    if isinstance(given, Grasp):
        return given.contacts
    if not isinstance(given, list | tuple):
        return None
    listed = cast("list[object] | tuple[object, ...]", given)
    if not listed or not isinstance(listed[0], Contact):
        return None
    check = partial(instance, kind=Contact, name="positions", remedy="all must be Contacts")
    return several(listed, check, "positions", "Contacts")


def _of_grasps(given: Any) -> tuple[Array, Array]:
    check = partial(instance, kind=Grasp, name="positions", remedy="or pass normals too")
    grasps = several(given, check, "positions", "Grasp values")
    shape = (len(grasps), FINGERS, 3)
    points = np.array([grasp.positions for grasp in grasps], dtype=np.float64).reshape(shape)
    units = np.array([grasp.normals for grasp in grasps], dtype=np.float64).reshape(shape)
    return points, units


def check_spread(extents: Array, name: str = "positions") -> None:
    """Refuse contacts that are apart by so little that squares of lengths vanish.

    Takes `extents` (..., 3) [m].
    """
    sizes: Array = extents.max(axis=-1)
    tiny = (sizes > 0.0) & (sizes < SMALLEST_SIZE)
    if tiny.any():
        raise InputError(
            f"{name} must spread over at least {SMALLEST_SIZE:g} m, got "
            f"{float(sizes[tiny].min()):.3g}; use other units"
        )


def contact_frictions(friction: ArrayLike, shape: int | tuple[int, int]) -> Array:
    """Return one checked Coulomb coefficient for each contact.

    Takes `friction` (k,) or (g, k); `shape` (g, k).
    """
    sizes = (shape,) if isinstance(shape, int) else shape
    values = real_array(friction, "friction")
    if values.ndim < len(sizes):
        values = np.broadcast_to(frozen_each(values, sizes[-1], "friction"), sizes)
    mu = frozen(values, sizes, "friction")
    if (mu < 0.0).any():
        raise InputError(f"friction must not be negative, got {float(mu.min()):.6g}")
    if (mu > LARGEST_FRICTION).any():
        raise InputError(
            f"friction must be at most {LARGEST_FRICTION:g}, got {float(mu.max()):.6g}"
        )
    return mu


def unit_size(points: Array) -> tuple[Array, Array, Array]:
    """Scale contacts (..., k, 3) so that the longest arm from their mean has length one.

    Gives arms from the mean contact over the longest, (..., k, 3); that centre, (..., 3) [m]; and
    that length, (...) [m], which is one where all contacts are in one place.
    """
    centers: Array = points.mean(axis=-2)
    arms = points - centers[..., None, :]
    lengths: Array = np.linalg.norm(arms, axis=-1).max(axis=-1)
    sizes = np.where(lengths > 0.0, lengths, 1.0)
    return arms / sizes[..., None, None], centers, sizes


def contacts_sha256(contacts: Iterable[Contact]) -> str:
    """Hash positions and normals in finger order with SHA-256; 0.0 and -0.0 count as equal."""
    # adding zero turns -0.0 into 0.0
    numbers = np.concatenate([part.ravel() for part in stacked(contacts)]) + 0.0
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()
