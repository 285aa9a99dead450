"""How fingertips are built and driven, and whether four of them find room at their contacts.

A fingertip is a sphere that touches its face at the contact, so its centre is p - r n. Two of them
overlap from the radius on at which their centres are 2 r apart, which is a quadratic equation. One
meets the object elsewhere from the radius on at which a further surface point q is as near to its
centre as p is: r = |q - p|^2 / (2 (p - q).n). The nearest q is found by shrinking: the point
nearest to the centre of too large a sphere gives a smaller sphere, until no point is inside.
"""

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, TypeAlias, get_args

import numpy as np

from grasp_core.arrays import Array, Indices, frozen
from grasp_core.checked import LARGEST, SMALLEST, number, one_of, positive
from grasp_core.errors import InputError
from grasp_core.geometry.nearest_points import nearest_on_surface
from grasp_core.objects.on_faces import ON_FACE, face_under
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact

Drive: TypeAlias = Literal["servo", "rigid"]
TIP_RADIUS = 0.1
"""Fingertip radius that is used where it fits, in object radii."""
LEAST_TIP_RADIUS = 1e-3
"""Smallest fingertip radius that is tried, in object radii."""
ROOM = 0.95
"""Fingertip radius relative to the largest that fits, where the usual one does not."""
TOUCHING = 1e-6
"""Largest overlap that is ignored, in fingertip radii."""
MAX_SHRINKING = 100
FACING = 1e-9
"""Value of 4 - |m|^2 below which the difference is rounding, and the normals are opposite."""


@dataclass(frozen=True, slots=True)
class FingerSettings:
    """How fingertips are built and driven; what is None is chosen to suit the grasp.

    Raises:
        InputError: A number is out of range (1e-9 to 1e9), or a choice is unknown.
    """

    max_normal_force_n: float = 10.0
    """Largest normal force of each finger [N]."""
    radius_m: float | None = None
    """Radius of the fingertips [m]; if None, a tenth of the object's radius, or what fits."""
    mass_kg: float | None = None
    stiffness_n_per_m: float | None = None
    """Stiffness of the servos [N/m]."""
    approach: tuple[float, float, float] | None = None
    """Direction in which all fingers move in from their start. If None, each finger takes the
    direction that was planned for it, or its normal."""
    drive: Drive = "servo"
    """How fingertips are held: servos push them, rigid ones stay where they are put."""
    indentation: float = 0.0
    """Depth to which a fingertip is put into its face, in grasp sizes, if more than just
    touching."""

    def __post_init__(self) -> None:
        positive(self.max_normal_force_n, "max_normal_force_n")
        for name in ("radius_m", "mass_kg", "stiffness_n_per_m"):
            if getattr(self, name) is not None:
                positive(getattr(self, name), name)
        if self.approach is not None:
            way = frozen(self.approach, (3,), "approach")
            if not SMALLEST <= float(np.linalg.norm(way)) <= LARGEST:
                raise InputError(f"approach must be a direction, not zero, got {self.approach}")
        one_of(self.drive, get_args(Drive), "drive")
        number(self.indentation, "indentation", least=0.0, below=1.0)


def fitting_radius(body: Polyhedron, positions: Array, normals: Array) -> float:
    """Choose a fingertip radius at which nothing overlaps, if a large enough one exists [m].

    Args:
        body: The object.
        positions: Contact points, (k, 3) [m].
        normals: Unit vectors into the object, (k, 3).
    """
    usual = TIP_RADIUS * body.radius
    clear = float(_largest_clear(body, positions, normals, usual).min())
    largest = min(_largest_apart(positions, normals), clear)
    if largest >= usual:
        return usual
    return max(ROOM * largest, LEAST_TIP_RADIUS * body.radius)


def clashes(body: Polyhedron, positions: Array, normals: Array, radius: float) -> tuple[str, ...]:
    """List what fingertips of a radius overlap: each other, or the object beside their contact.

    Args:
        body: The object.
        positions: Contact points, (k, 3) [m].
        normals: Unit vectors into the object, (k, 3).
        radius: Fingertip radius [m].

    Returns:
        One sentence for each overlap.
    """
    least = radius * (1.0 - TOUCHING)
    found = [
        f"fingertips {i} and {j} of radius {radius:.3g} m overlap"
        for i, j in combinations(range(len(positions)), 2)
        if _largest_apart(positions[[i, j]], normals[[i, j]]) < least
    ]
    found += [
        f"fingertip {i} of radius {radius:.3g} m meets the object beside its contact"
        for i in np.flatnonzero(_largest_clear(body, positions, normals, radius) < least)
    ]
    return tuple(found)


def _largest_apart(positions: Array, normals: Array) -> float:
    """Radius up to which no two fingertips overlap: |d - r m| = 2 r for the closest pair.

    It is the positive root of (4 - m.m) r^2 + 2 (d.m) r = d.d. Two fingers that face each other
    have none, and do not limit it.
    """
    largest = math.inf
    for i, j in combinations(range(len(positions)), 2):
        d, m = positions[i] - positions[j], normals[i] - normals[j]
        a, b, c = 4.0 - float(m @ m), float(d @ m), float(d @ d)
        root = math.sqrt(b * b + a * c)
        if a > FACING:
            largest = min(largest, (root - b) / a)
        elif b > 0.0:
            largest = min(largest, c / (root + b))
    return largest


def _largest_clear(body: Polyhedron, positions: Array, normals: Array, start: float) -> Array:
    """Radius up to which each fingertip meets nothing beside its contact, at most `start`, (k,)."""
    return np.array(
        [_clear_radius(body, *contact, start) for contact in zip(positions, normals, strict=True)]
    )


def _clear_radius(body: Polyhedron, position: Array, normal: Array, start: float) -> float:
    """Radius up to which one fingertip meets nothing beside its contact, at most `start`.

    Contacts may be a little below their own faces, because positions in files are rounded. The
    surface of a curved patch does not count where it is touched: a finger is taken to touch its
    plane.
    """
    slack, radius = ON_FACE * body.radius, start
    triangles = _triangles_near(body, position, normal, start)
    for _ in range(MAX_SHRINKING if len(triangles) else 0):
        center = position - radius * normal
        nearest = nearest_on_surface(body.vertices, triangles, center[None])[0]
        if np.linalg.norm(nearest - center) >= radius * (1.0 - TOUCHING) - slack:
            break
        away = nearest - position
        radius = float(away @ away) / (-2.0 * float(away @ normal))
    return radius


def _triangles_near(body: Polyhedron, position: Array, normal: Array, radius: float) -> Indices:
    """Triangles that a fingertip of up to a radius may meet, (t, 3).

    Spheres of smaller radius at the same contact lie inside the largest one.
    """
    face = face_under(body, Contact(position, normal)) if body.patches else None
    keep = np.ones(len(body.triangles), dtype=np.bool_)
    if face is not None:
        keep[face.facets] = False
    triangles = body.triangles[keep]
    corners = body.vertices[triangles]
    middles = corners.mean(axis=1)
    extents = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    return triangles[
        np.linalg.norm(middles - position + radius * normal, axis=1) <= radius + extents
    ]
