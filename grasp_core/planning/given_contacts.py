"""Moves contacts that another tool found onto an object's faces, and makes a grasp of them.

Such contacts lie beside the surface: by rounding, sampling, or because a simulator lets bodies
overlap. Each is moved to the nearest point of the surface whose normal leans little from the
given one, and takes the surface's normal there, so what is judged is what fingers touch. On planar
faces that is a face of the object; a curved surface gets a new face around each contact, as its
patches need not cover it.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen, frozen_units
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import circle, plane_frame
from grasp_core.objects.on_faces import nearest_on_triangles
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face, areas_and_normals
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.solvers.ties import first_best
from grasp_core.values import (
    FINGERS,
    Contact,
    ContactRegion,
    FaceQuadruple,
    ForceCone,
    Grasp,
    Witness,
    four,
)

LARGEST_LEAN = math.radians(20.0)
"""Largest angle between a given normal and the normal where the contact is put [rad]."""
PATCH_RADIUS = 0.05
"""Radius of the face around a contact on a curved surface, relative to the object's size."""
PATCH_CORNERS = 16
NEARER_FACE = 1e-9
"""Distance, relative to the object's size, by which a face must be nearer than an earlier one to
replace it: a contact on an edge goes to the first of its faces with a fitting normal."""
LARGEST_MOVE = 0.02
"""Largest distance of a given contact from the surface, relative to the object's size."""


@dataclass(frozen=True, slots=True, eq=False)
class Seated:
    """Four contacts that were moved onto the faces of an object."""

    body: Polyhedron  # the object; a curved one with four more faces, one around each contact
    faces: FaceQuadruple
    contacts: tuple[Contact, Contact, Contact, Contact]
    moved_m: float = 0.0  # largest distance of a contact from where it was given [m]


def seat(body: Polyhedron, positions: ArrayLike, normals: ArrayLike) -> Seated:
    """Move four contacts to the nearest faces of an object with fitting normals."""
    points = frozen(positions, (FINGERS, 3), "positions")
    inward = frozen_units(normals, (FINGERS, 3), "normals")
    facets = facets_of(body)
    found = list[Nearest]()
    reach, margin = LARGEST_MOVE * body.radius, NEARER_FACE * body.radius
    for finger, (point, normal) in enumerate(zip(points, inward, strict=True)):
        nearest = nearest_like(facets, point, normal, lean=LARGEST_LEAN, reach=reach, margin=margin)
        if nearest is None:
            raise InputError(
                f"contact {finger} is on no face: expected one within {reach:.3g} m whose inward "
                f"normal is within {math.degrees(LARGEST_LEAN):.0f} deg of the given one"
            )
        found.append(nearest)
    faces = four(each.face for each in found)
    if body.patches is not None:
        around = [_around(body, each.face, each.contact) for each in found]
        faces = four(len(body.faces) + finger for finger in range(FINGERS))
        body = replace(body, faces=(*body.faces, *around))
    contacts = four(each.contact for each in found)
    return Seated(body, faces, contacts, max(each.distance for each in found))


def grasp_of(seated: Seated, friction: float, name: str) -> Grasp | ClosureCertificate:
    """Make a grasp without regions of four contacts, or return the proof that there is none."""
    body = seated.body
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
        critical_friction=min(critical_friction(positions, normals), friction),
        closure_margin=certificate.margin,
        ferrari_canny=(quality.lower, quality.upper),
        witness=Witness(positions, certificate.forces),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """Triangles that make up a surface: of the convex pieces of faces, or of a curved mesh."""

    faces: Indices  # index of the face, or of the triangle where the object is curved, (t,)
    normals: Array  # unit vectors into the object, (t, 3)
    corners: Array  # counter-clockwise about the normals, (t, 3, 3) [m]


@lru_cache(maxsize=8)
def facets_of(body: Polyhedron) -> Facets:
    """List the triangles on which fingers may stand; kept, as every contact searches them."""
    if body.patches is None:
        fans = [fan(face) for face in body.faces]
        faces = np.repeat(np.arange(len(fans)), [len(each) for each in fans])
        return Facets(faces, body.normals[faces], np.concatenate(fans))
    corners = body.vertices[body.triangles[:, ::-1]]
    areas, normals = areas_and_normals(corners)
    areas[body.surface.caps] = 0.0
    (kept,) = np.nonzero(areas > 0.0)
    return Facets(kept, normals[kept], corners[kept])


def fan(face: Face) -> Array:
    """Split the convex pieces of a face into triangles about their first corners, (t, 3, 3)."""
    fans = (
        np.stack([np.broadcast_to(piece[0], piece[2:].shape), piece[1:-1], piece[2:]], axis=1)
        for piece in face.pieces
    )
    return np.concatenate([np.empty((0, 3, 3)), *fans])


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """The point of a surface that is nearest to a given one, among facets with a like normal."""

    face: int  # index of the face, or of the triangle where the object is curved
    contact: Contact
    distance: float  # distance from the given point [m]


def nearest_like(
    facets: Facets, point: Array, normal: Array, *, lean: float, reach: float, margin: float
) -> Nearest | None:
    """Find the point nearest to a given one on facets that lean little; None beyond reach."""
    heights = np.abs(np.einsum("ti,ti->t", facets.normals, point - facets.corners[:, 0]))
    (likely,) = np.nonzero((facets.normals @ normal >= math.cos(lean)) & (heights <= reach))
    at = nearest_on_triangles(facets.corners[likely], point)
    distances = np.linalg.norm(at - point, axis=1)
    if not (distances <= reach).any():
        return None
    best = first_best(np.where(distances <= reach, -distances, -np.inf), margin)
    index = likely[best]
    contact = Contact(at[best], facets.normals[index])
    return Nearest(int(facets.faces[index]), contact, float(distances[best]))


def _around(body: Polyhedron, triangle: int, contact: Contact) -> Face:
    """Make a round face around a contact on a triangle, in the triangle's plane."""
    radius = PATCH_RADIUS * body.radius
    polygon = contact.position + radius * circle(PATCH_CORNERS) @ plane_frame(contact.normal).T
    return Face(
        normal=contact.normal,
        centroid=contact.position,
        area=math.pi * radius**2,
        polygon=polygon,
        holes=(),
        pieces=(polygon,),
        facets=np.array([triangle]),
    )
