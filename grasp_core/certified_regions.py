"""Independent regions for the fingers of any grasp, polygons on its faces, with a proof.

Contacts may be anywhere in their own regions, whatever the others do, and the grasp stays in force
closure: first the largest equal discs for which that is proved (`region_search`), around the
contacts or around better centres (`region_centers`), then polygons around the discs that the same
proof allows, or as much area as covers are found for (`region_growth`). Every proof is checked by
`TwistCover.verify` before it is returned.

On patches of curved surfaces a contact may be as far off the plane as the surface is, and friction
loses the angle by which the surface leans, so that normals are counted as the plane's.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array, positive
from grasp_core.closure import force_closure
from grasp_core.errors import InputError, SolverError
from grasp_core.face_pieces import FacePiece, inscribed_disc_radius_of, inset_piece, piece_of
from grasp_core.on_faces import check_on_faces
from grasp_core.region_centers import better_centers
from grasp_core.region_growth import BEGINNINGS, disc_polygons, most_area, shared_out, tidy
from grasp_core.region_search import WIDER, Grounds, Proved, largest_discs
from grasp_core.twist_covers import TwistCover
from grasp_core.values import ContactRegion, Grasp, Polyhedron, four, stacked

Balance: TypeAlias = Literal["radius", "area"]
"""What regions are grown for: the smallest inscribed disc, or the total area."""
CONES = 10_000
"""Cones of one cover at most, unless told otherwise: half a second's work."""


@dataclass(frozen=True, slots=True, eq=False)
class CertifiedRegions:
    """Where each finger may stand while the others are anywhere in their own regions."""

    regions: tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
    radius: float
    """Of discs around `centers` whose parts on the faces were proved first [m]."""
    centers: Array
    """(4, 3) [m]"""
    limit: float
    """A larger radius for which `open_choice` was found; infinite if none was [m]."""
    open_choice: Array | None
    """Contacts in those discs that are not force-closed, (4, 3) [m]."""
    friction: Array
    """For which all choices are force-closed, (4,)."""
    origin: Array
    """Of the torques of the proof, (3,) [m]."""
    normals: Array
    """Of the faces, into the object, (4, 3)."""
    depths: Array
    """How far the surface may be off the regions' planes, (4,) [m]."""
    cover: TwistCover
    """The proof; lengths relative to `scale`."""
    scale: float
    """[m]"""

    def verify(self) -> bool:
        """Re-check in plain arithmetic that every choice of contacts is force-closed."""
        prisms = [
            (np.vstack([r.polygon - depth * n, r.polygon + depth * n]) - self.origin) / self.scale
            for r, n, depth in zip(self.regions, self.normals, self.depths, strict=True)
        ]
        return self.cover.verify(prisms, self.normals, self.friction)


def certify_regions(  # noqa: PLR0913 - what a user may choose
    body: Polyhedron,
    grasp: Grasp,
    friction: float,
    *,
    reserve: float = 0.0,
    balance: Balance = "radius",
    recenter: bool = False,
    clearance: float = 0.0,
    cones: int = CONES,
) -> CertifiedRegions | None:
    """Regions around the contacts of a grasp, as large as a proof is found for.

    Args:
        body: The object.
        grasp: On its faces.
        friction: Coulomb coefficient at every contact.
        reserve: Share of the friction that is not counted on.
        balance: Seek large discs for all fingers, or much area in total (some ten times slower).
        recenter: Move the regions' centres to where the discs can be largest; the contacts may
            then be outside of their regions.
        clearance: How far regions stay from the edges of their faces, up to half the radius of the
            largest disc there [m].
        cones: Of one proof, at most. The radius grows with it, and the time in proportion.

    Returns:
        The regions; None if no radius could be proved.

    Raises:
        InputError: The contacts are not on the faces, or not closed with what friction is left; a
            number or a choice is out of its range.
    """
    check_on_faces(body, grasp)
    if not 0.0 <= reserve < 1.0:
        raise InputError(f"reserve must be from 0 to below 1, got {reserve}")
    if not (math.isfinite(clearance) and clearance >= 0.0):
        raise InputError(f"clearance must be at least 0, got {clearance}")
    if balance not in {"radius", "area"}:
        raise InputError(f"balance must be 'radius' or 'area', got {balance!r}")
    left = positive(friction, "friction") * (1.0 - reserve)
    positions, normals = stacked(grasp.contacts)
    if not force_closure(positions, normals, left).closed:
        raise InputError(f"grasp {grasp.id} is not in force closure at friction {left:.6g}")
    origin = positions.mean(axis=0)
    scale = float(np.linalg.norm(positions - origin, axis=1).max())
    pieces = tuple(
        inset_piece(_piece(body, grasp, finger, origin, scale), clearance / scale)
        for finger in range(len(positions))
    )
    steepest = math.atan(left) - np.array([piece.spread for piece in pieces])
    if steepest.min() <= 0.0:
        return None
    grounds = Grounds(pieces, np.tan(steepest), cones)
    arms = (positions - origin) / scale
    ys = np.array(
        [piece.frame.T @ (x - piece.origin) for piece, x in zip(pieces, arms, strict=True)]
    )
    proved = largest_discs(grounds, better_centers(grounds, ys) if recenter else ys)
    if proved is None:
        return None
    polygons, cover = _polygons(grounds, proved, balance, grasp, origin, scale)
    return _checked(grasp, grounds, proved, polygons, cover, origin, scale)


def _polygons(
    grounds: Grounds, proved: Proved, balance: Balance, grasp: Grasp, origin: Array, scale: float
) -> tuple[list[Array], TwistCover]:
    """Polygons in plane coordinates, and their proof."""
    if balance == "radius":
        discs = grounds.discs(proved.ys, proved.radius)
        return shared_out(grounds, proved.ys, discs, proved.cover), proved.cover
    beginnings = [disc_polygons(grounds, proved.ys, b * proved.radius) for b in BEGINNINGS]
    planned = [
        tidy(((region.polygon - origin) / scale - piece.origin) @ piece.frame)
        for region, piece in zip(grasp.regions, grounds.pieces, strict=True)
    ]
    if min(map(len, planned)) > 2:  # noqa: PLR2004 - polygons, not points
        beginnings.append(planned)
    return most_area(grounds, proved, beginnings)


def _checked(  # noqa: PLR0913, PLR0917 - everything that regions are made of
    grasp: Grasp, grounds: Grounds, proved: Proved, polygons: list[Array], cover: TwistCover,
    origin: Array, scale: float,
) -> CertifiedRegions:  # fmt: skip
    """Regions in the object's frame, with their proof, checked."""
    placed = [
        origin + scale * (piece.origin + polygon @ piece.frame.T)
        for piece, polygon in zip(grounds.pieces, polygons, strict=True)
    ]
    normals = np.array([piece.normal for piece in grounds.pieces])
    depths = np.array([piece.depth for piece in grounds.pieces])
    choice = _open_choice(grounds, proved)
    found = CertifiedRegions(
        regions=four(
            ContactRegion("certified", polygon, inscribed_disc_radius_of(polygon, normal))
            for polygon, normal in zip(placed, normals, strict=True)
        ),
        radius=scale * proved.radius,
        centers=origin + scale * grounds.points(proved.ys),
        limit=math.inf if choice is None else scale * proved.limit,
        open_choice=None if choice is None else origin + scale * choice,
        friction=grounds.friction,
        origin=origin,
        normals=normals,
        depths=scale * depths,
        cover=cover,
        scale=scale,
    )
    if not found.verify():
        raise SolverError(f"grasp {grasp.id}: the proof of its regions fails its check")
    return found


def _open_choice(grounds: Grounds, proved: Proved) -> Array | None:
    """The choice that a search found open, if it is, by the exact test, and is where it says."""
    if proved.choice is None or any(piece.depth for piece in grounds.pieces):
        return None
    away = np.linalg.norm(proved.choice - grounds.points(proved.ys), axis=1)
    normals = np.array([piece.normal for piece in grounds.pieces])
    closed = force_closure(proved.choice, normals, float(grounds.friction.min())).closed
    return None if closed or (away > WIDER * proved.limit).any() else proved.choice


def _piece(body: Polyhedron, grasp: Grasp, finger: int, origin: Array, scale: float) -> FacePiece:
    """The convex piece of a face that a contact lies on, the one it is deepest in, at unit size."""
    index, point = grasp.faces[finger], grasp.contacts[finger].position
    face = body.faces[index]
    normal = face.normal / np.linalg.norm(face.normal)  # files round them
    pieces = [piece_of(index, normal, (corners - origin) / scale) for corners in face.pieces]
    at = (point - origin) / scale

    def depth(piece: FacePiece) -> float:
        return float((piece.b - piece.E @ (piece.frame.T @ (at - piece.origin))).min())

    found = max(pieces, key=depth)
    return replace(found, spread=face.spread, depth=face.depth / scale)
