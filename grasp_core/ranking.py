"""Which face quadruples are worth a program, at which angle, and in which order.

Each is planned at theta_plan = min(theta, just below its span angle theta*): the smaller
cones lie inside the real ones, so what holds there holds at the friction asked for.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.concurrent_grasps import radius_bounds
from grasp_core.face_pieces import FacePiece, unit_pieces
from grasp_core.spanning import spanning_quadruples
from grasp_core.values import Polyhedron, four

LEAST_RADIUS = 1e-3
"""Smaller discs, relative to the object's radius, do not count as a region to stand in."""
LEAST_SPAN_ANGLE = math.atan(LEAST_RADIUS)
"""With narrower cones no disc at a depth of one object radius would count."""
BELOW_SPAN_ANGLE = 0.999
"""Share of theta* to plan with: P3 is strict."""
INSIDE_FRICTION = 1.0 - 1e-6
"""Share of the friction angle to plan with, so that equilibrium is not marginal."""

PiecesByFace: TypeAlias = list[list[FacePiece]]
"""The convex pieces of each face."""


@dataclass(frozen=True, slots=True)
class Quadruple:
    """Four faces to try, with the half-angle to plan them at."""

    faces: tuple[int, int, int, int]
    span_angle: float
    half_angle: float
    bound: float
    """No disc can be larger, relative to the object's radius."""


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """The spanning quadruples, largest radius bound first."""

    faces: Indices
    """(q, 4)"""
    numbers: Array
    """Span angle, half-angle and bound of each, (q, 3)."""

    def __len__(self) -> int:
        return len(self.faces)

    def __iter__(self) -> Iterator[Quadruple]:
        for faces, numbers in zip(self.faces, self.numbers, strict=True):
            yield Quadruple(four(int(face) for face in faces), *(float(x) for x in numbers))


def rank_quadruples(body: Polyhedron, pieces: PiecesByFace, theta: float) -> Ranking:
    """Quadruples that span, by what their cones can reach and their faces have room for.

    Args:
        body: The object.
        pieces: Its convex pieces.
        theta: Half-angle of the friction cones to plan with [rad].
    """
    normals = body.normals
    found = spanning_quadruples(normals, LEAST_SPAN_ANGLE)
    angles = np.minimum(INSIDE_FRICTION * theta, BELOW_SPAN_ANGLE * found.span_angles)
    centroids = np.array([face.centroid for face in body.faces])
    heights = np.einsum("fi,fi->f", normals, centroids - body.center_of_mass) / body.radius
    reach = radius_bounds(normals[found.indices], heights[found.indices], angles)
    room = np.array([max((p.inradius for p in choices), default=0.0) for choices in pieces])
    bounds = np.minimum(reach, room[found.indices].min(axis=1, initial=np.inf))
    order = np.argsort(-bounds, kind="stable")
    numbers = np.column_stack([found.span_angles, angles, bounds])
    return Ranking(found.indices[order], numbers[order])


def pieces_by_face(body: Polyhedron) -> PiecesByFace:
    """The convex pieces with room for a contact, listed for each face."""
    pieces: PiecesByFace = [[] for _ in body.faces]
    for piece in unit_pieces(body):
        pieces[piece.face].append(piece)
    return pieces
