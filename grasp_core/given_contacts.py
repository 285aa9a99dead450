"""Contacts from elsewhere, put on an object's faces and made a grasp where they are closed.

Contacts of other tools lie beside the surface by what rounding, sampling or a simulator's give
leave. Each is moved to the nearest point of a face whose normal leans little from the given one,
and takes the surface's normal there: what is judged is what fingers touch.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen, frozen_units
from grasp_core.closure import ClosureCertificate, force_closure
from grasp_core.critical import critical_friction
from grasp_core.errors import InputError
from grasp_core.on_faces import within
from grasp_core.quality import ferrari_canny
from grasp_core.spanning import span_angle
from grasp_core.values import (
    FINGERS,
    Contact,
    ContactRegion,
    FaceQuadruple,
    ForceCone,
    Grasp,
    Polyhedron,
    Witness,
    four,
)

LARGEST_LEAN = math.radians(20.0)
"""Between a given normal and that of the face the contact is put on [rad]."""
LARGEST_MOVE = 0.02
"""How far a contact may be from such a face, relative to the object's size."""


@dataclass(frozen=True, slots=True, eq=False)
class Seated:
    """Contacts on the faces of an object."""

    faces: FaceQuadruple
    contacts: tuple[Contact, Contact, Contact, Contact]
    moved_m: float
    """Largest distance of a contact from where it was given."""


def seat(body: Polyhedron, positions: ArrayLike, normals: ArrayLike) -> Seated:
    """Put four contacts on the faces of an object.

    Args:
        body: The object.
        positions: In its frame, (4, 3) [m].
        normals: Into the object, unit vectors, (4, 3).

    Raises:
        InputError: The numbers are not those of four contacts, or one is near no face.
    """
    points = frozen(positions, (FINGERS, 3), "positions")
    inward = frozen_units(normals, (FINGERS, 3), "normals")
    found = [_nearest(body, i, p, n) for i, (p, n) in enumerate(zip(points, inward, strict=True))]
    a, b, c, d = (face for face, _, _ in found)
    return Seated(
        (a, b, c, d),
        four(contact for _, contact, _ in found),
        max(distance for _, _, distance in found),
    )


def grasp_of(
    body: Polyhedron, seated: Seated, friction: float, name: str
) -> Grasp | ClosureCertificate:
    """Four contacts as a grasp, or the proof that they are not in force closure.

    The grasp claims no regions, and its lines of force no class but the general one.

    Args:
        body: The object.
        seated: Contacts on its faces.
        friction: Coulomb coefficient.
        name: What to call the grasp.

    Raises:
        UndecidedError: Closure, or the critical friction, is too close to call.
    """
    positions = np.array([contact.position for contact in seated.contacts])
    normals = np.array([contact.normal for contact in seated.contacts])
    certificate = force_closure(positions, normals, friction)
    if certificate.forces is None:
        return certificate
    quality = ferrari_canny(
        positions, normals, friction, center=body.center_of_mass, torque_scale=body.radius
    )
    theta = math.atan(friction)
    return Grasp(
        id=name,
        family="regulus",
        faces=seated.faces,
        contacts=seated.contacts,
        focus_points=np.empty((0, 3)),
        force_cones=four(ForceCone(normal, theta) for normal in normals),
        regions=four(ContactRegion("point", point[None], 0.0) for point in positions),
        radius=0.0,
        span_angle=span_angle(normals),
        critical_friction=critical_friction(positions, normals),
        closure_margin=certificate.margin,
        ferrari_canny=(quality.lower, quality.upper),
        witness=Witness(positions, certificate.forces),
    )


def _nearest(
    body: Polyhedron, finger: int, point: Array, normal: Array
) -> tuple[int, Contact, float]:
    """The face, the contact on it, and how far away it was.

    Raises:
        InputError: No face is near.
    """
    best: tuple[float, int, Contact] | None = None
    least = math.cos(LARGEST_LEAN)
    reach = LARGEST_MOVE * body.radius
    for index in range(len(body.faces)):
        for inward, polygon in _flat_parts(body, index):
            if float(inward @ normal) < least or abs(float(inward @ (point - polygon[0]))) > reach:
                continue
            at = _nearest_in(polygon, inward, point)
            distance = float(np.linalg.norm(at - point))
            if distance <= reach and (best is None or distance < best[0]):
                best = distance, index, Contact(at, inward)
    if best is None:
        lean = math.degrees(LARGEST_LEAN)
        raise InputError(
            f"contact {finger} is on no face: expected one within {reach:.3g} m whose inward "
            f"normal is within {lean:.0f} deg of the given one"
        )
    distance, index, contact = best
    return index, contact, distance


def _flat_parts(body: Polyhedron, index: int) -> Iterator[tuple[Array, Array]]:
    """Inward normals (3,) and convex polygons (k, 3) that a face's surface consists of."""
    face = body.faces[index]
    if not len(face.facets):
        yield from ((face.normal, piece) for piece in face.pieces)
        return
    corners = body.vertices[body.triangles[face.facets][:, ::-1]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    yield from zip(normals, corners, strict=True)


def _nearest_in(polygon: Array, normal: Array, point: Array) -> Array:
    """The point of a convex polygon nearest to a point, (3,)."""
    flat = point - float(normal @ (point - polygon[0])) * normal
    if within(flat, polygon, normal, 0.0):
        return flat
    edges = np.roll(polygon, -1, axis=0) - polygon
    share = np.einsum("ki,ki->k", flat - polygon, edges) / np.einsum("ki,ki->k", edges, edges)
    ends = polygon + np.clip(share, 0.0, 1.0)[:, None] * edges
    return ends[int(np.linalg.norm(ends - flat, axis=1).argmin())]
