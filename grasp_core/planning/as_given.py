"""Translates what was found on an object in standard order back to the object as it was given.

Faces get their original numbers back, and fingers are listed by face number. A grasp found on a
mirror image is mirrored: a reflection D keeps forces in their cones and turns the torque x x f into
-(D x) x (D f), so balance, closure and regions are preserved. A separating twist (a, b) becomes
(D a, -D b).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.families.free import Absence
from grasp_core.families.placements import Placement
from grasp_core.objects.face_pieces import FacePiece
from grasp_core.objects.standard_order import FLIP, Standard
from grasp_core.planning.certify import Certified
from grasp_core.values import ContactRegion, ForceCone, four

PAIRED = ("p", "r")
"""Letters of the constructions whose fingers (0, 1) and (2, 3) are pairs: pencil and regulus."""


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """The face, or half of a face, on which a finger stands."""

    face: int
    """The face's number on the object as it was given."""
    half: str
    """Half of the face, `a` or `b`; empty for a whole face."""

    @property
    def name(self) -> str:
        """Face number and half, as the id of a grasp spells them."""
        return f"{self.face}{self.half}"


def as_given(found: Certified, places: Sequence[Place], *, mirrored: bool) -> Certified:
    """Translate a grasp to the object as given, fingers in the order of their faces.

    Args:
        found: The grasp in standard order.
        places: Where its four fingers stand, in finger order.
        mirrored: Whether the grasp was found on the mirror image.
    """
    order = _finger_order(found.id[0], places)
    named = "-".join([found.id[0], *(places[finger].name for finger in order)])
    swapped = found.id[0] in PAIRED and order[0] > 1
    grasp = replace(
        found,
        id=named,
        faces=four(places[finger].face for finger in order),
        pieces=tuple(found.pieces[finger] for finger in order),
        cones=tuple(found.cones[finger] for finger in order),
        regions=tuple(found.regions[finger] for finger in order),
        placement=_reordered(found.placement, order, swapped=swapped),
        ways_out=None if found.ways_out is None else found.ways_out[order],
    )
    return _mirrored_grasp(grasp) if mirrored else grasp


def _finger_order(letter: str, places: Sequence[Place]) -> list[int]:
    """Finger order by face: within pairs, then the pairs; all four where there are no pairs."""
    if letter not in PAIRED:
        return sorted(range(len(places)), key=places.__getitem__)
    pairs = [sorted(pair, key=places.__getitem__) for pair in ((0, 1), (2, 3))]
    first, second = sorted(pairs, key=lambda pair: places[pair[0]])
    return [*first, *second]


def _reordered(placement: Placement, order: list[int], *, swapped: bool) -> Placement:
    return replace(
        placement,
        positions=placement.positions[order],
        forces=placement.forces[order],
        foci=placement.foci[::-1] if swapped else placement.foci,
        radii=placement.radii[order],
        planned=None if placement.planned is None else placement.planned[order],
    )


def _mirrored_grasp(found: Certified) -> Certified:
    placement = found.placement
    return replace(
        found,
        pieces=tuple(_mirrored_piece(piece) for piece in found.pieces),
        cones=tuple(ForceCone(cone.axis * FLIP, cone.half_angle) for cone in found.cones),
        regions=tuple(
            ContactRegion(each.kind, (each.polygon * FLIP)[::-1], each.inscribed_radius)
            for each in found.regions
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
    """Mirror image of a piece: its frame is mirrored, so its plane coordinates stay the same."""
    return replace(
        piece,
        normal=piece.normal * FLIP,
        origin=piece.origin * FLIP,
        frame=piece.frame * FLIP[:, None],
    )


def absence_as_given(proof: Absence, standard: Standard, owners: Sequence[int]) -> Absence:
    """Translate a proof of absence to the faces of the object as it was given.

    Args:
        proof: Proof about pieces of the standard object's faces.
        standard: The object in standard order.
        owners: For each face index, the whole face it is or is a half of.
    """
    pieces = [replace(piece, face=standard.faces[owners[piece.face]]) for piece in proof.pieces]
    if not standard.mirrored:
        return replace(proof, pieces=tuple(pieces))
    return replace(
        proof,
        pieces=tuple(map(_mirrored_piece, pieces)),
        leaves=tuple((path, _mirrored_certificate(leaf)) for path, leaf in proof.leaves),
    )


def _mirrored_certificate(leaf: ClosureCertificate) -> ClosureCertificate:
    # a torque is an axial vector: it takes the other sign
    wrench = leaf.separating_wrench
    return replace(
        leaf,
        positions=leaf.positions * FLIP,
        normals=leaf.normals * FLIP,
        forces=_mirrored_or_none(leaf.forces, FLIP),
        separating_wrench=_mirrored_or_none(wrench, np.concatenate([FLIP, -FLIP])),
    )


def _mirrored_or_none(vectors: Array | None, flip: Array) -> Array | None:
    return None if vectors is None else vectors * flip
