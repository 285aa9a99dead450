"""Groups triangles into planar faces, by explicit limits of angle and distance, and outlines them.

A group grows across shared edges from a seed triangle and is measured against the seed's
own plane, never from neighbour to neighbour, so that the facets of a fine sphere cannot
creep into one "face".
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.checked import number
from grasp_core.geometry.polygons import (
    area_and_centroid,
    is_convex,
    merge_into_convex_pieces,
    plane_frame,
    signed_area,
    without_straight_corners,
)
from grasp_core.objects.face import Face
from grasp_core.solvers.ties import largest_first

MAX_FACES = 200
"""Number of planar faces above which an object counts as curved: 200 faces have 65 million
quadruples, some 6 million of which positively span."""
SIDES = 2
"""Number of triangles that meet at an edge of a closed surface."""

Triangulate: TypeAlias = Callable[[list[Array]], Indices]
"""Function from the corners of an outer border and holes, in order, to counter-clockwise triangles.
"""


@dataclass(frozen=True, slots=True)
class FlatnessLimits:
    """Limits within which triangles count as one planar face."""

    angle: float = 1e-3
    """Largest angle between normals [rad]: about a thousand times the error of the normal of a
    triangle one millimetre high in single precision, and far below any friction angle of interest.
    """
    distance: float = 1e-6
    """Largest distance from the plane, relative to the object's largest extent: some ten times the
    rounding of single precision."""

    def __post_init__(self) -> None:
        number(self.angle, "angle", least=0.0, most=1.0)
        number(self.distance, "distance", least=0.0, most=0.1)


def planar_faces(
    vertices: Array,
    triangles: Indices,
    groups: Sequence[Indices],
    limits: FlatnessLimits,
    triangulate: Triangulate,
) -> tuple[Face, ...]:
    """Outline one planar face for each group of coplanar triangles of a closed, outward mesh."""
    slack = limits.distance * float(np.ptp(vertices, axis=0).max())
    return tuple(_face(vertices, triangles[group], slack, triangulate) for group in groups)


def coplanar_groups(vertices: Array, triangles: Indices, limits: FlatnessLimits) -> list[Indices]:
    """Group triangles that lie in one plane within the limits and connect across edges, (g,) each.

    Groups are in the order of their first triangle, and do not depend on the winding.

    Groups grow from the largest triangles first, whose planes are the least affected by rounding. A
    triangle thinner than the distance limit has no meaningful normal, so only its distance counts.
    """
    corners = vertices[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_area = np.linalg.norm(cross, axis=1)
    normals = cross / np.where(double_area > 0.0, double_area, 1.0)[:, None]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    distance = limits.distance * float(np.ptp(vertices, axis=0).max())
    sliver = double_area <= distance * longest
    neighbours = triangle_neighbours(triangles)
    group_of = np.full(len(triangles), -1)
    for seed in largest_first(double_area):
        if group_of[seed] >= 0:
            continue
        normal, origin = normals[seed], corners[seed, 0]
        stack, group_of[seed] = [int(seed)], seed
        while stack:
            for other in neighbours[stack.pop()]:
                if other < 0 or group_of[other] >= 0:
                    continue
                tilt = 0.0 if sliver[other] else np.linalg.norm(normals[other] - normal)
                if tilt <= limits.angle and _off(corners[other], origin, normal) <= distance:
                    group_of[other] = seed
                    stack.append(int(other))
    _, first, counts = np.unique(group_of, return_index=True, return_counts=True)
    members = np.split(np.argsort(group_of, kind="stable"), np.cumsum(counts)[:-1])
    return [members[group] for group in np.argsort(first, kind="stable")]


def _off(points: Array, origin: Array, normal: Array) -> float:
    return float(np.abs((points - origin) @ normal).max())


def triangle_neighbours(triangles: Indices) -> Indices:
    """Find the triangle across each edge (k, k+1) of each triangle, (t, 3).

    An entry is -1 unless the edge has exactly one other triangle.
    """
    tail, head = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    edges = np.sort(np.column_stack([tail, head]), axis=1)
    _, place, uses = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(place, kind="stable")
    paired = order[(uses == SIDES)[place[order]]].reshape(-1, SIDES)
    across = np.full(len(tail), -1, dtype=np.int64)
    across[paired[:, 0]], across[paired[:, 1]] = paired[:, 1] // 3, paired[:, 0] // 3
    return across.reshape(-1, 3)


def _face(vertices: Array, triangles: Indices, slack: float, triangulate: Triangulate) -> Face:
    corners = vertices[triangles]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    normal = -outward / np.linalg.norm(outward)
    weights = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    origin = (weights[:, None] * corners.mean(axis=1)).sum(axis=0) / weights.sum()
    frame = plane_frame(normal)

    def flat(loop: list[int]) -> Array:
        return without_straight_corners((vertices[loop[::-1]] - origin) @ frame, slack)

    def lift(loop: Array) -> Array:
        return origin + loop @ frame.T

    found = [flat(loop) for loop in border_loops(triangles)]
    loops = [found[place] for place in largest_first([signed_area(loop) for loop in found])]
    outer, holes = loops[0], loops[1:]
    pieces = convex_pieces(loops, triangulate, slack)
    area, centroid = area_and_centroid(loops)
    return Face(
        normal=normal,
        centroid=origin + frame @ centroid,
        area=area,
        polygon=lift(outer),
        holes=tuple(lift(hole) for hole in holes),
        pieces=tuple(lift(piece) for piece in pieces),
    )


def convex_pieces(loops: list[Array], triangulate: Triangulate, slack: float) -> list[Array]:
    """Split a plane figure into convex polygons, (k, 2) each.

    Args:
        loops: Outer border, counter-clockwise, and holes, clockwise, each (k, 2).
        triangulate: Triangulates a border with holes by an outside library.
        slack: Corners within this distance of a line count as on it.
    """
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
        loops += _cut_at_repeats(loop)
    return loops


def _cut_at_repeats(walk: list[int]) -> list[list[int]]:
    loops: list[list[int]] = []
    current: list[int] = []
    for vertex in walk:
        if vertex in current:
            start = current.index(vertex)
            loops.append(current[start:])
            current = current[:start]
        current.append(vertex)
    return [*loops, current]


def _next_on_border(inside: dict[tuple[int, int], int], edge: tuple[int, int]) -> tuple[int, int]:
    pivot, apex = edge[1], inside[edge]
    while (apex, pivot) in inside:
        apex = inside[apex, pivot]
    return pivot, apex
