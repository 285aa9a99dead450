"""Which face quadruples are worth a program, at which angle, and in which order.

Each is planned at theta_plan = min(theta, just below its span angle theta*): the smaller
cones lie inside the real ones, so what holds there holds at the friction asked for.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import compress
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.constructions import LEAST_RADIUS, Construction, FingerOrder
from grasp_core.face_pieces import FacePiece, unit_pieces
from grasp_core.spanning import balancing_weights, spanning_quadruples
from grasp_core.values import FaceQuadruple, Polyhedron, four

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

    faces: FaceQuadruple
    half_angle: float
    """Of the force cones [rad]."""
    bound: float
    """No disc can be larger, relative to the object's radius; infinite without discs."""
    orders: tuple[FingerOrder, ...]
    """Finger orders worth a program."""


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """Quadruples that span, most promising first."""

    faces: Indices
    """(q, 4)"""
    numbers: Array
    """Half-angle and bound of each, (q, 2)."""
    worth: NDArray[np.bool_]
    """Which finger orders are worth a program, (q, orders)."""
    construction: Construction
    dropped: int
    """Candidates, quadruples with a finger order, that were left out."""

    def __len__(self) -> int:
        return len(self.faces)

    def __iter__(self) -> Iterator[Quadruple]:
        for faces, numbers, worth in zip(self.faces, self.numbers, self.worth, strict=True):
            half_angle, bound = (float(x) for x in numbers)
            orders = tuple(compress(self.construction.orders, worth))
            yield Quadruple(four(int(face) for face in faces), half_angle, bound, orders)

    def candidates_from(self, place: int) -> int:
        """How many candidates are left from a place in the order on."""
        return int(self.worth[place:].sum())


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """The quadruples of an object that span, with what bounds their grasps."""

    faces: Indices
    """(q, 4)"""
    normals: Array
    """(q, 4, 3)"""
    half_angles: Array
    """theta_plan of each, (q,) [rad]."""
    depths: Array
    """Mean depth of any point below the four planes, weighted by the balancing weights of the
    normals: it does not depend on the point, (q,), in object radii."""
    rooms: Array
    """Radius of the largest disc that fits in each of the four faces, (q,)."""

    def __len__(self) -> int:
        return len(self.faces)

    def ranked(self, construction: Construction) -> Ranking:
        """In the order of an upper bound on the radius; for reguli, widest force cones first."""
        if construction.bounds is None:
            bounds = np.full(len(self), np.inf)
            order = np.argsort(-self.half_angles, kind="stable")
        else:
            reach = construction.bounds(self.depths, self.half_angles)
            bounds = np.minimum(reach, self.rooms)
            order = np.argsort(-bounds, kind="stable")
        worth = np.array(
            [construction.admits(self.normals[:, finger_order], self.half_angles)
             for finger_order in construction.orders]
        ).T & (bounds >= LEAST_RADIUS)[:, None]  # fmt: skip
        order = order[worth[order].any(axis=1)]
        numbers = np.column_stack([self.half_angles, bounds])
        dropped = int((~worth).sum())
        return Ranking(self.faces[order], numbers[order], worth[order], construction, dropped)


def candidate_quadruples(body: Polyhedron, pieces: PiecesByFace, theta: float) -> Candidates:
    """The quadruples of an object that span, with the angle to plan each at.

    Args:
        body: The object.
        pieces: Its convex pieces.
        theta: Half-angle of the friction cones to plan with [rad].
    """
    normals = body.normals
    found = spanning_quadruples(normals, LEAST_SPAN_ANGLE)
    quads = found.indices
    room = np.array([max((p.inradius for p in choices), default=0.0) for choices in pieces])
    return Candidates(
        faces=quads,
        normals=normals[quads],
        half_angles=np.minimum(INSIDE_FRICTION * theta, BELOW_SPAN_ANGLE * found.span_angles),
        depths=_mean_depths(normals[quads], _heights(body)[quads]),
        rooms=room[quads].min(axis=1, initial=np.inf),
    )


def pieces_by_face(body: Polyhedron) -> PiecesByFace:
    """The convex pieces with room for a contact, listed for each face."""
    pieces: PiecesByFace = [[] for _ in body.faces]
    for piece in unit_pieces(body):
        pieces[piece.face].append(piece)
    return pieces


def _heights(body: Polyhedron) -> Array:
    """Height n.x of each face's plane, about the centre of mass over the radius, (faces,)."""
    centroids = np.array([face.centroid for face in body.faces])
    return np.einsum("fi,fi->f", body.normals, centroids - body.center_of_mass) / body.radius


def _mean_depths(normals: Array, heights: Array) -> Array:
    """-sum lam h / sum lam, with the positive weights of sum lam n = 0, (q,)."""
    return -np.einsum("qi,qi->q", balancing_weights(normals), heights)
