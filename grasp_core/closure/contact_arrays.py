"""Contacts are made into checked arrays, one set or many sets of equal size, and into a hash."""

import hashlib
from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import SMALLEST_SIZE, Array, frozen, frozen_each, frozen_units, real_array
from grasp_core.checked import LARGEST_FRICTION, instance, several, shown
from grasp_core.errors import InputError
from grasp_core.values import FINGERS, Contact, Grasp


def stacked(contacts: Iterable[Contact]) -> tuple[Array, Array]:
    """Return the positions [m] and inward normals of contacts, each (k, 3)."""
    listed = tuple(contacts)
    positions = np.array([contact.position for contact in listed])
    return positions, np.array([contact.normal for contact in listed])


def contact_arrays(positions: ArrayLike | Grasp, normals: ArrayLike | None) -> tuple[Array, Array]:
    """Return checked positions and inward normals, each (k, 3), of a grasp or of two arrays.

    Raises:
        InputError: Shapes differ, a normal is not a unit vector, or there are fewer than two
            contacts.
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
        extents: Extent of each set of contacts along each axis, (..., 3) [m].
        name: What to call the contacts in an error message.

    Raises:
        InputError: The contacts of a set are in different places, yet less than `SMALLEST_SIZE`
            apart.
    """
    sizes: Array = extents.max(axis=-1)
    tiny = (sizes > 0.0) & (sizes < SMALLEST_SIZE)
    if tiny.any():
        raise InputError(
            f"{name} must spread over at least {SMALLEST_SIZE:g} m, got "
            f"{float(sizes[tiny].min()):.3g}; use other units"
        )


def contact_frictions(friction: ArrayLike, count: int) -> Array:
    """Return one checked Coulomb coefficient per contact, (count,), of one for all or one each."""
    mu = frozen_each(friction, count, "friction")
    if (mu < 0.0).any():
        raise InputError(f"friction must not be negative, got {float(mu.min()):.6g}")
    if (mu > LARGEST_FRICTION).any():
        raise InputError(
            f"friction must be at most {LARGEST_FRICTION:g}, got {float(mu.max()):.6g}"
        )
    return mu


FEWEST = 2
NO_NORMALS = "or give normals"


def many_contact_arrays(
    positions: ArrayLike | Iterable[Grasp], normals: ArrayLike | None
) -> tuple[Array, Array]:
    """Return checked positions and inward normals, each (g, k, 3), of grasps or of two arrays.

    Raises:
        InputError: Shapes differ, a normal is not a unit vector, or there are fewer than two
            contacts in a set.
    """
    given: Any = positions
    if normals is None:
        grasps = (given,) if isinstance(given, Grasp) else several(
            given, partial(instance, kind=Grasp, name="positions", remedy=NO_NORMALS),
            "positions", "Grasp values",
        )  # fmt: skip
        both = np.array([contact_arrays(grasp, None) for grasp in grasps], dtype=np.float64)
        points, units = np.moveaxis(both.reshape(-1, 2, FINGERS, 3), 1, 0)
        return points, units
    points = frozen(given, (None, None, 3), "positions")
    if points.shape[1] < FEWEST:
        raise InputError(f"positions: at least two contacts are needed, got {points.shape[1]}")
    check_spread(np.ptp(points, axis=1))
    return points, frozen_units(normals, points.shape, "normals")


def many_frictions(friction: ArrayLike, shape: tuple[int, int]) -> Array:
    """Return one checked Coulomb coefficient for each of (g, k) contacts.

    Args:
        friction: One coefficient for all contacts, or one each, (k,) or (g, k).
        shape: Number of sets and of contacts in each, (g, k).

    Raises:
        InputError: The shape differs, or a coefficient is negative or too large.
    """
    values = real_array(friction, "friction")
    if values.ndim < len(shape):
        return np.broadcast_to(contact_frictions(values, shape[1]), shape)
    return contact_frictions(frozen(values, shape, "friction").ravel(), values.size).reshape(shape)


def many_frames(normals: Array) -> Array:
    """Orthonormal frames of many sets of normals (g, k, 3), each as by `contact_frames`."""
    x, y, z = np.moveaxis(normals, -1, 0)
    # the axis nearest to square to the normal gives the longest cross product; x wins ties, then y
    nothing, least = np.zeros_like(x), np.abs(normals).min(axis=-1)
    crossed = np.stack([-y, x, nothing], axis=-1)
    crossed[np.abs(y) == least] = np.stack([z, nothing, -x], axis=-1)[np.abs(y) == least]
    crossed[np.abs(x) == least] = np.stack([nothing, -z, y], axis=-1)[np.abs(x) == least]
    first = crossed / np.linalg.norm(crossed, axis=-1, keepdims=True)
    frames = np.empty((*normals.shape, 3))
    frames[..., 0], frames[..., 1], frames[..., 2] = normals, first, np.cross(normals, first)
    return frames


def unit_sizes(points: Array) -> tuple[Array, Array, Array]:
    """Arms, centres (g, 3) and lengths (g,) of many sets of points (g, k, 3), as by `unit_size`."""
    centers = points.mean(axis=1)
    arms = points - centers[:, None]
    sizes = np.linalg.norm(arms, axis=2).max(axis=1)
    sizes[sizes == 0.0] = 1.0
    return arms / sizes[:, None, None], centers, sizes


def contacts_sha256(contacts: Iterable[Contact]) -> str:
    """Hash positions and normals in finger order with SHA-256; 0.0 and -0.0 count as equal."""
    # adding zero turns -0.0 into 0.0
    numbers = np.concatenate([part.ravel() for part in stacked(contacts)]) + 0.0
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()
