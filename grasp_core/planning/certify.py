"""Certifies placed contacts as a grasp if an exact test and their witness both confirm it.

The exact test decides force closure. The witness is four contact forces that balance inside the
friction cones and whose lines form the claimed family.
"""

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
"""Largest wrench by which witness forces may miss balance, for normal parts that sum to one and an
object of size one: forces written with six digits meet it."""


@dataclass(frozen=True, slots=True, eq=False)
class Certified:
    """A certified grasp at unit object size, before it is converted to the object's frame."""

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
    """Unit vectors along which fingers can leave, (4, 3); None if no free lines were sought."""

    @property
    def normals(self) -> Array:
        """Return the inward unit normals at the contacts, (4, 3)."""
        return np.array([piece.normal for piece in self.pieces])


def named(letter: str, faces: FaceQuadruple) -> str:
    """Return a grasp's id: the method's letter and the faces by finger, as in `p-0-3-1-2`."""
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
    """Certify placed contacts; None if the witness or the exact closure test rejects them."""
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
    """Return the margin of the exact force-closure test; None unless it finds closure."""
    normals = np.array([piece.normal for piece in pieces])
    try:
        certificate = force_closure(placement.positions, normals, friction)
    except UndecidedError:
        return None
    return certificate.margin if certificate.closed else None


def witness_fault(
    points: Array, normals: Array, forces: Array, friction: float, family: Family
) -> str | None:
    """Return why witness forces are wrong (unbalanced, outside a cone, another family), or None.

    Args:
        points: Contacts on an object of size one, (4, 3).
        normals: Inward unit normals at the contacts, (4, 3).
        forces: Contact forces whose normal parts sum to one, (4, 3).
        friction: Coulomb coefficient.
        family: The family of grasps to which the lines of force should belong.
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
        raise InputError(f"grasp {grasp.id}: {fault}; plan the grasp again")


def _beside_foci(body: Polyhedron, grasp: Grasp) -> bool:
    """Check whether a line of force misses its focus: the only one, or that of its pair."""
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
    """Convert points from unit object size to the object's frame, (k, 3) [m]."""
    return body.center_of_mass + body.radius * unit_points


def _quality(placement: Placement, normals: Array, friction: float) -> tuple[float, float]:
    found = ferrari_canny(placement.positions, normals, friction, torque_scale=1.0)
    return found.lower, found.upper


def _critical(placement: Placement, normals: Array, friction: float) -> float:
    """Compute the least friction of force closure, at most `friction`, which is proved enough."""
    return min(critical_friction(placement.positions, normals), friction)
