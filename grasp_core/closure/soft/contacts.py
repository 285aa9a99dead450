"""Describes soft contacts: point contacts that also transmit a torque about their normal.

With the coefficients mu of sliding and mu_t of torsion, a length, the normal part n, the tangential
part t and the torque m about the normal stay in the cone

    (|t| / mu)^2 + (m / mu_t)^2  <=  n^2,   n >= 0,                                     (1)

the ellipsoid of MuJoCo's elliptic cones of dimension 4. In the local coordinates

    x = (n, t / mu, m / mu_t),    wrench = A_i x,                                       (2)

every cone is the same Lorentz cone x_0 >= |(x_1, x_2, x_3)|, and the support of cone i, cut at unit
normal force, along a twist y with the contact velocity v and the turning w about the normal is

    s_i(y) = n.v + sqrt(mu^2 |tangential part of v|^2 + mu_t^2 w^2)
           = (A_i'y)_0 + |(A_i'y)_1..3|.                                                (3)

Contacts without torsion, or without friction, have columns of zeros.

Source: the elliptical limit surface in Howe & Cutkosky, "Practical force-motion models for sliding
manipulation", IJRR 15(6), 1996; MuJoCo's documentation, "Computation", on elliptic friction cones.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, cross, frozen, frozen_each, is_array
from grasp_core.checked import LARGEST
from grasp_core.closure.contact_arrays import unit_size
from grasp_core.closure.wrenches import WRENCH, contact_frames, grasp_map, in_frames
from grasp_core.errors import InputError

LOCAL = 4
"""Number of local coordinates (2) of a soft contact."""


def contact_torsions(torsion_m: ArrayLike, friction: Array) -> Array | None:
    """Return one checked torsional coefficient for each contact; None if no contact has any.

    Takes `torsion_m` (k,) [m]; `friction` (k,).
    """
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
    """Return the lengths mu_t / mu that make torques of contacts comparable with forces, (k,) [m].

    They are zero without friction, where there is no torsion either.
    """
    return torsions / np.where(friction > 0.0, friction, 1.0)


def are_torsions(value: Any, friction: Array) -> bool:
    """Return whether a value holds a torsional coefficient for each contact, some above zero."""
    if not is_array(value, len(friction)):
        return False
    fits = bool(((value >= 0.0) & (value <= LARGEST) & ((friction > 0.0) | (value == 0.0))).all())
    return fits and bool(value.any())


@dataclass(frozen=True, slots=True, eq=False)
class SoftContacts:
    """Soft contacts at unit size, and the matrices (2) from local coordinates to wrenches."""

    friction: Array
    """Coulomb coefficients mu, (k,)."""
    reach: Array
    """Torsional coefficients mu_t over the contacts' size, (k,)."""
    frames: Array
    """Columns (normal, tangent, tangent) of each contact, (k, 3, 3)."""
    center: Array
    """Mean of the contacts, (3,) [m]."""
    size: float
    """Length that torques are divided by [m]."""
    A: Array
    """The matrices A_i of (2), (k, 6, 4)."""

    @classmethod
    def of(
        cls, positions: Array, normals: Array, friction: Array, torsions: Array
    ) -> "SoftContacts":
        """Set up contacts from checked arrays.

        Takes `positions` (k, 3) [m]; `normals` (k, 3); `friction` (k,); `torsions` (k,) [m].
        """
        arms, center, size = unit_size(positions)
        frames, reach = contact_frames(normals), torsions / size
        k = len(arms)
        A = np.zeros((k, WRENCH, LOCAL))
        maps = in_frames(grasp_map(arms), frames).reshape(WRENCH, k, 3)
        A[:, :, :3] = maps.transpose(1, 0, 2)
        A[:, :, 1:3] *= friction[:, None, None]
        A[:, 3:, 3] = reach[:, None] * frames[:, :, 0]
        return cls(friction, reach, frames, center, float(size), A)

    def at_friction(self, friction: float) -> "SoftContacts":
        """Return the same contacts with another Coulomb coefficient and the same torsion."""
        A, mu = self.A.copy(), np.full(len(self.friction), friction)
        A[:, :, 1:3] *= (mu / self.friction)[:, None, None]
        return SoftContacts(mu, self.reach, self.frames, self.center, self.size, A)

    @property
    def matrix(self) -> Array:
        """Return the matrices (2) side by side, (6, 4k)."""
        return self.A.transpose(1, 0, 2).reshape(WRENCH, -1)

    @property
    def longest(self) -> Array:
        """Return the length of the longest force and torque of unit normal part, (k,)."""
        return np.sqrt(1.0 + self.friction**2 + self.reach**2)

    @property
    def shares(self) -> Array:
        """Return 1 / mu, by which depths in the cones are weighted; 1 without friction, (k,)."""
        return 1.0 / np.where(self.friction == 0.0, 1.0, self.friction)

    def slopes(self, twist: Array) -> Array:
        """Compute the powers A_i'y of the local coordinates on a twist at unit size, (k, 4)."""
        return np.einsum("kwj,w->kj", self.A, twist)

    def in_space(self, local: Array) -> tuple[Array, Array]:
        """Return forces (k, 3) and torques about the normals (k,), in units of force and metres."""
        scaled = local[:, :3] * np.column_stack([np.ones_like(self.friction), *[self.friction] * 2])
        forces = np.einsum("kij,kj->ki", self.frames, scaled)
        return forces, local[:, 3] * self.reach * self.size

    def local(self, forces: Array, torques: Array) -> Array:
        """Return the local coordinates (k, 4) of forces (k, 3) and torques about normals (k,).

        What a contact cannot transmit is left out.
        """
        parts = np.einsum("kij,ki->kj", self.frames, forces)
        turning = torques / self.size
        spread = np.column_stack([np.ones_like(self.friction), *[self.friction] * 2, self.reach])
        every = np.column_stack([parts, turning])
        return np.divide(every, spread, out=np.zeros_like(every), where=spread > 0.0)

    def missed(self, forces: Array, torques: Array) -> float:
        """Compute by how much forces and torques miss balance, or what contacts can transmit.

        Gives the largest component of a wrench at unit size, or of a part that friction or torsion
        of zero does not allow.
        """
        local = self.local(forces, torques)
        kept, turned = self.in_space(local)
        parts = (forces - kept, (torques - turned) / self.size, self.matrix @ local.ravel())
        return max(float(np.abs(part).max()) for part in parts)

    def at_unit_size(self, wrench: Array) -> Array:
        """Move a twist (6,) [m/s, rad/s] from the frame's origin to the mean contact, scaled."""
        turned = cross(wrench[3:], self.center)
        return np.concatenate([wrench[:3] + turned, wrench[3:] * self.size])

    def about_origin(self, twist: Array) -> Array:
        """Move a twist at unit size from the mean contact to the frame's origin, (6,)."""
        turning = twist[3:] / self.size
        return np.concatenate([twist[:3] - cross(turning, self.center), turning])
