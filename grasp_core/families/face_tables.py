"""Puts convex face pieces into one array per property, for compiled code."""

from collections.abc import Sequence

import numpy as np

from grasp_core.families.kernel_tables import FaceTable
from grasp_core.objects.face_pieces import FacePiece


def face_table(pieces: Sequence[FacePiece | None]) -> FaceTable:
    """Make a table with one row per piece; faces too narrow for a contact leave zeros."""
    count, most = len(pieces), max((len(piece.E) for piece in pieces if piece), default=0)
    table = FaceTable(
        normals=np.zeros((count, 3)),
        origins=np.zeros((count, 3)),
        frames=np.zeros((count, 3, 2)),
        E=np.zeros((count, most, 2)),
        b=np.zeros((count, most)),
        edges=np.zeros(count, dtype=np.int64),
        corners=np.zeros((count, most, 3)),
        depths=np.zeros(count),
    )
    for place, piece in enumerate(pieces):
        if piece is None:
            continue
        edges = len(piece.E)
        table.normals[place], table.origins[place] = piece.normal, piece.origin
        table.frames[place], table.depths[place] = piece.frame, piece.depth
        table.edges[place] = edges
        table.corners[place, :edges] = piece.origin + piece.corners @ piece.frame.T
        table.E[place, :edges], table.b[place, :edges] = piece.E, piece.b
    return table
