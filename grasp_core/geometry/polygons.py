"""Handles polygons in a plane: frames, edges, clipping, convex pieces, and checks of certificates.

A polygon is a (k, 2) array of corners, counter-clockwise unless it is a hole. A convex polygon is
also the set {y : E y <= b}, with the rows of E unit outward edge normals. Polygons of certificates
(`FlatPolygon`) are checked in plain arithmetic, at about unit size.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.frames import plane_tangents
from grasp_core.solvers.ties import first_best

MERGE_ORDERS = 16
CONVEX_SLACK = 1e-9
"""How far a corner may turn inwards and still count as straight, relative to the product of its two
edges' lengths: well above the rounding of coordinates, well below a visible notch."""

SAME_PART = 1e-3
"""Corners whose heights above a line differ by less than this share of the slack of straight
corners are equally high."""
SAME_CORNER = 1e-9
"""Distance below which two corners count as one, at unit size."""
ON_LINE = 1e-12
"""Distance from a line, relative to coordinates, below which a corner is on it: a thousand rounding
errors. Without it, a cut through a corner leaves a second corner beside it on some machines."""
TRIMMED = 1e-3
"""Share of a polygon's area that is given up to have fewer corners."""


def plane_frame(normal: Array) -> Array:
    """Return two orthonormal columns, (3, 2), right-handed with the normal, which decides them."""
    return np.array(plane_tangents(*normal.tolist())).T


def signed_area(polygon: Array) -> float:
    """Return the area of a polygon, positive if its corners are counter-clockwise."""
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def area_and_centroid(loops: list[Array]) -> tuple[float, Array]:
    """Return the area and its centre (2,) of an outer border with holes (holes clockwise)."""
    area, moment = 0.0, np.zeros(2)
    for loop in loops:
        following = np.roll(loop, -1, axis=0)
        cross = loop[:, 0] * following[:, 1] - loop[:, 1] * following[:, 0]
        area += 0.5 * float(cross.sum())
        moment += ((loop + following) * cross[:, None]).sum(axis=0) / 6.0
    return area, moment / area


def edge_rows(polygon: Array) -> tuple[Array, Array]:
    """Return the half-planes (E, b) of a convex counter-clockwise polygon: inside is E y <= b."""
    along = np.roll(polygon, -1, axis=0) - polygon
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    E = np.column_stack([along[:, 1], -along[:, 0]])
    return E, np.einsum("kj,kj->k", E, polygon)


def clip(polygon: Array, rows: Array, limits: Array) -> Array:
    """Cut a convex polygon (k, m) to rows @ y <= limits; it is (0, m) if nothing is left."""
    for row, limit in zip(rows, limits, strict=True):
        height = polygon @ row - limit
        height[np.abs(height) <= ON_LINE * np.abs(polygon).max(initial=0.0)] = 0.0
        kept: list[Array] = []
        for here in range(len(polygon)):
            after = (here + 1) % len(polygon)
            if height[here] <= 0.0:
                kept.append(polygon[here])
            if height[here] * height[after] < 0.0:
                share = height[here] / (height[here] - height[after])
                kept.append(polygon[here] + share * (polygon[after] - polygon[here]))
        polygon = np.array(kept).reshape(-1, polygon.shape[1])
    return polygon


def circle(count: int) -> Array:
    """Return points at equal distances on the circle of radius one, counter-clockwise, (n, 2)."""
    turns = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(turns), np.sin(turns)])


def clip_to_disc(polygon: Array, center: Array, radius: float, sides: int) -> Array:
    """Cut a convex polygon to a regular one around a disc."""
    rows = circle(sides)
    return clip(polygon, rows, rows @ center + radius)


def tidy(polygon: Array) -> Array:
    """Remove corners from a polygon (k, 2) at unit size that coincide with the corner before."""
    return polygon[np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1) > SAME_CORNER]


def with_fewer_corners(polygon: Array) -> Array:
    """Drop corners that add little area to a convex polygon (k, 2); the result is inside it."""
    left = TRIMMED * signed_area(polygon)
    while len(polygon) > 3:  # noqa: PLR2004 - a triangle has no corner to spare
        before = np.roll(polygon, 1, axis=0) - polygon
        after = np.roll(polygon, -1, axis=0) - polygon
        areas = 0.5 * np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
        least = first_best(-areas, ON_LINE)
        left -= areas[least]
        if left < 0.0:
            break
        polygon = np.delete(polygon, least, axis=0)
    return polygon


def nearest_point(polygon: Array, point: Array) -> Array:
    """Return the point of a convex counter-clockwise polygon (k, 2) nearest to a point (2,)."""
    E, b = edge_rows(polygon)
    if (E @ point <= b).all():
        return point
    feet = nearest_on_segments(polygon, np.roll(polygon, -1, axis=0), point)
    return feet[first_best(-np.linalg.norm(feet - point, axis=1))]


def nearest_on_segments(starts: Array, ends: Array, points: Array) -> Array:
    """Return the points of segments nearest to given points, (..., d); segments may be points."""
    along = ends - starts
    squares = np.einsum("...i,...i->...", along, along)
    shares = np.einsum("...i,...i->...", points - starts, along)
    shares = np.clip(shares / np.where(squares > 0.0, squares, 1.0), 0.0, 1.0)
    return starts + shares[..., None] * along


def convex_hull(points: Array) -> Array:
    """Return the corners of a convex hull, counter-clockwise from the first point on, (k, 2)."""
    ordered = points[np.lexsort(points.T[::-1])]
    apart = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))
    # Python's numbers: one by one they take a tenth of the time that numpy's take
    run: list[list[float]] = ordered[apart].tolist()

    def lower(run: list[list[float]]) -> list[list[float]]:
        chain = list[list[float]]()
        for point in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
                chain.pop()
            chain.append(point)
        return chain[: max(len(chain) - 1, 1)]

    hull = np.array(lower(run) + lower(run[::-1]))
    hull = without_straight_corners(hull, SAME_CORNER * float(np.ptp(points, axis=0).max()))
    places = (points[None] == hull[:, None]).all(axis=2).argmax(axis=1)
    return np.roll(hull, -int(places.argmin()), axis=0)


def _turn(one: Sequence[float], two: Sequence[float], three: Sequence[float]) -> float:
    """Return twice the area of a triangle, positive if it turns left."""
    (a, b), (c, d), (e, f) = one, two, three
    return (c - a) * (f - b) - (d - b) * (e - a)


def without_straight_corners(polygon: Array, slack: float) -> Array:
    """Drop corners that lie within `slack` of the line through their two neighbours."""
    kept = polygon
    while len(kept) > 3:  # noqa: PLR2004 - a triangle has no corner to spare
        before, after = np.roll(kept, 1, axis=0), np.roll(kept, -1, axis=0)
        chord = after - before
        cross = chord[:, 0] * (kept - before)[:, 1] - chord[:, 1] * (kept - before)[:, 0]
        height = np.abs(cross) / np.maximum(np.linalg.norm(chord, axis=1), slack)
        straightest = first_best(-height, SAME_PART * slack)
        if height[straightest] > slack:
            break
        kept = np.delete(kept, straightest, axis=0)
    return kept


def is_convex(polygon: Array) -> bool:
    """Return whether a counter-clockwise polygon turns left (or goes straight) at every corner."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    following = np.roll(edge, -1, axis=0)
    turn = edge[:, 0] * following[:, 1] - edge[:, 1] * following[:, 0]
    lengths = np.linalg.norm(edge, axis=1) * np.linalg.norm(following, axis=1)
    return bool((turn >= -CONVEX_SLACK * lengths).all())


def merge_into_convex_pieces(points: Array, triangles: Indices) -> list[Array]:
    """Join the triangles of a polygon into few convex pieces.

    Diagonals are removed one by one as long as the two pieces beside a diagonal form a convex
    piece; the result has at most four times the least possible number of pieces. The order matters,
    so a few orders are tried and the result with the fewest pieces is kept.

    Source:
        Hertel & Mehlhorn, "Fast triangulation of the plane with respect to simple
        polygons", Information and Control 64, 1985.
    """
    edges = {edge for triangle in triangles.tolist() for edge in _edges(triangle)}
    diagonals = sorted(edge for edge in edges if edge[0] < edge[1] and edge[::-1] in edges)
    starts = range(0, len(diagonals), 1 + len(diagonals) // MERGE_ORDERS)
    orders = [diagonals[start:] + diagonals[:start] for start in starts] or [diagonals]
    return min((_merged(points, triangles, order) for order in orders), key=len)


def _merged(points: Array, triangles: Indices, diagonals: list[tuple[int, int]]) -> list[Array]:
    pieces = {index: [int(v) for v in triangle] for index, triangle in enumerate(triangles)}
    owner = {edge: key for key, loop in pieces.items() for edge in _edges(loop)}
    for tail, head in diagonals:
        one, two = owner[tail, head], owner[head, tail]
        if one == two:
            continue
        # along the common edge: walk one from head to tail, then the other back
        start, other = pieces[one].index(head), pieces[two].index(tail)
        back = pieces[two][other:] + pieces[two][:other]
        joined = pieces[one][start:] + pieces[one][:start] + back[1:-1]
        if len(set(joined)) == len(joined) and is_convex(points[joined]):
            pieces[one] = joined
            del pieces[two]
            owner.update(dict.fromkeys(_edges(joined), one))
    return [points[loop] for _, loop in sorted(pieces.items())]


def _edges(loop: list[int]) -> list[tuple[int, int]]:
    return list(zip(loop, loop[1:] + loop[:1], strict=True))


FEWEST_CORNERS, MOST_CORNERS = 3, 5000
RADIUS_ERROR, EXTENT_ERROR = 1e-6, 1e-9
"""Largest error of a claimed radius of the largest disc, over it and over the polygon's extent."""
LEFT_OUT = 2e-3
"""Share of a polygon's area by which it may fail to cover its disc: half of it is given up to have
fewer corners, the rest is for `CIRCLE_SIDES`."""
CIRCLE_SIDES = 64
"""Number of sides of the polygon around a disc; its area exceeds the disc's by a share of 8e-4."""


@dataclass(frozen=True, slots=True, eq=False)
class FlatPolygon:
    """A convex polygon in its plane, by its corners and by its half-planes."""

    corners: Array  # counter-clockwise, (k, 2)
    E: Array  # unit outward edge normals, (k, 2)
    b: Array  # offsets of the edges, (k,): a point y is inside where E y <= b

    def holds(self, points: Array, slack: float) -> bool:
        """Return whether points (n, 2) are inside, or outside by at most a slack."""
        return bool((points @ self.E.T <= self.b + slack).all())


def convex_polygon(corners: Array, slack: float) -> FlatPolygon | None:
    """Make a polygon of corners (k, 2), repeats left out; None if not convex and in order."""
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
    slack = RADIUS_ERROR * radius + EXTENT_ERROR * extent
    inner, outer = (
        clip(polygon.corners, polygon.E, polygon.b - radius - sign * slack) for sign in (-1.0, 1.0)
    )
    return radius > 0.0 and len(inner) > 0 and len(outer) == 0


def holds_disc(polygon: FlatPolygon, border: FlatPolygon, center: Array, radius: float) -> bool:
    """Return whether a polygon covers a disc in a border, but for `LEFT_OUT` of its own area."""
    disc = clip_to_disc(border.corners, center, radius, CIRCLE_SIDES)
    if len(disc) == 0:
        return radius == 0.0
    held = clip(disc, polygon.E, polygon.b)
    lacking = signed_area(disc) - (signed_area(held) if len(held) else 0.0)
    return lacking <= LEFT_OUT * signed_area(polygon.corners)
