"""Measures how diverse recorded postures of a hand are, as DexGraspNet reports it.

DexGraspNet (Wang et al., ICRA 2023) states the mean and the standard deviation over joints of the
entropy of their angles. Its repository holds no code for that. Here it is computed as DGTR does,
whose code is public (iSEE-Laboratory/DGTR, `tools/evaluate.py`): the range of a joint is divided
into 100 bins of one width, and with the shares p of records in them its entropy is

    H = - sum p ln p,                                                                     (1)

from 0, where all angles are in one bin, to ln 100 = 4.6. Other publications take other numbers of
bins, so their figures are others. DexGraspBench (`src/task/statistic.py`) states something else,
the shares of variance along principal components, which is not computed here.
"""

import numpy as np

from grasp_core.arrays import Array

BINS = 100


def joint_entropies(angles: Array, ranges: Array) -> Array:
    """Return the entropy of each joint's angles: (1), (j,).

    Args:
        angles: Angles of n records, (n, j) [rad]; one beyond the range counts at its end.
        ranges: Least and largest angle of each joint, (j, 2) [rad]; a joint without a range, which
            is NaN, has a full turn.
    """
    low, high = np.where(np.isnan(ranges), (-np.pi, np.pi), ranges).T
    width = np.where(high > low, high - low, 1.0)
    bins = np.clip(np.floor(BINS * (angles - low) / width), 0, BINS - 1).astype(np.int64)
    counts = np.array([np.bincount(own, minlength=BINS) for own in bins.T])
    shares = counts / len(angles)
    logarithms = np.log(np.where(counts > 0, shares, 1.0))
    return -np.sum(shares * logarithms, axis=1)
