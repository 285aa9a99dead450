"""Face quadruples of convex example objects, as the constructions take them."""

import math

import numpy as np

from grasp_core.cones.spanning import SpanningTable
from grasp_core.families import placing_kernel
from grasp_core.families.placements import NOT_DECIDED, PAIRINGS
from grasp_core.objects.face_pieces import unit_pieces
from grasp_core.values import ForceCone
from scenes.example_objects import example_object


def spanning_quadruples(normals, least_angle):
    """All quadruples of directions that positively span at a larger angle than given."""
    return SpanningTable(normals, least_angle).quadruples(0, len(normals))


def paired_quadruples(name, theta, limit=None):
    """Pieces and normal-axis force cones of the quadruples that span at theta, in all pairings."""
    body = example_object(name)
    pieces = unit_pieces(body)
    for faces in spanning_quadruples(body.normals, theta)[:limit]:
        for order in PAIRINGS:
            quad = [pieces[faces[finger]] for finger in order]
            yield quad, [ForceCone(piece.normal, theta) for piece in quad]


def tilted_side_cones(pieces, tilt, half_angle):
    """Force cones for the four sides of an upright box, tilted up on one pair, down on the other.

    The normals of a box never satisfy P3; these axes do.
    """
    cones = []
    for piece in pieces:
        sign = 1.0 if abs(piece.normal[0]) > 0.5 else -1.0
        axis = math.cos(tilt) * piece.normal + sign * math.sin(tilt) * np.array([0.0, 0, 1.0])
        cones.append(ForceCone(axis / np.linalg.norm(axis), half_angle))
    return cones


def leave_all(monkeypatch):
    """Have compiled code solve no program of discs."""
    monkeypatch.setattr(placing_kernel, "place", lambda *given: given[-1].ends.fill(NOT_DECIDED))
