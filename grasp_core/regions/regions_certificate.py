"""Proves that contacts anywhere in given regions stay in force closure.

Solved: given convex regions K_i on planes, are contacts x_i in K_i force-closed for every choice?

Criterion. Contacts are in force closure if each twist y = (a, b) other than zero is resisted by
one of them: some force f in a friction cone C_i has positive power f.v at its contact, where the
object moves with v = a + b x x. As the choice of one contact does not bind the others,

    all choices are closed  <=>  for every y != 0 there is an i such that                    (1)
                                 min over x in K_i of max over f in C_i of f.(a + b x x) > 0.

Cover. Choose forces F_i in the cones C_i, some perhaps zero. The least that their powers sum to,

    h(y) = sum over i of min over x in K_i of F_i.(a + b x x),                               (2)

is concave in y, as a sum of least values of linear functions, and h(t y) = t h(y) for t > 0. So if
h is positive on some rays of twists, it is positive on the whole cone that they span; and where a
sum of powers is positive one of them is. A *cover* is a list of cones, six rays each, with forces,
whose cones fill all of R^6: if h > 0 on the rays of each, every choice of contacts is force-closed.
For F_i with normal part n and tangential part g a disc of radius r around p gives, b_t and b_n
being the parts of b across and along the normal,

    min F_i.(a + b x x) = F_i.(a + b x p) - r |n b_t - b_n g|,                               (3)

and over a polygon the least is at a corner. A region that is thicker than its plane, as below a
patch of a curved surface, is a prism, with corners on both sides.

Cuts (4). The sixty-four orthants of six independent twists fill R^6. A cone is cut into two by a
ray on one of its edges, the sum of its ends, in place of either end; so cones still fill R^6.

Completeness. If all choices are closed with something to spare, cutting long edges long enough ends
with a cover; edges are preferred where power lacks, but all are cut in the end. If a twist has
h <= 0 for any forces, there is a choice that is not closed (5), as each contact has a best force
and a worst place (the power is linear in both). Between the two only time decides, and it takes
little: were regions points, h would be linear, and a cone of twists in a half-space would be
covered by one set of forces (force closure itself); what bends h is how the worst place moves from
ray to ray.

Source: for single forces the criterion is that of independent regions by primitive wrenches
(Pollard, "Closure and quality equivalence for efficient synthesis of grasps from examples", 2004).
Covers by cones that are cut where needed, with forces that share the work, are ours, as is their
use for regions of reguli, for which Sudsang & Ponce (1995) have no method.

`CertifiedRegions` holds regions with their cover, and checks every claim about them.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Annotated

import numpy as np
from annotated_types import Interval

from grasp_core.allowed_values import LARGEST_FRICTION, Quantity
from grasp_core.arrays import Amount, Array, Indices, Point, Polygon, Shape, Wrench, is_array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import (
    FEWEST_CORNERS,
    MOST_CORNERS,
    FlatPolygon,
    convex_polygon,
    has_inscribed_radius,
    holds_disc,
    plane_frame,
)
from grasp_core.values import FINGERS, ContactRegion

TWIST = 6
UNDIVIDED = 15
"""Code of a cone that is not divided; smaller codes number the edges (0, 1), (0, 2), ... (4, 5)."""
EDGES = tuple((i, j) for i in range(TWIST) for j in range(i + 1, TWIST))
POWER_SLACK = 1e-12
"""Rounding of a power, relative to the lengths of wrench and `summed` twist: thousands of
roundings."""
LARGEST_EXACT = 2.0**50
"""Entries of rays up to this are exact: they are sums of whole numbers. Lengths of axes must be
between its inverse and it."""


@declared
class TwistCover(Declared):
    """Cones that fill the space of twists, each with contact forces that resist all its twists.

    The rays of a cone are whole numbers in the coordinates of `axes`, so that dividing cones is
    exact.
    """

    axes: Annotated[Array, Shape(TWIST, TWIST)]
    """Six independent twists as rows: velocity of the origin, then angular velocity, (6, 6)."""
    codes: Annotated[Indices, Shape("n", whole=True, most=UNDIVIDED)]
    """The tree of cones, (n,), level by level from the 64 orthants: for each cone the number of the
    edge at which it is divided, or `UNDIVIDED`."""
    forces: Annotated[Array, Shape("m", "k", 3)]
    """Forces on the object for each cone that is not divided, in the same order, (m, k, 3)."""

    def _check_together(self) -> None:
        leaves = int(np.count_nonzero(self.codes == UNDIVIDED))
        if len(self.forces) != leaves:
            raise InputError(
                f"forces must be those of the {leaves} cones that are not divided, got "
                f"{len(self.forces)}"
            )

    def leaves(self) -> Iterator[tuple[slice, Array]]:
        """Yield undivided cones by levels: their slice of `forces`, and their rays, (m, 6, 6)."""
        cones, at, begun = orthants(), 0, 0
        while len(cones):
            codes = self.codes[at : at + len(cones)]
            if len(codes) < len(cones):
                break
            uncut = codes == UNDIVIDED
            count = int(np.count_nonzero(uncut))
            yield slice(begun, begun + count), cones[uncut]
            at, begun = at + len(cones), begun + count
            cones = halves(cones[~uncut], codes[~uncut])
        if len(cones) or at < len(self.codes):
            how = "ends before" if len(cones) else "goes on after"
            raise InputError(f"cover.codes must hold one code per cone, but it {how} the last cone")

    def verify(self, regions: Sequence[Array], normals: Array, friction: Array) -> bool:
        """Return whether all contacts in regions, (c, 3) each, are proved force-closed.

        The answer is False for arguments that are not regions, normals or friction.
        """
        if not self.is_sound():
            return False
        k = self.forces.shape[1]
        units = is_array(normals, k, 3, units=True, slack=POWER_SLACK)
        if not (units and is_array(friction, k, least=0.0, most=LARGEST_FRICTION)):
            return False
        placed = isinstance(regions, list | tuple) and len(regions) == k
        placed = placed and all(is_array(each, None, 3) and len(each) > 0 for each in regions)
        largest = np.abs(self.forces).max(axis=(1, 2), initial=0.0)
        lengths = np.linalg.norm(self.axes, axis=1)
        exact = ((lengths > 1.0 / LARGEST_EXACT) & (lengths < LARGEST_EXACT)).all()
        if not (placed and (largest > 0.0).all() and exact):
            return False
        independence = np.linalg.svd(self.axes / lengths[:, None], compute_uv=False)[-1]
        forces = self.forces / largest[:, None, None]  # else squares of tiny ones are zero
        along = np.einsum("mki,ki->mk", forces, normals)
        across = np.linalg.norm(forces - along[..., None] * normals, axis=2)
        # every F_i lies in its cone C_i
        in_cones = ((along >= 0.0) & (across <= friction * along)).all()
        if not (independence > POWER_SLACK and in_cones):
            return False
        try:
            return all(
                self._powerful(forces[where], rays, regions) for where, rays in self.leaves()
            )
        except InputError:
            return False

    def _powerful(self, forces: Array, rays: Array, regions: Sequence[Array]) -> bool:
        """Return whether forces have positive power, h > 0 in (2), on the rays of each cone."""
        # beyond this the rays would not be exact, nor the cuts (4)
        if np.abs(rays).max(initial=0.0) > LARGEST_EXACT:
            return False
        powers, sizes = np.zeros(rays.shape[:2]), np.zeros(rays.shape[:2])
        twists, lengths = rays @ self.axes, summed(rays, self.axes)
        for region, F in zip(regions, forces.swapaxes(0, 1), strict=True):
            slopes, at_origin = power_of(F, twists)
            # the least of (2) is at a corner of the region
            powers += at_origin + (slopes @ region.T).min(axis=2)
            sizes += lengths * slack_of(F, region)[:, None]
        return bool((powers > sizes).all())


def power_of(F: Array, twists: Array) -> tuple[Array, Array]:
    """Compute the power F.(a + b x x) of forces (m, 3) at x under twists (m, r, 6).

    It is linear in x: the slopes F x b, (m, r, 3), and the constants F.a, (m, r), are given.
    """
    return np.cross(F[:, None], twists[..., 3:]), np.einsum("mi,mri->mr", F, twists[..., :3])


def summed(rays: Array, axes: Array) -> Array:
    """Return the sum of the lengths that make up each twist, (m, r), also where they cancel."""
    return np.linalg.norm(np.abs(rays) @ np.abs(axes), axis=2)


def slack_of(F: Array, places: Array) -> Array:
    """Bound the rounding of powers of forces (m, 3) at places (c, 3), per `summed`, (m,)."""
    farthest = np.linalg.norm(places, axis=1).max()
    return POWER_SLACK * np.linalg.norm(F, axis=1) * (1.0 + farthest)


def orthants() -> Array:
    """Return the rays of the 64 orthants, (64, 6, 6)."""
    signs = 1.0 - 2.0 * (np.arange(1 << TWIST)[:, None] >> np.arange(TWIST) & 1)
    return signs[:, :, None] * np.eye(TWIST)


def halves(cones: Array, codes: Indices) -> Array:
    """Divide cones (m, 6, 6) at the edges with these numbers; halves are next to each other."""
    ends = np.array(EDGES)[codes]
    rows = np.arange(len(cones))
    # (4): the sum of its ends cuts an edge
    middles = cones[rows, ends[:, 0]] + cones[rows, ends[:, 1]]
    halves = np.repeat(cones, 2, axis=0)
    halves[2 * rows, ends[:, 0]] = middles
    halves[2 * rows + 1, ends[:, 1]] = middles
    return halves


PLACE_SLACK = 1e-9
"""How far points may be off their planes and borders, and radii off their measured values, relative
to `scale`, which is no longer than contacts are apart: files that keep ten digits stay within it.
"""


@declared
class CertifiedRegions(Declared):
    """Regions in which each finger may stand while the others stand anywhere in theirs."""

    regions: tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
    """Contact regions, one per finger: convex polygons inside `borders`."""
    borders: tuple[Polygon, Polygon, Polygon, Polygon]
    """Convex piece of a face around each region, at the asked distance from edges, (k, 3) [m]."""
    radius: Amount
    """Radius of discs around `centers` [m]. Each polygon holds the part of its disc inside its
    border, except for at most 0.2 % of the polygon's area. The radius is at most that of discs that
    hold all of `borders`."""
    centers: Annotated[Array, Shape(FINGERS, 3)]
    """Centres of the discs, which lie in the polygons, (4, 3) [m]."""
    limit: Annotated[float, Interval(ge=0.0, le=math.inf)]
    """Radius of slightly larger discs that contain the contacts `open_choice` [m]; infinite if no
    such contacts were found."""
    open_choice: Annotated[Array, Shape(FINGERS, 3)] | None
    """Contacts inside `borders` and the discs of radius `limit` that are not force-closed, (4, 3)
    [m]."""
    open_wrench: Wrench | None
    """Separating wrench of `open_choice`, like `ClosureCertificate.separating_wrench`, (6,)."""
    friction: Annotated[Array, Shape(FINGERS, least=0.0, most=LARGEST_FRICTION)]
    """Coulomb coefficients at which all contacts in the regions are force-closed, (4,)."""
    origin: Point
    """Point about which torques are taken in the proof, (3,) [m]."""
    normals: Annotated[Array, Shape(FINGERS, 3, units=True)]
    """Unit normals of the faces, into the object, (4, 3)."""
    depths: Annotated[Array, Shape(FINGERS, least=0.0)]
    """Largest distance of the true surface from each region's plane, (4,) [m]."""
    cover: TwistCover
    """Proof that all contacts in the regions are force-closed, with lengths relative to `scale`."""
    scale: Quantity
    """Length that the proof uses as its unit [m]."""

    def verify(self) -> bool:
        """Check every field again in plain arithmetic.

        This checks that every choice of contacts in `regions`, on planes with `normals` and at most
        `depths` off them, is force-closed with `friction`; that the polygons are convex, in their
        borders, as wide as they say, and hold the discs; and that `open_choice` is open. Whoever
        has the object checks that `borders` are parts of its faces.
        """
        with np.errstate(all="ignore"):
            known = self.is_sound() and all(map(len, self.borders)) and self._has_fitting_scale()
            return known and self._has_discs() and self._is_open() and self._closes()

    def _has_fitting_scale(self) -> bool:
        """Return whether the unit of length is no longer than contacts in the borders are apart.

        What may be `PLACE_SLACK` off is measured with it: twice as long as it need be, for
        rounding.
        """
        return self.scale <= 2.0 * float(np.linalg.norm(np.ptp(np.vstack(self.borders), axis=0)))

    def _has_discs(self) -> bool:
        farthest = 0.0
        for i, region in enumerate(self.regions):
            if region.kind != "certified":
                return False
            border, polygon = self._polygon(i, self.borders[i]), self._polygon(i, region.polygon)
            center = self._flat(i, self.centers[i : i + 1])
            if border is None or polygon is None or center is None:
                return False
            width, radius = region.inscribed_radius / self.scale, self.radius / self.scale
            if not (
                border.holds(polygon.corners, PLACE_SLACK)
                and polygon.holds(center, PLACE_SLACK)
                and has_inscribed_radius(polygon, width)
                and holds_disc(polygon, border, center[0], radius)
            ):
                return False
            away = np.linalg.norm(border.corners - center, axis=1)
            farthest = max(farthest, float(away.max()))
        return self.radius <= (farthest + PLACE_SLACK) * self.scale

    def _flat(self, i: int, points: Array) -> Array | None:
        """Write points in the plane of a finger's border, at unit size, (n, 2); None if off it."""
        arms = (points - self.borders[i][0]) / self.scale
        if float(np.abs(arms @ self.normals[i]).max()) > PLACE_SLACK:
            return None
        return arms @ plane_frame(self.normals[i])

    def _polygon(self, i: int, corners: Array) -> FlatPolygon | None:
        """Write a convex polygon in the coordinates of `_flat`; None if it is none."""
        if not FEWEST_CORNERS <= len(corners) <= MOST_CORNERS:
            return None
        flat = self._flat(i, corners)
        return None if flat is None else convex_polygon(flat, PLACE_SLACK)

    def _is_open(self) -> bool:
        """Return whether `open_choice` lies on the borders at radius `limit`, without closure."""
        choice, wrench = self.open_choice, self.open_wrench
        if choice is None:
            return wrench is None and self.limit == math.inf
        if self.limit == math.inf:
            return False
        for i, place in enumerate(choice):
            border, at = self._polygon(i, self.borders[i]), self._flat(i, place[None])
            if border is None or at is None or not border.holds(at, PLACE_SLACK):
                return False
        away = float(np.linalg.norm(choice - self.centers, axis=1).max())
        proof = ClosureCertificate(False, 0.0, choice, self.normals, self.friction, None, wrench)
        return abs(away - self.limit) <= PLACE_SLACK * self.scale and proof.verify()

    # a region with depth is a prism: its corners lie on both sides of the plane
    def _closes(self) -> bool:
        prisms = [
            (np.vstack([r.polygon - depth * n, r.polygon + depth * n]) - self.origin) / self.scale
            for r, n, depth in zip(self.regions, self.normals, self.depths, strict=True)
        ]
        return self.cover.verify(prisms, self.normals, self.friction)
