"""Whether a grasp from elsewhere belongs to an object: its contacts lie on the faces it names."""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.values import Contact, Face, Grasp, Polyhedron

ON_FACE = 1e-6
"""How far a contact may be off its face, in object radii: what six digits in a file keep."""


def check_on_faces(body: Polyhedron, grasp: Grasp) -> None:
    """Refuse a grasp whose contacts are not on the faces it names.

    Raises:
        InputError: A face does not exist, or a contact is off its plane or outside its border.
    """
    for finger, (face, contact) in enumerate(zip(grasp.faces, grasp.contacts, strict=True)):
        where = f"grasp {grasp.id}: contact {finger}"
        if not 0 <= face < len(body.faces):
            raise InputError(f"{where} names face {face}; there are 0..{len(body.faces) - 1}")
        plane, slack = body.faces[face], ON_FACE * body.radius
        off = abs(float(plane.normal @ (contact.position - plane.centroid)))
        if off > slack or float(np.abs(contact.normal - plane.normal).max()) > ON_FACE:
            raise InputError(f"{where} does not lie on face {face} with that face's normal")
        if not any(within(contact.position, piece, plane.normal, slack) for piece in plane.pieces):
            raise InputError(f"{where} lies outside the border of face {face}")


def face_under(body: Polyhedron, contact: Contact) -> Face | None:
    """The face on which a contact lies, with that face's normal, if there is one."""
    slack = ON_FACE * body.radius
    for face in body.faces:
        off = abs(float(face.normal @ (contact.position - face.centroid)))
        turned = float(np.abs(contact.normal - face.normal).max())
        if max(off / body.radius, turned) <= ON_FACE and any(
            within(contact.position, piece, face.normal, slack) for piece in face.pieces
        ):
            return face
    return None


def within(point: Array, polygon: Array, normal: Array, slack: float) -> bool:
    """Whether a point in the plane of a convex polygon is inside it, or outside by a slack at most.

    Args:
        point: (3,) [m]
        polygon: Corners in order about `normal`, (n, 3) [m].
        normal: (3,)
        slack: [m]
    """
    edges = np.roll(polygon, -1, axis=0) - polygon
    inward = np.cross(normal, edges) / np.linalg.norm(edges, axis=1, keepdims=True)
    return bool((np.einsum("ki,ki->k", inward, point - polygon) >= -slack).all())
