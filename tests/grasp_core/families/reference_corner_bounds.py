"""Reference for `placing_kernel`: its bound (2) in NumPy."""

from itertools import combinations

import numpy as np

from grasp_core.families.placing_kernel import SAME_AXIS
from grasp_core.values import FINGERS


def widths(corners, axes):
    """The bound (2) on s_i + s_j for contacts i and j of one focus, (q, 4, 4)."""
    found = np.full((len(axes), FINGERS, FINGERS), np.inf)
    for i, j in combinations(range(FINGERS), 2):
        apart = axes[:, i] - axes[:, j]
        low = np.einsum("qki,qi->qk", corners[:, i], apart).min(axis=1, initial=np.inf)
        high = np.einsum("qki,qi->qk", corners[:, j], apart).max(axis=1, initial=-np.inf)
        # 1 - a_i.a_j of (2) is half of |a_i - a_j|^2
        share = 0.5 * np.einsum("qi,qi->q", apart, apart)
        bound = np.where(share > SAME_AXIS, (high - low) / np.maximum(share, SAME_AXIS), np.inf)
        found[:, i, j] = found[:, j, i] = bound
    return found
