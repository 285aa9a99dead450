"""Proves force closure of soft contacts by forces and torques, and its opposite by twists.

These are the proofs of `closure.proofs` in the local coordinates x = (n, a) of `contacts`, where
every cone is n >= |a|. Let e_i = n_i - |a_i| be depths, r_i = 1 / mu_i, w the wrench of all x_i,
and sigma the sixth singular value of the matrix of the A_i. A correction of length
c = (|w| + rounding) / sigma balances the forces and takes at most sqrt(2) c from each depth, so

    min_i (e_i - sqrt(2) c) / r_i / (sum n_i + sqrt(k) c)  >  0                         (1)

proves closure and bounds the margin from below. A twist y refutes closure if no support is
positive but for rounding; the largest support M, where it is negative, bounds the margin t:

    t  <=  M / sum_i r_i (M - n_i.v_i).                                                 (2)

For with t r_i <= e_i the shares b_i = n_i - r_i t are at least |a_i|, so that the power of contact
i is at most b_i s_i + r_i t n_i.v_i, and the sum of the powers is zero.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.margin_program import CHECK_SLACK
from grasp_core.closure.proofs import RANK
from grasp_core.closure.soft.contacts import SoftContacts
from grasp_core.closure.wrenches import WRENCH


def supports(slopes: Array) -> Array:
    """Compute the supports s_i of the cones, from powers of local coordinates (k, 4), (k,)."""
    return slopes[:, 0] + np.linalg.norm(slopes[:, 1:], axis=1)


def depths(local: Array) -> Array:
    """Compute the depths e_i of local coordinates (k, 4) in their cones, (k,)."""
    return local[:, 0] - np.linalg.norm(local[:, 1:], axis=1)


def proved_margin(contacts: SoftContacts, local: Array, caution: float = 1.0) -> float:
    """Compute the margin (1) that forces and torques prove.

    Takes `local` (k, 4). Gives a lower bound of the optimum of the margin program; minus infinity
    if there is none.
    """
    matrix = contacts.matrix
    if not (np.isfinite(matrix).all() and np.isfinite(local).all()) or matrix.shape[1] < WRENCH:
        return -math.inf
    least = float(np.linalg.svd(matrix, compute_uv=False)[WRENCH - 1])
    if least <= RANK:
        return -math.inf
    rounding = CHECK_SLACK * max(1.0, float(contacts.reach.max()))
    imbalance = float(np.linalg.norm(matrix @ local.ravel()))
    # c of (1); its normal parts sum to at most sqrt(k) c
    corrected = caution * (imbalance + rounding) / least
    pushes = float(local[:, 0].sum()) + math.sqrt(len(local)) * corrected
    left = float(((depths(local) - math.sqrt(2.0) * corrected) / contacts.shares).min())
    return left / pushes if pushes > 0.0 else -math.inf


def margin_ceiling(contacts: SoftContacts, twist: Array, caution: float = 1.0) -> float:
    """Bound the margin of closure from above by (2), with a twist that separates the contacts.

    Takes `twist` (6,). Gives the bound, below zero; zero where the largest support M is zero to
    within rounding; infinity where M is more, and the twist proves nothing.
    """
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
