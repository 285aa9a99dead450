"""Tells objects that are too large or too small for a hand, by proof or by copies of other sizes.

Let the middles of two fingertips be a_ij to b_ij apart when they touch at contacts i and j, which
may be anywhere in their regions. No hand touches at all contacts if

    some a_ij exceeds the way along the links from one fingertip to any other, or          (1)
    some b_ij is less than two fingertips are thick, which are balls and must not overlap. (2)

Both are proofs. Otherwise the same grasp is tried on copies of the object: an object is too large
if the hand stands in the grasp on a smaller copy, and too small if it does on a larger one. Which
are tried follows from whether contacts are farther apart than fingertips in the hand's postures.

A block touches with any of its corners: its middle is taken to be within its own size of where
that of its ball would be.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.hands.hand_arrays import HandArrays, Targets
from grasp_core.hands.pose_search import AskedPose, pose_if, postures
from grasp_core.messages import MILLI

SMALLER, LARGER = (0.75, 0.5, 0.25), (1.5, 2.0, 4.0)
"""Sizes of the copies, as multiples of the object's own, nearest first."""
SizeReason: TypeAlias = Literal["too large", "too small"]


def size_proof(
    arrays: HandArrays, clearance: float, choices: Sequence[Targets]
) -> tuple[SizeReason, str] | None:
    """Prove by (1) or (2) that a hand cannot touch at any choice of contacts, where it is so."""
    found = [_proof(arrays, clearance, each) for each in choices]
    return found[0] if all(found) else None


def _proof(arrays: HandArrays, clearance: float, aims: Targets) -> tuple[SizeReason, str] | None:
    (least, most), longest = _distances(arrays, aims), _longest(arrays)
    if least > longest:
        return "too large", (
            f"the object is too large: two fingertips would have to be {_mm(least)} apart or more, "
            f"and the hand's links reach {_mm(longest)} at most, which proves it"
        )
    if most < (thickness := _thickness(arrays, clearance)):
        return "too small", (
            f"the object is too small: two fingertips would have to be {_mm(most)} apart or less, "
            f"and balls as thick as theirs are {_mm(thickness)} apart at least, which proves it"
        )
    return None


def _distances(arrays: HandArrays, aims: Targets) -> tuple[float, float]:
    """Return the largest a_ij and the smallest b_ij [m]."""
    kernel, (near, other) = compiled("grasp_core.hands.distances_kernel"), np.empty((2, 3))
    radius, middles = arrays.tip_radii[0], list[Array]()
    for k, normal in enumerate(aims.normals):
        region = aims.edge_points[aims.edge_contacts == k]
        middles.append((region if len(region) else aims.origins[k : k + 1]) - radius * normal)
    pairs, slack = list(combinations(middles, 2)), 2.0 * _slack(arrays)
    least = max(kernel.hull_hull(*pair, np.inf, near, other) for pair in pairs)
    most = min(float(np.linalg.norm(a[:, None] - b, axis=2).max()) for a, b in pairs)
    return least - slack, most + slack


def _slack(arrays: HandArrays) -> float:
    """Return how far the middle of a touching tip may be from that of the first finger's ball."""
    fingers = np.repeat(np.arange(len(arrays.tip_radii)), np.diff(arrays.tip_firsts))
    arms = np.linalg.norm(arrays.tip_corners - arrays.tip_centers[fingers], axis=1)
    reaches, radii = arms + arrays.tip_roundings[fingers], arrays.tip_radii[fingers]
    aside = np.where(arms > 0.0, reaches + radii, 0.0)  # corners of a block
    return float((aside + np.abs(radii - arrays.tip_radii[0])).max())


def _longest(arrays: HandArrays) -> float:
    """Return the longest way along links from one fingertip's middle to another's [m]."""
    arms, firsts = np.linalg.norm(arrays.positions, axis=1), arrays.starts[:-1]
    reaches = np.add.reduceat(arms, firsts) - arms[firsts]
    reaches += np.linalg.norm(arrays.tip_centers, axis=1)
    i, j = np.triu_indices(len(firsts), 1)
    roots = np.linalg.norm(arrays.positions[firsts[i]] - arrays.positions[firsts[j]], axis=1)
    return float((roots + reaches[i] + reaches[j]).max())


def _thickness(arrays: HandArrays, clearance: float) -> float:
    """Return the least distance of two fingertips' middles, if they are balls; else zero [m]."""
    between = np.isin(arrays.pairs, arrays.tip_shapes).all(axis=1)
    count = len(arrays.tip_radii)
    if len(arrays.tip_corners) > count or between.sum() < count * (count - 1) // 2:
        return 0.0
    return float(np.sort(arrays.tip_radii)[:2].sum()) + clearance


def size_fault(
    asked: AskedPose, choices: Sequence[tuple[int, ...]]
) -> tuple[SizeReason, str] | None:
    """Say that an object is too large or too small, if the hand stands in the grasp on a copy."""
    points = asked.grasp.positions
    _, tips = postures(asked.hand, asked.settings.seed)
    large = _mean_distance(points[None]) > _mean_distance(tips)
    for size in SMALLER if large else LARGER:
        if pose_if(asked, choices, (), size=size):
            widest = max(float(np.linalg.norm(a - b)) for a, b in combinations(points, 2))
            reason: SizeReason = "too large" if large else "too small"
            return reason, (
                f"the object is {reason}: its contacts are up to {_mm(widest)} apart, and the hand "
                f"stands in the grasp on a copy where they are up to {_mm(size * widest)} apart"
            )
    return None


def _mean_distance(points: Array) -> float:
    """Return the mean distance between points of a set, over n sets (n, k, 3) [m]."""
    i, j = np.triu_indices(points.shape[1], 1)
    return float(np.linalg.norm(points[:, i] - points[:, j], axis=2).mean())


def _mm(length: float) -> str:
    return f"{MILLI * length:.3g} mm"
