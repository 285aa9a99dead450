"""Faces without a margin along their edges, as convex pieces."""

from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.polygons import merge_into_convex_pieces, plane_frame
from grasp_core.objects.booleans import inset_figure, triangulate
from grasp_core.values import Face, Polyhedron


def clear_of_edges(body: Polyhedron, margin: float) -> Polyhedron:
    """The object with faces on which contacts keep a distance from all edges and holes.

    Args:
        body: The object.
        margin: [m]; faces without room keep no pieces.
    """
    return replace(body, faces=tuple(_without_margin(face, margin) for face in body.faces))


def _without_margin(face: Face, margin: float) -> Face:
    frame = plane_frame(face.normal)
    loops = [(loop - face.centroid) @ frame for loop in (face.polygon, *face.holes)]
    pieces: list[Array] = []
    for figure in inset_figure(loops, margin):
        convex = merge_into_convex_pieces(np.vstack(figure), triangulate(figure))
        pieces += [face.centroid + piece @ frame.T for piece in convex]
    return replace(face, pieces=tuple(pieces))
