"""The convex hull of points that arrive one at a time, in any dimension.

The hull is kept as simplices with their planes and neighbours. A new point sees some of them;
those go, and every ridge between a seen and an unseen simplex becomes a new simplex with the
point. Its plane needs no system of equations: planes through a ridge are the combinations of
the two planes that met there, and the one through the point p is

    (a, b) = e (a_u, b_u) - u (a_s, b_s),   e = a_s.p - b_s > 0,   u = a_u.p - b_u <= 0,

with s seen and u unseen: both weights are positive (to rounding), so normals stay outward and
errors are averaged, not amplified, however flat the simplices become.
"""

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices

FLAT = 1e-9
"""Points closer than this to a common plane, relative to their extent, span nothing more."""
ABOVE = 1e-12
"""Height from which on a point sees a simplex, relative to the extent: some thousand roundings."""
DEAD = 1e300
"""Offset of a simplex that was removed: no point sees it, and it is never the lowest."""
MARKS = np.random.default_rng(1995).integers(1, 2**63, 4096, dtype=np.uint64)
"""Random number of each point; a ridge is recognised by the sum of its points' numbers."""
MOST_POINTS = len(MARKS)


class GrowingHull:
    """The simplices that bound the convex hull of points which arrive one by one."""

    def __init__(self, simplex: Array) -> None:
        """Start from d + 1 points in general position, (d + 1, d)."""
        count, d = simplex.shape
        self.points: list[Array] = list(simplex)
        self.slack = ABOVE * float(np.ptp(simplex, axis=0).max())
        weights = np.linalg.inv(np.vstack([simplex.T, np.ones(count)]))
        lengths = np.linalg.norm(weights[:, :d], axis=1, keepdims=True)
        self.planes: Array = weights * np.append(-np.ones(d), 1.0) / lengths
        """Outward unit normal and offset of each simplex, (n, d + 1)."""
        others = [[i for i in range(count) if i != j] for j in range(count)]
        self.corners: Indices = np.array(others)
        """Points at the corners of each simplex, (n, d)."""
        self.neighbors: Indices = np.array(others)
        """Neighbour of each simplex across the ridge without each corner, (n, d)."""
        self._used = count
        self._ridges = np.array([[i for i in range(d) if i != j] for j in range(d)])
        self._dead = np.append(np.zeros(d), DEAD)

    @property
    def size(self) -> int:
        """Number of simplices that are kept, live or removed."""
        return self._used

    def lowest(self) -> tuple[Array, float]:
        """Return the plane of least signed distance from zero: outward normal and distance."""
        nearest = self.planes[self.planes[: self._used, -1].argmin()]
        return nearest[:-1], float(nearest[-1])

    def add(self, point: Array) -> bool:
        """Extend the hull to a point; return False if it sees no simplex, being inside."""
        heights = self.planes[: self._used] @ np.append(point, -1.0)
        hidden = heights <= self.slack
        seen = (~hidden).nonzero()[0]
        if not seen.size:
            return False
        around = self.neighbors[seen]
        row, corner = hidden[around].nonzero()
        inner, outer = seen[row], around[row, corner]
        fresh = self._places(seen, len(row))
        # the plane (a, b) of the module's text, for each ridge between a seen and an unseen simplex
        planes = heights[inner, None] * self.planes[outer]
        planes -= heights[outer, None] * self.planes[inner]
        planes /= np.sqrt(np.einsum("ij,ij->i", planes[:, :-1], planes[:, :-1]))[:, None]
        ridges = self.corners[inner[:, None], self._ridges[corner]]
        marks = MARKS[ridges]
        keys = marks.sum(axis=1)
        across = MARKS[self.corners[outer]]
        beyond = across == (across.sum(axis=1) - keys)[:, None]  # the corner not on the ridge
        self.neighbors[outer, beyond.argmax(axis=1)] = fresh
        self.planes[seen] = self._dead
        self.planes[fresh] = planes
        self.corners[fresh, :-1] = ridges
        self.corners[fresh, -1] = len(self.points)
        self.neighbors[fresh, -1] = outer
        self._join(fresh, keys[:, None] - marks)
        self.points.append(point)
        return True

    def simplices(self) -> tuple[Array, Indices]:
        """Return outward normals (n, d) and corners (n, d) of the hull's simplices."""
        alive = np.flatnonzero(self.planes[: self._used, -1] < DEAD)
        return self.planes[alive, :-1], self.corners[alive]

    def _places(self, free: Indices, count: int) -> Indices:
        """Choose where to keep new simplices: in place of removed ones, then at the end."""
        if count <= len(free):
            return free[:count]
        end = self._used + count - len(free)
        if end > len(self.planes):
            d = self.corners.shape[1]
            spare = np.zeros((2 * end, d), dtype=np.int64)
            self.planes = np.vstack([self.planes, np.tile(self._dead, (2 * end, 1))])
            self.corners = np.vstack([self.corners, spare])
            self.neighbors = np.vstack([self.neighbors, spare])
        added = np.arange(self._used, end, dtype=np.int64)
        self._used = end
        return np.concatenate([free, added])

    def _join(self, fresh: Indices, keys: NDArray[np.uint64]) -> None:
        """Make new simplices neighbours if they share the new point and all but one of the others.

        Args:
            fresh: Places of the new simplices, (m,).
            keys: Sums of the marks of the points shared besides the new one, for each corner that
                is left out, (m, d - 1).
        """
        # a ridge belongs to two simplices, so that equal keys come in pairs
        pairs = keys.ravel().argsort().reshape(-1, 2)
        owner = fresh[pairs // keys.shape[1]]
        self.neighbors[owner, pairs % keys.shape[1]] = owner[:, ::-1]


def spread_simplex(points: Array) -> Indices | None:
    """Find d + 1 widely spread points among (n, d), as indices; None if all lie in one plane."""
    rest = points - points.mean(axis=0)
    chosen = [int(np.einsum("ij,ij->i", rest, rest).argmax())]
    rest = points - points[chosen[0]]
    flat = (FLAT * float(np.abs(rest).max())) ** 2
    for _ in range(points.shape[1]):
        squares = np.einsum("ij,ij->i", rest, rest)
        farthest = int(squares.argmax())
        if squares[farthest] <= flat:
            return None
        chosen.append(farthest)
        unit = rest[farthest] / np.sqrt(squares[farthest])
        rest -= np.outer(rest @ unit, unit)
    return np.array(chosen)
