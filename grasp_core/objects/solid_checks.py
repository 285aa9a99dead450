"""Welds the vertices of triangles, and checks that their edges close around a volume.

Close vertices are linked and connected parts found with numpy, since importing scipy's graphs takes
longer than planning a small object does. Its search tree is used only where points are dense.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.objects.booleans import Solid, intersection_volume
from grasp_core.objects.planar_faces import SIDES, edges_of

WELD = 1e-8
"""Distance below which vertices are joined, relative to the extent: single precision in a file
keeps 6e-8, and vertices that were equal before are equal to the last bit."""
THINNEST = 1e-9
"""Least volume of a solid, relative to the cube of the extent."""
THIN = 4e-6
"""Width of a slit, relative to the extent, which rounding in single precision may leave."""


def welded(
    points: Array, corners: Indices, reach: float | None = None
) -> tuple[Array, Indices, int]:
    """Join close vertices, drop unused ones and collapsed triangles; also count the latter."""
    used, corners = np.unique(corners, return_inverse=True)
    points, corners = points[used], corners.reshape(-1, 3)
    if reach is None:
        reach = WELD * float(np.ptp(points, axis=0).max())
    try:
        links = close_pairs(points, reach) if reach >= 0.0 else np.empty((0, 2), dtype=np.int64)
    except InputError as error:
        raise MeshError(MeshRefusal.LIMIT, str(error)) from error
    label = components(len(points), links)
    _, first, order = np.unique(label, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    points, corners = points[np.sort(first)], rank[order][corners]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise MeshError(MeshRefusal.ZERO_VOLUME, "no triangle has an area; export a solid")
    return points, corners[whole], int((~whole).sum())


def surface_fault(corners: Indices) -> MeshError | None:
    """Return the fault by which triangles do not bound a solid, or None if they do.

    They bound a solid if each edge belongs to two triangles that run along it in opposite
    directions. Inconsistent orientation is reported first, since a surface with any other fault may
    have usable parts.
    """
    place, forward = edges_of(corners)
    uses, ahead = np.bincount(place), np.bincount(place, weights=forward)
    same_side = int(((uses == SIDES) & (ahead != 1)).sum())
    if same_side:
        message = (
            f"{same_side} edges have triangles of opposite orientation; wind all "
            "triangles counter-clockwise seen from outside"
        )
        return MeshError(MeshRefusal.WINDING, message)
    if (uses == 1).any():
        message = (
            f"{int((uses == 1).sum())} edges belong to one triangle only; close the surface, or "
            "use its sound parts (--faces patches)"
        )
        return MeshError(MeshRefusal.OPEN, message)
    if (uses != SIDES).any():
        edge = int(np.argmax(uses != SIDES))
        row, side = divmod(int(np.argmax(place == edge)), 3)
        ends = sorted((int(corners[row, side]), int(corners[row, (side + 1) % 3])))
        message = (
            f"edge {ends} belongs to {uses[edge]} triangles"
            ", expected two; separate the parts there, or use sound parts (--faces patches)"
        )
        return MeshError(MeshRefusal.NON_MANIFOLD, message)
    return None


def balanced(corners: Indices) -> bool:
    """Return whether edges are run along as often in both directions: a volume is enclosed then."""
    place, forward = edges_of(corners)
    return not np.bincount(place, weights=np.where(forward, 1.0, -1.0)).any()


def triangle_areas(points: Array, corners: Indices) -> Array:
    """Compute the areas of triangles, (t,) [m^2]."""
    a, b, c = (points[corners[:, corner]] for corner in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def check_volume(solid: Solid) -> None:
    """Refuse a solid that encloses almost no volume."""
    extent = float(np.ptp(solid.vertices, axis=0).max())
    if abs(solid.volume) < THINNEST * extent**3:
        message = f"the mesh encloses only {solid.volume:.3g} m^3; close it around a solid"
        raise MeshError(MeshRefusal.ZERO_VOLUME, message)


def thin_share(solid: Solid) -> float:
    """Return the share of the surface that is beside slits or walls thinner than `THIN`.

    Solved: a solid that is moved by a step along an axis leaves a volume of the step times the area
    that it shows along the axis, each wall counted, less what slits and walls thinner than the step
    hide. The largest share of the three axes is returned.
    """
    step = THIN * float(np.ptp(solid.vertices, axis=0).max())
    corners = solid.vertices[solid.triangles]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    seen = 0.25 * np.abs(crosses).sum(axis=0)
    left = [
        solid.volume - intersection_volume(solid, solid.moved(step * axis)) for axis in np.eye(3)
    ]
    return float(np.abs(seen - np.array(left) / step).max() / seen.max())


GENERAL = np.array([0.41421, 0.56714, 0.69315])
"""Direction of the line on which points are projected, perpendicular to no face that parts usually
have. It is shorter than one, so that projections are closer together than points."""
CROWDED = 64
"""Largest number of neighbours on the line that are compared with a point one by one."""
MOST_LINKS = 100
"""Largest number of links per point."""


def close_pairs(points: Array, reach: float) -> Indices:
    """List links between points within a distance of each other, as pairs of indices, (k, 2).

    Close points have close projections on a line, so only neighbours there are compared. Equal
    points are linked in a row, and only one of them is compared with other points.
    """
    shadows = ((points - points[0]) * GENERAL).sum(axis=1)
    order = np.argsort(shadows, kind="stable")
    equal = (points[order[1:]] == points[order[:-1]]).all(axis=1)
    links = [np.column_stack([order[:-1], order[1:]])[equal]]
    order = order[np.append(True, ~equal)]
    for step in range(1, len(order)):
        near = shadows[order[step:]] - shadows[order[:-step]] <= reach
        if not near.any():
            break
        if step > CROWDED:
            links.append(order[_pairs_of_tree(points[order], reach)])
            break
        pairs = np.column_stack([order[:-step][near], order[step:][near]])
        apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        links.append(pairs[apart <= reach])
    return np.concatenate(links)


def _pairs_of_tree(points: Array, reach: float) -> Indices:
    spatial: Any = importlib.import_module("scipy.spatial")
    tree = spatial.KDTree(points)
    pairs = (int(tree.count_neighbors(tree, reach)) - len(points)) // 2
    if pairs > MOST_LINKS * len(points):
        raise InputError(
            f"{pairs} pairs of points are within {reach:.3g} of each other, more than {MOST_LINKS} "
            "per point; merge points that coincide first"
        )
    return np.asarray(tree.query_pairs(reach, output_type="ndarray"), dtype=np.int64)


def components(count: int, links: Indices) -> Indices:
    """Return for each item the least index among the items connected with it, (count,).

    Items point to items of their set, in the end to the least one. In each round the item that a
    linked one points to is made to point to the least one at the other ends, and then every item
    to the end of its way. Rounds grow as the square of the logarithm of `count` at most, and there
    are fifteen for a million items in a row of any order.

    Source:
        Liu and Tarjan, "Simple concurrent labeling algorithms for connected components", SOSA 2019.
    """
    least = np.arange(count)
    apart = links
    while len(apart):
        low, high = np.sort(apart, axis=1).T
        np.minimum.at(least, high, low)
        while not np.array_equal(further := least[least], least):
            least = further
        apart = least[apart]
        apart = apart[apart[:, 0] != apart[:, 1]]
    return least
