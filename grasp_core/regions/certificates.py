"""Holds independent regions with their proof, and checks every claim about them."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from grasp_core.arrays import Amount, Array, Point, Polygon, Shape, Wrench
from grasp_core.checked import LARGEST_FRICTION
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.declared import Declared
from grasp_core.geometry.polygons import (
    FEWEST_CORNERS,
    MOST_CORNERS,
    FlatPolygon,
    flat_polygon,
    has_inscribed_radius,
    holds_disc,
    plane_frame,
)
from grasp_core.kinds import Quantity, Range
from grasp_core.regions.proof import TwistCover
from grasp_core.values import FINGERS, ContactRegion

PLACED = 1e-9
"""How far points may be off their planes and borders, and radii off their measured values, relative
to `scale`, which is no longer than contacts are apart: files that keep ten digits stay within it.
"""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
    limit: Annotated[float, Range(least=0.0, most=math.inf)]
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

        What may be `PLACED` off is measured with it: twice as long as it need be, for rounding.
        """
        return self.scale <= 2.0 * float(np.linalg.norm(np.ptp(np.vstack(self.borders), axis=0)))

    def _has_discs(self) -> bool:
        farthest = 0.0
        for i, region in enumerate(self.regions):
            if region.kind != "certified":
                return False
            border, polygon = self._flat(i, self.borders[i]), self._flat(i, region.polygon)
            center = self._at(i, self.centers[i])
            if border is None or polygon is None or center is None:
                return False
            width, radius = region.inscribed_radius / self.scale, self.radius / self.scale
            if not (
                border.holds(polygon.corners, PLACED)
                and polygon.holds(center[None], PLACED)
                and has_inscribed_radius(polygon, width)
                and holds_disc(polygon, border, center, radius)
            ):
                return False
            away = np.linalg.norm(border.corners - center, axis=1)
            farthest = max(farthest, float(away.max()))
        return self.radius <= (farthest + PLACED) * self.scale

    def _flat(self, i: int, polygon: Array) -> FlatPolygon | None:
        """Write a convex polygon in the plane of a finger's border, at unit size; else None."""
        if not FEWEST_CORNERS <= len(polygon) <= MOST_CORNERS:
            return None
        start = self.borders[i][0]
        return flat_polygon((polygon - start) / self.scale, self.normals[i], PLACED)

    def _at(self, i: int, point: Array) -> Array | None:
        """Write a point in the coordinates of `_flat`, (2,); None if it is off the plane."""
        arm = (point - self.borders[i][0]) / self.scale
        if abs(float(arm @ self.normals[i])) > PLACED:
            return None
        return arm @ plane_frame(self.normals[i])

    def _is_open(self) -> bool:
        """Return whether `open_choice` lies on the borders at radius `limit`, without closure."""
        choice, wrench = self.open_choice, self.open_wrench
        if choice is None:
            return wrench is None and self.limit == math.inf
        if self.limit == math.inf:
            return False
        for i, place in enumerate(choice):
            border, at = self._flat(i, self.borders[i]), self._at(i, place)
            if border is None or at is None or not border.holds(at[None], PLACED):
                return False
        away = float(np.linalg.norm(choice - self.centers, axis=1).max())
        proof = ClosureCertificate(False, 0.0, choice, self.normals, self.friction, None, wrench)
        return abs(away - self.limit) <= PLACED * self.scale and proof.verify()

    # a region with depth is a prism: its corners lie on both sides of the plane
    def _closes(self) -> bool:
        prisms = [
            (np.vstack([r.polygon - depth * n, r.polygon + depth * n]) - self.origin) / self.scale
            for r, n, depth in zip(self.regions, self.normals, self.depths, strict=True)
        ]
        return self.cover.verify(prisms, self.normals, self.friction)
