"""The convex hull of points that arrive one at a time, in any dimension.

The hull is kept as simplices with their planes and neighbours. A new point sees some of them;
those go, and every ridge between a seen and an unseen simplex becomes a new simplex with the
point. Its plane needs no system of equations: planes through a ridge are the combinations of
the two planes that met there, and the one through the point p is

    (a, b) = e (a_u, b_u) - u (a_s, b_s),   e = a_s.p - b_s > 0,   u = a_u.p - b_u <= 0,

with s seen and u unseen: both weights are positive, so normals stay outward and errors are
averaged, not amplified, however flat the simplices become.
"""

import numpy as np

from grasp_core.arrays import Array, Indices

FLAT = 1e-9
"""Points closer than this to a common plane, relative to their extent, span nothing more."""
ABOVE = 1e-12
"""A point sees a simplex from this height on, relative to the extent: some thousand roundings."""
MARKS = np.random.default_rng(1995).integers(1, 2**63, 4096, dtype=np.uint64)
"""A random number per point; a ridge is recognised by the sum of its points' numbers."""
MOST_POINTS = len(MARKS)


class GrowingHull:
    """Simplices that bound the hull; dead ones have an infinite offset."""

    def __init__(self, simplex: Array) -> None:
        """Start from d + 1 points in general position, (d + 1, d)."""
        count, d = simplex.shape
        self.points: list[Array] = list(simplex)
        self.extent = float(np.ptp(simplex, axis=0).max())
        weights = np.linalg.inv(np.vstack([simplex.T, np.ones(count)]))
        lengths = np.linalg.norm(weights[:, :d], axis=1)
        self.normals: Array = -weights[:, :d] / lengths[:, None]
        self.offsets: Array = weights[:, d] / lengths
        others = [[i for i in range(count) if i != j] for j in range(count)]
        self.corners: Indices = np.array(others)
        """Points of each simplex, (n, d)."""
        self.neighbors: Indices = np.array(others)
        """Neighbour across the ridge without each corner, (n, d)."""
        self._used = count
        self._ridges = np.array([[i for i in range(d) if i != j] for j in range(d)])

    @property
    def size(self) -> int:
        """How many simplices are kept, live or dead."""
        return self._used

    def lowest(self) -> tuple[Array, float]:
        """The plane of least signed distance from the origin: outward normal and distance."""
        nearest = int(self.offsets[: self._used].argmin())
        return self.normals[nearest], float(self.offsets[nearest])

    def add(self, point: Array) -> bool:
        """Extend the hull to a point; False if it sees no simplex, being inside."""
        used = self._used
        heights = self.normals[:used] @ point - self.offsets[:used]
        seen = np.flatnonzero(heights > ABOVE * self.extent)
        if not seen.size:
            return False
        around = self.neighbors[seen]
        row, corner = np.nonzero(heights[around] <= ABOVE * self.extent)
        inner, outer = seen[row], around[row, corner]
        fresh = self._places(seen, len(row))
        up, down = heights[inner][:, None], heights[outer][:, None]
        normals = up * self.normals[outer] - down * self.normals[inner]
        offsets = up[:, 0] * self.offsets[outer] - down[:, 0] * self.offsets[inner]
        lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))
        ridges = self.corners[inner[:, None], self._ridges[corner]]
        new, back = np.nonzero(self.neighbors[outer] == inner[:, None])
        self.neighbors[outer[new], back] = fresh[new]
        self.offsets[seen] = np.inf
        self.normals[fresh] = normals / lengths[:, None]
        self.offsets[fresh] = offsets / lengths
        self.corners[fresh, :-1], self.corners[fresh, -1] = ridges, len(self.points)
        self.neighbors[fresh, -1] = outer
        self._join(fresh, ridges)
        self.points.append(point)
        return True

    def simplices(self) -> tuple[Array, Indices]:
        """Outward normals (n, d) and corners (n, d) of the hull's simplices."""
        alive = np.flatnonzero(np.isfinite(self.offsets[: self._used]))
        return self.normals[alive], self.corners[alive]

    def _places(self, free: Indices, count: int) -> Indices:
        """Where to keep new simplices: in place of the dead, then at the end."""
        more = max(count - len(free), 0)
        end = self._used + more
        if end > len(self.offsets):
            room = end  # doubles the store
            self.normals = np.vstack([self.normals, np.zeros((room, self.normals.shape[1]))])
            self.offsets = np.append(self.offsets, np.full(room, np.inf))
            spare = np.zeros((room, self.corners.shape[1]), dtype=np.int64)
            self.corners = np.vstack([self.corners, spare])
            self.neighbors = np.vstack([self.neighbors, spare])
        added = np.arange(self._used, end, dtype=np.int64)
        places: Indices = np.concatenate([free, added])[:count]
        self._used = end
        return places

    def _join(self, fresh: Indices, ridges: Indices) -> None:
        """Make new simplices neighbours that share the new point and all but one other."""
        marks = MARKS[ridges]
        keys = (marks.sum(axis=1)[:, None] - marks).ravel()
        pairs = keys.argsort(kind="stable").reshape(-1, 2)
        owner, corner = np.divmod(pairs, ridges.shape[1])
        self.neighbors[fresh[owner], corner] = fresh[owner[:, ::-1]]


def spread_simplex(points: Array) -> Indices | None:
    """Indices of d + 1 widely spread points among (n, d); None if all lie in one plane."""
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
