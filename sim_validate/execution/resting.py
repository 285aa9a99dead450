"""How an object rests on a table: on the faces of its convex hull that carry its centre of mass.

A face carries it if the centre of mass, dropped onto the face, lies inside. An object that is
thrown and settles without sliding comes to rest on a face about as often as the solid angle says
under which the centre of mass sees the face, so faces are tried in this order.
"""

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import largest_first

FLAT = 1e-6
"""Difference of normals, and of offsets in object radii, up to which facets are one face."""
CLEAR = 0.01
"""Least gap between fingertips and the table, in object radii."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """A face of the convex hull on which the object can rest."""

    down: Array
    """Unit normal out of the object, (3,)."""
    height: float
    """Distance of the centre of mass from the table [m]."""
    likelihood: float
    """Share of the sphere that the face takes, as the centre of mass sees it."""


def rests(body: Polyhedron) -> tuple[Rest, ...]:
    """Return the faces on which an object can rest, the likeliest first."""
    spatial: Any = importlib.import_module("scipy.spatial")
    points = (body.vertices - body.center_of_mass) / body.radius
    hull = spatial.ConvexHull(points)
    normals, offsets = hull.equations[:, :3], -hull.equations[:, 3]
    left = set(range(len(normals)))
    found = list[Rest]()
    for first in range(len(normals)):
        if first not in left:
            continue
        alike = (np.abs(normals - normals[first]).max(axis=1) <= FLAT) & (
            np.abs(offsets - offsets[first]) <= FLAT
        )
        own = [facet for facet in np.flatnonzero(alike) if facet in left]
        left -= set(own)
        triangles = points[hull.simplices[own]]
        if _carries(triangles, normals[first]):
            share = float(sum(_solid_angle(corners) for corners in triangles) / (4.0 * np.pi))
            found.append(Rest(normals[first], float(offsets[first]) * body.radius, share))
    order = largest_first([rest.likelihood for rest in found])
    return tuple(found[place] for place in order)


def resting(body: Polyhedron, tips: Array, radii: Array) -> Rest | None:
    """Return the likeliest rest in which no fingertip meets the table; None if there is none.

    Takes `tips` (k, 3) [m]; `radii` (k,) [m].
    """
    for rest in rests(body):
        if (tips @ rest.down + radii).max() <= rest.height - CLEAR * body.radius:
            return rest
    return None


def _carries(triangles: Array, normal: Array) -> bool:
    """Return whether the origin, dropped along a normal, falls into one of the triangles."""
    return any(_is_inside(corners, normal) for corners in triangles)


def _is_inside(corners: Array, normal: Array) -> bool:
    sides = np.cross(np.roll(corners, -1, axis=0) - corners, -corners) @ normal
    return bool((sides >= 0.0).all() or (sides <= 0.0).all())


def _solid_angle(corners: Array) -> float:
    """Return the solid angle of a triangle seen from the origin (Van Oosterom & Strackee 1983)."""
    a, b, c = corners
    x, y, z = np.linalg.norm(corners, axis=1)
    along = x * y * z + (a @ b) * z + (b @ c) * x + (c @ a) * y
    return float(abs(2.0 * np.arctan2(a @ np.cross(b, c), along)))
