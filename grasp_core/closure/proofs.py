"""Proves force closure by contact forces, and its opposite by twists, of hard and soft contacts.

Contacts are given at unit size: arms from their mean point, the longest of length one. A hard
contact transmits a force f in R^3 with the normal n. A soft one also transmits a torque m about its
normal. With the coefficients mu of sliding and mu_t of torsion, a length, they stay in the cone

    |f_t|^2 + (m mu / mu_t)^2  <=  (mu n.f)^2,   n.f >= 0,                              (1)

the ellipsoid of MuJoCo's elliptic cones of dimension 4. So a soft contact is a hard one in one
dimension more: its force is (f, u) with u = m mu / mu_t, its normal (n, 0), and u is a torque over
the length mu_t / mu. A contact without torsion has length zero, and without friction only the
normal part of its force acts. A matrix maps the forces of all contacts to their wrench.

The program and the supports s_i are those of `force_closure`. Let d_i be the depth mu_i n_i.f_i -
|tangential part of f_i| of force i in its cone, or n_i.f_i without friction, w the wrench of all
forces, and sigma the sixth singular value of the matrix of wrenches that contacts can apply, with
tangential parts in units of e_i: of one, or of mu_i for soft contacts, whose torques are over mu_t
then and have columns of order one. A correction of length c = (|w| + rounding) / sigma balances the
forces, and takes no more than sqrt(e_i^2 + mu_i^2) c from d_i, or c without friction. So forces
prove closure, and the left side bounds the margin from below, if

    min_i (d_i - sqrt(e_i^2 + mu_i^2) c) / (sum n_i.f_i + sqrt(k) c)  >  0,             (2)

and a twist y refutes closure if no support is positive but for rounding:

    s_i(y) <= rounding sqrt(1 + mu_i^2 + mu_ti^2) |y|  for all i.                       (3)

With the velocities v_i, M the largest support, and r_i = 1 / mu_i, or 1 without friction, a
negative M bounds the margin t from above:

    t  <=  M / sum_i r_i (M - n_i.v_i).                                                 (4)

For in forces with t + |tangential part of f_i| <= mu_i n_i.f_i the shares b_i = n_i.f_i - r_i t are
not negative, and their power, which is zero, is at most M sum_i b_i + t sum_i r_i n_i.v_i.

Source: the elliptical limit surface in Howe & Cutkosky, "Practical force-motion models for sliding
manipulation", IJRR 15(6), 1996; MuJoCo's documentation, "Computation", on elliptic friction cones.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.closure.contacts import (
    WRENCH,
    contact_frames,
    grasp_map,
    normal_and_tangential,
    torsion_lengths,
    with_torques,
)

CHECK_SLACK = 1e-12
"""Slack of the plain-arithmetic checks, for data scaled to unit size: some thousand
rounding errors."""
LEAST_DIVISOR = float(np.finfo(np.float64).tiny)
"""Least number that is divided by: the smallest of full precision."""
GIANT = 1e100
"""Largest number accepted from a compiled search, which may end with larger ones or NaN where
contacts are degenerate."""
RANK = 1e-9
"""Smallest singular value of the unit-size grasp map that counts as full rank."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactCones:
    """Friction cones of contacts at unit size, in three dimensions or, of soft contacts, in four.

    Any number of leading axes stands for many sets of contacts.
    """

    arms: Array
    """Contact points, (..., k, 3)."""
    inward: Array
    """Inward unit normals, (..., k, 3)."""
    friction: Array
    """Coulomb coefficients, (..., k) or (..., 1)."""
    torsion: Array | None
    """Torsional coefficients mu_t over the contacts' size, (..., k); None of hard contacts."""
    maps: Array
    """Matrices from the contacts' forces side by side to their wrench, (..., 6, k w)."""
    normals: Array
    """Unit normals in w dimensions, (..., k, w)."""

    @classmethod
    def at(
        cls, arms: Array, normals: Array, friction: Array, torsion: Array | None = None
    ) -> "ContactCones":
        """Set up the cones of contacts."""
        if torsion is None:
            return cls(arms, normals, friction, None, grasp_map(arms), normals)
        maps = with_torques(grasp_map(arms), normals, torsion_lengths(torsion, friction))
        widened = np.concatenate([normals, np.zeros((*normals.shape[:-1], 1))], axis=-1)
        return cls(arms, normals, friction, torsion, maps, widened)

    def at_friction(self, friction: float) -> "ContactCones":
        """Return the same contacts with one Coulomb coefficient for all, and the same torsion."""
        alike = np.full(self.arms.shape[:-1], friction)
        return ContactCones.at(self.arms, self.inward, alike, self.torsion)

    def only(self, chosen: "Indices | NDArray[np.bool_]") -> "ContactCones":
        """Return some contacts of one set."""
        torsion = None if self.torsion is None else self.torsion[chosen]
        given = (self.arms[chosen], self.inward[chosen], self.friction[chosen])
        return ContactCones.at(*given, torsion)

    @property
    def width(self) -> int:
        """Return the number w of dimensions: three, or four with torsion."""
        return self.normals.shape[-1]

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Return which components (normal, tangents, torque) can act, (k, w), of one set."""
        able = np.repeat(self.friction[:, None] > 0.0, self.width, axis=1)
        able[:, 0] = True
        if self.torsion is not None:
            able[:, 3] = self.torsion > 0.0
        return able

    @property
    def frames(self) -> Array:
        """Return orthonormal columns (normal, tangent, tangent, torque) of one set, (k, w, w)."""
        frames = np.zeros((*self.normals.shape, self.width))
        frames[:, 3:, 3:] = 1.0
        frames[:, :3, :3] = contact_frames(self.inward)
        return frames

    @property
    def units(self) -> Array:
        """Return the units e_i of tangential parts, zero without friction, (..., k) or (..., 1)."""
        return np.where(self.friction > 0.0, 1.0, 0.0) if self.torsion is None else self.friction

    @property
    def generators(self) -> Array:
        """Return matrices that span all wrenches that can be applied, (..., 6, k w)."""
        units = self.units[..., None, None]
        if (units == 1.0).all():
            return self.maps
        along = self.normals[..., :, None] * self.normals[..., None, :]
        acting = along + units * (np.eye(self.width) - along)
        blocks = self.maps.reshape(*self.maps.shape[:-1], *self.normals.shape[-2:])
        return np.einsum("...wki,...kij->...wkj", blocks, acting).reshape(self.maps.shape)

    @property
    def longest(self) -> Array:
        """Return the length of the longest force and torque of unit normal part, (..., k)."""
        turning = 0.0 if self.torsion is None else self.torsion**2
        return np.sqrt(1.0 + self.friction**2 + turning)

    def velocities(self, twist: Array) -> Array:
        """Compute the velocities, (..., k, w), on which the forces have their power."""
        moved = np.einsum("...wj,...w->...j", self.maps, twist)
        return moved.reshape(*moved.shape[:-1], *self.normals.shape[-2:])

    def wrench(self, forces: Array) -> Array:
        """Compute the wrench of all forces (..., k, w), (..., 6)."""
        stacked = forces.reshape(*forces.shape[:-2], self.maps.shape[-1])
        return np.einsum("...wj,...j->...w", self.maps, stacked)

    def supports(self, twist: Array) -> Array:
        """Compute the support s_i(y) of each friction cone, cut at unit normal force, (..., k)."""
        along, across = normal_and_tangential(self.velocities(twist), self.normals)
        return along + self.friction * across

    def depths(self, forces: Array) -> Array:
        """Compute the depth d_i of each force in its cone, (..., k)."""
        along, across = normal_and_tangential(forces, self.normals)
        return np.where(self.friction == 0.0, along, self.friction * along - across)


def proves_closure(cones: ContactCones, forces: Array) -> NDArray[np.bool_]:
    """Return whether forces, by (2), prove closure: they stay in the cones once balanced."""
    return np.asarray(proved_margin(cones, without_giants(forces, 2)) > 0.0)


def refutes_closure(cones: ContactCones, twist: Array) -> NDArray[np.bool_]:
    """Return whether, by (3), no contact force in its cone has positive power on a twist."""
    return np.asarray(margin_ceiling(cones, without_giants(twist, 1)) <= 0.0)


def proved_margin(cones: ContactCones, forces: Array, caution: float = 1.0) -> Array:
    """Compute the margins (2) that forces prove, (...); minus infinity where they prove none."""
    along, across = normal_and_tangential(forces, cones.normals)
    generators = cones.generators
    if generators.shape[-1] < WRENCH or not np.isfinite(generators).all():
        return np.full(along.shape[:-1], -math.inf)
    # without friction only the normal parts act, so only they have to balance
    flat = cones.friction == 0.0
    wrenches = cones.wrench(np.where(flat[..., None], along[..., None] * cones.normals, forces))
    least = np.linalg.svd(generators, compute_uv=False)[..., WRENCH - 1]
    full = least > RANK
    rounding = CHECK_SLACK
    if cones.torsion is not None:
        rounding = CHECK_SLACK * np.maximum(cones.torsion.max(axis=-1), 1.0)
    # c of (2); its normal parts sum to at most sqrt(k) c
    imbalance = np.linalg.norm(wrenches, axis=-1)
    corrected = caution * (imbalance + rounding) / np.where(full, least, 1.0)
    pushes = along.sum(axis=-1) + math.sqrt(along.shape[-1]) * corrected
    lost = np.where(flat, 1.0, np.sqrt(cones.units**2 + cones.friction**2)) * corrected[..., None]
    left = (np.where(flat, along, cones.friction * along - across) - lost).min(axis=-1)
    usable = full & (pushes > 0.0)
    return np.where(usable, left / np.where(usable, pushes, 1.0), -math.inf)


def margin_ceiling(cones: ContactCones, twist: Array, caution: float = 1.0) -> Array:
    """Bound margins of closure from above by (4), with twists (..., 6) that separate the contacts.

    A bound is negative; zero where M is zero to within rounding; infinity where M is more, and the
    twist proves nothing.
    """
    along, across = normal_and_tangential(cones.velocities(twist), cones.normals)
    supports = along + cones.friction * across
    lengths: Array = np.linalg.norm(twist, axis=-1)
    rounding = CHECK_SLACK * lengths[..., None] * cones.longest
    refuted = (lengths > 0.0) & (lengths < math.inf) & (supports <= rounding).all(axis=-1)
    # M of (4), which rounding may raise
    largest = (supports + caution * rounding).max(axis=-1)
    below = largest < 0.0
    # r_i of (4); each term of the sum is raised by rounding, so that the bound is no less
    flat = cones.friction == 0.0
    shares = np.where(flat, 1.0, 1.0 / np.maximum(cones.friction, LEAST_DIVISOR))
    sums = (shares * (largest[..., None] - along + caution * rounding)).sum(axis=-1)
    return np.where(refuted, np.where(below, largest / np.where(below, sums, 1.0), 0.0), math.inf)


def without_giants(vectors: Array, axes: int) -> Array:
    """Replace sets that contain huge numbers or NaN by zeros, which prove nothing."""
    last = tuple(range(-axes, 0))
    sizes = np.max(np.abs(vectors), axis=last, keepdims=True, initial=0.0)
    return np.where(sizes < GIANT, vectors, 0.0)
