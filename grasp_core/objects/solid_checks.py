"""Checks that triangles bound one solid: closed, consistently wound, without overlapping parts."""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.geometry.connectivity import close_pairs, components
from grasp_core.objects.booleans import Solid, intersection_volume, union_volume
from grasp_core.objects.planar_faces import SIDES, triangle_neighbours

WELD = 1e-8
"""Distance below which vertices are joined, relative to the extent: single precision in a file
keeps 6e-8, and vertices that were equal before are equal to the last bit."""
THINNEST = 1e-9
"""Least volume of a solid, relative to the cube of the extent."""
OVERLAP = 1e-6
"""Volume shared by two parts, relative to the whole, above which they overlap; parts that only
touch share what rounding leaves."""


def welded(points: Array, corners: Indices) -> tuple[Array, Indices, int]:
    """Join vertices closer than `WELD`, and drop unused vertices and collapsed triangles.

    Returns:
        Vertices, triangles, and the number of triangles that were dropped.
    """
    used, corners = np.unique(corners, return_inverse=True)
    points, corners = points[used], corners.reshape(-1, 3)
    reach = WELD * float(np.ptp(points, axis=0).max())
    label = components(len(points), _links(points, reach))
    _, first, order = np.unique(label, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    points, corners = points[np.sort(first)], rank[order][corners]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return points, corners[whole], int((~whole).sum())


def _links(points: Array, reach: float) -> Indices:
    try:
        return close_pairs(points, reach)
    except InputError as error:
        raise MeshError(MeshRefusal.LIMIT, str(error)) from error


def surface_fault(corners: Indices) -> MeshError | None:
    """Return the fault by which triangles do not bound a solid, or None if they do.

    They bound a solid if each edge belongs to two triangles that run along it in opposite
    directions. Inconsistent orientation is reported first, since a surface with any other fault may
    have usable parts.
    """
    tail, head = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    edges, where, uses = np.unique(
        np.sort(np.column_stack([tail, head]), axis=1), axis=0, return_inverse=True,
        return_counts=True,
    )  # fmt: skip
    forward = np.bincount(where.ravel(), weights=tail < head)
    same_side = int(((uses == SIDES) & (forward != 1)).sum())
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
        message = (
            f"edge {edges[uses != SIDES][0].tolist()} belongs to {uses[uses != SIDES][0]} triangles"
            ", expected two; separate the parts there, or use sound parts (--faces patches)"
        )
        return MeshError(MeshRefusal.NON_MANIFOLD, message)
    return None


def largest_part(points: Array, corners: Indices) -> tuple[Array, Indices, list[str]]:
    """Return the largest connected part of a faulty surface, as it is, and notes about it.

    The orientation of an open surface cannot be checked, so the part is never turned.
    """
    parts = _labels(points, corners)
    crosses = np.cross(
        points[corners[:, 1]] - points[corners[:, 0]], points[corners[:, 2]] - points[corners[:, 0]]
    )
    areas = np.bincount(parts, weights=0.5 * np.linalg.norm(crosses, axis=1))
    largest, notes = int(areas.argmax()), list[str]()
    if (areas > 0.0).sum() > 1:
        share = 100.0 * float(areas[largest] / areas.sum())
        notes.append(
            f"the surface has {len(areas)} parts; the largest, {share:.3g} % of it, is used alone"
        )
    kept = corners[parts == largest]
    if Solid(points, kept).volume < 0.0:
        notes.append("the surface may be inside out: it seems to enclose a negative volume")
    used, local = np.unique(kept, return_inverse=True)
    return points[used], local.reshape(-1, 3), notes


def check_volume(solid: Solid) -> None:
    """Refuse a solid that encloses almost no volume.

    Raises:
        MeshError: The volume is next to nothing.
    """
    extent = float(np.ptp(solid.vertices, axis=0).max())
    if abs(solid.volume) < THINNEST * extent**3:
        message = f"the mesh encloses only {solid.volume:.3g} m^3; close it around a solid"
        raise MeshError(MeshRefusal.ZERO_VOLUME, message)


def oriented(points: Array, corners: Indices, most: int) -> tuple[Indices, bool]:
    """Orient triangles counter-clockwise seen from outside, and return whether they were turned.

    Args:
        points: Vertices, (n, 3) [m].
        corners: Vertex indices, (t, 3).
        most: Largest number of parts.

    Raises:
        MeshError: The mesh is flat, or its parts are separate, overlap or contradict each other.
    """
    check_volume(Solid(points, corners))
    total = Solid(points, corners).volume
    if total < 0.0:
        corners = corners[:, ::-1]
    parts = _parts(points, corners, most)
    bodies = [part for part in parts if part.volume > 0.0]
    cavities = [Solid(part.vertices, part.triangles[:, ::-1]) for part in parts if part.volume <= 0]
    slack = OVERLAP * abs(total)
    if len(bodies) > 1 and sum(body.volume for body in bodies) - union_volume(bodies) > slack:
        message = (
            f"the mesh holds {len(bodies)} solids that overlap; unite them into one surface first"
        )
        raise MeshError(MeshRefusal.OVERLAP, message)
    if len(bodies) > 1:
        message = f"the mesh holds {len(bodies)} solids, expected one solid; give each its own file"
        raise MeshError(MeshRefusal.SEPARATE, message)
    for cavity in cavities:
        inside = sum(intersection_volume(body, cavity) for body in bodies)
        if cavity.volume - inside > slack:
            message = "one part is inside out and not a cavity of another; turn its triangles"
            raise MeshError(MeshRefusal.WINDING, message)
    return corners, total < 0.0


def _parts(points: Array, corners: Indices, most: int) -> list[Solid]:
    """Split a closed mesh into parts that connect across edges.

    Parts that meet only in a point are separate.

    Raises:
        MeshError: There are too many parts.
    """
    across = triangle_neighbours(corners)
    links = np.column_stack([np.repeat(np.arange(len(corners)), SIDES + 1), across.ravel()])
    _, label = np.unique(components(len(corners), links), return_inverse=True)
    parts = list[Solid]()
    if label.max() >= most:
        message = (
            f"the mesh has {label.max() + 1} parts, more than the limit of {most}; give one solid"
        )
        raise MeshError(MeshRefusal.SEPARATE, message)
    for part in range(int(label.max()) + 1):
        used, local = np.unique(corners[label == part], return_inverse=True)
        parts.append(Solid(points[used], local.reshape(-1, 3)))
    return parts


def _labels(points: Array, corners: Indices) -> Indices:
    """Number the part that each triangle belongs to, (t,), for parts that share no vertex."""
    sides = np.column_stack([corners.ravel(), np.roll(corners, 1, axis=1).ravel()])
    label = components(len(points), sides)
    _, part = np.unique(label[corners[:, 0]], return_inverse=True)
    return part
