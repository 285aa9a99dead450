"""Independent regions for the fingers of any grasp, polygons on its faces, with a proof.

The largest radius is sought for which a cover of all twists (`twist_covers`) proves that contacts
may be anywhere in discs of that radius on their faces. The cover then says more: where its forces
have power is a half-plane for each ray, so each finger's region is the whole part of its face in
all half-planes of its forces, a convex polygon that contains what the face has of the disc.

How the radius is sought: doubled from the planner's while covers are found, then halved into; an
attempt may take so many cones. Every proof is checked by `TwistCover.verify` before it is returned.
The axes of the cones make the motion of the contacts the same in all of their directions, so that
long objects need no more cones than round ones.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, positive
from grasp_core.closure import force_closure
from grasp_core.cover_search import cover_of
from grasp_core.errors import InputError, SolverError
from grasp_core.face_pieces import inscribed_disc_radius_of
from grasp_core.on_faces import check_on_faces
from grasp_core.polygons import clip, plane_frame
from grasp_core.twist_covers import SLACK, TwistCover, summed
from grasp_core.values import ContactRegion, Grasp, Polyhedron, contact_frictions, four, stacked
from grasp_core.wrenches import contact_frames

CONES = 200_000
"""Cones of one cover at most, unless told otherwise: a second's work or less."""
FINENESS = 0.05
"""The radius is found to this, relative to it."""
FIRST_RADIUS, LEAST_RADIUS = 0.05, 1e-6
"""Where the search begins and gives up, relative to the levers of the contacts."""
MARGIN = 4.0
"""Half-planes keep the powers so many times their slack."""


@dataclass(frozen=True, slots=True, eq=False)
class CertifiedRegions:
    """Where each finger may stand while the others are anywhere in their own regions."""

    regions: tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
    radius: float
    """Of discs around the contacts whose parts on the faces are in the regions [m]."""
    friction: float
    """For which all choices are force-closed."""
    center: Array
    """Origin of the torques of the proof, (3,) [m]."""
    normals: Array
    """Of the faces, into the object, (4, 3)."""
    cover: TwistCover
    """The proof; lengths relative to `scale`."""
    scale: float
    """[m]"""

    def verify(self) -> bool:
        """Re-check in plain arithmetic that every choice of contacts is force-closed."""
        corners = [(region.polygon - self.center) / self.scale for region in self.regions]
        friction = contact_frictions(self.friction, len(corners))
        return self.cover.verify(corners, self.normals, friction)


def certify_regions(
    body: Polyhedron, grasp: Grasp, friction: float, *, reserve: float = 0.0, cones: int = CONES
) -> CertifiedRegions | None:
    """Regions around the contacts of a grasp, as large as a proof is found for.

    Args:
        body: The object, with planar faces.
        grasp: On its faces.
        friction: Coulomb coefficient at every contact.
        reserve: Share of the friction that is not counted on.
        cones: Of one proof, at most. The radius grows with it, and the time in proportion.

    Returns:
        The regions; None if no radius could be proved.

    Raises:
        InputError: The contacts are not on the faces, or not closed with what friction is left; the
            surface is curved; a number is out of its range.
    """
    check_on_faces(body, grasp)
    if body.patches is not None:
        raise InputError("regions are certified on planar faces only: this surface is curved")
    if not 0.0 <= reserve < 1.0:
        raise InputError(f"reserve must be from 0 to below 1, got {reserve}")
    left = positive(friction, "friction") * (1.0 - reserve)
    positions, normals = stacked(grasp.contacts)
    if not force_closure(positions, normals, left).closed:
        raise InputError(f"grasp {grasp.id} is not in force closure at friction {left:.6g}")
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)  # files round them
    search = _Search(positions, normals, left, cones)
    found = search.largest(_reaches(body, grasp, search.scale))
    if found is None:
        return None
    radius, cover = found
    regions = four(
        ContactRegion("certified", polygon, inscribed_disc_radius_of(polygon, normal))
        for polygon, normal in zip(search.polygons(body, grasp, cover), normals, strict=True)
    )
    proved = CertifiedRegions(
        regions, radius * search.scale, left, search.center, normals, cover, search.scale
    )
    if not proved.verify():
        raise SolverError(f"grasp {grasp.id}: the proof of its regions fails its check")
    return proved


def _reaches(body: Polyhedron, grasp: Grasp, scale: float) -> float:
    """The largest disc that is not a whole face, relative to a scale."""
    return (
        max(
            float(np.linalg.norm(_piece(body, grasp, finger) - contact.position, axis=1).max())
            for finger, contact in enumerate(grasp.contacts)
        )
        / scale
    )


def _piece(body: Polyhedron, grasp: Grasp, finger: int) -> Array:
    """The convex piece of a face that a contact lies on, the one it is deepest in, (k, 3) [m]."""
    face, point = body.faces[grasp.faces[finger]], grasp.contacts[finger].position
    if len(face.pieces) == 1:
        return face.pieces[0]

    def depth(piece: Array) -> float:
        edges = np.roll(piece, -1, axis=0) - piece
        inward = np.cross(face.normal, edges) / np.linalg.norm(edges, axis=1, keepdims=True)
        return float(np.einsum("ki,ki->k", inward, point - piece).min())

    return max(face.pieces, key=depth)


class _Search:
    """Covers of a contact set for discs of several radii, at unit size."""

    def __init__(self, positions: Array, normals: Array, friction: float, cones: int) -> None:
        self.center = positions.mean(axis=0)
        arms = positions - self.center
        self.scale = float(np.linalg.norm(arms, axis=1).max())
        self.points = arms / self.scale
        self.frames = contact_frames(normals)
        self.friction = np.full(len(normals), friction)
        self.axes = _even_axes(self.points, self.frames, friction)
        self.cones = cones

    def largest(self, reach: float) -> tuple[float, TwistCover] | None:
        """The largest radius, up to a reach, for which a cover is found, and the cover."""
        lower, upper, best = 0.0, math.inf, None
        radius = min(FIRST_RADIUS, reach)
        while radius >= LEAST_RADIUS and (upper - lower) > FINENESS * lower:
            cover = self.cover(radius)
            if cover is None:
                upper = radius
            else:
                lower, best = radius, cover
                if radius >= reach:
                    break
            if math.isinf(upper):
                radius = min(2.0 * radius, reach)
            else:
                radius = 0.5 * (lower + upper) if lower > 0.0 else 0.25 * upper
        return None if best is None else (lower, best)

    def cover(self, radius: float) -> TwistCover | None:
        """A cover for discs of a radius, if one is found in time."""
        return cover_of(self.points, self.frames, self.friction, radius, self.axes, self.cones)

    def polygons(self, body: Polyhedron, grasp: Grasp, cover: TwistCover) -> list[Array]:
        """The part of each face on which all forces of a cover have power, (c, 3) [m]."""
        found: list[Array] = []
        for finger in range(len(self.points)):
            piece = (_piece(body, grasp, finger) - self.center) / self.scale
            found.append(self.center + self.scale * _powerful_part(piece, cover, finger, self))
        return found


def _powerful_part(piece: Array, cover: TwistCover, finger: int, search: _Search) -> Array:
    """The part of a convex piece on which all of a finger's forces have power, (c, 3)."""
    origin, normal = search.points[finger], search.frames[finger][:, 0]
    frame = plane_frame(normal)
    flat, reach = (piece - origin) @ frame, float(np.linalg.norm(piece - origin, axis=1).max())
    rows, limits = list[Array](), list[Array]()
    for where, rays in cover.leaves():
        mine = np.flatnonzero(cover.contacts[where] == finger)
        twists, forces = rays[mine] @ cover.axes, cover.forces[where][mine][:, None, :]
        turned = np.cross(forces, twists[..., 3:])
        at = (forces * twists[..., :3]).sum(axis=2) + turned @ origin
        lengths = summed(rays[mine], cover.axes) * np.linalg.norm(forces, axis=2)
        at -= MARGIN * SLACK * (2.0 + reach) * lengths
        falling = -turned @ frame
        sizes = np.linalg.norm(falling, axis=2)
        near = at < sizes * reach
        rows.append(falling[near] / sizes[near][:, None])
        limits.append(at[near] / sizes[near])
    return origin + _inside(flat, np.concatenate(rows), np.concatenate(limits)) @ frame.T


def _inside(polygon: Array, rows: Array, limits: Array) -> Array:
    """The part of a convex polygon (c, 2) in half-planes rows @ y <= limits, most idle."""
    while len(rows):
        beyond = (rows @ polygon.T).max(axis=1) - limits
        worst = int(beyond.argmax())
        if beyond[worst] <= 0.0:
            break
        polygon = clip(polygon, rows[worst : worst + 1], limits[worst : worst + 1])
        beyond[worst] = 0.0
        rows, limits = rows[beyond > 0.0], limits[beyond > 0.0]
    return polygon


def _even_axes(points: Array, frames: Array, friction: float) -> Array:
    """Twists as rows that move contacts alike, tangents counted with the friction, (6, 6)."""
    motions = list[Array]()
    for (x, y, z), frame in zip(points, frames, strict=True):
        turning = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        weights = np.array([1.0, friction, friction])
        motions.append(weights[:, None] * (frame.T @ np.hstack([np.eye(3), turning])))
    J = np.vstack(motions)
    values, vectors = np.linalg.eigh(J.T @ J)
    return (vectors / np.sqrt(np.maximum(values, SLACK * values[-1]))).T
