"""Reference for `placing_kernel`: its bounds (1) and (2) in NumPy."""

from itertools import combinations

import numpy as np

from grasp_core.families.disc_bounds import pencil_radius_bounds
from grasp_core.families.placing_kernel import SAME_AXIS
from grasp_core.values import FINGERS
from tests.judges import balancing_weights


def disc_limits(corners, faces, axes, half_angles):
    """Upper bounds on the discs of many quadruples, (q, 4), from (1) and (2) alone."""
    points, angles = corners.points[faces], np.maximum(half_angles, 0.0)
    far, wide = reaches(points, axes), widths(points, axes)
    concurrent = far * np.tan(angles)
    return np.hstack([concurrent[:, None], pencil_radius_bounds(far, wide, angles)])


def reaches(corners, axes):
    """The bound (1) on the mean distance of a focus before or behind its contacts, (q,)."""
    heights = np.einsum("qfki,qfi->qfk", corners, axes)
    weights = balancing_weights(axes)
    # (1) holds for whichever side the focus is on: the larger bound covers both
    before = -np.einsum("qf,qf->q", weights, heights.min(axis=2, initial=np.inf))
    behind = np.einsum("qf,qf->q", weights, heights.max(axis=2, initial=-np.inf))
    return np.maximum(before, behind)


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
