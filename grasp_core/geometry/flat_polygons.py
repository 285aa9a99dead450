"""Checks convex polygons of certificates in plain arithmetic: shape, width, and discs in them.

Coordinates are in the polygon's plane, with the polygon at about unit size.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.polygons import clip, edge_rows, plane_frame, signed_area, tidy

FEWEST_CORNERS, MOST_CORNERS = 3, 5000
WIDTH, FINE = 1e-6, 1e-9
"""Largest error of a claimed radius of the largest disc: relative to it, and to the extent of
the polygon."""
LEFT_OUT = 2e-3
"""Share of a polygon's area by which it may fail to cover its disc: half of it is given up to have
fewer corners, the rest is for `SIDES`."""
SIDES = 64
"""Number of sides of the polygon around a disc; its area exceeds the disc's by a share of 8e-4."""


@dataclass(frozen=True, slots=True, eq=False)
class FlatPolygon:
    """A convex polygon in its plane, by its corners and by its half-planes."""

    corners: Array
    """Corners, counter-clockwise, (k, 2)."""
    E: Array
    """Unit outward edge normals, (k, 2)."""
    b: Array
    """Offsets of the edges, (k,): a point y is inside where E y <= b."""

    def holds(self, points: Array, slack: float) -> bool:
        """Return whether points (n, 2) are inside, or outside by at most a slack."""
        return bool((points @ self.E.T <= self.b + slack).all())


def flat_polygon(arms: Array, normal: Array, slack: float) -> FlatPolygon | None:
    """Make a convex polygon from points (k, 3) in the plane through zero, or None.

    The polygon is counter-clockwise about its normal.

    Gives the polygon; None if the points are off the plane, or not corners of a convex polygon in
    order.
    """
    if float(np.abs(arms @ normal).max()) > slack:
        return None
    return convex_polygon(arms @ plane_frame(normal), slack)


def convex_polygon(corners: Array, slack: float) -> FlatPolygon | None:
    """Make a convex polygon from corners (k, 2); None if they are not its corners in order.

    A corner that coincides with the corner before it, as cutting leaves them, counts once.
    """
    corners = tidy(corners)
    if len(corners) < FEWEST_CORNERS:
        return None
    E, b = edge_rows(corners)
    found = FlatPolygon(corners, E, b)
    turning = np.isfinite(E).all() and signed_area(corners) > 0.0 and _turns_once(E)
    return found if turning and found.holds(corners, slack) else None


def _turns_once(E: Array) -> bool:
    """Return whether normals of a polygon's edges, (k, 2), turn around once, not more often."""
    following = np.roll(E, -1, axis=0)
    turns = E[:, 0] * following[:, 1] - E[:, 1] * following[:, 0]
    return abs(float(np.arctan2(turns, (E * following).sum(axis=1)).sum())) < 3.0 * np.pi


def has_inscribed_radius(polygon: FlatPolygon, radius: float) -> bool:
    """Return whether a polygon shrinks to nothing when its edges move in by the radius."""
    extent = float(np.linalg.norm(np.ptp(polygon.corners, axis=0)))
    slack = WIDTH * radius + FINE * extent
    inner, outer = (
        clip(polygon.corners, polygon.E, polygon.b - radius - sign * slack) for sign in (-1.0, 1.0)
    )
    return radius > 0.0 and len(inner) > 0 and len(outer) == 0


def holds_disc(polygon: FlatPolygon, border: FlatPolygon, center: Array, radius: float) -> bool:
    """Return whether a polygon covers a disc within a border, but for a share `LEFT_OUT`.

    The share refers to the polygon's own area.
    """
    turns = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rows = np.column_stack([np.cos(turns), np.sin(turns)])
    disc = clip(border.corners, rows, rows @ center + radius)
    if len(disc) == 0:
        return radius == 0.0
    held = clip(disc, polygon.E, polygon.b)
    lacking = signed_area(disc) - (signed_area(held) if len(held) else 0.0)
    return lacking <= LEFT_OUT * signed_area(polygon.corners)
