"""The predecessor's largest independent squares, without projection.

Ponce, Sullivan, Boissonnat & Merlet (1993) look for contacts and focus together, in eleven
dimensions, and for regions in the projection to the contacts. Their projection is convex, so a
product of polygons is in it if every choice of corners is, each with a focus of its own: for
squares one linear program with 4^4 foci. Sudsang & Ponce (1995) take one focus for all.
"""

from itertools import product

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import lil_matrix

CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
SIDES = 8
"""Of the pyramids inscribed in the force cones, as the planner's."""


def largest_squares(pieces, cones):
    """Half the side of the largest equal squares, one on each piece; None if there are none.

    Args:
        pieces: Four convex pieces of faces, with E, b, origin and frame.
        cones: The force cones, which positively span.
    """
    choices = list(product(range(len(CORNERS)), repeat=len(pieces)))
    first, width = 2 * len(pieces) + 1, 2 * len(pieces) + 1 + 3 * len(choices)
    facets = [facets_of(cone.axis, cone.half_angle) for cone in cones]
    rows = sum(len(CORNERS) * len(piece.E) for piece in pieces) + len(choices) * SIDES * len(pieces)
    A, b, row = lil_matrix((rows, width)), np.zeros(rows), 0
    for i, piece in enumerate(pieces):
        for corner in CORNERS:
            for edge, limit in zip(piece.E, piece.b, strict=True):
                A[row, 2 * i : 2 * i + 2], A[row, first - 1], b[row] = edge, edge @ corner, limit
                row += 1
    for number, choice in enumerate(choices):
        focus = slice(first + 3 * number, first + 3 * number + 3)
        for i, (piece, place) in enumerate(zip(pieces, choice, strict=True)):
            for facet in facets[i]:
                A[row, focus] = -facet
                A[row, 2 * i : 2 * i + 2] = facet @ piece.frame
                A[row, first - 1] = facet @ piece.frame @ CORNERS[place]
                b[row] = -facet @ piece.origin
                row += 1
    c = np.zeros(width)
    c[first - 1] = -1.0
    bounds = [(None, None)] * (first - 1) + [(0.0, None)] + [(None, None)] * (width - first)
    found = linprog(c, A_ub=A.tocsr(), b_ub=b, bounds=bounds, method="highs")
    return float(found.x[first - 1]) if found.status == 0 else None


def facets_of(axis, half_angle):
    """Inward normals of the facets of a pyramid inscribed in a cone, (SIDES, 3)."""
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    turns = 2.0 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
    ways = np.outer(np.cos(turns), side) + np.outer(np.sin(turns), np.cross(axis, side))
    slope = np.tan(half_angle) * np.cos(np.pi / SIDES)
    normals = slope * axis - ways
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
