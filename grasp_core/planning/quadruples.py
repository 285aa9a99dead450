"""Chooses force cones for sets of four faces (quadruples), and ranks these by their discs.

A force cone holds the directions in which a finger may push, inside its friction cone. A disc is
the region around a contact in which it may move while the grasp stays good. Cones around the
normals, as in the paper, are planned at theta_plan = min(theta, just below the span angle theta*):
these smaller cones lie inside the real ones, so what holds for them holds at the friction asked
for. Tilted cones are an alternative, and for most quadruples the only one.

There are two tables: one gives the widest possible force cones of each quadruple, the other the
force cones that were chosen. Both can be ranked for a construction: the rows are ordered by an
upper bound on the radius of their discs, and rows that are not worth a linear program are dropped.

Blocks. All quadruples are split into blocks, those with room for large discs first. The room of a
face is the radius of the largest disc in it. Faces are numbered by falling room. Quadruples i < j <
k < l are counted with the smallest l first, then by k, then j, then i. So the quadruple has number
C(l, 4) + C(k, 3) + C(j, 2) + i, a block is a range of numbers, and no disc of this block or a later
one is larger than the room of the block's first l.

Quadruples are rows: faces (q, 4), axes of both choices of cones (q, 2, 4, 3), angles [rad]; bounds
on discs are in object radii.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property, partial

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, frozen_copy
from grasp_core.cones.spanning import SpanningTable, span_sines
from grasp_core.cones.tilting import tilted_cones, toward, widened, widest_half_angles
from grasp_core.declared import trusted
from grasp_core.families.disc_bounds import (
    angle_limits,
    corners_of,
    disc_limits,
    distances,
    widths_apart,
)
from grasp_core.families.placements import LEAST_RADIUS, FaceCorners, Placement
from grasp_core.families.placing import Attempt, Construction, FourCones
from grasp_core.objects.face_pieces import FacePiece, Shapes
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import coarse, graded
from grasp_core.values import FINGERS, ForceCone, four

LEAST_SPAN_ANGLE = math.atan(LEAST_RADIUS)
"""Least half-angle to plan with [rad]: narrower cones hold no disc that counts one radius deep."""
BELOW_SPAN_ANGLE = 0.999
"""Share of the span angle theta* to plan with: P3 is a strict inequality."""
INSIDE_FRICTION = 1.0 - 1e-6
"""Share of the friction angle to plan with, so that equilibrium is not marginal."""
NORMAL, TILTED = 0, 1
"""Indices of the two choices of force cones."""


@dataclass(frozen=True, eq=False)
class PlannedCones:
    """Chooses force cones for the face quadruples of one object."""

    body: Polyhedron
    shapes: Shapes
    theta: float  # half-angle of the friction cones to plan with [rad]
    tilted: bool  # whether cones may also be tilted away from the normals

    @cached_property
    def rooms(self) -> Array:
        """Return the radius of the largest disc in each face, or zero, (f,) [object radii]."""
        return np.array(
            [max(p.inradius for p in shape.pieces) if shape else 0.0 for shape in self.shapes]
        )

    def widest(self, quads: Indices) -> Array:
        """Return upper bounds on the half-angles of any choice of force cones, (q,) [rad]."""
        normals, thetas = self.normals[quads], self._thetas[quads]
        sines = span_sines(normals)
        around = _around(sines, thetas)
        if not self.tilted:
            return around
        return np.maximum(around, widest_half_angles(normals, thetas, sines))

    def limits(self, quads: Indices, widest: Array) -> Array:
        """Return upper bounds on discs for cones no wider than `widest`, (q, 4), see `disc_limits`.

        With psi the half-angle, theta the friction angle and h half the angle between two normals,
        narrower cones may lean more, so the bound tan(psi / 2) / sin(h - theta + psi) of a pair has
        to hold for all psi up to the widest w. Where h >= theta it grows with psi, as
        1 / sin(psi) is above cot(h - theta + psi). Where h < theta, cones that positively span (P3)
        still never overlap: half the angle between their axes is above psi, so the true bound is
        below tan(psi / 2) / sin(psi) = 1 / (2 cos^2(psi / 2)), and the bound of w is above this.
        """
        extent = float(np.linalg.norm(self._corners.points, axis=-1).max(initial=0.0))
        leaning = np.maximum(self._thetas[quads].max(axis=1, initial=0.0) - widest, 0.0)
        widths = widths_apart(quads, self._distances, self._halves, leaning)
        return angle_limits(extent, widths, widest)

    def chosen(self, quads: Indices) -> tuple[Array, Array, Array]:
        """Choose both kinds of cones: axes (q, 2, 4, 3), half-angles (q, 2), limits (q, 2, 4)."""
        normals, thetas = self.normals[quads], self._thetas[quads]
        axes = [normals, normals]
        half_angles = [_around(span_sines(normals), thetas), np.zeros(len(quads))]
        if self.tilted:
            leaning = tilted_cones(normals, thetas)
            axes[TILTED] = leaning.axes
            half_angles[TILTED] = BELOW_SPAN_ANGLE * leaning.half_angles
        limits = [
            disc_limits(self._corners, self.normals, quads, axes[kind], half_angles[kind])
            for kind in range(1 + self.tilted)
        ]
        return (
            np.stack(axes, axis=1),
            np.stack(half_angles, axis=1),
            np.stack([limits[NORMAL], limits[-1]], axis=1),
        )

    @cached_property
    def normals(self) -> Array:
        """Return the inward unit normals of all faces, (f, 3)."""
        return self.body.normals

    @cached_property
    def _distances(self) -> Array:
        return distances(self._corners)

    @cached_property
    def _halves(self) -> Array:
        """Return half the angle between every two face normals, (f, f) [rad]."""
        apart = np.linalg.norm(self.normals[:, None] - self.normals, axis=-1)
        return np.arcsin(np.minimum(0.5 * apart, 1.0))

    @cached_property
    def _thetas(self) -> Array:
        return usable_half_angles(self.theta, np.array([face.spread for face in self.body.faces]))

    @cached_property
    def _corners(self) -> FaceCorners:
        return corners_of(self.body)


def usable_half_angles(theta: float, spreads: Array) -> Array:
    """Compute half-angles inside friction cones all over a patch, too small where it leans."""
    return np.maximum(INSIDE_FRICTION * theta - spreads, 0.5 * LEAST_SPAN_ANGLE)


def cones_around(
    placed: Sequence[tuple[Sequence[FacePiece], Placement]], theta: float
) -> list[tuple[FourCones, ...]]:
    """Choose tilted cones: towards the faces' or the object's middle, or around the forces."""
    normals = np.array([[piece.normal for piece in pieces] for pieces, _ in placed])
    spreads = np.array([[piece.spread for piece in pieces] for pieces, _ in placed])
    thetas = usable_half_angles(theta, spreads)
    middles = np.array(
        [[piece.point(piece.corners.mean(axis=0)) for piece in pieces] for pieces, _ in placed]
    )
    forces = np.array([at.forces if at.planned is None else at.planned for _, at in placed])
    kinds = (
        toward(middles.mean(axis=1), middles, normals, thetas),
        toward(np.zeros((len(placed), 3)), middles, normals, thetas),
        widened(forces, normals, thetas),
    )
    return [
        tuple(
            four(ForceCone(axis, angle) for axis in kind.axes[place])
            for kind in kinds
            if (angle := BELOW_SPAN_ANGLE * float(kind.half_angles[place])) > LEAST_SPAN_ANGLE
        )
        for place in range(len(placed))
    ]


def _around(sines: Array, thetas: Array) -> Array:
    """Compute half-angles of cones around normals from sines of span angles, (q,) [rad]."""
    spanned = BELOW_SPAN_ANGLE * np.arcsin(np.maximum(sines, 0.0))
    return np.minimum(thetas.min(axis=1, initial=np.inf), spanned)


FIRST_FACES = 14
"""Number of faces in the first block: 1,001 quadruples."""
LARGEST_BLOCK = 30_000
SPANNING_SHARE = 0.125
"""Share of quadruples of random directions that positively span space."""


@dataclass(frozen=True, slots=True, eq=False)
class ConedQuadruples:
    """A table of face quadruples with two choices of force cones each, and bounds on discs."""

    faces: Indices  # faces of each quadruple, (q, 4)
    normals: Array  # inward unit normals of the faces, (q, 4, 3)
    axes: Array  # unit cone axes of both choices, around the normals and tilted, (q, 2, 4, 3)
    half_angles: Array
    """Half-angle of each choice, (q, 2) [rad]; not positive where the choice does not exist."""
    limits: Array
    """Upper bounds on the discs of each choice (see `disc_limits`), (q, 2, 4) [object radii]."""
    rooms: Array
    """Radius of the largest disc that fits in each of the four faces, (q,) [object radii]."""

    def __len__(self) -> int:
        return len(self.faces)

    def some(self, rows: Indices) -> "ConedQuadruples":
        """The quadruples in the given rows, in that order."""
        return ConedQuadruples(*(getattr(self, each.name)[rows] for each in fields(self)))

    def ranked(self, construction: Construction) -> tuple["ConedQuadruples", Array]:
        """Order what is worth a program; bound each choice and order, (q, 2, orders), or -inf."""
        bounds = self._bounds(construction)
        best = bounds.max(axis=(1, 2), initial=-np.inf)
        promise = self.half_angles[:, NORMAL] if construction.limits is None else best
        order = np.argsort(-graded(promise), kind="stable")
        order = order[best[order] > -np.inf]
        return self.some(order), bounds[order]

    def _bounds(self, construction: Construction) -> Array:
        usable: NDArray[np.bool_] = self.half_angles > LEAST_SPAN_ANGLE
        usable &= self.rooms[:, None] > 0.0
        spans = usable[:, NORMAL].copy()
        if construction.limits is None:
            usable[:, TILTED] = False  # no region to gain: the free method finds such grasps
            bounds = np.full((*usable.shape, len(construction.orders)), np.inf)
        else:
            limits = self.limits[:, :, construction.limits]
            # an undefined limit bounds nothing
            bounds = np.where(np.isnan(limits), np.inf, limits)
            bounds = np.minimum(bounds, self.rooms[:, None, None])
        for column, order in enumerate(construction.orders):
            if construction.admits is None:
                break
            normals = self.normals[spans][:, order]
            admitted = construction.admits(normals, self.half_angles[spans, NORMAL])
            kept = np.where(admitted[:, None], bounds[spans, :, column], -np.inf)
            bounds[spans, :, column] = kept
        return np.where(usable[:, :, None] & (bounds >= LEAST_RADIUS), bounds, -np.inf)

    def attempts(self, row: int, construction: Construction, bounds: Array) -> tuple[Attempt, ...]:
        """List the attempts to make on the quadruple in one row."""
        found: list[Attempt] = []
        made = cache(partial(self._cones, row))
        for column, order in enumerate(construction.orders):
            kinds = np.argsort(-graded(bounds[:, column]), kind="stable").tolist()
            kinds = [kind for kind in kinds if bounds[kind, column] > -np.inf]
            if kinds:
                faces = four(int(self.faces[row, finger]) for finger in order)
                cones = tuple(four(made(kind)[finger] for finger in order) for kind in kinds)
                attempt = Attempt(faces, cones, tuple(float(bounds[k, column]) for k in kinds))
                found.append(attempt)
        return tuple(found)

    def _cones(self, row: int, kind: int) -> FourCones:
        half_angle = float(self.half_angles[row, kind])
        axes = frozen_copy(self.axes[row, kind])
        return four(trusted(ForceCone, axis=axis, half_angle=half_angle) for axis in axes)


@dataclass(frozen=True, slots=True, eq=False)
class WideQuadruples:
    """A table of face quadruples with upper bounds on their force cones, not chosen yet."""

    cones: PlannedCones
    faces: Indices  # faces of each quadruple, (q, 4)
    widest: Array  # upper bound on the half-angle of any choice of force cones, (q,) [rad]

    def __len__(self) -> int:
        return len(self.faces)

    @property
    def rooms(self) -> Array:
        """Return the radius of the largest disc that fits in each of the four faces, (q,)."""
        return self.cones.rooms[self.faces].min(axis=1, initial=np.inf)

    def some(self, rows: Indices) -> "WideQuadruples":
        """The quadruples in the given rows, in that order."""
        return WideQuadruples(self.cones, self.faces[rows], self.widest[rows])

    def coned(self, rows: slice) -> ConedQuadruples:
        """Choose force cones for the face quadruples in the given rows."""
        faces = self.faces[rows]
        normals, rooms = self.cones.normals[faces], self.rooms[rows]
        return ConedQuadruples(faces, normals, *self.cones.chosen(faces), rooms)

    def ranked(self, construction: Construction, worth: float) -> tuple["WideQuadruples", Array]:
        """Order the rows by upper bounds on their discs, (q,); drop those below `worth`."""
        rooms, bounds = self.rooms, np.full(len(self), np.inf)
        promise = self.widest
        if construction.limits is not None:
            limits = self.cones.limits(self.faces, self.widest)[:, construction.limits]
            promise = bounds = np.minimum(limits.max(axis=1), rooms)
        usable = (self.widest > LEAST_SPAN_ANGLE) & (rooms > 0.0) & (bounds > worth)
        order = np.argsort(-graded(promise), kind="stable")
        order = order[usable[order]]
        return self.some(order), bounds[order]


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks of the face quadruples of an object."""

    rooms: Array  # upper bound on the discs of each block, (blocks,) [object radii]
    sizes: Sequence[int]
    """Number of quadruples in each block, also of those that its table leaves out."""
    make: Callable[[int], WideQuadruples]


def kept(blocks: Blocks, count: int) -> Blocks:
    """Give blocks a memory: the first `count` are made once and then kept."""
    once = cache(blocks.make)

    def make(place: int) -> WideQuadruples:
        return (once if place < count else blocks.make)(place)

    return replace(blocks, make=make)


def all_blocks(cones: PlannedCones, whole: int, shared: Indices) -> Blocks:
    """Split all face quadruples of an object into blocks."""
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

    sizes: list[int] = [*(ends - starts).tolist(), *(len(part) for part in parts)]
    return Blocks(np.concatenate(rooms), sizes, make)


def spanning_blocks(cones: PlannedCones, whole: int) -> Blocks:
    """Split the quadruples whose normals positively span space (P3) into blocks, roomy or not."""
    order = _by_room(cones, whole)
    table = SpanningTable(cones.body.normals[order], LEAST_SPAN_ANGLE)
    cuts = _face_ends(len(order), int(LARGEST_BLOCK / SPANNING_SHARE))
    pairs = [pair for pair in zip([0, *cuts], cuts, strict=False) if pair[1] >= FINGERS]
    firsts = [max(start, FINGERS - 1) for start, _ in pairs]

    def make(place: int) -> WideQuadruples:
        return _quadruples(cones, order[table.quadruples(*pairs[place])])

    sizes = [math.comb(end, FINGERS) - math.comb(start, FINGERS) for start, end in pairs]
    return Blocks(coarse(cones.rooms)[order][firsts], sizes, make)


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
