"""Proves force closure by contact forces, and its opposite by twists.

Contacts are given at unit size: arms from their mean point, the longest of length one. Arms,
normals and forces are (..., k, 3), twists (..., 6), frictions (..., k) or (..., 1). The program
and the supports s_i are those of `force_closure`. Let d_i be the depth mu_i n_i.f_i - |tangential
part of f_i| of force i in its cone, or n_i.f_i without friction, w the wrench of all forces, and
sigma the sixth singular value of the matrix of wrenches that contacts can apply. A correction of
length c = (|w| + rounding) / sigma balances the forces, and takes no more than sqrt(1 + mu_i^2) c
from d_i. So forces prove closure, and the left side bounds the margin from below, if

    min_i (d_i - sqrt(1 + mu_i^2) c) / (sum n_i.f_i + sqrt(k) c)  >  0,                       (1)

and a twist y refutes closure if no support is positive but for rounding:

    s_i(y) <= rounding sqrt(1 + mu_i^2) |y|  for all i.                                       (2)

With the velocities v_i, M the largest support, and r_i = 1 / mu_i, or 1 without friction, a
negative M bounds the margin t from above:

    t  <=  M / sum_i r_i (M - n_i.v_i).                                                       (3)

For in forces with t + |tangential part of f_i| <= mu_i n_i.f_i the shares b_i = n_i.f_i - r_i t are
not negative, and their power, which is zero, is at most M sum_i b_i + t sum_i r_i n_i.v_i.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, cross
from grasp_core.closure.contacts import (
    WRENCH,
    contact_frames,
    grasp_map,
    in_frames,
    normal_and_tangential,
)

CHECK_SLACK = 1e-12
"""Slack of the plain-arithmetic checks, for data scaled to unit size: some thousand
rounding errors."""
SMALLEST_NORMAL = float(np.finfo(np.float64).tiny)
"""Least number that is divided by: the smallest of full precision."""
GIANT = 1e100
"""Largest number accepted from a compiled search, which may end with larger ones or NaN where
contacts are degenerate."""
RANK = 1e-9
"""Smallest singular value of the unit-size grasp map that counts as full rank."""


def supports(twist: Array, arms: Array, normals: Array, friction: Array) -> Array:
    """Compute the support s_i(y) of each friction cone, cut at unit normal force, (..., k)."""
    velocities = twist[..., None, :3] + cross(twist[..., None, 3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    return along + friction * across


def allowed(friction: Array) -> NDArray[np.bool_]:
    """Return which components (normal, tangent, tangent) of forces may be non-zero, (3k,)."""
    sliding = friction > 0.0
    return np.column_stack([np.ones_like(sliding), sliding, sliding]).ravel()


def generators_of(arms: Array, normals: Array, friction: Array) -> Array:
    """Return wrenches that span all that contacts can apply: three each, one without friction."""
    G = grasp_map(arms)
    if (friction > 0.0).all():
        return G
    return in_frames(G, contact_frames(normals))[:, allowed(friction)]


def refutes_closure(
    twist: Array, arms: Array, normals: Array, friction: Array
) -> NDArray[np.bool_]:
    """Return whether, by (2), no contact force in its cone has positive power on a twist."""
    twist = without_giants(twist, 1)
    length: Array = np.linalg.norm(twist, axis=-1)
    # over the length of the longest force with unit normal part, which rounding is relative to
    excess: Array = supports(twist, arms, normals, friction) / np.sqrt(1.0 + friction**2)
    return (length > 0.0) & (excess.max(axis=-1) <= CHECK_SLACK * length)


def proves_closure(
    forces: Array, arms: Array, normals: Array, friction: Array
) -> NDArray[np.bool_]:
    """Return whether forces, by (1), prove closure: they stay in the cones once balanced."""
    forces, maps = without_giants(forces, 2), grasp_map(arms)
    flat = np.broadcast_to(friction == 0.0, forces.shape[:-1])[..., None]
    if flat.any():
        # without friction only the normal parts act, so only they count
        along, _ = normal_and_tangential(forces, normals)
        pushing = np.where(
            flat[..., None], normals[..., :, None] * normals[..., None, :], np.eye(3)
        )
        blocks = maps.reshape(*maps.shape[:-1], -1, 3)
        maps = np.einsum("...wki,...kij->...wkj", blocks, pushing).reshape(maps.shape)
        forces = np.where(flat, along[..., None] * normals, forces)
    stacked = forces.reshape(*maps.shape[:-2], maps.shape[-1])
    imbalance = np.linalg.norm(np.einsum("...wj,...j->...w", maps, stacked), axis=-1)
    least = np.linalg.svd(maps, compute_uv=False)[..., WRENCH - 1]
    # c of (1)
    corrected = (imbalance + CHECK_SLACK) / np.maximum(least, RANK)
    depths = depths_in_cones(forces, normals, friction)
    left = depths - np.sqrt(1.0 + friction**2) * corrected[..., None]
    proved: NDArray[np.bool_] = (least > RANK) & (left > 0.0).all(axis=-1)
    return proved


def proved_margin(
    forces: Array, arms: Array, normals: Array, friction: Array, caution: float = 1.0
) -> Array:
    """Compute the margins (1) that forces prove, (...); minus infinity where they prove none.

    They bound the optimum of the margin program from below: the forces' depth, less the cost of
    balancing them. Many sets at once must all have friction.
    """
    along, _ = normal_and_tangential(forces, normals)
    depths = depths_in_cones(forces, normals, friction)
    # without friction only the normal parts act, so only they have to balance
    balanced = np.where(friction[..., None] == 0.0, along[..., None] * normals, forces)
    maps, generators = grasp_map(arms), generators_of(arms, normals, friction)
    if generators.shape[-1] < WRENCH or not np.isfinite(generators).all():
        return np.full(along.shape[:-1], -math.inf)
    stacked = balanced.reshape(*maps.shape[:-2], maps.shape[-1])
    # many are summed one by one, and one alone by BLAS: margins keep the last digits of either
    wrenches = maps @ stacked if stacked.ndim == 1 else np.einsum("gwj,gj->gw", maps, stacked)
    least = np.linalg.svd(generators, compute_uv=False)[..., WRENCH - 1]
    full = least > RANK
    # c of (1); its normal parts sum to at most sqrt(k) c
    imbalance = np.linalg.norm(wrenches, axis=-1)
    corrected = caution * (imbalance + CHECK_SLACK) / np.where(full, least, 1.0)
    pushes = along.sum(axis=-1) + math.sqrt(arms.shape[-2]) * corrected
    left = (depths - np.sqrt(1.0 + friction**2) * corrected[..., None]).min(axis=-1)
    usable = full & (pushes > 0.0)
    return np.where(usable, left / np.where(usable, pushes, 1.0), -math.inf)


def margin_ceiling(
    twist: Array, arms: Array, normals: Array, friction: Array, caution: float = 1.0
) -> Array:
    """Bound margins of closure from above by (3), with twists (..., 6) that separate the contacts.

    A bound is negative; zero where M is zero to within rounding; infinity where M is more, and the
    twist proves nothing.
    """
    velocities = twist[..., None, :3] + cross(twist[..., None, 3:], arms)
    along, _ = normal_and_tangential(velocities, normals)
    sizes = np.linalg.norm(twist, axis=-1)[..., None]
    rounding = caution * CHECK_SLACK * sizes * np.sqrt(1.0 + friction**2)
    # M of (3), which rounding may raise
    largest = (supports(twist, arms, normals, friction) + rounding).max(axis=-1)
    below = largest < 0.0
    # r_i of (3); each term of the sum is raised by rounding, so that the bound is no less
    shares = np.where(friction == 0.0, 1.0, 1.0 / np.maximum(friction, SMALLEST_NORMAL))
    sums = (shares * (largest[..., None] - along + rounding)).sum(axis=-1)
    bounds = np.where(below, largest / np.where(below, sums, 1.0), 0.0)
    return np.where(refutes_closure(twist, arms, normals, friction), bounds, math.inf)


def without_giants(vectors: Array, axes: int) -> Array:
    """Replace sets that contain huge numbers or NaN by zeros, which prove nothing."""
    last = tuple(range(-axes, 0))
    sizes = np.max(np.abs(vectors), axis=last, keepdims=True, initial=0.0)
    return np.where(sizes < GIANT, vectors, 0.0)


def depths_in_cones(forces: Array, normals: Array, friction: Array) -> Array:
    """Compute the depth d_i of each force in its cone, (..., k)."""
    along, across = normal_and_tangential(forces, normals)
    return np.where(friction == 0.0, along, friction * along - across)
