"""Finds the face, or the triangle of a curved patch, under each contact on an object."""

from functools import lru_cache

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.checked import instance
from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.values import Contact, Grasp

ON_FACE = 1e-6
"""Largest distance of a contact from its face, in object radii: files that keep six digits stay
within it."""


def check_body(body: Polyhedron) -> None:
    """Refuse a value that is not an object."""
    instance(body, Polyhedron, "body", "gc.load_polyhedron reads one from a mesh file")


def check_planar(body: Polyhedron, asking: str) -> None:
    """Refuse a value that is not an object, and an object with curved faces."""
    check_body(body)
    if body.patches is not None:
        raise InputError(
            f"{asking}: expected an object with planar faces, got {body.name} with curved ones; "
            "take a mesh with fewer, planar faces"
        )


def check_on_faces(body: Polyhedron, grasp: Grasp) -> None:
    """Refuse a grasp whose contacts are not on the faces it names."""
    check_body(body)
    instance(
        grasp, Grasp, "grasp", "gc.plan makes grasps; of contacts of your own, seat and grasp_of "
        "in grasp_core.planning.given_contacts make one, as docs/python.md shows",
    )  # fmt: skip
    slack = ON_FACE * body.radius
    for finger, (face, contact) in enumerate(zip(grasp.faces, grasp.contacts, strict=True)):
        where = f"grasp {grasp.id}: contact {finger}"
        if not 0 <= face < len(body.faces):
            raise InputError(
                f"{where} names face {face}, but faces are numbered 0 to {len(body.faces) - 1}"
            )
        if not _on_surface(body, body.faces[face], contact):
            raise InputError(
                f"{where} does not lie on face {face} with its normal; use a grasp of this object"
            )
        plane = body.faces[face]
        if not any(within(contact.position, piece, plane.normal, slack) for piece in plane.pieces):
            raise InputError(
                f"{where} lies outside the border of face {face}; use a grasp of this object"
            )


@lru_cache(maxsize=32)
def face_under(body: Polyhedron, contact: Contact) -> Face | None:
    """Find the face on which a contact lies with its normal; kept, as controls repeat it."""
    slack = ON_FACE * body.radius
    # planar faces that lean otherwise are left out at once; patches have many normals
    turned = np.abs(body.normals - contact.normal).max(axis=1)
    flat = body.patches is None
    for face in (body.faces[place] for place in np.flatnonzero((turned <= ON_FACE) | (not flat))):
        if _on_surface(body, face, contact) and any(
            within(contact.position, piece, face.normal, slack) for piece in face.pieces
        ):
            return face
    return None


def _on_surface(body: Polyhedron, face: Face, contact: Contact) -> bool:
    """Return whether a contact is in the plane of a face, or on a triangle of a curved patch."""
    slack = ON_FACE * body.radius
    if not len(face.facets):
        off = abs(float(face.normal @ (contact.position - face.centroid)))
        return off <= slack and float(np.abs(contact.normal - face.normal).max()) <= ON_FACE
    corners = body.vertices[body.triangles[face.facets][:, ::-1]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights = np.abs(np.einsum("fi,fi->f", normals, contact.position - corners[:, 0]))
    turned = np.abs(normals - contact.normal).max(axis=1)
    return any(
        within(contact.position, corners[facet], normals[facet], slack)
        for facet in np.flatnonzero((heights <= slack) & (turned <= ON_FACE))
    )


def within(point: Array, polygon: Array, normal: Array, slack: float) -> bool:
    """Return whether a point is inside a convex polygon, or outside by at most `slack`."""
    edges = np.concatenate((polygon[1:], polygon[:1])) - polygon
    inward = cross(normal, edges) / np.linalg.norm(edges, axis=1, keepdims=True)
    return bool((np.einsum("ki,ki->k", inward, point - polygon) >= -slack).all())
