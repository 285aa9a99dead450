"""Finds the face, or the triangle of a curved patch, under each contact on an object.

Nearest points of triangles are found without tolerances, however small or thin triangles are.

Solved: for a point p and a triangle a, b, c, the point q of the triangle nearest to p.

Method. q is the foot of p on the triangle's plane if that is inside, else it is on one of the
edges. With n = (b - a) x (c - a) the foot is a + v (b - a) + w (c - a), v = n.((p - a) x (c - a)) /
n.n and w = n.((b - a) x (p - a)) / n.n; it is inside if v, w >= 0 and v + w <= 1. Of these four
candidates the nearest is taken. As each candidate is on the triangle, rounding can make q too far
from p, never too near. The error is some 1e-16 lengths of the triangle, divided by the ratio of its
height to its length, but no more than its height: at worst 1e-8 lengths, for very thin triangles.

Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5. The signs tested there are
products of four lengths, which no single threshold suits, so the nearest candidate is taken
instead.
"""

import math
from functools import lru_cache

import numpy as np

from grasp_core.allowed_values import instance
from grasp_core.arrays import Array, Indices, cross
from grasp_core.errors import InputError
from grasp_core.geometry.polygons import nearest_on_segments
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face, areas_and_normals
from grasp_core.solvers.ties import first_best
from grasp_core.values import Contact, Grasp

ON_FACE = 1e-6
"""Largest distance of a contact from its face [object radii]: six digits of a file keep it."""
MESH_ROUNDING = 1e-3
"""Most that the rounding of a mesh adds to that [object radii]: a larger flatness is the user's."""


def on_face_slack(body: Polyhedron) -> float:
    """Return the distance within which a point is on a face [m], also where its mesh is rounded."""
    return max(ON_FACE * body.radius, min(body.surface.flatness_m, MESH_ROUNDING * body.radius))


def check_body(body: Polyhedron) -> None:
    """Refuse a value that is not an object."""
    instance(body, Polyhedron, "body", "gc.load_polyhedron reads one from a mesh file")


def check_planar(body: Polyhedron, asking: str) -> None:
    """Refuse a value that is not an object, and an object with curved faces."""
    check_body(body)
    if body.patches is not None:
        raise InputError(
            f"{asking}: expected an object with planar faces, got {body.name} with curved ones; "
            "read it with faces='planar', or take a mesh with fewer, planar faces"
        )


def check_on_faces(body: Polyhedron, grasp: Grasp) -> None:
    """Refuse a grasp whose contacts are not on the faces it names."""
    check_body(body)
    instance(
        grasp, Grasp, "grasp", "gc.plan makes grasps; of contacts of your own, seat and grasp_of "
        "in grasp_core.planning.given_contacts make one, as docs/python.md shows",
    )  # fmt: skip
    slack = on_face_slack(body)
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


def edge_distance(face: Face, point: Array) -> float:
    """Return how far a point on a face is from the face's nearest edge [m]."""
    nearest = [
        nearest_on_segments(loop, np.roll(loop, -1, axis=0), point)
        for loop in (face.polygon, *face.holes)
    ]
    return float(np.linalg.norm(np.concatenate(nearest) - point, axis=1).min())


def nearest_edge(body: Polyhedron, grasp: Grasp) -> float:
    """Return the least distance of a grasp's contacts from the edges of their faces [m]."""
    return min(
        edge_distance(body.faces[face], contact.position)
        for face, contact in zip(grasp.faces, grasp.contacts, strict=True)
    )


@lru_cache(maxsize=32)
def face_under(body: Polyhedron, contact: Contact) -> Face | None:
    """Find the face on which a contact lies with its normal; kept, as controls repeat it."""
    slack = on_face_slack(body)
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
    slack = on_face_slack(body)
    if not len(face.facets):
        off = abs(float(face.normal @ (contact.position - face.centroid)))
        return off <= slack and float(np.abs(contact.normal - face.normal).max()) <= ON_FACE
    corners = body.vertices[body.triangles[face.facets][:, ::-1]]
    _, normals = areas_and_normals(corners)
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


def nearest_on_surface(vertices: Array, triangles: Indices, points: Array) -> Array:
    """Find the surface point nearest to each of several points, (n, 3) [m]."""
    candidates = nearest_on_triangles(vertices[triangles], points)
    distances = np.linalg.norm(candidates - points[:, None], axis=2)
    chosen = [first_best(-own) for own in distances]
    return candidates[np.arange(len(points)), chosen]


def nearest_on_triangles(corners: Array, points: Array) -> Array:
    """Find the point of each triangle (t, 3, 3) nearest to points (..., 3), (..., t, 3) [m]."""
    points = points[..., None, None, :]
    on_edges = nearest_on_segments(corners, np.roll(corners, -1, axis=1), points)
    feet = _foot(corners, points[..., 0, :])[..., None, :]
    candidates = np.concatenate([on_edges, feet], axis=-2)
    nearest = np.linalg.norm(candidates - points, axis=-1).argmin(axis=-1)
    found: Array = np.take_along_axis(candidates, nearest[..., None, None], axis=-2)
    return found[..., 0, :]


def _foot(corners: Array, points: Array) -> Array:
    """Return the foot of points (..., 1, 3) on each triangle if inside, else a corner."""
    tails = corners[:, 0]
    one, other, away = corners[:, 1] - tails, corners[:, 2] - tails, points - tails
    normals = cross(one, other)
    squares = np.einsum("ti,ti->t", normals, normals)
    scaled = normals / np.where(squares > 0.0, squares, 1.0)[:, None]
    v = np.einsum("ti,...ti->...t", scaled, cross(away, other))
    w = np.einsum("ti,...ti->...t", scaled, cross(one, away))
    inside = (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    v, w = np.where(inside, v, 0.0), np.where(inside, w, 0.0)
    return tails + v[..., None] * one + w[..., None] * other


LEAN = math.cos(3e-3)
"""Cosine of the largest angle at which a normal and a triangle's normal agree: planar faces are
flat to within `planar_faces.ANGLE`, and files keep six digits."""


class SolidSurface:
    """The surface of a closed triangle mesh whose triangles face outwards."""

    def __init__(self, vertices: Array, triangles: Indices) -> None:
        self._corners = vertices[triangles]
        self._inward = -areas_and_normals(self._corners)[1]

    def holds(self, point: Array, normal: Array | None, slack: float) -> bool:
        """Return whether a point is within `slack` of a triangle with such a normal, if given."""
        near = np.linalg.norm(nearest_on_triangles(self._corners, point) - point, axis=1) <= slack
        if normal is None:
            return bool(near.any())
        return bool((self._inward[near] @ normal >= LEAN).any())
