"""Finds independent regions for the fingers of a grasp, polygons on its faces, with a proof.

Contacts may be anywhere in their own regions, wherever the others are, and the grasp stays in force
closure. The search begins with the largest equal discs for which this is proved, around the
contacts or around better centres. Then polygons grow around the discs, as far as the same proof
allows (`growth`). Every proof is checked by `CertifiedRegions.verify` before it is returned.

On patches of curved surfaces a contact may be as far off the plane as the surface is. The plane's
normals are used there, and the friction angle is reduced by the angle between surface and plane.
"""

import math

import numpy as np

from grasp_core.allowed_values import Friction, MaxCones, Reserve, number, value_of
from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.contacts import stacked
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError, SolverError, UndecidedError
from grasp_core.geometry.polygons import (
    SAME_CORNER,
    clip,
    convex_polygon,
    edge_rows,
    holds_disc,
    nearest_point,
    tidy,
    with_fewer_corners,
)
from grasp_core.objects.face_pieces import FacePiece, deepest, inscribed_radius, piece_of
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.regions.growth import (
    Proved,
    RegionTask,
    better_centers,
    larger_inside,
    largest_discs,
    shared_out,
)
from grasp_core.regions.regions_certificate import PLACE_SLACK, CertifiedRegions
from grasp_core.solvers.ties import coarse, on_grid
from grasp_core.values import ContactRegion, Grasp, four

REGION_CONES = 10_000
"""Default for the largest number of cones in one proof, which takes half a second."""
UNIT_DIGITS, PLACE_DIGITS = 6, 8
"""Digits after the point of the unit and its origin [object radii], and of centres."""
DISC_PRECISION = 1e-3
"""Precision of the largest discs in grown polygons, relative to the proved radius."""


def certify_regions(
    body: Polyhedron,
    grasp: Grasp,
    friction: float,
    *,
    reserve: float = 0.0,
    recenter: bool = False,
    clearance: float = 0.0,
    max_cones: int = REGION_CONES,
) -> CertifiedRegions | None:
    """Find independent regions around the contacts of a grasp, as large as can be proved.

    Args:
        body: The object.
        grasp: A grasp on faces of the object.
        friction: Coulomb coefficient at every contact.
        reserve: Share of the friction that is not counted on.
        recenter: Move the regions' centres to where the discs can be largest; the contacts may
            then be outside of their regions.
        clearance: Distance of regions from the edges of their faces [m]. The region of a contact
            nearer to an edge is centred at the nearest place that keeps it.
        max_cones: Most cones of one attempt at a proof, at least 64. With more, radii grow by
            some hundredths, or not at all where they are as large as can be.

    Returns:
        The regions; None if no radius could be proved.

    Raises:
        InputError: The contacts are not on the faces or not force-closed with the friction that is
            left, or a number is out of its range.
        UndecidedError: Force closure of the contacts is too close to call.
        SolverError: A proof failed its check.
    """
    check_on_faces(body, grasp)
    value_of(Reserve, reserve, "reserve")
    value_of(bool, recenter, "recenter")
    number(clearance, "clearance", ge=0.0, lt=body.radius, where=", the object's radius in m")
    value_of(MaxCones, max_cones, "max_cones")
    left = value_of(Friction, friction, "friction") * (1.0 - reserve)
    positions, normals = stacked(grasp.contacts)
    if not force_closure(positions, normals, left).closed:
        raise InputError(
            f"grasp {grasp.id} is not in force closure at friction {left:.6g}; raise the friction"
        )
    unit = RegionUnit(body, positions)
    pieces = room_under(body, grasp, unit, clearance)
    # where the surface leans more than the friction angle nothing can be proved
    least = math.atan(left) - max(body.faces[face].spread for face in grasp.faces)
    if pieces is None or least <= 0.0:
        return None
    leaning = [math.tan(math.atan(left) - p.spread) if p.spread else left for p in pieces]
    task = RegionTask(pieces, np.array(leaning), max_cones)
    ys = np.array([
        nearest_point(piece.corners, on_grid(piece.in_plane(x), PLACE_DIGITS))
        for piece, x in zip(pieces, unit.at(positions), strict=True)
    ])  # fmt: skip
    proved = largest_discs(task, ys)
    if recenter:
        moved = largest_discs(task, better_centers(task, ys))
        proved = larger_inside(task, moved, proved)
    if proved is None:
        return None
    polygons = shared_out(task, proved)
    if min(map(len, polygons)) < 3:  # noqa: PLR2004 - not polygons
        return None
    found = _placed(task, proved, polygons, unit)
    if not found.verify():
        raise SolverError(f"grasp {grasp.id}: its regions failed their own check; please report it")
    return found


class RegionUnit:
    """A unit of length and an origin that make the contacts' longest lever about one.

    Both are rounded to few digits, so that places in this unit do not depend on the last digits of
    the contacts.
    """

    def __init__(self, body: Polyhedron, positions: Array) -> None:
        places = (positions - body.center_of_mass) / body.radius
        middle = on_grid(places.mean(axis=0), UNIT_DIGITS)
        lever = float(np.linalg.norm(places - middle, axis=1).max())
        self.origin = body.center_of_mass + body.radius * middle
        self.scale = body.radius * coarse(lever, UNIT_DIGITS)

    def at(self, points: Array) -> Array:
        """Write points [m] in this unit."""
        return (points - self.origin) / self.scale

    def back(self, points: Array) -> Array:
        """Write points in this unit in metres."""
        return self.origin + self.scale * points


def room_under(
    body: Polyhedron, grasp: Grasp, unit: RegionUnit, clearance: float
) -> tuple[FacePiece, ...] | None:
    """Return the pieces that contacts are deepest in, clear of edges; None if one is too narrow."""
    found = list[FacePiece]()
    for index, contact in zip(grasp.faces, grasp.contacts, strict=True):
        face = body.faces[index]
        normal = face.normal / np.linalg.norm(face.normal)  # files round normals
        every = [piece_of(index, normal, unit.at(corners)) for corners in face.pieces]
        point = unit.at(contact.position)
        whole = deepest(every, point)
        corners = tidy(clip(whole.corners, whole.E, whole.b - clearance / unit.scale))
        if len(corners) < 3:  # noqa: PLR2004 - not a polygon
            return None
        found.append(
            piece_of(index, normal, whole.places(corners), face.spread, face.depth / unit.scale)
        )
    return tuple(found)


def _placed(
    task: RegionTask, proved: Proved, polygons: list[Array], unit: RegionUnit
) -> CertifiedRegions:
    """Return polygons as regions in the object's frame, with their proof."""
    trimmed = list[Array]()
    for polygon, y in zip(polygons, proved.ys, strict=True):
        fewer = with_fewer_corners(polygon)
        E, b = edge_rows(fewer)
        trimmed.append(fewer if (E @ y <= b).all() else polygon)  # else the centre would be lost
    centers = unit.back(task.points(proved.ys))
    opened = _open_choice(task, proved, unit)
    choice = None if opened is None else opened.positions
    return CertifiedRegions(
        regions=four(
            ContactRegion(
                "certified",
                unit.back(piece.places(polygon)),
                unit.scale * inscribed_radius(*edge_rows(polygon)),
            )
            for piece, polygon in zip(task.pieces, trimmed, strict=True)
        ),
        borders=four(unit.back(task.places(i)) for i in range(len(task.pieces))),
        radius=unit.scale * _radius_held(task, proved, trimmed),
        centers=centers,
        limit=math.inf if choice is None else float(np.linalg.norm(choice - centers, axis=1).max()),
        open_choice=choice,
        open_wrench=None if opened is None else opened.separating_wrench,
        friction=task.friction,
        origin=unit.origin,
        normals=np.array([piece.normal for piece in task.pieces]),
        depths=unit.scale * np.array([piece.depth for piece in task.pieces]),
        cover=proved.cover,
        scale=unit.scale,
    )


def _radius_held(task: RegionTask, proved: Proved, polygons: list[Array]) -> float:
    """Return the largest radius, up to the proved one, of discs that fit into the polygons."""
    pairs = [
        (convex_polygon(polygon, PLACE_SLACK), convex_polygon(piece.corners, PLACE_SLACK), y)
        for piece, polygon, y in zip(task.pieces, polygons, proved.ys, strict=True)
    ]

    def held(radius: float) -> bool:
        return all(
            polygon and border and holds_disc(polygon, border, y, radius)
            for polygon, border, y in pairs
        )

    if held(proved.radius):
        return proved.radius
    low, high = 0.0, proved.radius
    while high - low > DISC_PRECISION * proved.radius:  # halved ten times
        middle = 0.5 * (low + high)
        low, high = (middle, high) if held(middle) else (low, middle)
    return low


def _open_choice(task: RegionTask, proved: Proved, unit: RegionUnit) -> ClosureCertificate | None:
    """Return the proof, in the object's frame, that contacts on the pieces are not closed.

    Nothing is claimed about patches, as curved surfaces are not planes.
    """
    if proved.choice is None or any(piece.depth or piece.spread for piece in task.pieces):
        return None
    on_pieces = all(
        piece.inset(x) >= -SAME_CORNER for piece, x in zip(task.pieces, proved.choice, strict=True)
    )
    normals = np.array([piece.normal for piece in task.pieces])
    try:
        found = force_closure(unit.back(proved.choice), normals, task.friction)
    except UndecidedError:
        return None
    return found if on_pieces and not found.closed else None
