"""Checks contacts, and builds their frames and the matrices from contact forces to wrenches.

A wrench is (force, torque), (6,), with the torque about a stated centre. A contact force is what
the finger applies to the object, in the object's frame. In this room positions, normals and forces
are (k, 3), a friction is (k,), and many sets of contacts have an axis before these; positions and
lengths are in metres, except for arms and twists at unit size (see `unit_size`).
"""

import hashlib
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, LARGEST_FRICTION, instance, several
from grasp_core.arrays import (
    SMALLEST_SIZE,
    Array,
    cross,
    frozen,
    frozen_each,
    frozen_units,
    real_array,
)
from grasp_core.errors import InputError
from grasp_core.frames import plane_tangents
from grasp_core.messages import shown
from grasp_core.values import FINGERS, Contact, Grasp

LEAST_CONTACTS = 2
WRENCH = 6
LOCAL = 4
"""Number of components of a soft contact's force: three, and a torque about the normal."""


def listed_contacts(given: Iterable[Contact], name: str) -> tuple[Contact, ...]:
    """Return contacts of any origin, if there are enough to balance anything."""
    each = partial(instance, kind=Contact, name=name, remedy="or give a Grasp")
    contacts = several(given, each, name, "Contact values")
    if len(contacts) < LEAST_CONTACTS:
        raise InputError(f"{name}: at least two are needed, got {len(contacts)}")
    return contacts


def stacked(contacts: Iterable[Contact]) -> tuple[Array, Array]:
    """Return the positions and inward normals of contacts."""
    listed = tuple(contacts)
    positions = np.array([contact.position for contact in listed])
    return positions, np.array([contact.normal for contact in listed])


def contact_arrays(
    positions: ArrayLike | Grasp | Iterable[Grasp] | Sequence[Contact], normals: ArrayLike | None,
    *, many: bool = False,
) -> tuple[Array, Array]:  # fmt: skip
    """Return checked positions and normals of one set of contacts, or of many sets."""
    given: Any = positions
    if normals is None and many:
        check = partial(instance, kind=Grasp, name="positions", remedy="or pass normals too")
        listed = [given] if isinstance(given, Grasp) else given
        grasps = several(listed, check, "positions", "Grasp values")
        points = np.array([grasp.positions for grasp in grasps]).reshape(-1, FINGERS, 3)
        return points, np.array([grasp.normals for grasp in grasps]).reshape(-1, FINGERS, 3)
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
    if points.shape[-2] < LEAST_CONTACTS:
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


def check_spread(extents: Array, name: str = "positions") -> None:
    """Refuse contacts whose `extents`, (..., 3), are so small that squares of them vanish."""
    sizes: Array = extents.max(axis=-1)
    tiny = (sizes > 0.0) & (sizes < SMALLEST_SIZE)
    if tiny.any():
        raise InputError(
            f"{name} must spread over at least {SMALLEST_SIZE:g} m, got "
            f"{float(sizes[tiny].min()):.3g}; use other units"
        )


def contact_frictions(friction: ArrayLike, shape: int | tuple[int, int]) -> Array:
    """Return one checked Coulomb coefficient for each contact, of a shape (k,) or (g, k)."""
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


def contact_torsions(torsion_m: ArrayLike, friction: Array) -> Array | None:
    """Return one checked torsional coefficient for each contact; None if no contact has any."""
    mu_t = frozen(frozen_each(torsion_m, len(friction), "torsion_m"), friction.shape, "torsion_m")
    if not mu_t.any():
        return None
    if not 0.0 <= float(mu_t.min()) <= float(mu_t.max()) <= LARGEST:
        raise InputError(
            f"torsion_m must be lengths from 0 to {LARGEST:g} m, got {float(mu_t.min()):.6g} to "
            f"{float(mu_t.max()):.6g}"
        )
    if ((mu_t > 0.0) & (friction == 0.0)).any():
        raise InputError(
            "torsion_m must be zero where friction is: a contact that slides freely turns freely; "
            "give such contacts some friction, or no torsion"
        )
    return mu_t


def torsion_lengths(torsions: Array, friction: Array) -> Array:
    """Return the lengths mu_t / mu that make torques of contacts forces; zero without friction."""
    return torsions / np.where(friction > 0.0, friction, 1.0)


def unit_size(points: Array) -> tuple[Array, Array, Array]:
    """Return arms from the mean contact over the longest, that centre, and that length, or one."""
    centers: Array = points.mean(axis=-2)
    arms = points - centers[..., None, :]
    lengths: Array = np.linalg.norm(arms, axis=-1).max(axis=-1)
    sizes = np.where(lengths > 0.0, lengths, 1.0)
    return arms / sizes[..., None, None], centers, sizes


def to_center(twist: Array, center: Array, size: Array | float) -> Array:
    """Move twists (..., 6) [m/s, rad/s] from the frame's origin to the centre, at unit size."""
    moved = twist[..., :3] + cross(twist[..., 3:], center)
    return np.concatenate([moved, twist[..., 3:] * np.asarray(size)[..., None]], axis=-1)


def to_origin(twist: Array, center: Array, size: Array | float) -> Array:
    """Move twists (..., 6) at unit size from the centre to the frame's origin."""
    turning = twist[..., 3:] / np.asarray(size)[..., None]
    return np.concatenate([twist[..., :3] - cross(turning, center), turning], axis=-1)


def contacts_sha256(contacts: Iterable[Contact]) -> str:
    """Hash positions and normals in finger order with SHA-256; 0.0 and -0.0 count as equal."""
    # adding zero turns -0.0 into 0.0
    numbers = np.concatenate([part.ravel() for part in stacked(contacts)]) + 0.0
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()


def grasp_map(positions: Array, center: Array | None = None) -> Array:
    """Build the matrix that maps stacked contact forces (3k,) to their wrench, (..., 6, 3k)."""
    arms = positions if center is None else positions - center
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    G = np.zeros((*arms.shape[:-2], WRENCH, arms.shape[-2], 3))
    G[..., 0, :, 0] = G[..., 1, :, 1] = G[..., 2, :, 2] = 1.0
    G[..., 3, :, 1], G[..., 3, :, 2] = -z, y
    G[..., 4, :, 0], G[..., 4, :, 2] = z, -x
    G[..., 5, :, 0], G[..., 5, :, 1] = -y, x
    return G.reshape(*arms.shape[:-2], WRENCH, 3 * arms.shape[-2])


def with_torques(G: Array, normals: Array, lengths: Array) -> Array:
    """Add a column to each contact in G, (..., 6, 3k): a torque about the normal, over a length."""
    each = G.reshape(*G.shape[:-1], -1, 3)
    turning = np.zeros((*each.shape[:-1], 1))
    turning[..., 3:, :, 0] = np.swapaxes(lengths[..., None] * normals, -1, -2)
    return np.concatenate([each, turning], axis=-1).reshape(*G.shape[:-1], -1)


def in_frames(G: Array, frames: Array) -> Array:
    """Rewrite a matrix on stacked forces (m, k w) for coordinates in contact frames (k, w, w)."""
    each = G.reshape(len(G), *frames.shape[:2])
    return np.einsum("mki,kij->mkj", each, frames).reshape(G.shape)


def cross_matrix(vector: Array) -> Array:
    """Build the matrix C of a cross product: C @ b is vector x b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def contact_frames(normals: Array) -> Array:
    """Build orthonormal contact frames, columns (normal, tangent, tangent), (..., 3, 3)."""
    rows = normals.reshape(-1, 3).tolist()
    columns = [((x, y, z), *plane_tangents(x, y, z)) for x, y, z in rows]
    return np.array(columns).reshape(*normals.shape, 3).swapaxes(-1, -2)


def normal_and_tangential(forces: Array, normals: Array) -> tuple[Array, Array]:
    """Split forces (..., k, 3) into normal components and tangential lengths."""
    along = np.einsum("...i,...i->...", forces, normals)
    across = forces - along[..., None] * normals
    return along, np.sqrt(np.einsum("...i,...i->...", across, across))
