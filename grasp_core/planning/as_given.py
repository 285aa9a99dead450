"""Turns what the planner certified into grasps and proofs of the object as it was given.

The planner works on a copy in standard order: its faces are renumbered, and it may be mirrored, so
that results do not depend on the mesh file (see `standard_order`). Here faces get their original
numbers back, and fingers are listed by face number. A grasp found on a mirror image is mirrored: a
reflection D keeps forces in their cones and turns the torque x x f into -(D x) x (D f), so balance,
closure and regions are preserved. A separating twist (a, b) becomes (D a, -D b).
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, frozen_copy
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.declared import altered, trusted
from grasp_core.families.free import Absence
from grasp_core.frames import kept_angle
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import FLIP, Standard
from grasp_core.planning.certify import Certified, LateFigures
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

PAIRED = ("p", "r")
"""Letters with which the ids of pencil and regulus grasps begin: their fingers (0, 1) and (2, 3)
form pairs."""
ORDER, UNMIRRORED = list(range(FINGERS)), np.ones(3)
"""The order of the fingers, and the signs of the coordinates, where nothing is translated."""
Place: TypeAlias = tuple[int, str]
"""The face on which a finger stands, by its number on the object as it was given, and the half of
the face, `a` or `b`; empty for a whole face."""


def to_grasp(
    body: Polyhedron, friction: float, found: Certified, on: Standard | None = None
) -> Grasp:
    """Convert a certified placement to a grasp in the object's frame, which has late figures.

    Takes `on`, the reordered copy of the object that it was found on, if it is not the object.
    """
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
    places = [_place(on, face) for face in found.faces]
    order = _finger_order(found.id[0], places)
    name = "-".join([found.id[0], *("{}{}".format(*places[finger]) for finger in order)])
    return name, [places[finger][0] for finger in order], order


def _place(on: Standard, face: int) -> Place:
    owner = on.owners[face]
    if face == owner:
        return on.faces[owner], ""
    first = on.owners.index(owner, len(on.faces))
    return on.faces[owner], "a" if face == first else "b"


def faces_as_given(faces: FaceQuadruple, on: Standard) -> FaceQuadruple:
    """Ascending faces of the object as given, where halves count as their whole faces."""
    return four(sorted(on.faces[on.owners[face]] for face in faces))


def _finger_order(letter: str, places: Sequence[Place]) -> list[int]:
    """Return the fingers sorted by face: within pairs, then the pairs; else all four at once."""
    if letter not in PAIRED:
        return sorted(range(len(places)), key=places.__getitem__)
    pairs = [sorted(pair, key=places.__getitem__) for pair in ((0, 1), (2, 3))]
    first, second = sorted(pairs, key=lambda pair: places[pair[0]])
    return [*first, *second]


def _mirrored_piece(piece: FacePiece) -> FacePiece:
    """Mirror a convex piece of a face; its frame is mirrored too, so plane coordinates stay."""
    return altered(
        piece, normal=frozen_copy(piece.normal * FLIP), origin=frozen_copy(piece.origin * FLIP),
        frame=frozen_copy(piece.frame * FLIP[:, None]),
    )  # fmt: skip


def absence_as_given(proof: Absence, on: Standard) -> Absence:
    """Translate a proof of absence to the faces of the object as it was given."""
    pieces = [altered(piece, face=on.faces[on.owners[piece.face]]) for piece in proof.pieces]
    if not on.mirrored:
        return altered(proof, pieces=tuple(pieces))
    return altered(
        proof,
        pieces=tuple(map(_mirrored_piece, pieces)),
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
