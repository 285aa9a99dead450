"""Which face quadruples may hold grasps: their force cones, and what bounds their discs.

Around the normals, as in the paper, each is planned at theta_plan = min(theta, just below its span
angle theta*): the smaller cones lie inside the real ones, so what holds there holds at the friction
asked for. Tilted cones are an alternative, and for most quadruples the only one.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import partial
from itertools import combinations

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.constructions import LEAST_RADIUS
from grasp_core.disc_limits import corners_of, disc_limits
from grasp_core.face_pieces import Shapes
from grasp_core.spanning import SpanningTable, span_sines
from grasp_core.tilted_cones import tilted_cones
from grasp_core.values import FINGERS, ForceCone, Polyhedron, four

LEAST_SPAN_ANGLE = math.atan(LEAST_RADIUS)
"""With narrower cones no disc at a depth of one object radius would count."""
BELOW_SPAN_ANGLE = 0.999
"""Share of theta* to plan with: P3 is strict."""
INSIDE_FRICTION = 1.0 - 1e-6
"""Share of the friction angle to plan with, so that equilibrium is not marginal."""
FIRST_FACES = 14
"""Faces of the first block: 1,001 quadruples."""
LARGEST_BLOCK = 30_000
"""Quadruples of one block: their cones are tilted in a second or two."""
SPANNING_SHARE = 0.125
"""Of four random directions, the share that positively spans."""
NORMAL, TILTED = 0, 1
"""The two choices of force cones."""


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
    limits: Array
    """Upper bounds on the discs of each choice (see `disc_limits`), (q, 2, 4), in object radii."""
    rooms: Array
    """Radius of the largest disc that fits in each of the four faces, (q,)."""

    def __len__(self) -> int:
        return len(self.faces)

    def some(self, places: Indices) -> "Candidates":
        """The quadruples at some places, in that order."""
        return Candidates(*(getattr(self, each.name)[places] for each in fields(self)))

    @property
    def spanning(self) -> int:
        """How many have normals that span at the least angle (P3)."""
        return int((self.half_angles[:, NORMAL] > LEAST_SPAN_ANGLE).sum())

    def cones(self, place: int, kind: int) -> tuple[ForceCone, ForceCone, ForceCone, ForceCone]:
        """One choice of force cones of one quadruple."""
        half_angle = float(self.half_angles[place, kind])
        return four(ForceCone(axis, half_angle) for axis in self.axes[place, kind])


def candidate_blocks(
    body: Polyhedron, shapes: Shapes, theta: float, whole: int, shared: Indices
) -> Iterator[tuple[float, Callable[[], Candidates]]]:
    """The quadruples of an object in blocks, those of faces with more room first.

    With each block comes the room of the first face that it adds: no disc of this block or a later
    one is larger. The block itself is made on request.

    Args:
        body: The object.
        shapes: Its faces.
        theta: Half-angle of the friction cones to plan with [rad].
        whole: How many of the faces count by themselves; the others are parts of them.
        shared: Quadruples with such parts, (s, 4).
    """
    rooms = _rooms(shapes)
    order = np.argsort(-rooms[:whole], kind="stable")
    order = order[rooms[order] > 0.0]
    for start, end, room in _face_blocks(rooms[order], LARGEST_BLOCK):
        quads = partial(_with_a_new_one, order, start, end)
        yield room, partial(_candidates, body, quads, rooms, theta, tilted=True)
    for part in np.array_split(shared, math.ceil(len(shared) / LARGEST_BLOCK) or 1):
        with_room = part[(rooms[part] > 0.0).all(axis=1)]
        if len(with_room):
            room, quads = float(rooms[with_room].min(axis=1).max()), partial(np.copy, with_room)
            yield room, partial(_candidates, body, quads, rooms, theta, tilted=True)


def spanning_blocks(
    body: Polyhedron, shapes: Shapes, theta: float, whole: int
) -> Iterator[tuple[float, Callable[[], Candidates]]]:
    """As `candidate_blocks`, for the quadruples whose normals span (P3), with cones around them."""
    rooms = _rooms(shapes)
    order = np.argsort(-rooms[:whole], kind="stable")
    table = SpanningTable(body.normals[order], LEAST_SPAN_ANGLE)
    for start, end, room in _face_blocks(rooms[order], int(LARGEST_BLOCK / SPANNING_SHARE)):
        quads = partial(_spanning_with_a_new_one, table, order, start, end)
        yield room, partial(_candidates, body, quads, rooms, theta, tilted=False)


def _face_blocks(rooms: Array, largest: int) -> Iterator[tuple[int, int, float]]:
    """Which faces each block adds to those before, and the room of the first that matters."""
    cuts = _block_ends(len(rooms), largest)
    for start, end in zip([0, *cuts], cuts, strict=False):
        if end >= FINGERS:
            yield start, end, float(rooms[max(start, FINGERS - 1)])


def _rooms(shapes: Shapes) -> Array:
    """Radius of the largest disc in each face, zero without room."""
    return np.array(
        [max(piece.inradius for piece in shape.pieces) if shape else 0.0 for shape in shapes]
    )


def _block_ends(count: int, largest: int) -> list[int]:
    """How many faces each block reaches to: as many new quadruples as before, up to a size."""
    ends = [min(FIRST_FACES, count)]
    while ends[-1] < count:
        before = math.comb(ends[-1], FINGERS)
        size, end = min(before, largest), ends[-1] + 1
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


def _spanning_with_a_new_one(table: SpanningTable, order: Indices, start: int, end: int) -> Indices:
    """As `_with_a_new_one`, of those whose normals span."""
    quads = np.sort(order[table.quadruples(start, end).indices], axis=1)
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
    body: Polyhedron,
    quadruples: Callable[[], Indices],
    rooms: Array,
    theta: float,
    *,
    tilted: bool,
) -> Candidates:
    quads = quadruples()
    normals = body.normals[quads].reshape(-1, FINGERS, 3)
    thetas = usable_half_angles(theta, np.array([face.spread for face in body.faces]))[quads]
    spanned = BELOW_SPAN_ANGLE * np.arcsin(np.maximum(span_sines(normals), 0.0))
    around = np.minimum(thetas.min(axis=1, initial=np.inf), spanned)
    axes, half_angles = [normals, normals], [around, np.zeros(len(quads))]
    if tilted:
        leaning = tilted_cones(normals, thetas)
        axes[TILTED] = leaning.axes
        half_angles[TILTED] = BELOW_SPAN_ANGLE * leaning.half_angles
    corners = corners_of(body)
    limits = [
        disc_limits(corners, body.normals, quads, *choice)
        for choice in list(zip(axes, half_angles, strict=True))[: 1 + tilted]
    ]
    return Candidates(
        faces=quads,
        normals=normals,
        axes=np.stack(axes, axis=1),
        half_angles=np.stack(half_angles, axis=1),
        limits=np.stack([limits[NORMAL], limits[-1]], axis=1),
        rooms=rooms[quads].min(axis=1, initial=np.inf),
    )
