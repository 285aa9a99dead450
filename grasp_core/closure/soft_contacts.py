"""Describes contacts that also transmit a torque about their normal, and proves their closure.

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

The proofs are those of `proofs` in these coordinates x = (n, a), where every cone is n >= |a|. Let
e_i = n_i - |a_i| be depths, r_i = 1 / mu_i, w the wrench of all x_i, and sigma the sixth singular
value of the matrix of the A_i. A correction of length c = (|w| + rounding) / sigma balances the
forces and takes at most sqrt(2) c from each depth, so

    min_i (e_i - sqrt(2) c) / r_i / (sum n_i + sqrt(k) c)  >  0                         (4)

proves closure and bounds the margin from below. A twist y refutes closure if no support is
positive but for rounding; the largest support M, where it is negative, bounds the margin t:

    t  <=  M / sum_i r_i (M - n_i.v_i).                                                 (5)

For with t r_i <= e_i the shares b_i = n_i - r_i t are at least |a_i|, so that the power of contact
i is at most b_i s_i + r_i t n_i.v_i, and the sum of the powers is zero.

Source: the elliptical limit surface in Howe & Cutkosky, "Practical force-motion models for sliding
manipulation", IJRR 15(6), 1996; MuJoCo's documentation, "Computation", on elliptic friction cones.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen, frozen_each
from grasp_core.closure.contacts import WRENCH, contact_frames, grasp_map, in_frames, unit_size
from grasp_core.closure.proofs import CHECK_SLACK, RANK
from grasp_core.errors import InputError
from grasp_core.kinds import LARGEST

LOCAL = 4
"""Number of local coordinates (2) of a soft contact."""


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


def are_torsions(torsions: Array, friction: Array) -> bool:
    """Return whether some torsional coefficients are above zero, and only where friction is."""
    return bool(torsions.any() and ((friction > 0.0) | (torsions == 0.0)).all())


@dataclass(frozen=True, slots=True, eq=False)
class SoftContacts:
    """Soft contacts at unit size, and the matrices (2) from local coordinates to wrenches."""

    friction: Array
    reach: Array
    """Torsional coefficients mu_t over the contacts' size, (k,)."""
    frames: Array
    """Columns (normal, tangent, tangent) of each contact, (k, 3, 3)."""
    size: float
    """Length that torques are divided by [m]."""
    A: Array
    """The matrices A_i of (2), (k, 6, 4)."""

    @classmethod
    def of(
        cls, positions: Array, normals: Array, friction: Array, torsions: Array
    ) -> "SoftContacts":
        """Set up contacts from checked arrays, with torsions in metres."""
        arms, _, size = unit_size(positions)
        frames, reach = contact_frames(normals), torsions / size
        k = len(arms)
        A = np.zeros((k, WRENCH, LOCAL))
        maps = in_frames(grasp_map(arms), frames).reshape(WRENCH, k, 3)
        A[:, :, :3] = maps.transpose(1, 0, 2)
        A[:, :, 1:3] *= friction[:, None, None]
        A[:, 3:, 3] = reach[:, None] * frames[:, :, 0]
        return cls(friction, reach, frames, float(size), A)

    def at_friction(self, friction: float) -> "SoftContacts":
        """Return the same contacts with another Coulomb coefficient and the same torsion."""
        A, mu = self.A.copy(), np.full(len(self.friction), friction)
        A[:, :, 1:3] *= (mu / self.friction)[:, None, None]
        return SoftContacts(mu, self.reach, self.frames, self.size, A)

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
        """Return local coordinates, (k, 4), of what contacts can transmit of forces and torques."""
        parts = np.einsum("kij,ki->kj", self.frames, forces)
        turning = torques / self.size
        spread = np.column_stack([np.ones_like(self.friction), *[self.friction] * 2, self.reach])
        every = np.column_stack([parts, turning])
        return np.divide(every, spread, out=np.zeros_like(every), where=spread > 0.0)

    def missed(self, forces: Array, torques: Array) -> float:
        """Compute by how much forces and torques miss balance and what contacts can transmit."""
        local = self.local(forces, torques)
        kept, turned = self.in_space(local)
        parts = (forces - kept, (torques - turned) / self.size, self.matrix @ local.ravel())
        return max(float(np.abs(part).max()) for part in parts)


def supports(slopes: Array) -> Array:
    """Compute the supports s_i of the cones, from powers of local coordinates (k, 4), (k,)."""
    return slopes[:, 0] + np.linalg.norm(slopes[:, 1:], axis=1)


def depths(local: Array) -> Array:
    """Compute the depths e_i of local coordinates (k, 4) in their cones, (k,)."""
    return local[:, 0] - np.linalg.norm(local[:, 1:], axis=1)


def proved_margin(contacts: SoftContacts, local: Array, caution: float = 1.0) -> float:
    """Compute the margin (4) that local coordinates (k, 4) prove; minus infinity if none."""
    matrix = contacts.matrix
    if not (np.isfinite(matrix).all() and np.isfinite(local).all()) or matrix.shape[1] < WRENCH:
        return -math.inf
    least = float(np.linalg.svd(matrix, compute_uv=False)[WRENCH - 1])
    if least <= RANK:
        return -math.inf
    rounding = CHECK_SLACK * max(1.0, float(contacts.reach.max()))
    imbalance = float(np.linalg.norm(matrix @ local.ravel()))
    # c of (4); its normal parts sum to at most sqrt(k) c
    corrected = caution * (imbalance + rounding) / least
    pushes = float(local[:, 0].sum()) + math.sqrt(len(local)) * corrected
    left = float(((depths(local) - math.sqrt(2.0) * corrected) / contacts.shares).min())
    return left / pushes if pushes > 0.0 else -math.inf


def margin_ceiling(contacts: SoftContacts, twist: Array, caution: float = 1.0) -> float:
    """Bound the margin of closure from above by (5), as `proofs.margin_ceiling` does by (3)."""
    length = float(np.linalg.norm(twist))
    if not 0.0 < length < math.inf:
        return math.inf
    slopes = contacts.slopes(twist)
    each = supports(slopes)
    if not (each / contacts.longest).max() <= CHECK_SLACK * length:
        return math.inf
    rounding = caution * CHECK_SLACK * length * contacts.longest
    largest = float((each + rounding).max())
    if largest >= 0.0:
        return 0.0
    return largest / float((contacts.shares * (largest - slopes[:, 0] + rounding)).sum())
