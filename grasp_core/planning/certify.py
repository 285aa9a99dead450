"""Certifies placed contacts as a grasp, and turns it into one of the object as it was given.

Contacts are certified if an exact test and their witness both confirm them. The exact test decides
force closure. The witness is four contact forces that balance inside the friction cones and whose
lines form the claimed family.

The planner works on a copy in standard order: its faces are renumbered, and it may be mirrored, so
that results do not depend on the mesh file (see `standard_order`). Here faces get their original
numbers back, and fingers are listed by face number. A grasp found on a mirror image is mirrored: a
reflection D keeps forces in their cones and turns the torque x x f into -(D x) x (D f), so balance,
closure and regions are preserved. A separating twist (a, b) becomes (D a, -D b).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, frozen_copy
from grasp_core.by_value import kept
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.contacts import grasp_map, normal_and_tangential
from grasp_core.closure.critical_friction import critical_friction, critical_frictions
from grasp_core.closure.force_closure import closing_margins, force_closure
from grasp_core.closure.lines import classify_each
from grasp_core.cones.spanning import span_angles
from grasp_core.declared import altered, trusted
from grasp_core.errors import InputError, UndecidedError
from grasp_core.families.absence_certificate import Absence
from grasp_core.families.placements import Placement
from grasp_core.frames import kept_angle
from grasp_core.names import Family, Method
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import FLIP, Standard
from grasp_core.quality.ferrari_canny import ferrari_canny
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

WITNESS_SLACK = 1e-6
"""Largest wrench by which witness forces may miss balance, for normal parts that sum to one and an
object of size one: forces written with six digits meet it."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Contacts that a method placed on four faces at unit object size, not certified yet."""

    id: str
    faces: FaceQuadruple
    family: Family
    pieces: tuple[FacePiece, ...]
    cones: tuple[ForceCone, ...]
    placement: Placement
    regions: tuple[ContactRegion, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Certified(Candidate):
    """A certified grasp at unit object size, before it is converted to the object's frame."""

    span_angle: float
    margin: float
    method: Method  # the method whose search found it: `free` may find grasps of any family
    ways_out: Array | None = None
    """Unit vectors along which fingers can leave, (4, 3); None if no free lines were sought."""

    @property
    def normals(self) -> Array:
        """Return the inward unit normals at the contacts, (4, 3)."""
        return np.array([piece.normal for piece in self.pieces])


def named(letter: str, faces: FaceQuadruple) -> str:
    """Return a grasp's id: the method's letter and the faces by finger, as in `p-0-3-1-2`."""
    return f"{letter}-" + "-".join(str(face) for face in faces)


def certify_each(candidates: Sequence[Candidate], friction: float) -> list[Certified | None]:
    """Certify placements together; None for each that the witness or the closure test rejects."""
    if not candidates:
        return []
    points = np.array([each.placement.positions for each in candidates])
    normals = np.array([[piece.normal for piece in each.pieces] for each in candidates])
    forces = np.array([each.placement.forces for each in candidates])
    families: list[Family] = [each.family for each in candidates]
    certified: list[Certified | None] = []
    faults = witness_faults(points, normals, forces, friction, families)
    margins = closing_margins(points, normals, friction).tolist()
    angles = span_angles(normals).tolist()
    for i, (each, fault, angle) in enumerate(zip(candidates, faults, angles, strict=True)):
        margin = margins[i]
        # where arrays of contacts leave closure open, it is decided for these contacts alone
        if fault is None and math.isnan(margin):
            try:
                alone = force_closure(points[i], normals[i], friction)
                margin = alone.margin if alone.closed else None
            except UndecidedError:
                margin = None
        certified.append(
            Certified(
                each.id, each.faces, each.family, each.pieces, each.cones, each.placement,
                each.regions, angle, margin, method=each.family,
            )
            if fault is None and margin is not None
            else None
        )  # fmt: skip
    return certified


def witness_faults(
    points: Array, normals: Array, forces: Array, friction: float, families: Sequence[Family]
) -> list[str | None]:
    """Return why the witness forces of each set of contacts are wrong, or None."""
    along, across = normal_and_tangential(forces, normals)
    stacked = forces.reshape(len(forces), -1)
    wrenches = np.einsum("gwj,gj->gw", grasp_map(points), stacked)
    missed = np.linalg.norm(wrenches, axis=-1)
    rules = {
        "the normal parts of the witness forces do not sum to one": (
            np.abs(along.sum(axis=-1) - 1.0) <= WITNESS_SLACK
        ),
        "a witness force is outside its friction cone": (
            (along > 0.0).all(axis=-1) & (across <= friction * along + WITNESS_SLACK).all(axis=-1)
        ),
        "the witness forces do not balance": missed <= WITNESS_SLACK,
    }
    kept = np.stack(list(rules.values()), axis=1).tolist()
    faults = [next((fault for fault, fits in zip(rules, row, strict=True) if not fits), None)
              for row in kept]  # fmt: skip
    sound = [place for place, fault in enumerate(faults) if fault is None]
    for place, found in zip(sound, classify_each(points[sound], forces[sound]), strict=True):
        if found != families[place]:
            faults[place] = f"the witness lines are {found}, not {families[place]}"
    return faults


def check_witness(body: Polyhedron, grasp: Grasp, friction: float) -> None:
    """Refuse a grasp read from elsewhere whose witness does not show what the grasp claims."""
    points = (grasp.witness.points - body.center_of_mass) / body.radius
    contacts = (grasp.positions - body.center_of_mass) / body.radius
    witness = points[None], grasp.normals[None], grasp.witness.forces[None]
    (fault,) = witness_faults(*witness, friction, [grasp.family])
    if np.abs(points - contacts).max() > WITNESS_SLACK:
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
    return bool(np.linalg.norm(misses, axis=1).max() > WITNESS_SLACK * body.radius)


@dataclass(frozen=True, slots=True, eq=False)
class LateFigures:
    """Computes the figures of a planned grasp from its contacts at unit object size."""

    positions: Array
    normals: Array
    friction: float

    def critical_friction(self) -> float:
        """Return the least friction of closure, at most `friction`, which is proved enough."""
        return min(critical_friction(self.positions, self.normals), self.friction)

    def ferrari_canny(self) -> tuple[float, float]:
        """Return the bounds of the quality at `friction`."""
        found = ferrari_canny(self.positions, self.normals, self.friction, torque_scale=1.0)
        return found.lower, found.upper


def find_critical_frictions(grasps: Iterable[Grasp]) -> None:
    """Find the critical friction of planned grasps that lack it, all in one batch."""
    late = [grasp for grasp in grasps if kept(grasp, "critical_friction") is None]
    if not late:
        return
    figures: list[LateFigures] = [kept(grasp, "_figures") for grasp in late]
    positions, normals = zip(*((each.positions, each.normals) for each in figures), strict=True)
    every = critical_frictions(np.array(positions), np.array(normals)).tolist()
    for grasp, each, found in zip(late, figures, every, strict=True):
        object.__setattr__(grasp, "critical_friction", min(found, each.friction))


PAIRED = ("p", "r")
"""Letters of the ids of pencils and reguli, whose fingers (0, 1) and (2, 3) form pairs."""
ORDER, UNMIRRORED = list(range(FINGERS)), np.ones(3)
"""The order of the fingers, and the signs of the coordinates, where nothing is translated."""
FingerPlace: TypeAlias = tuple[int, str]
"""The face on which a finger stands, by its number on the object as it was given, and the half of
the face, `a` or `b`; empty for a whole face."""


def to_grasp(
    body: Polyhedron, friction: float, found: Certified, on: Standard | None = None
) -> Grasp:
    """Convert a certified placement, found on a reordered copy if given, to one of the object."""
    name, faces, order = (found.id, found.faces, ORDER) if on is None else _named(found, on)
    flip = FLIP if on is not None and on.mirrored else UNMIRRORED
    center, radius, placement = body.center_of_mass, body.radius, found.placement
    axes = [cone.axis for cone in found.cones]
    vectors = np.array([placement.positions, found.normals, placement.forces, axes])
    unit_positions, normals, forces, axes = frozen_copy(vectors[:, order] * flip)
    positions = frozen_copy(center + radius * unit_positions)
    foci = placement.foci[::-1] if found.id[0] in PAIRED and order[0] > 1 else placement.foci
    return trusted(
        Grasp,
        id=name,
        family=found.family,
        faces=four(faces),
        contacts=four(
            trusted(Contact, position=position, normal=normal)
            for position, normal in zip(positions, normals, strict=True)
        ),
        focus_points=frozen_copy(center + radius * (foci * flip)),
        force_cones=four(
            trusted(ForceCone, axis=axis, half_angle=kept_angle(found.cones[finger].half_angle))
            for axis, finger in zip(axes, order, strict=True)
        ),
        regions=four(_region(found.regions[finger], body, flip) for finger in order),
        radius=radius * float(placement.radii.min()),
        span_angle=kept_angle(found.span_angle),
        closure_margin=found.margin,
        witness=trusted(Witness, points=positions, forces=forces),
        approach_directions=(
            None if found.ways_out is None else frozen_copy(-found.ways_out[order] * flip)
        ),
        _figures=LateFigures(unit_positions, normals, friction),
    )


def _region(region: ContactRegion, body: Polyhedron, flip: Array) -> ContactRegion:
    """Put a region into the object's frame; a mirrored one is listed the other way around."""
    listed = region.polygon if flip is UNMIRRORED else region.polygon[::-1] * flip
    corners = body.center_of_mass + body.radius * listed
    corners.setflags(write=False)
    radius = body.radius * region.inscribed_radius
    return trusted(ContactRegion, kind=region.kind, polygon=corners, inscribed_radius=radius)


def _named(found: Certified, on: Standard) -> tuple[str, Sequence[int], list[int]]:
    """Return the id and the faces of a grasp on the object as given, and its fingers in order."""
    letter, places = found.id[0], [_place(on, face) for face in found.faces]
    order = sorted(range(FINGERS), key=places.__getitem__)
    if letter in PAIRED:  # within pairs, then the pairs
        pairs = [sorted(pair, key=places.__getitem__) for pair in ((0, 1), (2, 3))]
        first, second = sorted(pairs, key=lambda pair: places[pair[0]])
        order = [*first, *second]
    name = "-".join([letter, *("{}{}".format(*places[finger]) for finger in order)])
    return name, [places[finger][0] for finger in order], order


def _place(on: Standard, face: int) -> FingerPlace:
    owner = on.owners[face]
    if face == owner:
        return on.faces[owner], ""
    first = on.owners.index(owner, len(on.faces))
    return on.faces[owner], "a" if face == first else "b"


def faces_as_given(faces: FaceQuadruple, on: Standard) -> FaceQuadruple:
    """Ascending faces of the object as given, where halves count as their whole faces."""
    return four(sorted(on.faces[on.owners[face]] for face in faces))


def absence_as_given(proof: Absence, on: Standard) -> Absence:
    """Translate a proof of absence to the faces of the object as it was given."""
    pieces = [altered(piece, face=on.faces[on.owners[piece.face]]) for piece in proof.pieces]
    if not on.mirrored:
        return altered(proof, pieces=tuple(pieces))
    mirrored = (  # frames too, so that plane coordinates stay
        altered(piece, normal=frozen_copy(piece.normal * FLIP),
                origin=frozen_copy(piece.origin * FLIP),
                frame=frozen_copy(piece.frame * FLIP[:, None]))
        for piece in pieces
    )  # fmt: skip
    return altered(
        proof,
        pieces=tuple(mirrored),
        leaves=tuple((path, _mirrored_certificate(leaf)) for path, leaf in proof.leaves),
    )


def _mirrored_certificate(leaf: ClosureCertificate) -> ClosureCertificate:
    # a torque is an axial vector: it takes the other sign
    return altered(
        leaf,
        positions=frozen_copy(leaf.positions * FLIP),
        normals=frozen_copy(leaf.normals * FLIP),
        forces=_mirrored_or_none(leaf.forces, FLIP),
        separating_wrench=_mirrored_or_none(leaf.separating_wrench, np.concatenate([FLIP, -FLIP])),
    )


def _mirrored_or_none(vectors: Array | None, flip: Array) -> Array | None:
    return None if vectors is None else frozen_copy(vectors * flip)
