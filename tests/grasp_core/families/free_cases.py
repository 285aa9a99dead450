"""Quadruples of faces and what the free method answers, as several tests ask."""

from functools import cache

import numpy as np

from grasp_core.families.free import place_free
from grasp_core.objects.face_pieces import unit_pieces
from scenes.example_objects import example_object

TOLERANCE = 1e-7
"""Ten times the residual at which a program's answer is accepted, in object radii."""
FRICTIONS = (0.2, 0.3, 0.5, 0.8)
OBJECTS = ("random-8-1", "random-12-3", "random-20-7", "random-30-2")
PER_OBJECT = 25
"""Quadruples of each object at each friction."""
NO_GRASP_BUT_CLOSED_PATCH = ("double-wedge-bar", (0, 6, 1, 7), 0.3)
"""The corners of these faces are in closure, but no four contacts are."""


@cache
def faces_of(name):
    return unit_pieces(example_object(name))


def quadruple(name, indices):
    return [faces_of(name)[index] for index in indices]


def normals_of(pieces):
    return np.array([piece.normal for piece in pieces])


def place(pieces, friction, cells=1, seed=0):
    return place_free(pieces, friction, rng=np.random.default_rng(seed), cells=cells)


@cache
def answers():
    """Pieces, friction and answer of random quadruples of different faces."""
    rng = np.random.default_rng(1)
    cases = []
    for name in OBJECTS:
        for friction in FRICTIONS:
            for _ in range(PER_OBJECT):
                pieces = quadruple(name, rng.choice(len(faces_of(name)), 4, replace=False))
                cases.append((pieces, friction, place(pieces, friction)))
    return cases


def of_kind(kind):
    return [case for case in answers() if isinstance(case[2], kind)]


def corners_in_space(piece):
    return piece.origin + piece.corners @ piece.frame.T


def inset(piece, point):
    """Distance of a point of a face to its nearest edge, by triple products."""
    corners = corners_in_space(piece)
    assert abs(piece.normal @ (point - corners[0])) < TOLERANCE
    edges = np.roll(corners, -1, axis=0) - corners
    inwards = np.cross(piece.normal, edges)
    heights = np.einsum("kj,kj->k", inwards, point - corners)
    return (heights / np.linalg.norm(edges, axis=1)).min()


def insets(pieces, points):
    return np.array([inset(piece, at) for piece, at in zip(pieces, points, strict=True)])


def wrench(points, forces):
    return np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


def split_absence():
    name, indices, friction = NO_GRASP_BUT_CLOSED_PATCH
    return place(quadruple(name, indices), friction, cells=60)
