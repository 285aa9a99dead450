"""Groups triangles into planar faces, by limits of angle and distance, and outlines them."""

from itertools import islice

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
from grasp_core.objects.triangles import NO_CAPS, Mesh, Plane, border_loops, crosses_of
from grasp_core.solvers.ties import largest_first

MAX_FACES = 200
"""Number of planar faces above which an object counts as curved: 200 faces have 65 million
quadruples, some 6 million of which positively span."""

PLANAR = 1e-6
"""Largest distance from a plane, relative to the extent, that always counts as in it: some ten
times the rounding of single precision."""
ANGLE = 1e-3
"""Largest angle between normals in one face [rad]: about a thousand times the error of the normal
of a triangle one millimetre high in single precision, and far below any friction angle of interest.
"""
FITS = 3
"""Number of times that a plane is fitted again to a group of triangles with rounded corners."""


def planar_slack(extent: float, flatness_m: float) -> float:
    """Return the distance within which corners of an object count as in one plane [m].

    `flatness_m` is the distance that rounding explains.
    """
    return max(PLANAR * extent, flatness_m)


def coplanar_groups(
    mesh: Mesh,
    distance: float,
    *,
    angle: float = ANGLE,
    blur: float = 0.0,
    caps: Indices = NO_CAPS,
    most: int | None = None,
) -> list[Indices]:
    """Group triangles that lie in one plane within the limits and connect across edges, (g,) each.

    Groups are in the order of their first triangle, and do not depend on the winding. Not all of
    them are found if there are more than `most`.

    Groups grow from the largest triangles first, whose planes are the least affected by rounding.
    Rounding may have moved one side of a triangle by `blur` against the opposite corner [m], so
    that a triangle of this height may lean by a radian more; then the plane is fitted again to
    what has grown. A triangle thinner than the distance limit has no meaningful normal, so only its
    distance counts.
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
        1 + FITS if blur else 1,
        caps,
    )
    members = [np.sort(group) for group, _ in islice(found, None if most is None else most + 1)]
    return sorted(members, key=lambda group: int(group[0]))


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
