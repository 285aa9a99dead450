"""Welds the vertices of triangles, and checks that solids enclose a volume without thin slits.

Close vertices are linked and connected parts found with numpy, since importing scipy's graphs takes
longer than planning a small object does. Its search tree is used only where points are dense.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.objects.booleans import Solid, intersection_volume
from grasp_core.objects.triangles import components, crosses_of

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
    seen = 0.25 * np.abs(crosses_of(corners)).sum(axis=0)
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
