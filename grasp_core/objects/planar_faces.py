"""Groups triangles into planar faces, by explicit limits of angle and distance, and outlines them.

A group grows across shared edges from a seed triangle and is measured against the seed's
own plane, never from neighbour to neighbour, so that the facets of a fine sphere cannot
creep into one "face".
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.polygons import (
    area_and_centroid,
    is_convex,
    merge_into_convex_pieces,
    plane_frame,
    signed_area,
    without_straight_corners,
)
from grasp_core.objects.booleans import triangulate
from grasp_core.objects.surface import Face
from grasp_core.solvers.ties import largest_first

MAX_FACES = 200
"""Number of planar faces above which an object counts as curved: 200 faces have 65 million
quadruples, some 6 million of which positively span."""
SIDES = 2
"""Number of triangles that meet at an edge of a closed surface."""

PLANAR = 1e-6
"""Largest distance from a plane, relative to the extent, that always counts as in it: some ten
times the rounding of single precision."""
FITS = 3
"""Number of times that a plane is fitted again to a group of triangles with rounded corners."""
NO_CAPS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Flatness:
    """Limits within which triangles count as one planar face."""

    distance: float  # largest distance from the plane [m]
    blur: float = 0.0
    """Largest distance by which rounding may have moved one side of a triangle against the opposite
    corner [m]: a triangle of this height may lean by a radian more."""
    angle: float = 1e-3
    """Largest angle between normals [rad]: about a thousand times the error of the normal of a
    triangle one millimetre high in single precision, and far below any friction angle of interest.
    """

    @classmethod
    def of(cls, extent: float, flatness_m: float) -> "Flatness":
        """Make the limits for an object of an extent, whose rounding explains a distance [m]."""
        return cls(max(PLANAR * extent, flatness_m), 0.5 * flatness_m)


def coplanar_groups(
    vertices: Array, triangles: Indices, flatness: Flatness, caps: Indices = NO_CAPS
) -> list[Indices]:
    """Group triangles that lie in one plane within the limits and connect across edges, (g,) each.

    Groups are in the order of their first triangle, and do not depend on the winding.

    Groups grow from the largest triangles first, whose planes are the least affected by rounding.
    Where coordinates are rounded, the plane is fitted again to what has grown. A triangle thinner
    than the distance limit has no meaningful normal, so only its distance counts.
    """
    table = _Triangles.of(vertices[triangles], triangle_neighbours(triangles), flatness)
    group_of = np.full(len(triangles), -1)
    group_of[caps] = len(triangles)
    for seed in largest_first(table.double_areas):
        if group_of[seed] >= 0:
            continue
        normal, origin = table.normals[seed], table.corners[seed, 0]
        members = table.grown(int(seed), normal, origin, group_of)
        for _ in range(FITS if flatness.blur else 0):
            group_of[members] = -1
            members = table.grown(int(seed), *table.fitted(members), group_of)
        group_of[members] = seed
    group_of[caps] = -1
    kept = np.flatnonzero(group_of >= 0)
    _, first, counts = np.unique(group_of[kept], return_index=True, return_counts=True)
    members = np.split(kept[np.argsort(group_of[kept], kind="stable")], np.cumsum(counts)[:-1])
    return [members[group] for group in np.argsort(first, kind="stable")]


@dataclass(frozen=True, slots=True, eq=False)
class _Triangles:
    """Triangles with what is needed to grow groups of them."""

    corners: Array  # (t, 3, 3) [m]
    crosses: Array  # normals twice as long as the areas, (t, 3)
    double_areas: Array
    normals: Array
    tilts: Array
    """Largest difference of each normal from that of a plane, (t,); infinite for slivers."""
    neighbours: Indices
    distance: float

    @classmethod
    def of(cls, corners: Array, neighbours: Indices, flatness: Flatness) -> "_Triangles":
        crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        double_areas = np.linalg.norm(crosses, axis=1)
        normals = crosses / np.where(double_areas > 0.0, double_areas, 1.0)[:, None]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        sliver = double_areas <= flatness.distance * longest
        heights = np.where(sliver, 1.0, double_areas) / longest
        tilts = np.where(sliver, np.inf, flatness.angle + flatness.blur / heights)
        return cls(corners, crosses, double_areas, normals, tilts, neighbours, flatness.distance)

    def grown(self, seed: int, normal: Array, origin: Array, group_of: Indices) -> list[int]:
        """Collect the triangles near a plane that connect with a seed, and mark them as its own."""
        members, stack = [seed], [seed]
        group_of[seed] = seed
        while stack:  # each triangle is marked once
            for other in self.neighbours[stack.pop()]:
                if other < 0 or group_of[other] >= 0:
                    continue
                tilt = float(np.linalg.norm(self.normals[other] - normal))
                off = np.abs((self.corners[other] - origin) @ normal).max()
                if tilt <= self.tilts[other] and off <= self.distance:
                    group_of[other] = seed
                    members.append(int(other))
                    stack.append(int(other))
        return members

    def fitted(self, members: list[int]) -> tuple[Array, Array]:
        """Fit a plane to triangles: its normal and a point on it."""
        whole, weights = self.crosses[members].sum(axis=0), self.double_areas[members]
        length = float(np.linalg.norm(whole))
        if length == 0.0:
            return self.normals[members[0]], self.corners[members[0], 0]
        return whole / length, weights @ self.corners[members].mean(axis=1) / weights.sum()


def edges_of(corners: Indices) -> tuple[Indices, NDArray[np.bool_]]:
    """Number the edge (k, k+1) of each triangle, and tell if it runs to a higher vertex, (3 t,)."""
    tail, head = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    names = np.minimum(tail, head) * (int(corners.max()) + 1) + np.maximum(tail, head)
    return np.unique(names, return_inverse=True)[1].ravel(), tail < head


def triangle_neighbours(triangles: Indices) -> Indices:
    """Find the one triangle across each edge (k, k+1), (t, 3); -1 if there is none, or several."""
    place, _ = edges_of(triangles)
    order = np.argsort(place, kind="stable")
    paired = order[(np.bincount(place) == SIDES)[place[order]]].reshape(-1, SIDES)
    across = np.full(len(place), -1, dtype=np.int64)
    across[paired[:, 0]], across[paired[:, 1]] = paired[:, 1] // 3, paired[:, 0] // 3
    return across.reshape(-1, 3)


def planar_face(vertices: Array, triangles: Indices, slack: float) -> Face:
    """Outline the planar face of a group of coplanar triangles of an outward mesh."""
    corners = vertices[triangles]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = crosses.sum(axis=0)
    normal = -outward / np.linalg.norm(outward)
    weights = np.linalg.norm(crosses, axis=1)
    origin = (weights[:, None] * corners.mean(axis=1)).sum(axis=0) / weights.sum()
    frame = plane_frame(normal)

    found = [
        without_straight_corners((vertices[loop[::-1]] - origin) @ frame, slack)
        for loop in border_loops(triangles)
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


def border_loops(triangles: Indices) -> list[list[int]]:
    """Walk along the borders of a group of triangles; return loops of vertices wound like them.

    Where the border touches itself in one vertex, the walk turns through the group's own
    triangles, and is then cut there, so that each loop passes a vertex once.
    """
    inside = {
        (int(t[k]), int(t[(k + 1) % 3])): int(t[(k + 2) % 3]) for t in triangles for k in range(3)
    }
    border = [edge for edge in inside if edge[::-1] not in inside]
    unseen, loops = dict.fromkeys(border), list[list[int]]()
    while unseen:
        edge = next(iter(unseen))
        loop: list[int] = []
        while edge in unseen:
            del unseen[edge]
            loop.append(edge[0])
            edge = _next_on_border(inside, edge)
        loops += cut_at_repeats(loop)
    return loops


def cut_at_repeats(walk: list[int]) -> list[list[int]]:
    """Cut a closed walk into loops, one wherever a vertex is met again."""
    loops, current, place = list[list[int]](), list[int](), dict[int, int]()
    for vertex in walk:
        if vertex in place:
            loops.append(current[place[vertex] :])
            del current[place[vertex] :]
            for passed in loops[-1]:
                del place[passed]
        place[vertex] = len(current)
        current.append(vertex)
    return [*loops, current]


def _next_on_border(inside: dict[tuple[int, int], int], edge: tuple[int, int]) -> tuple[int, int]:
    pivot, apex = edge[1], inside[edge]
    while (apex, pivot) in inside:
        apex = inside[apex, pivot]
    return pivot, apex
