"""Grows large convex polygons in a plane between segments that must stay outside.

A segment is kept out by the half-plane through the segment's point nearest to the middle of the
polygon, perpendicular to the line that connects the two: as a segment is convex, all of it is
beyond. Distance is measured by an ellipse fitted to the polygon, so that long polygons grow long;
the largest polygon of a few rounds is kept.

The idea is that of IRIS (Deits & Tedrake, "Computing large convex regions of obstacle-free space
through semidefinite programming", 2015), with the ellipse of the polygon's second moments.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.polygons import area_and_centroid, clip, signed_area
from grasp_core.solvers.ties import first_best, surpassing

ROUNDS = 5
SLENDEREST = 1e-5
"""Least width of a polygon that grows further, relative to its length: places that are stretched to
a disc are rounded by some 1e-16 of the length divided by this, which must be well below the gap."""
SAME_HEIGHT = 1.0 - 1e-12
"""Share of a half-plane's distance from the middle at which an end of a segment counts as beyond.
"""
CANDIDATES = 400
"""Largest number of points that are tried as the middle of a polygon."""


def clearest_point(points: Array, segments: Array) -> tuple[Array, float]:
    """Find the point farthest from all segments, (2,), and its distance from them.

    Takes `points` (n, 2); `segments` (m, 2, 2).
    """
    tried = points[:: 1 + len(points) // CANDIDATES]
    room = np.array([_nearest(point, segments)[1].min() for point in tried])
    best = first_best(room)
    return tried[best], float(room[best])


def clearing(start: Array, segments: Array, gap: float) -> Array | None:
    """Find a convex polygon around a point that no segment enters, (k, 2).

    The polygon is counter-clockwise; None if there is no room for one.

    Takes `start` (2,); `segments` (m, 2, 2).
    """
    low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    box = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    best, middle, stretch = None, start, np.eye(2)
    for _ in range(ROUNDS):
        polygon = _cut(box, middle, segments, stretch, gap)
        least = 0.0 if best is None else surpassing(signed_area(best))
        if len(polygon) < 3 or signed_area(polygon) <= least:  # noqa: PLR2004
            break
        best = polygon
        if (ellipse := _ellipse(polygon)) is None:
            break
        middle, stretch = ellipse
    return best


def _cut(box: Array, middle: Array, segments: Array, stretch: Array, gap: float) -> Array:
    """Cut a polygon by one half-plane for each segment, the nearest segment first.

    Each half-plane is put where its own segment is beyond it as computed, so that at least this
    segment is dropped: the rounding of `away` moves the ends of a long segment near the middle.
    """
    left = (segments - middle) @ stretch.T
    polygon = box
    while len(left):
        points, distances = _nearest(np.zeros(2), left)
        nearest = first_best(-distances)
        if distances[nearest] <= 0.0:
            return np.empty((0, 2))
        away = points[nearest] / distances[nearest]
        heights = left @ away
        limit = distances[nearest]
        if (own := heights[nearest].min()) < limit * SAME_HEIGHT:
            limit = own
        if limit <= 0.0:
            return np.empty((0, 2))
        row = away @ stretch
        length = float(np.linalg.norm(row))
        polygon = clip(
            polygon, row[None] / length, np.array([(limit + row @ middle) / length - gap])
        )
        left = left[(heights < limit * SAME_HEIGHT).any(axis=1)]
    return polygon


def _nearest(point: Array, segments: Array) -> tuple[Array, Array]:
    """Return the points of segments nearest to a point, (m, 2), and their distances, (m,)."""
    tails, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    squared = np.einsum("mi,mi->m", along, along)
    share = np.einsum("mi,mi->m", point - tails, along) / np.where(squared > 0.0, squared, 1.0)
    points = tails + np.clip(share, 0.0, 1.0)[:, None] * along
    return points, np.linalg.norm(points - point, axis=1)


def _ellipse(polygon: Array) -> tuple[Array, Array] | None:
    """Return a polygon's centre, and the map that turns its second moments into a disc's.

    The result is None for a polygon so slender that rounding would distort the map.
    """
    _, centre = area_and_centroid([polygon])
    after = np.roll(polygon, -1, axis=0)
    corners = np.concatenate([polygon, 0.5 * (polygon + after)]) - centre
    values, axes = np.linalg.eigh(corners.T @ corners)
    if values[0] <= SLENDEREST**2 * values[1]:
        return None
    return centre, (axes / np.sqrt(values)) @ axes.T
