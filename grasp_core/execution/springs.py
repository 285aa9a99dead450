"""The stiffness of fingertips, given as one number, one each or a matrix each."""

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen, frozen_each, real_array
from grasp_core.checked import LARGEST, SMALLEST
from grasp_core.errors import InputError

SYMMETRIC = 1e-9
"""How far the matrix of a spring may be from symmetric, relative to its largest eigenvalue."""


def springs(stiffness: ArrayLike, count: int) -> Array:
    """Return one checked matrix for each fingertip, (count, 3, 3), of one number or one each.

    Takes `stiffness` [N/m].
    """
    if real_array(stiffness, "stiffness").ndim < len(("finger", "row", "column")):
        each = frozen_each(stiffness, count, "stiffness")
        stiffness = each[:, None, None] * np.eye(3)
    K = frozen(stiffness, (count, 3, 3), "stiffness")
    if not are_springs(K):
        raise InputError(
            "stiffness must be positive, or matrices that are symmetric and positive definite, "
            f"with eigenvalues from {SMALLEST:g} to {LARGEST:g} N/m"
        )
    return K


def are_springs(K: Array) -> bool:
    """Return whether matrices (k, 3, 3) are symmetric, positive definite and of plausible size."""
    if float(np.abs(K).max()) > LARGEST:
        return False
    values = np.linalg.eigvalsh(K)
    odd = np.abs(K - np.swapaxes(K, 1, 2)).max(axis=(1, 2))
    return bool((values >= SMALLEST).all() and (odd <= SYMMETRIC * values[:, -1]).all())
