"""Computes the margins that forces and twists prove for many sets of contacts, as `proofs` does.

The friction is positive and one for all contacts; numbers in comments are those of `proofs`.
"""

import math

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.closure.margin_program import CHECK_SLACK
from grasp_core.closure.proofs import RANK, refutes_closure, supports
from grasp_core.closure.wrenches import WRENCH, grasp_map, normal_and_tangential


def proved_margins(
    forces: Array, arms: Array, normals: Array, friction: float, caution: float = 1.0
) -> Array:
    """Compute the margins (1) that the forces of many sets of contacts prove, (g,).

    `proved_margin` explains them; friction has to be positive, and one for all contacts.

    Takes `forces`, `arms`, `normals` (g, k, 3). Gives lower bounds of the optima of the margin
    programs; minus infinity where there is none.
    """
    maps = grasp_map(arms)
    if not maps.size:
        return np.full(len(arms), -math.inf)
    along, across = normal_and_tangential(forces, normals)
    stacked = forces.reshape(len(forces), maps.shape[-1])
    imbalance = np.linalg.norm(np.einsum("gwj,gj->gw", maps, stacked), axis=-1)
    least = np.linalg.svd(maps, compute_uv=False)[..., WRENCH - 1]
    full = least > RANK
    # c of (1); its normal parts sum to at most sqrt(k) c
    corrected = caution * (imbalance + CHECK_SLACK) / np.where(full, least, 1.0)
    pushes = along.sum(axis=-1) + math.sqrt(arms.shape[-2]) * corrected
    depths = friction * along - across
    left = depths.min(axis=-1) - math.sqrt(1.0 + friction**2) * corrected
    usable = full & (pushes > 0.0)
    return np.where(usable, left / np.where(usable, pushes, 1.0), -math.inf)


def margin_ceilings(
    twists: Array, arms: Array, normals: Array, friction: float, caution: float = 1.0
) -> Array:
    """Bound the margins of closure of many sets of contacts from above by (3), (g,).

    `margin_ceiling` explains the bounds.

    Takes `twists` (g, 6); `arms`, `normals` (g, k, 3).
    """
    every = np.full((len(twists), 1), friction)
    velocities = twists[:, None, :3] + cross(twists[:, None, 3:], arms)
    along, _ = normal_and_tangential(velocities, normals)
    sizes = np.linalg.norm(twists, axis=-1)[:, None]
    rounding = caution * CHECK_SLACK * sizes * math.sqrt(1.0 + friction**2)
    # M of (3), which rounding may raise
    largest = (supports(twists, arms, normals, every) + rounding).max(axis=-1)
    below = largest < 0.0
    # each term of the sum is raised by rounding, so that the bound is no less
    sums = ((largest[:, None] - along + rounding) / friction).sum(axis=-1)
    bounds = np.where(below, largest / np.where(below, sums, 1.0), 0.0)
    return np.where(refutes_closure(twists, arms, normals, every), bounds, math.inf)
