"""Proves that a polytope inside a wrench set contains a ball around the zero wrench.

The polytope is given by simplices between points of the set. Every ray from zero meets some
simplex, at a combination of its corners, if every ridge belongs to an even number of simplices
and one generic ray crosses an odd number of them. Where no corner is lower than r along the normal
of its simplex, rays meet no simplex nearer than r.

Few simplices can be crossed by a given ray. With l and h the heights of the lowest corner of a
simplex and of the highest of all points, along its normal n, every point x of any simplex has
n.x <= h; so a ray t u crosses none beyond T, the least h / n.u among those with n.u > 0. It can
cross one that has l > 0 only if n.u > 0 and l <= T n.u. Where the polytope is convex, these are
those at which it leaves.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.by_value import ByValue
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.closure.wrenches import WRENCH
from grasp_core.fields import are_units, is_array, is_indices

ON_RIDGE = 1e-9
"""Distance of a ray from a ridge, as a share of the simplex, below which the ray proves nothing."""
SAME_RAY = 1e-6
"""Least distance by which a flat simplex, which no generic ray crosses, must miss the ray."""
ROUNDED = 1e-9
"""Share by which a ray may cross a simplex farther away than computed."""
BLOCK = 2**15
"""Number of heights compared at a time: as many as fit into a processor's cache."""
TINY = 1e-300
"""Smallest length that is divided by: a normal may have length zero."""
LARGEST_KEY = 2**62
"""Largest integer that may name a ridge, with one digit for each of its corners."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class InnerPolytope(ByValue):
    """A polytope inside a wrench set whose planes bound the quality from below."""

    forces: Array
    """Local contact forces; their wrenches are the points of the polytope, (n, 3k)."""
    corners: Indices
    """Indices of the points of each simplex of the boundary, (m, 6)."""
    normals: Array
    """Outward unit normals of the simplices, (m, 6)."""

    def sound(self, width: int) -> bool:
        """Return whether the fields fit each other and forces of `width` components."""
        count = len(self.corners) if is_indices(self.corners, None, WRENCH) else 0
        return (
            count > 0
            and is_array(self.forces, None, width)
            and len(self.forces) > 0
            and are_units(self.normals, count, WRENCH)
        )

    def radius(self, wrenches: WrenchSet) -> float:
        """Return the least height of a corner along the normal of its simplex."""
        if len(self.normals) != len(self.corners):
            return -np.inf
        lowest, _ = self._heights(self.forces @ wrenches.G.T)
        return float(lowest.min())

    def proved_radius(self, wrenches: WrenchSet) -> float:
        """Return the radius if the simplices enclose zero, and minus infinity otherwise."""
        if not 0 < len(self.normals) == len(self.corners) or not self._even():
            return -np.inf
        points = self.forces @ wrenches.G.T
        lowest, highest = self._heights(points)
        radius = float(lowest.min())
        enclosed = radius > 0.0 and self._crossed_oddly(points, lowest, highest)
        return radius if enclosed else -np.inf

    def _heights(self, points: Array) -> tuple[Array, Array]:
        """Return heights of each simplex's lowest corner and of the highest point, (m,) each."""
        count = len(self.corners)
        lowest, highest = np.empty(count), np.empty(count)
        step = max(BLOCK // len(points), 1)
        for start in range(0, count, step):
            block = slice(start, start + step)
            heights = points @ _units(self.normals[block]).T
            each = np.arange(len(heights.T))
            corners = [heights[corner, each] for corner in self.corners[block].T]
            np.minimum.reduce(corners, out=lowest[block])
            heights.max(axis=0, out=highest[block])
        return lowest, highest

    def _even(self) -> bool:
        """Return whether every ridge belongs to an even number of simplices."""
        count, d = len(self.forces), self.corners.shape[1]
        outside = self.corners.min() < 0 or self.corners.max() >= count
        if outside or count ** (d - 1) > LARGEST_KEY:
            return False
        digits = np.zeros((d, d), dtype=np.int64)  # column j: of the ridge without corner j
        for j in range(d):
            digits[:j, j] = count ** np.arange(j)
            digits[j + 1 :, j] = count ** np.arange(j, d - 1)
        keys = np.sort((np.sort(self.corners, axis=1) @ digits).ravel())
        return keys.size % 2 == 0 and bool((keys[::2] == keys[1::2]).all())

    def _crossed_oddly(self, points: Array, lowest: Array, highest: Array) -> bool:
        """Return whether one generic ray from zero crosses an odd number of simplices."""
        d = points.shape[1]
        ray = np.cos(np.arange(1, d + 1, dtype=np.float64))
        along = _units(self.normals) @ ray
        ahead = along > 0.0
        if not ahead.any():
            return False
        end = (1.0 + ROUNDED) * float((highest[ahead] / along[ahead]).min())
        cells = points[self.corners[ahead & (lowest <= end * along)]].transpose(0, 2, 1)
        solid = np.abs(np.linalg.det(cells)) > np.finfo(np.float64).tiny
        cells = cells[solid]  # no generic ray crosses a flat one
        shares = np.asarray(np.linalg.solve(cells, ray[:, None])[:, :, 0], dtype=np.float64)
        doubtful = ON_RIDGE * np.abs(shares).max(axis=1)
        lowest_share = shares.min(axis=1)
        if (np.abs(lowest_share) <= doubtful).any():
            return False  # the ray is not generic: it may meet a ridge
        reached = np.asarray(np.einsum("mjc,mc->mj", cells, shares), dtype=np.float64)
        hit = np.linalg.norm(reached - ray, axis=1) < SAME_RAY
        return int((hit & (shares > 0.0).all(axis=1)).sum()) % 2 == 1


def _units(normals: Array) -> Array:
    squares = np.einsum("mj,mj->m", normals, normals)
    return normals / np.sqrt(np.maximum(squares, TINY))[:, None]
