"""Finds all contact forces that balance external wrenches: smallest forces plus a null space.

With the map G from forces to their wrench and the external wrenches w_i, the forces

    f = F0_i + N z   with   F0_i = -inv(G) w_i,  G N = 0                                      (1)

balance w_i for every z, inv(G) being the pseudo-inverse; none that balance are smaller than F0_i.
Limits and friction pyramids are inequalities on z:

    R f <= 0,   l <= f_n <= u.                                                                (2)

Forces are local, (normal, tangent, tangent) for each contact, in units of the largest normal
force; lengths are in units of the longest arm. What does not depend on the wrench is computed
once for all wrenches.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frames, grasp_map, in_frames
from grasp_core.cones.pyramids import PYRAMID_SIDES, facet_turns, inscribed_share

FORCE_RESIDUAL = 1e-6
"""Largest imbalance and cone violation accepted, in units of the largest normal force: a
hundred times the accuracy asked of ProxQP."""

CLEARLY = 1.01
"""Factor by which a wrench must exceed all forces, so that rounding and `FORCE_RESIDUAL` do not
matter."""
NO_FORCE = 1e-100
"""Smallest normal force that is divided by: a contact may have no force."""


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Wrenches on one set of contacts, and the forces F0[i] + null @ z that balance them."""

    frames: Array
    """Columns (normal, tangent, tangent) of each contact, (k, 3, 3)."""
    G: Array
    """Matrix from stacked local forces to their wrench, (6, 3k)."""
    inverse: Array
    """Pseudo-inverse of G, (3k, 6)."""
    null: Array
    """Orthonormal basis of the forces whose wrench is zero, as columns, (3k, v)."""
    scales: Array
    """Unit of force for each wrench, (n,) [N]."""
    W: Array
    """External wrenches, (n, 6), in units of `scales` and of the longest arm."""
    F0: Array
    """Balancing forces of least norm, which may break limits and leave cones, (n, 3k)."""
    least: Array
    """Least normal force allowed at any contact, (n,)."""
    largest: Array
    """Largest normal force allowed at any contact, (n,)."""

    @classmethod
    def of(
        cls, arms: Array, normals: Array, wrenches: Array, normal_force: tuple[float, float], *,
        by_load: bool,
    ) -> "Balance":  # fmt: skip
        """Scale contacts and external wrenches to unit size.

        Takes `arms` (k, 3) [m]; `normals` (k, 3); `wrenches` (force, torque) or (n, 6) [N, N m];
        `normal_force` [N].
        """
        least, largest = normal_force
        size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
        scales = np.full(len(wrenches), largest)
        # the unit of force, the load or the limit, keeps all numbers of order one
        if by_load or not math.isfinite(largest):
            loads = np.linalg.norm(wrenches / np.repeat([1.0, size], 3), axis=1)
            scales = np.minimum(np.maximum(loads, least), largest)
            scales[scales == 0.0] = 1.0
        W = wrenches / scales[:, None]
        W[:, 3:] /= size
        frames = contact_frames(normals)
        G = in_frames(grasp_map(arms / size), frames)
        inverse, null = _inverse_and_null_space(G)
        limits = least / scales, largest / scales
        return cls(frames, G, inverse, null, scales, W, -W @ inverse.T, *limits)

    def one(self, i: int) -> "Balance":
        """Return the balance of the i-th wrench alone, the same bits as if made from it alone."""
        W = self.W[[i]]
        return replace(
            self, scales=self.scales[[i]], W=W, F0=-W @ self.inverse.T,
            least=self.least[[i]], largest=self.largest[[i]],
        )  # fmt: skip

    def beyond(self, friction: Array) -> NDArray[np.bool_]:
        """Return which wrenches exceed all forces within limits and cones, (n,).

        No arm is longer than one, so this bounds forces and torques alike. Wrenches far beyond that
        would keep solvers busy for seconds.

        Takes `friction` (k,).
        """
        # force and torque separately, in units of the longest arm
        sizes = np.linalg.norm(self.W.reshape(-1, 2, 3), axis=2).max(axis=1)
        most = CLEARLY * np.sqrt(1.0 + friction**2).sum()
        return sizes > most * self.largest

    def pyramids(self, friction: Array) -> Array:
        """Return rows R with R @ f <= 0 in pyramids inside the friction cones, (16 k, 3 k).

        Takes `friction` (k,).
        """
        count, each = len(friction), np.arange(len(friction))
        rows = np.zeros((count, PYRAMID_SIDES, count, 3))
        rows[each, :, each, 0] = -friction[:, None] * inscribed_share()
        rows[each, :, each, 1:] = facet_turns(PYRAMID_SIDES)
        return rows.reshape(count * PYRAMID_SIDES, 3 * count)

    def polyhedra(self, rows: Array) -> tuple[Array, Array]:
        """Rewrite (2) for f = F0[i] + null @ z as inequalities C @ z <= D[i]."""
        along, normal_parts = self.null[0::3], self.F0[:, 0::3]
        # (2) with the forces (1) put in: what multiplies z goes left, the rest right
        C, D = [rows @ self.null, -along], [-self.F0 @ rows.T, normal_parts - self.least[:, None]]
        if np.isfinite(self.largest).all():
            C.append(along)
            D.append(self.largest[:, None] - normal_parts)
        return np.vstack(C), np.hstack(D)

    def checked(self, F: Array, residual: float = FORCE_RESIDUAL) -> Array:
        """Make forces (n, 3k) balance to rounding; NaN where they then break a limit."""
        # the least change that balances f is the pseudo-inverse of what is left
        exact = F - (F @ self.G.T + self.W) @ self.inverse.T
        along = exact[:, 0::3]
        wrong = np.abs(exact @ self.G.T + self.W).max(axis=1)
        wrong = np.maximum(wrong, self.least - along.min(axis=1))
        wrong = np.maximum(wrong, along.max(axis=1) - self.largest)
        exact[~(wrong <= residual)] = np.nan
        return exact

    def into_cones(self, F: Array, friction: float) -> Array:
        """Move forces (n, 3k) slightly so that they meet limits and friction cones exactly."""
        # normal parts are brought into the limits first, since they say how far slides may reach
        along = np.clip(F[:, 0::3], self.least[:, None], self.largest[:, None])
        across = np.hypot(F[:, 1::3], F[:, 2::3])
        shrink = np.minimum(1.0, friction * along / np.maximum(across, NO_FORCE))
        parts = along, shrink * F[:, 1::3], shrink * F[:, 2::3]
        return np.stack(parts, axis=2).reshape(F.shape)

    def in_space(self, F: Array) -> Array:
        """Turn local forces into forces in the object's frame, (n, k, 3) [N]."""
        local = F.reshape(len(F), len(self.frames), 3)
        forces = np.einsum("kij,nkj->nki", self.frames, local)
        return self.scales[:, None, None] * np.asarray(forces, dtype=np.float64)


def needed_friction(F: Array, friction: Array) -> Array:
    """Return the largest share of its friction that any contact needs, (n,).

    Takes `F` (n, 3k); `friction` (k,).
    """
    along, across = F[:, 0::3], np.hypot(F[:, 1::3], F[:, 2::3])
    shares = across / np.maximum(friction * along, NO_FORCE)
    return np.where(across <= FORCE_RESIDUAL, 0.0, shares).max(axis=1)


def _inverse_and_null_space(G: Array) -> tuple[Array, Array]:
    U, sizes, Vt = np.linalg.svd(G)
    rank = int(np.count_nonzero(sizes > max(G.shape) * np.finfo(np.float64).eps * sizes[0]))
    return (Vt[:rank].T / sizes[:rank]) @ U[:, :rank].T, Vt[rank:].T
