"""Splits all sets of four faces (quadruples) into blocks, those with room for large discs first.

The room of a face is the radius of the largest disc in it. Faces are numbered by falling room.
Quadruples i < j < k < l are counted with the smallest l first, then by k, then j, then i. So the
quadruple has number C(l, 4) + C(k, 3) + C(j, 2) + i, a block is a range of numbers, and no disc of
this block or a later one is larger than the room of the block's first l.
"""

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.cones.spanning import SpanningTable
from grasp_core.planning.planned_cones import LEAST_SPAN_ANGLE, PlannedCones
from grasp_core.planning.quadruples import WideQuadruples
from grasp_core.solvers.ties import coarse, graded
from grasp_core.values import FINGERS

FIRST_FACES = 14
"""Number of faces in the first block: 1,001 quadruples."""
LARGEST_BLOCK = 30_000
"""Most quadruples in one block."""
SPANNING_SHARE = 0.125
"""Share of quadruples of random directions that positively span space."""


Blocks: TypeAlias = tuple[Array, Callable[[int], WideQuadruples]]
"""Upper bound on the discs of each block, (blocks,) [object radii], and the function that makes the
block at a place."""


def kept(blocks: Blocks, count: int) -> Blocks:
    """Give blocks a memory: the first `count` are made once and then kept."""
    rooms, make = blocks
    once = cache(make)
    return rooms, lambda place: (once if place < count else make)(place)


def all_blocks(cones: PlannedCones, whole: int, shared: Indices) -> Blocks:
    """Split all face quadruples of an object into blocks.

    Takes `shared` (s, 4).
    """
    order = _by_room(cones, whole)
    order = order[cones.rooms[order] > 0.0]
    ends = _range_ends(math.comb(len(order), FINGERS))
    starts = np.append(0, ends)[:-1]
    with_room = shared[(cones.rooms[shared] > 0.0).all(axis=1)]
    parts = [with_room[i : i + LARGEST_BLOCK] for i in range(0, len(with_room), LARGEST_BLOCK)]
    rooms = [
        coarse(cones.rooms)[order][_unranked(starts, len(order))[:, -1]],
        coarse(np.array([cones.rooms[part].min(axis=1).max() for part in parts])),
    ]

    def make(place: int) -> WideQuadruples:
        if place >= len(ends):
            return _quadruples(cones, parts[place - len(ends)])
        numbers = np.arange(int(starts[place]), int(ends[place]), dtype=np.int64)
        return _quadruples(cones, order[_unranked(numbers, len(order))])

    return np.concatenate(rooms), make


def spanning_blocks(cones: PlannedCones, whole: int) -> Blocks:
    """Split the quadruples whose normals positively span space (P3) into blocks, roomy or not."""
    order = _by_room(cones, whole)
    table = SpanningTable(cones.body.normals[order], LEAST_SPAN_ANGLE)
    cuts = _face_ends(len(order), int(LARGEST_BLOCK / SPANNING_SHARE))
    pairs = [pair for pair in zip([0, *cuts], cuts, strict=False) if pair[1] >= FINGERS]
    firsts = [max(start, FINGERS - 1) for start, _ in pairs]

    def make(place: int) -> WideQuadruples:
        return _quadruples(cones, order[table.quadruples(*pairs[place]).indices])

    return coarse(cones.rooms)[order][firsts], make


def _by_room(cones: PlannedCones, whole: int) -> Indices:
    return np.argsort(-graded(cones.rooms[:whole]), kind="stable")


def _quadruples(cones: PlannedCones, quads: Indices) -> WideQuadruples:
    quads = np.sort(quads.reshape(-1, FINGERS), axis=1)
    quads = quads[np.lexsort(quads.T[::-1])]
    return WideQuadruples(cones, quads, cones.widest(quads))


def _range_ends(count: int) -> Indices:
    """Return where blocks of `count` quadruples end: each doubles the total, up to a size."""
    ends = [min(math.comb(FIRST_FACES, FINGERS), count)]
    while ends[-1] < min(LARGEST_BLOCK, count):
        ends.append(min(2 * ends[-1], count))
    rest = np.arange(ends[-1], count, LARGEST_BLOCK)[1:]
    return np.unique([*ends, *rest.tolist(), count]) if count else np.empty(0, dtype=np.int64)


def _unranked(numbers: Indices, count: int) -> Indices:
    """Return the face quadruples with the given numbers, faces ascending, (q, 4)."""
    found = np.empty((len(numbers), FINGERS), dtype=np.int64)
    left = numbers.copy()
    # greedy: the largest C(face, size) that fits gives the face, as in the module docstring
    for size in range(FINGERS, 0, -1):
        before = np.array([math.comb(face, size) for face in range(count)], dtype=np.int64)
        found[:, size - 1] = np.searchsorted(before, left, side="right") - 1
        left -= before[found[:, size - 1]]
    return found


def _face_ends(count: int, largest: int) -> Sequence[int]:
    """Return the face counts at which blocks end: each doubles the total, up to a size."""
    ends = [min(FIRST_FACES, count)]
    while ends[-1] < count:
        before = math.comb(ends[-1], FINGERS)
        size, end = min(before, largest), ends[-1] + 1
        while end < count and math.comb(end + 1, FINGERS) - before <= size:
            end += 1
        ends.append(end)
    return ends
