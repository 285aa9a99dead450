"""Face quadruples of convex example objects, as the constructions take them."""

from grasp_core.constructions import PAIRINGS
from grasp_core.face_pieces import unit_pieces
from grasp_core.spanning import spanning_quadruples
from grasp_core.values import ForceCone
from scenes.objects import example_object


def paired_quadruples(name, theta, limit=None):
    """Pieces and normal-axis force cones of the quadruples that span at theta, in all pairings."""
    body = example_object(name)
    pieces = unit_pieces(body)
    for faces in spanning_quadruples(body.normals, theta).indices[:limit]:
        for order in PAIRINGS:
            quad = [pieces[faces[finger]] for finger in order]
            yield quad, [ForceCone(piece.normal, theta) for piece in quad]
