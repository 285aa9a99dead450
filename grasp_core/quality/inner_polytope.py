"""Proves that a polytope inside a wrench set contains a ball around the zero wrench.

The polytope is given by simplices between points of the set, in any number and order: whoever made
them, the following holds.

*A ball.* If every ray from zero meets a simplex, the hull of the points holds zero, as no plane
through zero has all of it on one side. Let l be the least height n.p of a corner p of a simplex
along its unit normal n, and r > 0 no larger than any l. All of a simplex is as high as its lowest
corner, so that no simplex comes nearer to zero than r, and the hull reaches r in every direction.

*Every ray.* Let every ridge, the simplex without a corner, belong to an even number of simplices.
Then they are a cycle modulo two, seen from zero a map to the sphere of directions, of which almost
all are met equally often modulo two. If one ray crosses an odd number of simplices, none of them
next to their ridges, then every ray meets some simplex. A simplex that is listed twice is crossed
twice, in whatever order its corners are: it adds nothing.

*One ray.* So all rests on counting the simplices on a ray t u, |u| = 1, without an error. By
rounding, sums of products may be off by `LOST` of the lengths of their factors; every comparison
below is made with this much against the claim. With h the height of the highest of all points along
n, every point x of any simplex has n.x <= h, and none is farther away than the farthest point R. So
the ray crosses none beyond T, the least of R and of h / n.u where n.u > 0, and a simplex only if

    l <= T n.u.                                                                             (1)

Let C have the corners p_j of such a simplex as columns. The ray crosses it if and only if C s = u
has positive shares s. It misses it, ridges included, if some y has

    y.u < min(0, y.p_1, ..., y.p_6) (n.u / l),                                              (2)

for positive shares have y.u = sum s_j y.p_j and l sum s_j <= n.u. And with any X near the inverse,

    |X C - 1| = e <= 1/2   =>   C has an inverse, and |s - X u| <= 2 e max |X u|,           (3)

as X u = (X C) s, with the largest sum of a row for |X C - 1|. A share above this bound is positive.
The worse the condition of C, the larger is e: it is crossed only where that is certain. If neither
(2), for the row of X with the least share, nor (3) decides, the next ray of a fixed list is tried,
and after the last one nothing is proved.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, Shape
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.declared import Declared

LOST = 64.0 * float(np.finfo(np.float64).eps)
"""Error of a sum of six products, relative to the lengths of the two vectors: ten times what it
can be, with room for normals that are scaled to length one."""
RAYS = np.cos(np.arange(1.0, 61.0)).reshape(10, 6)
"""Rays along which simplices may be counted, of any length: cosines of whole numbers are in no
relation to anything that is meant."""
FLATTEST = 1e-30
"""Least singular value, over the largest, by which rows of X are divided."""
BLOCK = 2**15
"""Number of heights compared at a time: as many as fit into a processor's cache."""
TINY = 1e-300
"""Smallest number that is divided by: a normal may have length zero."""
LARGEST_KEY = 2**62
"""Largest integer that may name a ridge, with one digit for each of its corners."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class InnerPolytope(Declared):
    """A polytope inside a wrench set whose planes bound the quality from below."""

    forces: Annotated[Array, Shape("n", None)]
    """Local contact forces; their wrenches are the points of the polytope, (n, 3k)."""
    corners: Annotated[Indices, Shape("m", WRENCH, whole=True)]
    """Indices of the points of each simplex of the boundary, (m, 6)."""
    normals: Annotated[Array, Shape("m", WRENCH, units=True)]
    """Outward unit normals of the simplices, (m, 6)."""

    def _is_consistent(self) -> bool:
        return len(self.corners) > 0 and len(self.forces) > 0

    def proved_radius(self, wrenches: WrenchSet) -> float:
        """Return the radius if the simplices enclose zero, and minus infinity otherwise."""
        if not 0 < len(self.normals) == len(self.corners) or not self._even():
            return -np.inf
        points = self.forces @ wrenches.G.T
        lowest, highest = self._heights(points)
        radius = float(lowest.min())
        farthest = float(np.linalg.norm(points, axis=1).max())
        if not radius > LOST * farthest:
            return -np.inf
        for ray in _units(RAYS):
            crossed = self._crossed(points, lowest, highest, ray)
            if crossed is not None:
                return radius if crossed % 2 == 1 else -np.inf
        return -np.inf

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

    def _crossed(self, points: Array, lowest: Array, highest: Array, ray: Array) -> int | None:
        """Count the simplices that a ray from zero crosses; None where one of them is doubtful."""
        farthest = float(np.linalg.norm(points, axis=1).max())
        lost = LOST * farthest
        along = _units(self.normals) @ ray
        ahead = along > LOST
        ends = (highest[ahead] + lost) / (along[ahead] - LOST)
        end = float(ends.min(initial=farthest))
        near = lowest <= end * along + 4.0 * lost  # (1): both sides are off by two at most
        cells = points[self.corners[near]].transpose(0, 2, 1)
        # X near the inverses, (m, 6, 6); of flat cells, something as large
        left, sizes, right = np.linalg.svd(cells)
        sizes = np.maximum(sizes, FLATTEST * np.maximum(sizes[:, :1], TINY))
        inverses = np.asarray(right.transpose(0, 2, 1) / sizes[:, None] @ left.transpose(0, 2, 1))
        shares = inverses @ ray
        # the most that shares can sum to, in (2)
        most = (along[near] + LOST) / np.maximum(lowest[near] - lost, TINY)
        missed = _miss(cells, inverses, shares, most)
        crossed = _cross(cells, inverses, shares)
        return int(crossed.sum()) if (missed | crossed).all() else None


def _miss(cells: Array, inverses: Array, shares: Array, most: Array) -> NDArray[np.bool_]:
    """Return which cells the ray misses for certain, by (2), (m,)."""
    y = inverses[np.arange(len(cells)), shares.argmin(axis=1)]
    lost = LOST * np.linalg.norm(y, axis=1)
    lowest = np.einsum("mi,mij->mj", y, cells).min(axis=1)
    lowest -= lost * np.linalg.norm(cells, axis=1).max(axis=1)
    missed: NDArray[np.bool_] = shares.min(axis=1) + lost < np.minimum(lowest, 0.0) * most
    return missed


def _cross(cells: Array, inverses: Array, shares: Array) -> NDArray[np.bool_]:
    """Return which cells the ray crosses for certain, by (3), (m,)."""
    rows, columns = np.linalg.norm(inverses, axis=2), np.linalg.norm(cells, axis=1)
    off = np.abs(inverses @ cells - np.eye(cells.shape[1]))
    off += LOST * rows[:, :, None] * columns[:, None]
    e = off.sum(axis=2).max(axis=1)
    doubtful = 2.0 * (e * np.abs(shares).max(axis=1) + LOST * rows.max(axis=1))
    crossed: NDArray[np.bool_] = (e <= 0.5) & (shares.min(axis=1) > doubtful)  # noqa: PLR2004
    return crossed


def _units(normals: Array) -> Array:
    squares = np.einsum("mj,mj->m", normals, normals)
    return normals / np.sqrt(np.maximum(squares, TINY))[:, None]
