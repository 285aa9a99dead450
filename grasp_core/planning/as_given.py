"""Translates grasps and proofs from the planner's reordered copy of an object to the original.

The planner works on a copy in standard order: its faces are renumbered, and it may be mirrored, so
that results do not depend on the mesh file (see `standard_order`). Here faces get their original
numbers back, and fingers are listed by face number. A grasp found on a mirror image is mirrored: a
reflection D keeps forces in their cones and turns the torque x x f into -(D x) x (D f), so balance,
closure and regions are preserved. A separating twist (a, b) becomes (D a, -D b).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, frozen_copy
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.declared import altered
from grasp_core.families.free import Absence
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.objects.standard_order import FLIP, Standard
from grasp_core.planning.certify import Certified
from grasp_core.values import FaceQuadruple, four

PAIRED = ("p", "r")
"""Letters with which the ids of pencil and regulus grasps begin: their fingers (0, 1) and (2, 3)
form pairs."""
Place: TypeAlias = tuple[int, str]
"""The face on which a finger stands, by its number on the object as it was given, and the half of
the face, `a` or `b`; empty for a whole face."""


def as_given(found: Certified, on: Standard) -> Certified:
    """Translate a grasp to the object as given, fingers in the order of their faces."""
    places = [_place(on, face) for face in found.faces]
    order = _finger_order(found.id[0], places)
    placement = found.placement
    swapped = found.id[0] in PAIRED and order[0] > 1
    grasp = replace(
        found,
        id="-".join([found.id[0], *("{}{}".format(*places[finger]) for finger in order)]),
        faces=four(places[finger][0] for finger in order),
        pieces=tuple(found.pieces[finger] for finger in order),
        cones=tuple(found.cones[finger] for finger in order),
        regions=tuple(found.regions[finger] for finger in order),
        placement=replace(
            placement,
            positions=placement.positions[order],
            forces=placement.forces[order],
            foci=placement.foci[::-1] if swapped else placement.foci,
            radii=placement.radii[order],
            planned=None if placement.planned is None else placement.planned[order],
        ),
        ways_out=None if found.ways_out is None else found.ways_out[order],
    )
    return _mirrored_grasp(grasp) if on.mirrored else grasp


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


def _mirrored_grasp(found: Certified) -> Certified:
    placement = found.placement
    return replace(
        found,
        pieces=tuple(map(_mirrored_piece, found.pieces)),
        cones=tuple(altered(cone, axis=frozen_copy(cone.axis * FLIP)) for cone in found.cones),
        regions=tuple(
            altered(each, polygon=frozen_copy(each.polygon[::-1] * FLIP)) for each in found.regions
        ),
        placement=replace(
            placement,
            positions=placement.positions * FLIP,
            forces=placement.forces * FLIP,
            foci=placement.foci * FLIP,
            planned=None if placement.planned is None else placement.planned * FLIP,
        ),
        ways_out=None if found.ways_out is None else found.ways_out * FLIP,
    )


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
