"""Says where fingertips are to touch: anywhere in their regions, or at the contacts themselves."""

import numpy as np

from grasp_core.arrays import Array, Indices, cross
from grasp_core.frames import plane_tangents
from grasp_core.hands.loop_values import Targets
from grasp_core.values import ContactRegion, Grasp

NARROW = 1e-4
"""Least inscribed radius of a region that is aimed at; in smaller ones the contact is [m]."""
SOFT = 2e-3
"""How far corners of a block below the farthest count while a pose is sought [m]."""
SHORT = 1e-9
"""Length below which an edge of a region is left out [m]."""


def targets(grasp: Grasp, used: Indices, *, regions: bool, up: Array, height: float) -> Targets:
    """Say where fingertips are to touch, with finger k at the k-th of the contacts that are used.

    Takes `used` (k,); `up` (3,); `height` [m].
    """
    normals, own = grasp.normals[used], [grasp.regions[int(contact)] for contact in used]
    aimed = [regions and _is_wide(region) for region in own]
    rows = [
        (finger, *row)
        for finger, region in enumerate(own)
        if aimed[finger]
        for row in _edges(region.polygon, normals[finger])
    ]
    return Targets(
        np.arange(len(used), dtype=np.int64),
        grasp.positions[used],
        normals,
        np.array([plane_tangents(*normal) for normal in normals.tolist()]),
        np.where(aimed, 0.0, 1.0),
        np.full((len(used), 3), np.nan),
        SOFT,
        np.array([row[0] for row in rows], np.int64),
        np.array([row[1] for row in rows]).reshape(-1, 3),
        np.array([row[2] for row in rows]).reshape(-1, 3),
        np.array(up),
        height,
    )


def _is_wide(region: ContactRegion) -> bool:
    return region.kind != "point" and region.inscribed_radius > NARROW


def _edges(polygon: Array, normal: Array) -> list[tuple[Array, Array]]:
    """Return a point of each edge and the unit vector from it into the convex polygon."""
    along = np.roll(polygon, -1, axis=0) - polygon
    kept = np.linalg.norm(along, axis=1) > SHORT
    starts, inward = polygon[kept], cross(normal, along[kept])
    sides = np.einsum("ej,ej->e", inward, polygon.mean(axis=0) - starts)
    inward *= np.copysign(1.0 / np.linalg.norm(inward, axis=1), sides)[:, None]
    return list(zip(starts, inward, strict=True))


def is_within(targets: Targets, contact: int, position: Array, slack: float) -> bool:
    """Return whether a position is in the region that one finger aimed at.

    Takes `position` (3,) [m]; `slack` [m].
    """
    if targets.pinned[contact] > 0.0:
        return bool(np.linalg.norm(position - targets.origins[contact]) <= slack)
    own = targets.edge_contacts == contact
    inside = np.einsum("ej,ej->e", position - targets.edge_points[own], targets.edge_inward[own])
    return bool(inside.min(initial=np.inf) >= -slack)
