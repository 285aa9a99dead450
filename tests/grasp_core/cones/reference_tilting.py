"""Reference for what the kernel of tilted cones rules out, in NumPy, on many quadruples at once."""

from itertools import combinations

import numpy as np

from grasp_core.cones.tilting import SLIGHT


def lowest_heights(normals):
    """Return the least max_i -n_i.m over the middles m of two normals or three, (q,)."""
    lowest = np.full(len(normals), np.inf)
    units = np.moveaxis(normals, 1, 0)
    middles = [one + other for one, other in combinations(units, 2)]
    for one, two, three in combinations(units, 3):
        # both directions square to the plane of the three tips are equally far from all three
        across = np.cross(two - one, three - one)
        middles += [across, -across]
    for middle in middles:
        length = np.linalg.norm(middle, axis=1)
        heights = -np.einsum("fqi,qi->qf", units, middle).min(axis=1) / np.maximum(length, SLIGHT)
        lowest = np.where(length > SLIGHT, np.minimum(lowest, heights), lowest)
    return lowest
