"""Finds the planar faces of a mesh, or nearly flat patches of a curved or scanned surface.

Triangles are grouped into planar faces by limits of angle and distance, and outlined.

Solved for patches: planes and convex polygons in them such that over each point of a polygon, along
the plane's normal, there is exactly one point of a connected group of triangles, at most `depth`
from the plane, where the surface leans from the plane by at most `spread`.

Derivation. Take a group of triangles that all lean from a plane by less than a right angle, and a
convex polygon in the plane that no edge on the group's border projects into. Over the polygon the
projection then has no folds and no ends: the number of triangles over a point is the same
everywhere. It is one at the point that the polygon grew from, so it is one everywhere. Spread and
depth are measured on all triangles that may reach over the polygon.

Groups grow (see `surface`) from the flattest triangles on. Edges of holes in the surface, or of
more than two triangles, are borders.

Polygons grow between segments that must stay outside. A segment is kept out by the half-plane
through the segment's point nearest to the middle of the polygon, perpendicular to the line that
connects the two: as a segment is convex, all of it is beyond. Distance is measured by an ellipse
fitted to the polygon, so that long polygons grow long; the largest polygon of a few rounds is kept.

The idea is that of IRIS (Deits & Tedrake, "Computing large convex regions of obstacle-free space
through semidefinite programming", 2015), with the ellipse of the polygon's second moments.
"""

import math
from bisect import insort
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.cones.spanning import angles_between
from grasp_core.geometry.polygons import (
    area_and_centroid,
    clip,
    edge_rows,
    is_convex,
    merge_into_convex_pieces,
    nearest_on_segments,
    plane_frame,
    signed_area,
    without_straight_corners,
)
from grasp_core.mesh_files.limits import PatchLimits
from grasp_core.objects.booleans import triangulate
from grasp_core.objects.surface import NO_CAPS, Face, Fit, Mesh, Plane, border_loops, crosses_of
from grasp_core.solvers.ties import first_best, graded, largest_first, ranks, surpassing

MAX_FACES = 200
"""Number of planar faces above which an object counts as curved: 200 faces have 65 million
quadruples, some 6 million of which positively span."""

PLANAR = 1e-6
"""Largest distance from a plane, over the extent, that is in it: ten single roundings."""
ANGLE = 1e-3
"""Largest angle between normals in one face [rad]: about a thousand times the error of the normal
of a triangle one millimetre high in single precision, and far below any friction angle of interest.
"""
FITS = 3
"""Number of times that a plane is fitted to a group of triangles of a patch, or again to one of a
face with rounded corners."""


ACROSS_SLIVERS = 4.0
"""Distance of faces that slivers part, in distances that are in a plane."""
LIKE = 0.99
"""Cosine of the largest angle of planes that are compared further."""


def planar_slack(extent: float, flatness_m: float) -> float:
    """Return the distance within which corners count as in one plane, if rounding explains some."""
    return max(PLANAR * extent, flatness_m)


def coplanar_groups(
    mesh: Mesh, distance: float, *, angle: float = ANGLE, blur: float = 0.0, refit: bool = False,
    caps: Indices = NO_CAPS, most: int | None = None,
) -> list[Indices]:  # fmt: skip
    """Group triangles that lie in one plane within the limits and connect across edges, (g,) each.

    Groups are in the order of their first triangle, and do not depend on the winding. Not all of
    them are found if there are more than `most`.

    Groups grow from the largest triangles first, whose planes are the least affected by rounding.
    Rounding may have moved one side of a triangle by `blur` against the opposite corner [m], so
    that a triangle of this height may lean by a radian more; with `refit` the plane is fitted again
    to what has grown. A triangle thinner than the distance limit has
    no meaningful normal, so only its distance counts.
    """
    corners, normals, areas = mesh.corners, mesh.normals, mesh.areas
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    sliver = 2.0 * areas <= distance * longest
    heights = np.where(sliver, 1.0, 2.0 * areas) / longest
    tilts = np.where(sliver, np.inf, angle + blur / heights)

    def fit(some: Indices, plane: Plane) -> NDArray[np.bool_]:
        normal, origin = plane
        tilt = np.linalg.norm(normals[some] - normal, axis=1)
        off = np.abs((corners[some] - origin) @ normal).max(axis=1)
        return (tilt <= tilts[some]) & (off <= distance)

    found = mesh.groups(
        largest_first(2.0 * areas),
        lambda seed: (normals[seed], corners[seed, 0]),
        fit,
        1 + FITS if refit else 1,
        caps,
    )
    every = list(islice(found, None if most is None else most + 1))
    groups = _bridged(mesh, every, fit, sliver, ACROSS_SLIVERS * distance)
    return sorted(map(np.sort, groups), key=lambda group: int(group[0]))


def _bridged(
    mesh: Mesh, found: Sequence[tuple[Indices, Plane]], fit: Fit, sliver: NDArray[np.bool_],
    beside: float,
) -> list[Indices]:  # fmt: skip
    """Join groups of one plane that slivers of other groups keep apart.

    A sliver fits many planes, and is in the group that grew first. Those that connect two groups of
    one plane and `beside` each other [m] are taken from other groups, unless that would leave these
    in pieces. A sliver that leads from one face to a distant one is no part of them.
    """
    across, corners = mesh.across, mesh.corners
    groups: list[Indices] = [group for group, _ in found]
    owner: Indices = np.full(len(sliver), -1, dtype=np.int64)
    for place, group in enumerate(groups):
        owner[group] = place
    thin = np.flatnonzero(sliver & (owner >= 0))
    if not len(thin):
        return groups
    normals = np.array([normal for _, (normal, _) in found])
    for place, (_, plane) in enumerate(found):
        likely = np.flatnonzero(normals[place + 1 :] @ plane[0] > LIKE) + place + 1
        alike = [
            other for other in likely.tolist()
            if len(groups[other]) and len(groups[place]) and fit(groups[other], plane).all()
            and _apart(corners[groups[place]], corners[groups[other]]) <= beside
        ]  # fmt: skip
        if not alike:
            continue
        own = np.concatenate([groups[place], *(groups[other] for other in alike)])
        reached = _connected(across, np.union1d(own, thin[fit(thin, plane)]), groups[place][0])
        joined = [other for other in alike if groups[other][0] in reached]
        whole = _without_ends(across, reached, ~np.isin(owner[reached], [place, *joined]))
        left = {
            other: np.setdiff1d(groups[other], whole)
            for other in map(int, np.setdiff1d(owner[whole], [place, *joined]))
        }  # fmt: skip
        if joined and all(
            len(_connected(across, rest, *rest[:1])) == len(rest) for rest in left.values()
        ):
            groups = [
                whole if at == place else left.get(at, group[: 0 if at in joined else None])
                for at, group in enumerate(groups)
            ]
            owner[whole] = place
    return [group for group in groups if len(group)]


def _apart(some: Array, others: Array) -> float:
    """Return how far corners of triangles (s, 3, 3), (o, 3, 3) are from edges of the others."""
    gaps = list[float]()
    for one, two in ((some, others), (others, some)):
        heads = np.roll(two, -1, axis=1)
        for point in one.reshape(-1, 3):
            nearest = nearest_on_segments(two, heads, point)
            gaps.append(float(np.linalg.norm(nearest - point, axis=-1).min()))
    return min(gaps)


def _connected(across: Indices, members: Indices, *first: int) -> Indices:
    """Return the triangles among sorted members that connect with a first one, sorted."""
    reached = np.array(first, dtype=np.int64)
    while len(more := np.setdiff1d(np.intersect1d(across[reached], members), reached)):
        reached = np.union1d(reached, more)
    return reached


def _without_ends(across: Indices, members: Indices, loose: NDArray[np.bool_]) -> Indices:
    """Drop loose triangles that do not lie between two others, again and again."""
    while True:
        ends = loose & (np.isin(across[members], members).sum(axis=1) < 2)  # noqa: PLR2004
        if not ends.any():
            return members
        members, loose = members[~ends], loose[~ends]


def planar_face(mesh: Mesh, group: Indices, slack: float) -> Face:
    """Outline the planar face of a group of coplanar triangles of an outward mesh."""
    corners = mesh.corners[group]
    crosses = crosses_of(corners)
    outward = crosses.sum(axis=0)
    normal = -outward / np.linalg.norm(outward)
    weights = np.linalg.norm(crosses, axis=1)
    origin = (weights[:, None] * corners.mean(axis=1)).sum(axis=0) / weights.sum()
    frame = plane_frame(normal)

    found = [
        without_straight_corners((mesh.vertices[loop[::-1]] - origin) @ frame, slack)
        for loop in border_loops(mesh.triangles[group])
    ]
    loops = [found[place] for place in largest_first([signed_area(loop) for loop in found])]
    area, centroid = area_and_centroid(loops)
    polygon, *holes = (origin + loop @ frame.T for loop in loops)
    return Face(
        normal=normal,
        centroid=origin + frame @ centroid,
        area=area,
        polygon=polygon,
        holes=tuple(holes),
        pieces=tuple(origin + piece @ frame.T for piece in convex_pieces(loops, slack)),
    )


def convex_pieces(loops: list[Array], slack: float) -> list[Array]:
    """Split a plane figure of loops (k, 2) into convex polygons."""
    if len(loops) == 1 and is_convex(loops[0]):
        return loops
    pieces = merge_into_convex_pieces(np.vstack(loops), triangulate(loops))
    return [without_straight_corners(piece, slack) for piece in pieces]


SMOOTHING = 10
"""Number of times that normals are averaged with neighbours, to find where a surface is flat."""
FLATNESS_DIGITS = 9
"""Digits to which cosines of normals and their averages are compared; equal ones are ties."""
BORDER_GAP = 1e-9
"""Distance that patches keep from borders of their triangles, relative to the object's extent."""


def flat_patches(surface: Mesh, limits: PatchLimits, caps: Indices = NO_CAPS) -> tuple[Face, ...]:
    """Find the largest nearly flat patches of a surface, those with the largest discs first."""
    extent = surface.extent
    depth = limits.depth * extent
    found: list[tuple[float, Face]] = []
    radii: list[float] = []
    for group in _groups(surface, math.radians(limits.spread_deg), depth, caps):
        # groups come by falling area, and no disc is larger than its group
        enough = len(radii) >= limits.most
        if enough and math.pi * radii[-limits.most] ** 2 >= group.area:
            break
        if patch := _patch(surface, group.triangles, -group.outward, BORDER_GAP * extent):
            found.append(patch)
            insort(radii, patch[0])
    return _largest_apart(found, limits.most, extent)


def _largest_apart(found: list[tuple[float, Face]], most: int, extent: float) -> tuple[Face, ...]:
    """Keep the patches with the largest discs, of equal ones, as a ring has, those far apart."""
    sizes = ranks([-radius for radius, _ in found])
    places = np.array([[*face.normal, *(face.centroid / extent)] for _, face in found])
    nearest, left = np.full(len(found), np.inf), np.ones(len(found), dtype=np.bool_)
    kept: list[int] = []
    while left.any() and len(kept) < most:
        largest = left & (sizes == sizes[left].min())
        kept.append(first_best(np.where(largest, nearest, -1.0)))
        left[kept[-1]] = False
        nearest = np.minimum(nearest, np.linalg.norm(places - places[kept[-1]], axis=1))
    return tuple(found[place][1] for place in kept)


class _Group(NamedTuple):
    """Connected triangles, with the outward normal of their plane and their area [m^2]."""

    triangles: Indices
    outward: Array
    area: float


def _groups(surface: Mesh, spread: float, depth: float, caps: Indices) -> list[_Group]:
    smooth, normals = _smoothed(surface), surface.normals
    flatness: Array = np.einsum("ti,ti->t", smooth, normals)
    flat_first = np.argsort(-graded(flatness, FLATNESS_DIGITS), kind="stable")

    def fit(some: Indices, plane: Plane) -> NDArray[np.bool_]:
        normal, origin = plane
        upright = normals[some] @ normal >= math.cos(spread)
        heights = np.abs((surface.corners[some] - origin) @ normal).max(axis=1)
        return upright & (heights <= depth)

    def first_plane(seed: int) -> Plane:
        # on flat ground the average is the better normal, beside an edge the triangle's own
        middle = surface.corners[seed].mean(axis=0)
        level = float(smooth[seed] @ normals[seed]) >= math.cos(0.5 * spread)
        near = bool(fit(np.array([seed]), (smooth[seed], middle))[0])  # a large triangle may not be
        return (smooth if level and near else normals)[seed], middle

    groups = [
        _Group(members, normal, float(surface.areas[members].sum()))
        for members, (normal, _) in surface.groups(flat_first, first_plane, fit, FITS, caps)
    ]
    return [groups[place] for place in largest_first([group.area for group in groups])]


def _smoothed(surface: Mesh) -> Array:
    """Average normals over neighbouring triangles, weighted by area, (t, 3)."""
    weighted = surface.normals * surface.areas[:, None]
    inner = surface.across >= 0
    for _ in range(SMOOTHING):
        around = np.where(inner[..., None], weighted[surface.across], 0.0).sum(axis=1)
        mean = weighted + around
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        weighted = mean / np.where(length > 0.0, length, 1.0) * surface.areas[:, None]
    return weighted / np.maximum(np.linalg.norm(weighted, axis=1, keepdims=True), 1e-300)


def _patch(surface: Mesh, group: Indices, normal: Array, gap: float) -> tuple[float, Face] | None:
    """Fit a convex polygon that a group covers once; also return its largest disc's radius [m]."""
    frame = plane_frame(normal)
    origin = surface.corners[group].mean(axis=(0, 1))
    flat = (surface.corners[group] - origin) @ frame
    inside = np.isin(surface.across[group], group)
    tails, heads = flat, np.roll(flat, -1, axis=1)
    border = np.stack([tails[~inside], heads[~inside]], axis=1)
    start, room = clearest_point(flat.mean(axis=1), border)
    along, away = heads - tails, start - tails
    turns = along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0]
    over = (turns > 0.0).all(axis=1) | (turns < 0.0).all(axis=1)
    # the derivation needs one triangle over the point from which the polygon grows
    if room <= 0.0 or over.sum() != 1:
        return None
    polygon = clearing(start, border, gap)
    if polygon is None:
        return None
    E, b = edge_rows(polygon)
    beyond = (np.einsum("tkj,ej->tke", flat, E) > b).all(axis=1).any(axis=1)
    facets = group[~beyond]
    heights = (surface.corners[facets] - origin) @ normal
    middle = 0.5 * float(heights.min() + heights.max())
    leans = angles_between(-surface.normals[facets], normal)
    area, centroid = area_and_centroid([polygon])
    plane = origin + middle * normal
    corners = plane + polygon @ frame.T
    face = Face(
        normal=normal,
        centroid=plane + frame @ centroid,
        area=area,
        polygon=corners,
        holes=(),
        pieces=(corners,),
        spread=float(leans.max()),
        depth=0.5 * float(np.ptp(heights)),
        facets=facets,
    )
    return float((b - E @ centroid).min()), face


FITTING_ROUNDS = 5
SLENDEREST = 1e-5
"""Least width of a polygon that grows further, relative to its length: places that are stretched to
a disc are rounded by some 1e-16 of the length divided by this, which must be well below the gap."""
SAME_HEIGHT = 1.0 - 1e-12
"""Share of a half-plane's distance at which an end of a segment counts as beyond."""
CANDIDATES = 400


def clearest_point(points: Array, segments: Array) -> tuple[Array, float]:
    """Find the point farthest from all segments, (2,), and its distance from them."""
    tried = points[:: 1 + len(points) // CANDIDATES]
    room = np.array([_nearest(point, segments)[1].min() for point in tried])
    best = first_best(room)
    return tried[best], float(room[best])


def clearing(start: Array, segments: Array, gap: float) -> Array | None:
    """Find a convex polygon around a point that no segment (m, 2, 2) enters; None without room."""
    low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
    box = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    best, middle, stretch = None, start, np.eye(2)
    for _ in range(FITTING_ROUNDS):
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
    points = nearest_on_segments(segments[:, 0], segments[:, 1], point)
    return points, np.linalg.norm(points - point, axis=1)


def _ellipse(polygon: Array) -> tuple[Array, Array] | None:
    """Return the centre and what turns the second moments into a disc's; None if too slender."""
    _, centre = area_and_centroid([polygon])
    after = np.roll(polygon, -1, axis=0)
    corners = np.concatenate([polygon, 0.5 * (polygon + after)]) - centre
    values, axes = np.linalg.eigh(corners.T @ corners)
    if values[0] <= SLENDEREST**2 * values[1]:
        return None
    return centre, (axes / np.sqrt(values)) @ axes.T
