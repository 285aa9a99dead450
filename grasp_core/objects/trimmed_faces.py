"""Shrinks faces before planning: into two halves for two fingers, or by a margin along edges.

For two fingers on one face, the face counts twice, as two halves with a gap between them. It is cut
once, across its longest direction and in its middle. Grasps found on the halves hold for the face.
If none are found, nothing is proved, as other cuts were not tried.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.geometry.polygons import clip, convex_hull, merge_into_convex_pieces, plane_frame
from grasp_core.objects.booleans import inset_figure, triangulate
from grasp_core.objects.face import Face
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS

SAME_LENGTH = 1.0 - 1e-6
"""Share of the largest length from which two lengths count as equal. The first of equal ones is
taken, so that rounding decides nothing."""


def with_halves(body: Polyhedron, apart: float) -> tuple[Polyhedron, tuple[int, ...]]:
    """Add two half faces to an object for each face that is long enough for two contacts.

    Takes `apart` [m]. Gives the object, and for each of its faces the whole face that it is or is a
    part of.
    """
    faces, owners = list(body.faces), list(range(len(body.faces)))
    for index, face in enumerate(body.faces):
        halves = _halves(face, apart)
        faces += halves
        owners += [index] * len(halves)
    return replace(body, faces=tuple(faces)), tuple(owners)


def shared_quadruples(owners: Sequence[int]) -> Indices:
    """List face quadruples with both halves of one face, or of two faces, (q, 4)."""
    whole = [index for index, owner in enumerate(owners) if index == owner]
    halves: dict[int, list[int]] = {}
    for index, owner in enumerate(owners):
        if index != owner:
            halves.setdefault(owner, []).append(index)
    found = [
        (*others, *pair)
        for owner, pair in halves.items()
        for others in combinations([index for index in whole if index != owner], 2)
    ]
    found += [(*one, *two) for one, two in combinations(halves.values(), 2)]
    return np.array(found, dtype=np.int64).reshape(-1, FINGERS)


def _halves(face: Face, apart: float) -> list[Face]:
    frame = plane_frame(face.normal)
    pieces = [(piece - face.centroid) @ frame for piece in face.pieces]
    if not pieces:
        return []
    along = _longest((face.polygon - face.centroid) @ frame)
    heights = np.concatenate(pieces) @ along
    middle = 0.5 * float(heights.min() + heights.max())
    halves: list[Face] = []
    for side in (-1.0, 1.0):
        limit = np.array([side * middle - 0.5 * apart])
        parts = [clip(piece, side * along[None], limit) for piece in pieces]
        parts = [part for part in parts if len(part) > 2]  # noqa: PLR2004 - else not a polygon
        if parts:
            border = convex_hull(np.vstack(parts))
            halves.append(
                replace(
                    face,
                    polygon=face.centroid + border @ frame.T,
                    holes=(),
                    pieces=tuple(face.centroid + part @ frame.T for part in parts),
                )
            )
    return halves if len(halves) == 2 else []  # noqa: PLR2004 - both or none


def _longest(border: Array) -> Array:
    """Return the unit vector between the two corners that are farthest apart, (2,)."""
    gaps = np.linalg.norm(border[:, None] - border[None], axis=2)
    i, j = np.argwhere(gaps >= SAME_LENGTH * gaps.max())[0]
    return (border[j] - border[i]) / gaps[i, j]


def clear_of_edges(body: Polyhedron, margin: float) -> Polyhedron:
    """Shrink an object's faces so that contacts keep a distance from all edges and holes.

    Takes `margin` [m].
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
