"""Turns a placement into a grasp if its witness and exact force closure both confirm it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.closure.lines import classify_lines
from grasp_core.closure.wrenches import grasp_map, normal_and_tangential
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import InputError, UndecidedError
from grasp_core.families.placements import Placement
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.values import (
    Contact,
    ContactRegion,
    FaceQuadruple,
    Family,
    ForceCone,
    Grasp,
    Method,
    Witness,
    four,
)

BALANCED = 1e-6
"""Largest wrench that witness forces may leave, for normal parts that sum to one and an object
of size one: six digits in a file keep this much."""


@dataclass(frozen=True, slots=True, eq=False)
class Certified:
    """A confirmed placement, before it is converted to a grasp in the object's frame."""

    id: str
    faces: FaceQuadruple
    family: Family
    span_angle: float
    pieces: tuple[FacePiece, ...]
    cones: tuple[ForceCone, ...]
    regions: tuple[ContactRegion, ...]
    """Contact regions, one per finger, in the pieces' units."""
    placement: Placement
    margin: float
    method: Method
    """The method whose search found it: `free` may find grasps of any family."""
    ways_out: Array | None = None
    """Unit vectors along the fingers' free lines, away from the tips, (4, 3), if sought."""

    @property
    def normals(self) -> Array:
        """Inward normals at the contacts, (4, 3)."""
        return np.array([piece.normal for piece in self.pieces])


def named(letter: str, faces: FaceQuadruple) -> str:
    """The id of a grasp: the method's letter and the faces in finger order, as in `p-0-3-1-2`."""
    return f"{letter}-" + "-".join(str(face) for face in faces)


def certify(  # noqa: PLR0913, PLR0917 - everything a grasp is made of
    name: str,
    faces: FaceQuadruple,
    family: Family,
    pieces: tuple[FacePiece, ...],
    cones: tuple[ForceCone, ...],
    placement: Placement,
    friction: float,
    regions: tuple[ContactRegion, ...],
) -> Certified | None:
    """Certify a placement; None if its witness or the exact closure test does not confirm it."""
    normals = np.array([piece.normal for piece in pieces])
    margin = closure_margin(pieces, placement, friction)
    fault = witness_fault(placement.positions, normals, placement.forces, friction, family)
    if margin is None or fault is not None:
        return None
    angle = span_angle(normals)
    return Certified(
        name, faces, family, angle, pieces, cones, regions, placement, margin, method=family
    )


def closure_margin(
    pieces: Sequence[FacePiece], placement: Placement, friction: float
) -> float | None:
    """Margin of the exact closure test; None unless the test certifies the contacts."""
    normals = np.array([piece.normal for piece in pieces])
    try:
        certificate = force_closure(placement.positions, normals, friction)
    except UndecidedError:
        return None
    return certificate.margin if certificate.closed else None


def witness_fault(
    points: Array, normals: Array, forces: Array, friction: float, family: Family
) -> str | None:
    """Why a witness is wrong (unbalanced, outside a cone, of another class); None if it is right.

    Args:
        points: Contacts on an object of size one, (4, 3).
        normals: Inward unit normals at the contacts, (4, 3).
        forces: Contact forces whose normal parts sum to one, (4, 3).
        friction: Coulomb coefficient.
        family: The class that the lines of force should form.
    """
    along, across = normal_and_tangential(forces, normals)
    if abs(float(along.sum()) - 1.0) > BALANCED:
        return "the normal parts of the witness forces do not sum to one"
    if along.min() <= 0.0 or (across > friction * along + BALANCED).any():
        return "a witness force is outside its friction cone"
    if np.linalg.norm(grasp_map(points) @ forces.ravel()) > BALANCED:
        return "the witness forces do not balance"
    found = classify_lines(points, forces)
    return None if found == family else f"the witness lines are {found}, not {family}"


def check_witness(body: Polyhedron, grasp: Grasp, friction: float) -> None:
    """Refuse a grasp read from elsewhere whose witness does not show what the grasp claims.

    Raises:
        InputError: The forces are not at the contacts, do not balance, leave their friction
            cones, or their lines are of another family.
    """
    points = (grasp.witness.points - body.center_of_mass) / body.radius
    contacts = (grasp.positions - body.center_of_mass) / body.radius
    fault = witness_fault(points, grasp.normals, grasp.witness.forces, friction, grasp.family)
    if np.abs(points - contacts).max() > BALANCED:
        fault = "the witness lines do not pass through the contacts"
    if grasp.family != "regulus" and _beside_foci(body, grasp):
        fault = "the witness lines do not pass through the focus points"
    if fault:
        raise InputError(f"grasp {grasp.id}: {fault}")


def _beside_foci(body: Polyhedron, grasp: Grasp) -> bool:
    """Whether a line of force misses its focus: the only focus, or the focus of its pair."""
    count = 1 if grasp.family == "concurrent" else 2
    if len(grasp.focus_points) != count:
        return True
    foci = np.repeat(grasp.focus_points, len(grasp.contacts) // count, axis=0)
    misses = np.cross(foci - grasp.witness.points, grasp.witness.directions)
    return bool(np.linalg.norm(misses, axis=1).max() > BALANCED * body.radius)


def to_grasp(body: Polyhedron, friction: float, found: Certified) -> Grasp:
    """Convert a certified placement to a grasp in the object's frame, with critical friction."""
    placement = found.placement
    positions = _at(body, placement.positions)
    normals = found.normals
    return Grasp(
        id=found.id,
        family=found.family,
        faces=found.faces,
        contacts=four(Contact(p, n) for p, n in zip(positions, normals, strict=True)),
        focus_points=_at(body, placement.foci),
        force_cones=four(found.cones),
        regions=four(
            ContactRegion(
                region.kind, _at(body, region.polygon), body.radius * region.inscribed_radius
            )
            for region in found.regions
        ),
        radius=body.radius * float(placement.radii.min()),
        span_angle=found.span_angle,
        critical_friction=_critical(placement, normals, friction),
        closure_margin=found.margin,
        ferrari_canny=_quality(placement, normals, friction),
        witness=Witness(positions, placement.forces),
        approach_directions=None if found.ways_out is None else -found.ways_out,
    )


def _at(body: Polyhedron, unit_points: Array) -> Array:
    """Convert points from the pieces' units to the object's frame, (k, 3) [m]."""
    return body.center_of_mass + body.radius * unit_points


def _quality(placement: Placement, normals: Array, friction: float) -> tuple[float, float]:
    found = ferrari_canny(placement.positions, normals, friction, torque_scale=1.0)
    return found.lower, found.upper


def _critical(placement: Placement, normals: Array, friction: float) -> float:
    """Critical friction, at most the friction that is already proved enough."""
    return min(critical_friction(placement.positions, normals), friction)
