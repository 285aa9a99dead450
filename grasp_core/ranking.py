"""Which face quadruples are worth a program, with which force cones, and in which order.

Around the normals, as in the paper, each is planned at theta_plan = min(theta, just below its span
angle theta*): the smaller cones lie inside the real ones, so what holds there holds at the friction
asked for. Tilted cones are an alternative, and for most quadruples the only one.

Upper bounds on the discs put the most promising first. With positive weights w of sum w_i a_i = 0
for the axes, and contacts c_i on the faces, sum w_i a_i.(x0 - c_i) = -sum w_i a_i.c_i wherever the
focus x0 is: the weighted mean of the distances along the axes is at most the *reach*
-sum w_i min a_i.c_i over the corners of each face, and for a focus behind the fingers at most
sum w_i max a_i.c_i.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations, compress
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.constructions import LEAST_RADIUS, Construction, FingerOrder
from grasp_core.face_pieces import FaceShape
from grasp_core.spanning import balancing_weights, span_sines, spanning_quadruples
from grasp_core.tilted_cones import tilted_cones
from grasp_core.values import FINGERS, FaceQuadruple, ForceCone, Polyhedron, four

LEAST_SPAN_ANGLE = math.atan(LEAST_RADIUS)
"""With narrower cones no disc at a depth of one object radius would count."""
BELOW_SPAN_ANGLE = 0.999
"""Share of theta* to plan with: P3 is strict."""
INSIDE_FRICTION = 1.0 - 1e-6
"""Share of the friction angle to plan with, so that equilibrium is not marginal."""

Shapes: TypeAlias = Sequence[FaceShape | None]
"""The faces of an object as the programs see them."""


BLOCK = 30
"""Faces of the first block: 27,405 quadruples, whose cones are tilted in some seconds."""
NORMAL, TILTED = 0, 1
"""The two choices of force cones."""


@dataclass(frozen=True, slots=True)
class ConeChoice:
    """Force cones for four faces, in the order of the faces."""

    cones: tuple[ForceCone, ForceCone, ForceCone, ForceCone]
    bound: float
    """No disc can be larger, relative to the object's radius; infinite without discs."""


@dataclass(frozen=True, slots=True)
class Quadruple:
    """Four faces to try, with force cones for them."""

    faces: FaceQuadruple
    choices: tuple[ConeChoice, ...]
    """The larger bound first."""
    orders: tuple[FingerOrder, ...]
    """Finger orders worth a program."""
    spans: bool
    """Whether the normals themselves span (P3), so that every family counts."""

    @property
    def bound(self) -> float:
        """No disc of any choice can be larger."""
        return self.choices[0].bound


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """Quadruples with force cones, most promising first."""

    candidates: "Candidates"
    places: Indices
    """Which of the candidates, (q,)."""
    bounds: Array
    """Of each choice of cones, minus infinity where it is not worth a program, (q, 2)."""
    worth: NDArray[np.bool_]
    """Which finger orders are worth a program, (q, orders)."""
    construction: Construction
    dropped: int
    """Quadruples with a finger order that were left out."""

    def __len__(self) -> int:
        return len(self.places)

    def __iter__(self) -> Iterator[Quadruple]:
        for place, bounds, worth in zip(self.places, self.bounds, self.worth, strict=True):
            order = [int(kind) for kind in np.argsort(-bounds, kind="stable")]
            yield Quadruple(
                faces=four(int(face) for face in self.candidates.faces[place]),
                choices=tuple(
                    ConeChoice(self.candidates.cones(int(place), kind), float(bounds[kind]))
                    for kind in order
                    if bounds[kind] > -np.inf
                ),
                orders=tuple(compress(self.construction.orders, worth)),
                spans=bool(bounds[NORMAL] > -np.inf),
            )

    def candidates_from(self, place: int) -> int:
        """How many candidates are left from a place in the order on."""
        return int(self.worth[place:].sum())


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Quadruples of faces with two choices of force cones, and what bounds their grasps."""

    faces: Indices
    """(q, 4)"""
    normals: Array
    """(q, 4, 3)"""
    axes: Array
    """Of both choices, around the normals and tilted, (q, 2, 4, 3)."""
    half_angles: Array
    """(q, 2) [rad]; not positive where there is no such choice."""
    reaches: Array
    """Upper bounds on the mean distance of a focus from its contacts, (q, 2), in object radii."""
    rooms: Array
    """Radius of the largest disc that fits in each of the four faces, (q,)."""

    def __len__(self) -> int:
        return len(self.faces)

    @property
    def spanning(self) -> int:
        """How many have normals that span at the least angle (P3)."""
        return int((self.half_angles[:, NORMAL] > LEAST_SPAN_ANGLE).sum())

    def cones(self, place: int, kind: int) -> tuple[ForceCone, ForceCone, ForceCone, ForceCone]:
        """One choice of force cones of one quadruple."""
        half_angle = float(self.half_angles[place, kind])
        return four(ForceCone(axis, half_angle) for axis in self.axes[place, kind])

    def ranked(self, construction: Construction) -> Ranking:
        """In the order of an upper bound on the radius; for reguli, widest force cones first."""
        usable = self.half_angles > LEAST_SPAN_ANGLE
        if construction.bounds is None:
            usable[:, TILTED] = False  # no region to gain: the free method finds such grasps
            bounds = np.where(usable, np.inf, -np.inf)
            order = np.argsort(-self.half_angles[:, NORMAL], kind="stable")
        else:
            reach = construction.bounds(self.reaches, np.maximum(self.half_angles, 0.0))
            bounds = np.minimum(reach, self.rooms[:, None])
            bounds = np.where(usable & (bounds >= LEAST_RADIUS), bounds, -np.inf)
            order = np.argsort(-bounds.max(axis=1, initial=-np.inf), kind="stable")
        spans = self.half_angles[:, NORMAL] > LEAST_SPAN_ANGLE
        admitted = np.ones((len(self), len(construction.orders)), dtype=np.bool_)
        for place, finger_order in enumerate(construction.orders):
            admitted[spans, place] = construction.admits(
                self.normals[spans][:, finger_order], self.half_angles[spans, NORMAL]
            )
        hopeful: NDArray[np.bool_] = np.any(bounds > -np.inf, axis=1)
        worth: NDArray[np.bool_] = admitted & hopeful[:, None]
        order = order[worth[order].any(axis=1)]
        return Ranking(self, order, bounds[order], worth[order], construction, int((~worth).sum()))


def candidate_blocks(
    body: Polyhedron, shapes: Shapes, theta: float, *, tilted: bool
) -> Iterator[tuple[float, Callable[[], Candidates]]]:
    """The quadruples of an object in blocks, those of faces with more room first.

    With each block comes the room of the first face that it adds: no disc of this block or a later
    one is larger. The block itself is made on request.

    Args:
        body: The object.
        shapes: Its faces.
        theta: Half-angle of the friction cones to plan with [rad].
        tilted: Whether force cones may lean; else they surround the normals.
    """
    rooms = np.array(
        [max(piece.inradius for piece in shape.pieces) if shape else 0.0 for shape in shapes]
    )
    order = np.argsort(-rooms, kind="stable")
    order = order[rooms[order] > 0.0]
    if not tilted:
        quads = spanning_quadruples(body.normals, LEAST_SPAN_ANGLE).indices
        yield float(rooms.max()), partial(_candidates, body, quads, rooms, theta, tilted=False)
        return
    cuts = _block_ends(len(order))
    for start, end in zip([0, *cuts], cuts, strict=False):
        quads = _with_a_new_one(order, start, end)
        room = float(rooms[order[max(start, FINGERS - 1)]]) if end >= FINGERS else 0.0
        yield room, partial(_candidates, body, quads, rooms, theta, tilted=tilted)


def _block_ends(count: int) -> list[int]:
    """How many faces each block reaches to: about as many new quadruples in each."""
    ends, size = [min(BLOCK, count)], math.comb(BLOCK, FINGERS)
    while ends[-1] < count:
        before = math.comb(ends[-1], FINGERS)
        end = ends[-1] + 1
        while end < count and math.comb(end + 1, FINGERS) - before <= size:
            end += 1
        ends.append(end)
    return ends


def _with_a_new_one(order: Indices, start: int, end: int) -> Indices:
    """Quadruples of the first `end` faces that are not all among the first `start`, (q, 4)."""
    listed = [
        np.array([(*rest, new) for rest in combinations(range(new), FINGERS - 1)])
        for new in range(max(start, FINGERS - 1), end)
    ]
    if not listed:
        return np.empty((0, FINGERS), dtype=np.int64)
    quads = np.sort(order[np.concatenate(listed)], axis=1)
    return quads[np.lexsort(quads.T[::-1])]


def usable_half_angles(theta: float, spreads: Array) -> Array:
    """Half-angles that fit inside the friction cones wherever a curved patch leans to [rad].

    Args:
        theta: Half-angle of the friction cones to plan with [rad].
        spreads: How far each patch leans from its plane [rad].

    Returns:
        Like `spreads`; a trifle, of no use to any construction, where nothing is left.
    """
    return np.maximum(INSIDE_FRICTION * theta - spreads, 0.5 * LEAST_SPAN_ANGLE)


def _candidates(
    body: Polyhedron, quads: Indices, rooms: Array, theta: float, *, tilted: bool
) -> Candidates:
    normals = body.normals[quads].reshape(-1, FINGERS, 3)
    thetas = usable_half_angles(theta, np.array([face.spread for face in body.faces]))[quads]
    spanned = BELOW_SPAN_ANGLE * np.arcsin(np.maximum(span_sines(normals), 0.0))
    around = np.minimum(thetas.min(axis=1, initial=np.inf), spanned)
    axes, half_angles = [normals, normals], [around, np.zeros(len(quads))]
    if tilted:
        leaning = tilted_cones(normals, thetas)
        axes[TILTED] = leaning.axes
        half_angles[TILTED] = BELOW_SPAN_ANGLE * leaning.half_angles
    return Candidates(
        faces=quads,
        normals=normals,
        axes=np.stack(axes, axis=1),
        half_angles=np.stack(half_angles, axis=1),
        reaches=np.stack([_reaches(body, quads, each) for each in axes], axis=1),
        rooms=rooms[quads].min(axis=1, initial=np.inf),
    )


def _reaches(body: Polyhedron, quads: Indices, axes: Array) -> Array:
    """Upper bounds on the mean distance of a focus before or behind its contacts, (q,)."""
    corners = [
        (np.vstack([face.polygon, *face.holes]) - body.center_of_mass) / body.radius
        for face in body.faces
    ]
    most = max(len(each) for each in corners)
    padded = np.array([np.vstack([each, np.repeat(each[:1], most - len(each), axis=0)])
                       for each in corners])  # fmt: skip
    heights = np.einsum("qfki,qfi->qfk", padded[quads], axes)
    weights = balancing_weights(axes)
    before = -np.einsum("qf,qf->q", weights, heights.min(axis=2, initial=np.inf))
    behind = np.einsum("qf,qf->q", weights, heights.max(axis=2, initial=-np.inf))
    return np.maximum(before, behind)
