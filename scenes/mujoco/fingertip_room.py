"""Describes fingertips, and finds a radius at which they overlap nothing beside their contacts.

A fingertip is a sphere that touches its face at the contact p, so with the inward normal n its
centre is p - r n. Two fingertips overlap from the radius r at which their centres are 2 r apart,
which is the root of a quadratic equation. A fingertip meets the object beside its contact from the
radius at which another surface point q is as near to its centre as p is: r = |q - p|^2 / (2 (p -
q).n). The q with the least radius is found by shrinking: the surface point nearest to the centre of
too large a sphere gives a smaller sphere, until no surface point is inside.
"""

import math
from itertools import combinations

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.objects.on_faces import (
    face_under,
    nearest_on_surface,
    nearest_on_triangles,
    on_face_slack,
)
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import areas_and_normals
from grasp_core.values import Contact

TIP_RADIUS = 0.1
"""Fingertip radius that is used wherever such fingertips overlap nothing, in object radii."""
LEAST_TIP_RADIUS = 1e-3
"""Smallest fingertip radius that is tried, in object radii."""
ROOM_SHARE = 0.95
"""Fingertip radius where `TIP_RADIUS` does not fit, relative to the largest that fits."""
MERE_TOUCH = 1e-6
"""Largest overlap that counts as mere touching, in fingertip radii."""
MAX_SHRINKING = 100
"""Steps after which a fingertip has no clear radius; up to fifteen are usual."""
FACING = 1e-9
"""Value of 4 - |m|^2, with m the difference of two unit normals, below which the normals count as
opposite."""


def fitting_radius(body: Polyhedron, positions: Array, normals: Array) -> float:
    """Choose a fingertip radius [m] at which nothing overlaps, if a large enough one exists."""
    usual = TIP_RADIUS * body.radius
    clear = float(_largest_clear(body, positions, normals, usual).min())
    largest = min(_largest_apart(positions, normals), clear)
    if largest >= usual:
        return usual
    return max(ROOM_SHARE * largest, LEAST_TIP_RADIUS * body.radius)


def clashes(body: Polyhedron, positions: Array, normals: Array, radius: float) -> tuple[str, ...]:
    """List what fingertips of a radius overlap: each other, or the object beside their contacts."""
    least = radius * (1.0 - MERE_TOUCH)
    found = [
        f"fingertips {i} and {j} of radius {radius:.3g} m overlap"
        for i, j in combinations(range(len(positions)), 2)
        if _largest_apart(positions[[i, j]], normals[[i, j]]) < least
    ]
    found += [
        f"fingertip {i} of radius {radius:.3g} m meets "
        f"{_met(body, positions[i], normals[i], radius)} beside its contact"
        for i in np.flatnonzero(_largest_clear(body, positions, normals, radius) < least)
    ]
    return tuple(found)


def _met(body: Polyhedron, position: Array, normal: Array, radius: float) -> str:
    """Name the face that is nearest to the centre of a fingertip which the object overlaps."""
    center = position - radius * normal
    corners = body.vertices[body.triangles]
    nearest = nearest_on_triangles(corners, center)
    at = int(np.linalg.norm(nearest - center, axis=1).argmin())
    _, outward = areas_and_normals(corners[at : at + 1])
    face = face_under(body, Contact(nearest[at], -outward[0]))
    places = [place for place, each in enumerate(body.faces) if each is face]
    return f"face {places[0]}" if places else "the object"


def _largest_apart(positions: Array, normals: Array) -> float:
    """Return the radius up to which no two fingertips overlap: |d - r m| = 2 r.

    Between two contacts d is the difference of the positions and m that of the normals. The radius
    is the positive root of (4 - m.m) r^2 + 2 (d.m) r = d.d. Two fingers that face each other have
    no such root, and do not limit the radius.
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
    """Return up to which radius each fingertip meets nothing beside its contact, (k,).

    The radius is at most `start`. Contacts may lie slightly below their faces, because positions in
    files are rounded. The surface of a curved patch does not count near the contact, because a
    fingertip is assumed to touch the plane of the patch.
    """
    near = _triangles_near(body, positions, normals, start)
    radii, meeting = np.full(len(positions), start), near.any(axis=1)
    if meeting.any() and body.patches is None:  # what counts for one contact counts for all
        centers = positions - start * normals
        nearest = nearest_on_surface(body.vertices, body.triangles[near.any(axis=0)], centers)
        meeting = np.linalg.norm(nearest - centers, axis=1) < _touched(body, start)
    for finger in np.flatnonzero(meeting):
        triangles = body.triangles[np.flatnonzero(near[finger])]
        radii[finger] = _clear_radius(body, positions[finger], normals[finger], start, triangles)
    return radii


def _touched(body: Polyhedron, radius: float) -> float:
    """Return the distance from which on a surface touches a fingertip but does not meet it [m]."""
    return radius * (1.0 - MERE_TOUCH) - on_face_slack(body)


def _clear_radius(
    body: Polyhedron, position: Array, normal: Array, start: float, triangles: Indices
) -> float:
    """Shrink one fingertip until it meets none of the triangles beside its contact."""
    radius = start
    for _ in range(MAX_SHRINKING):
        center = position - radius * normal
        nearest = nearest_on_surface(body.vertices, triangles, center[None])[0]
        if np.linalg.norm(nearest - center) >= _touched(body, radius):
            return radius
        away = nearest - position
        radius = float(away @ away) / (-2.0 * float(away @ normal))
    return 0.0  # nothing is shown to be clear


def _triangles_near(body: Polyhedron, positions: Array, normals: Array, radius: float) -> Array:
    """Tell which triangles each fingertip of at most a given radius may meet, (k, t)."""
    corners = body.vertices[body.triangles]
    middles = corners.mean(axis=1)
    extents = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    centers = positions - radius * normals
    near = np.linalg.norm(middles - centers[:, None], axis=2) <= radius + extents
    for finger, contact in enumerate(zip(positions, normals, strict=True)):
        face = face_under(body, Contact(*contact)) if body.patches else None
        if face is not None:
            near[finger, face.facets] = False
    return near
