"""Holds independent regions with their proof, and checks every claim about them."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from grasp_core.arrays import (
    Array,
    are_frictions,
    are_units,
    frozen,
    is_a,
    is_array,
    is_number,
    is_tuple_of,
)
from grasp_core.checked import SMALLEST, instance, number, positive, several
from grasp_core.closure.contacts import contact_frictions
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.declared import ByValue
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import (
    FEWEST_CORNERS,
    MOST_CORNERS,
    FlatPolygon,
    flat_polygon,
    has_inscribed_radius,
    holds_disc,
    plane_frame,
)
from grasp_core.regions.proof import TwistCover
from grasp_core.values import FINGERS, ContactRegion

ARRAYS = {
    "centers": (FINGERS, 3), "normals": (FINGERS, 3), "friction": (FINGERS,), "origin": (3,),
    "depths": (FINGERS,), "open_choice": (FINGERS, 3), "open_wrench": (6,),
}  # fmt: skip
"""Shapes of the fields that hold arrays; the last two may be None."""
PLACED = 1e-9
"""How far points may be off their planes and borders, and radii off their measured values, relative
to `scale`, which is no longer than contacts are apart: files that keep ten digits stay within it.
"""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CertifiedRegions(ByValue):
    """Regions in which each finger may stand while the others stand anywhere in theirs."""

    regions: tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
    """Contact regions, one per finger: convex polygons inside `borders`."""
    borders: tuple[Array, Array, Array, Array]
    """Convex piece of a face around each region, at the asked distance from edges, (k, 3) [m]."""
    radius: float
    """Radius of discs around `centers` [m]. Each polygon holds the part of its disc inside its
    border, except for at most 0.2 % of the polygon's area. The radius is at most that of discs that
    hold all of `borders`."""
    centers: Array
    """Centres of the discs, which lie in the polygons, (4, 3) [m]."""
    limit: float
    """Radius of slightly larger discs that contain the contacts `open_choice` [m]; infinite if no
    such contacts were found."""
    open_choice: Array | None
    """Contacts inside `borders` and the discs of radius `limit` that are not force-closed, (4, 3)
    [m]."""
    open_wrench: Array | None
    """Separating wrench of `open_choice`, like `ClosureCertificate.separating_wrench`, (6,)."""
    friction: Array
    """Coulomb coefficients at which all contacts in the regions are force-closed, (4,)."""
    origin: Array
    """Point about which torques are taken in the proof, (3,) [m]."""
    normals: Array
    """Unit normals of the faces, into the object, (4, 3)."""
    depths: Array
    """Largest distance of the true surface from each region's plane, (4,) [m]."""
    cover: TwistCover
    """Proof that all contacts in the regions are force-closed, with lengths relative to `scale`."""
    scale: float
    """Length that the proof uses as its unit [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", contact_frictions(self.friction, FINGERS))
        for name, shape in ARRAYS.items():
            if getattr(self, name) is not None or not name.startswith("open"):
                object.__setattr__(self, name, frozen(getattr(self, name), shape, name))
        border = partial(frozen, shape=(None, 3), name="borders")
        object.__setattr__(self, "borders", several(self.borders, border, "borders", "polygons"))
        region = partial(instance, kind=ContactRegion, name="regions")
        regions = several(self.regions, region, "regions", "ContactRegion values")
        if not len(regions) == len(self.borders) == FINGERS:
            got = f"{len(regions)} regions and {len(self.borders)} borders"
            raise InputError(
                f"regions and borders must be {FINGERS} each, one per finger, got {got}"
            )
        instance(self.cover, TwistCover, "cover")
        positive(self.scale, "scale")
        number(self.radius, "radius", least=0.0)
        number(self.limit, "limit", least=0.0, most=math.inf)
        if (self.depths < 0.0).any():
            raise InputError(f"depths must not be negative, got {float(self.depths.min()):.6g}")

    def verify(self) -> bool:
        """Check every field again in plain arithmetic.

        This checks that every choice of contacts in `regions`, on planes with `normals` and at most
        `depths` off them, is force-closed with `friction`; that the polygons are convex, in their
        borders, as wide as they say, and hold the discs; and that `open_choice` is open. Whoever
        has the object checks that `borders` are parts of its faces.
        """
        with np.errstate(all="ignore"):
            known = self._has_numbers() and self._has_fitting_scale()
            return known and self._has_discs() and self._is_open() and self._closes()

    def _has_numbers(self) -> bool:
        arrays = all(
            is_array(value, *shape) if value is not None else name.startswith("open")
            for name, shape in ARRAYS.items()
            for value in [getattr(self, name)]
        )
        return (
            arrays
            and bool((self.depths >= 0.0).all())
            and are_units(self.normals, FINGERS, 3)
            and are_frictions(self.friction, FINGERS)
            and is_tuple_of(self.regions, ContactRegion, FINGERS)
            and is_tuple_of(self.borders, np.ndarray, FINGERS)
            and all(is_array(each, None, 3) and len(each) > 0 for each in self.borders)
            and is_a(self.cover, TwistCover)
            and is_number(self.scale, least=SMALLEST)
            and is_number(self.radius, least=0.0)
        )

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
        if not is_array(polygon, None, 3) or not FEWEST_CORNERS <= len(polygon) <= MOST_CORNERS:
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
        if not is_number(self.limit, least=0.0):
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
