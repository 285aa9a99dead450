"""Bounds the Ferrari-Canny quality from both sides, with exact circular friction cones.

Solved: Q, the radius of the largest ball around the zero wrench inside the set W of wrenches
that bounded contact forces can apply (see `wrench_sets`); if zero lies outside W, minus its
distance from W. With h the support of W, (1) of `wrench_sets`, over unit directions y,

    Q  =  min h(y)  <=  h(y) for any y.                                                       (1)

A polytope inside W bounds Q from below, with n.x <= b the planes of its simplices:

    Q  >=  min b, if the simplices enclose zero.                                              (2)

The polytope is grown where it is weakest: the point of W farthest along the normal of the nearest
plane is added, until that plane and its support agree. If zero is outside, the nearest point of W
is found by a cone program; its forces bound the distance from above, its direction from below:

    -|w|  <=  Q  for any w in W.                                                              (3)

Without closure, Q of `l1` is negative; that of `linf` is zero, since fingers may then rest.

Both proofs are kept and can be checked again in plain arithmetic. A compiled kernel grows the
polytopes; one whose proof fails counts for nothing, and the bounds are then those of (1) and (3).
Its simplices are between points of the set, in any number and order: whoever made them, the
following holds.

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
rounding, sums of products may be off by `PRODUCT_ERROR` of the lengths of their factors; every
comparison below is made with this much against the claim. With h the height of the highest of all
points along n, every point x of any simplex has n.x <= h, and none is farther away than the
farthest point R. So the ray crosses none beyond T, the least of R and of h / n.u where n.u > 0, and
a simplex only if

    l <= T n.u.                                                                             (4)

Let C have the corners p_j of such a simplex as columns. The ray crosses it if and only if C s = u
has positive shares s. It misses it, ridges included, if some y has

    y.u < min(0, y.p_1, ..., y.p_6) (n.u / l),                                              (5)

for positive shares have y.u = sum s_j y.p_j and l sum s_j <= n.u. And with any X near the inverse,

    |X C - 1| = e <= 1/2   =>   C has an inverse, and |s - X u| <= 2 e max |X u|,           (6)

as X u = (X C) s, with the largest sum of a row for |X C - 1|. A share above this bound is positive.
The worse the condition of C, the larger is e: it is crossed only where that is certain. If neither
(5), for the row of X with the least share, nor (6) decides, the next ray of a fixed list is tried,
and after the last one nothing is proved.

Source: Ferrari & Canny 1992; the growing polytope is the expanding-polytope algorithm of
collision detection in six dimensions (also Zheng 2013 for this metric).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike, NDArray

from grasp_core.allowed_values import value_of
from grasp_core.arrays import Array, Indices, ProofNumber, Shape
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.wrench_sets import Norm, WrenchSet, nearest_wrench
from grasp_core.compiled import compiled
from grasp_core.declared import Declared, declared, trusted
from grasp_core.values import Contact, Grasp

QUALITY_GAP = 1e-4
"""Default of the largest relative gap (upper - lower) / upper between the bounds of a quality."""
FINEST_QUALITY_GAP = 1e-7
"""Smallest gap that may be asked for: below it, rounding of the planes of tiny simplices costs more
than they gain."""
QualityGap = Annotated[float, Interval(ge=FINEST_QUALITY_GAP, lt=1.0)]
MOST_SIMPLICES, MOST_POINTS = 60_000, 4096
"""Simplices and corners at which the polytope stops growing; its bounds hold all the same, farther
apart."""
CHECK_SLACK = 1e-12
"""Slack of the plain-arithmetic checks, relative to the longest wrench."""
MOST_SLACK = 1e-6
"""Largest slack of a quality, however long wrenches are [N]."""
QUALITY_KERNEL = "grasp_core.quality.ferrari_canny_kernel"
UnitTwist = Annotated[Array, Shape(WRENCH, units=True)]
"""A velocity and an angular velocity, of length one, with torques over a torque scale, (6,)."""
PRODUCT_ERROR = 64.0 * float(np.finfo(np.float64).eps)
"""Error of a sum of six products, relative to the lengths of the two vectors: ten times what it
can be, with room for normals that are scaled to length one."""
COUNTING_RAYS = np.cos(np.arange(1.0, 61.0)).reshape(10, 6)
"""Rays along which simplices may be counted, of any length: cosines of whole numbers are in no
relation to anything that is meant."""
FLATTEST_SIMPLEX = 1e-30
"""Least singular value, over the largest, by which rows of X are divided."""
HEIGHTS_AT_ONCE = 2**15
"""Number of heights compared at a time: as many as fit into a processor's cache."""
SMALLEST_DIVISOR = 1e-300
LARGEST_KEY = 2**62
"""Largest integer that may name a ridge, with one digit for each of its corners."""


@declared
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
        return self.radius_between(self.forces @ wrenches.G.T)

    def radius_between(self, points: Array) -> float:
        """Return the radius that simplices between points prove, in any number of dimensions."""
        if not 0 < len(self.normals) == len(self.corners) or not self._even():
            return -np.inf
        lowest, highest = self._heights(points)
        radius = float(lowest.min())
        farthest = float(np.linalg.norm(points, axis=1).max())
        if not radius > PRODUCT_ERROR * farthest:
            return -np.inf
        for ray in _units(COUNTING_RAYS[:, : points.shape[1]]):
            crossed = self._crossed(points, lowest, highest, ray)
            if crossed is not None:
                return radius if crossed % 2 == 1 else -np.inf
        return -np.inf

    def _heights(self, points: Array) -> tuple[Array, Array]:
        """Return heights of each simplex's lowest corner and of the highest point, (m,) each."""
        count = len(self.corners)
        lowest, highest = np.empty(count), np.empty(count)
        step = max(HEIGHTS_AT_ONCE // len(points), 1)
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
        lost = PRODUCT_ERROR * farthest
        along = _units(self.normals) @ ray
        ahead = along > PRODUCT_ERROR
        ends = (highest[ahead] + lost) / (along[ahead] - PRODUCT_ERROR)
        end = float(ends.min(initial=farthest))
        near = lowest <= end * along + 4.0 * lost  # (4): both sides are off by two at most
        cells = points[self.corners[near]].transpose(0, 2, 1)
        # X near the inverses, (m, 6, 6); of flat cells, something as large
        left, sizes, right = np.linalg.svd(cells)
        sizes = np.maximum(sizes, FLATTEST_SIMPLEX * np.maximum(sizes[:, :1], SMALLEST_DIVISOR))
        inverses = np.asarray(right.transpose(0, 2, 1) / sizes[:, None] @ left.transpose(0, 2, 1))
        shares = inverses @ ray
        # the most that shares can sum to, in (5)
        most = (along[near] + PRODUCT_ERROR) / np.maximum(lowest[near] - lost, SMALLEST_DIVISOR)
        missed = _miss(cells, inverses, shares, most)
        crossed = _cross(cells, inverses, shares)
        return int(crossed.sum()) if (missed | crossed).all() else None


def _miss(cells: Array, inverses: Array, shares: Array, most: Array) -> NDArray[np.bool_]:
    """Return which cells the ray misses for certain, by (5), (m,)."""
    y = inverses[np.arange(len(cells)), shares.argmin(axis=1)]
    lost = PRODUCT_ERROR * np.linalg.norm(y, axis=1)
    lowest = np.einsum("mi,mij->mj", y, cells).min(axis=1)
    lowest -= lost * np.linalg.norm(cells, axis=1).max(axis=1)
    missed: NDArray[np.bool_] = shares.min(axis=1) + lost < np.minimum(lowest, 0.0) * most
    return missed


def _cross(cells: Array, inverses: Array, shares: Array) -> NDArray[np.bool_]:
    """Return which cells the ray crosses for certain, by (6), (m,)."""
    rows, columns = np.linalg.norm(inverses, axis=2), np.linalg.norm(cells, axis=1)
    off = np.abs(inverses @ cells - np.eye(cells.shape[1]))
    off += PRODUCT_ERROR * rows[:, :, None] * columns[:, None]
    e = off.sum(axis=2).max(axis=1)
    doubtful = 2.0 * (e * np.abs(shares).max(axis=1) + PRODUCT_ERROR * rows.max(axis=1))
    crossed: NDArray[np.bool_] = (e <= 0.5) & (shares.min(axis=1) > doubtful)  # noqa: PLR2004
    return crossed


def _units(normals: Array) -> Array:
    squares = np.einsum("mj,mj->m", normals, normals)
    return normals / np.sqrt(np.maximum(squares, SMALLEST_DIVISOR))[:, None]


@declared
class FerrariCanny(Declared):
    """Bounds of a quality, with the direction and the polytope, or forces, that prove them."""

    lower: ProofNumber
    """Lower bound of the quality [N]."""
    upper: ProofNumber
    """Upper bound of the quality [N]."""
    wrenches: WrenchSet
    """The set of wrenches to whose largest inscribed ball the quality refers."""
    direction: UnitTwist
    """Unit twist, (6,), with torques over the torque scale, in which the support is at most
    `upper`."""
    polytope: InnerPolytope | None
    """Polytope that proves `lower` if the zero wrench is inside the set; None otherwise."""
    forces: Annotated[Array, Shape(None)] | None
    """Local forces, (3k,), or (4k,) with torsion, whose wrench is no longer than -`lower`, if the
    zero wrench is outside the set; None otherwise."""

    def verify(self) -> bool:
        """Check every field again in plain arithmetic, without any solver.

        The bounds hold for the set `wrenches`, which is checked to be that of some contacts, to
        within 1e-12 of its longest wrench, and 1e-6 N at most.
        """
        with np.errstate(all="ignore"):
            if not (self.is_sound() and self.lower <= self.upper and is_unit(self.direction)):
                return False
            slack = min(CHECK_SLACK * self.wrenches.size, MOST_SLACK)
            # (1) for the direction
            support, _ = self.wrenches.support(self.direction)
            return support <= self.upper + slack and self._proves_lower(slack)

    def _proves_lower(self, slack: float) -> bool:
        width = self.wrenches.G.shape[1]
        # (2), the points being wrenches of allowed forces
        if self.polytope is not None:
            return (
                self.forces is None
                and self.polytope.forces.shape[1] == width
                and are_allowed(self.polytope.forces, self.wrenches)
                and self.polytope.proved_radius(self.wrenches) >= self.lower - slack
            )
        # (3), by the wrench of allowed forces
        return (
            self.forces is not None
            and self.forces.shape == (width,)
            and are_allowed(self.forces[None], self.wrenches)
            and float(np.linalg.norm(self.wrenches.G @ self.forces)) <= -self.lower + slack
        )


def is_unit(direction: Array) -> bool:
    """Return whether a vector has length one, to `CHECK_SLACK`."""
    return abs(float(np.linalg.norm(direction)) - 1.0) <= CHECK_SLACK


def are_allowed(forces: Array, wrenches: WrenchSet) -> bool:
    """Return whether forces, one a row, are allowed, to `CHECK_SLACK` shared by all contacts."""
    longest = 1.0 + float(wrenches.friction.max())
    return wrenches.holds(forces, CHECK_SLACK * longest / len(wrenches.friction))


def ferrari_canny(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    *,
    center: ArrayLike = (0.0, 0.0, 0.0),
    torque_scale: float,
    norm: Norm = "l1",
    gap: float = QUALITY_GAP,
    torsion_m: ArrayLike = 0.0,
) -> FerrariCanny:
    """Bound the largest wrench that bounded contact forces resist in every direction.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each, (k,).
        center: Point about which torques are taken, (3,) [m].
        torque_scale: Length that makes a torque comparable with a force [m], such as the
            object's radius. Values with different scales cannot be compared.
        norm: `l1`, normal forces sum to 1 N, or `linf`, each is at most 1 N.
        gap: Wanted (upper - lower) / upper, from 1e-7. Where more simplices would be needed than
            are kept, for very symmetric or many contacts, the bounds are some per cent apart.
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]; zero is a hard
            finger.

    Returns:
        Bounds in newtons. Without closure: of `l1`, minus the distance of the zero wrench from the
        set; of `linf`, zero.

    Raises:
        InputError: Shapes, lengths or signs are wrong.
        SolverError: The cone program's answer failed its check.
    """
    value_of(QualityGap, gap, "gap")
    wrenches = WrenchSet.of(
        positions, normals, friction, center=center, torque_scale=torque_scale, norm=norm,
        torsion_m=torsion_m,
    )  # fmt: skip
    return wrench_set_quality(wrenches, gap)


def wrench_set_quality(wrenches: WrenchSet, gap: float = QUALITY_GAP) -> FerrariCanny:
    """Bound the signed distance of zero from the border of a wrench set, with proofs."""
    kernel = compiled(QUALITY_KERNEL)
    linf = wrenches.norm == "linf"
    cones = kernel.SetCones(np.array(wrenches.G, order="C"), np.array(wrenches.friction), linf)
    status, forces, corners, normals, weakest = kernel.grow(
        cones, wrenches.edges(), gap, MOST_SIMPLICES, MOST_POINTS
    )
    slack = CHECK_SLACK * wrenches.size
    if status == kernel.GROWN:
        polytope = trusted(InnerPolytope, forces=forces, corners=corners, normals=normals)
        radius = polytope.proved_radius(wrenches)
        if radius > slack:
            upper = wrenches.support(weakest)[0]
            lower = min(radius - slack, upper)
            return FerrariCanny(lower, upper, wrenches, weakest, polytope, None)
    return _outside(wrenches, weakest if weakest.any() else None)


def _outside(wrenches: WrenchSet, direction: Array | None) -> FerrariCanny:
    """Bound the quality where zero is outside the set, or no polytope shows that it is inside."""
    unit = replace(wrenches, norm="l1")
    forces, facing = nearest_wrench(unit)
    wrench = unit.G @ forces
    length = float(np.linalg.norm(wrench))
    # a degenerate set has support zero across its span; each direction bounds Q by (1)
    trials = [] if direction is None else [direction]
    _, _, right = np.linalg.svd(wrenches.edges() @ wrenches.G.T, full_matrices=False)
    others = [y for y in (-wrench, facing, right[-1], -right[-1]) if y.any()]
    trials += [y / float(np.linalg.norm(y)) for y in others]
    weakest = min(trials, key=lambda y: wrenches.support(y)[0])
    upper = wrenches.support(weakest)[0]
    # resting fingers apply no wrench, which is allowed by linf
    if wrenches.norm == "linf":
        forces, length = np.zeros_like(forces), 0.0
    return FerrariCanny(-length, max(upper, -length), wrenches, weakest, None, forces)
