"""The programs of the paper's families on every spanning quadruple of an object.

Ours decides them by compiled bounds, assembly and proofs included. The contenders are handed the
same programs ready made, and only have to solve them. First every verdict has to be that of
HiGHS at its door, with all its checks, and every value the same.
"""

import math
import time
from collections import Counter
from itertools import combinations

import numpy as np

from grasp_core.cones.pyramids import inscribed_facets
from grasp_core.families.concurrent import BEFORE, BEHIND
from grasp_core.families.concurrent import _rows as concurrent_rows
from grasp_core.families.constructions import CONSTRUCTIONS, LEAST_RADIUS
from grasp_core.families.disc_bounds import KERNELS, AttemptBounds
from grasp_core.families.free import place_free
from grasp_core.families.kernel_tables import Attempts
from grasp_core.families.pencil import CELL_A, CELL_B, _discs, _near_rows
from grasp_core.families.pencil import _rows as pencil_rows
from grasp_core.families.placements import focus_direction
from grasp_core.families.regulus import (
    CHOICES,
    SIDES,
    SLOPES,
    frames_of_pairs,
    line_of,
    regulus_bounds,
    regulus_program,
    slope_at,
)
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.planning.planned_cones import NORMAL, PlannedCones
from grasp_core.planning.quadruples import spanning_blocks
from grasp_core.solvers.lp import LinearProgram, Optimum, _by_highs
from grasp_core.values import ForceCone
from scenes.example_objects import example_object
from tests.benchmarks.planning import sphere_hull
from tests.benchmarks.programs import COMPILED, CONTENDERS
from tests.benchmarks.timing import Row, compared, once

OBJECTS = ("random-12-1", "icosahedron", "random-30-1")
GROWING = ("tetrahedron", "octahedron", "dodecahedron", "icosahedron", "random-20-1",
           "random-30-1", "random-50-1", 100)  # fmt: skip
"""Built-in objects, and a hull with so many faces."""
TYPE_FREE = (("random-12-1", 0.2), ("icosahedron", 0.1), ("random-20-1", 0.3))
MANY = 600
"""Quadruples that are decided without a type."""
THETA = math.radians(10.0)
BLOCKS, SAMPLE = 9, 12
"""Blocks in turns, and programs that contenders get of each."""
LEAST = 400
"""Programs that we solve in each block."""
SAME = 1e-7
MOST_LEFT = 0.01
"""Share of the attempts that compiled code may leave undecided."""
REPEATS = 5


class Programs:
    """What one family asks of one object: attempts for us, programs for the others."""

    def __init__(self, name, family):
        body = example_object(name)
        shapes = face_shapes(body)
        self.construction, self.bounded = CONSTRUCTIONS[family], AttemptBounds(shapes)
        self.attempts = _attempts(body, shapes, self.construction)
        self.programs = [self._programs(shapes, family, *each)
                         for each in zip(*self.attempts, strict=True)]  # fmt: skip

    def _programs(self, shapes, family, faces, axes, half_angle):
        """Those of an attempt: two sides of the focus, or cells, or all slopes and sides."""
        pieces = [shapes[face].hull for face in faces]
        cones = [ForceCone(axis, float(half_angle)) for axis in axes]
        if family == "concurrent":
            rows = [concurrent_rows(pieces, cones, sides) for sides in (BEFORE, BEHIND)]
            return [LinearProgram(np.eye(16)[15], A, b) for A, b in rows]
        if family == "regulus":
            return list(regulus_programs(pieces, cones))
        u = focus_direction(axes)
        found = []
        for cell in (CELL_A, CELL_B):
            discs = _discs(pieces, cones, u).in_cell(cell)
            A, b = pencil_rows(pieces, cones, discs, LEAST_RADIUS)
            if cell == CELL_B:
                near, ends = _near_rows(pieces, cones, discs, u)
                A, b = np.vstack([A, near]), np.append(b, ends)
            found.append(LinearProgram(np.eye(10)[9], A, b))
        return found

    def bounds(self, _=None):
        if self.construction.family == "regulus":
            return regulus_bounds(self.bounded._table, self.attempts)[0]
        return self.bounded.of(self.construction, self.attempts, -np.inf)

    def values(self):
        """By HiGHS."""
        return np.array([max(map(by_highs, programs)) for programs in self.programs])


def by_highs(program):
    found = _by_highs(program)
    return found.value if isinstance(found, Optimum) else -np.inf


def regulus_programs(pieces, cones):
    pairs = frames_of_pairs(cones)
    facets = [inscribed_facets(c, p.frame[:, 0]) for c, p in zip(cones, pieces, strict=True)]
    for *which, side in CHOICES:
        slopes = [slope_at(pair, SLOPES[each]) for pair, each in zip(pairs, which, strict=True)]
        lines = [line_of(pairs, slopes, finger) for finger in range(4)]
        yield regulus_program(pieces, facets, lines, slopes, SIDES[side])


def _attempts(body, shapes, construction):
    """Every order of the fingers on every spanning quadruple."""
    cones = PlannedCones(body, shapes, THETA, tilted=False)
    rooms, make = spanning_blocks(cones, len(body.faces))
    found = []
    for place in range(len(rooms)):
        part = make(place).coned(slice(None))
        for order in map(list, construction.orders):
            normals, half_angles = part.normals[:, order], part.half_angles[:, NORMAL]
            some = construction.admits(normals, half_angles)
            found.append((part.faces[some][:, order], normals[some], half_angles[some]))
    return Attempts(*map(np.concatenate, zip(*found, strict=True)))


def rows():
    """A group per object and family."""
    found = []
    for name in OBJECTS:
        for family in (*KERNELS, "regulus"):
            found += group(name, family)
    for name in GROWING:
        found += whole(name)
    return found + [type_free(*case) for case in TYPE_FREE]


def group(name, family):
    every = Programs(name, family)
    bounds, values = every.bounds(), every.values()
    left = np.isposinf(bounds)
    assert left.mean() <= MOST_LEFT
    bounds, values = bounds[~left], values[~left]
    assert (np.isfinite(bounds) == np.isfinite(values)).all()
    held = np.isfinite(bounds)
    assert np.abs(bounds[held] - values[held]).max() <= SAME
    if family in KERNELS:
        assert ((bounds > LEAST_RADIUS) == (values > LEAST_RADIUS)).all()
    rng = np.random.default_rng(0)
    flat = [program for both in every.programs for program in both]
    samples = [[flat[i] for i in rng.integers(len(flat), size=SAMPLE)] for _ in range(BLOCKS)]
    repeats = max(1, LEAST // len(flat))

    def compiled(_):
        for _ in range(repeats):
            every.bounds()
        return repeats * len(flat)

    def by(solve):
        return lambda block: len([solve(program) for program in block])

    ours = f"{family}, {name}, per program"
    others = {f"  {what}": by(solve) for what, solve in CONTENDERS.items() if what != COMPILED}
    remark = f"{len(flat)} programs, none differs, {left.sum()} left to the reference"
    return compared("families", {ours: compiled} | others, samples, {ours: remark})


def whole(name):
    """Every program of the three families of one object, from its normals on.

    Once for the paper's cones, as wide as the friction, and once with narrower ones where only
    they span.
    """
    body = sphere_hull(name) if isinstance(name, int) else example_object(name)
    shapes = face_shapes(body)
    bounded = AttemptBounds(shapes)
    found = []
    for cones, least in (("10 deg", 0.99 * THETA), ("up to 10 deg", 0.0)):
        seconds, counts = [], Counter()
        for _ in range(REPEATS):
            begun = time.process_time()
            counts = decided(body, shapes, bounded, least)
            seconds.append(time.process_time() - begun)
        each = ", ".join(f"{counts[family]} of {counts[family, 'asked']} {family}"
                         for family in CONSTRUCTIONS)  # fmt: skip
        what = f"three families of the {body.name}, cones of {cones}"
        median = 1e6 * float(np.median(seconds))
        found.append(Row("families", what, 1, median, remark=f"{each}"))
        if median > TOO_LONG:
            break
    return found


def type_free(name, friction):
    """A grasp of any type on four faces or a proof that there is none, on many quadruples."""
    shapes = face_shapes(example_object(name))
    quads = np.random.default_rng(0).permutation(list(combinations(range(len(shapes)), 4)))[:MANY]
    faces = [[shapes[face].pieces[0] for face in quad] for quad in quads]

    def decide():
        return [place_free(each, friction, rng=np.random.default_rng(0)) for each in faces]

    ended = Counter(type(one).__name__ for one in decide())
    row, _ = once("families", f"type-free, {name}, friction {friction}", decide, len(faces))
    return row.with_remark(", ".join(f"{count} {kind}" for kind, count in sorted(ended.items())))


TOO_LONG = 1.5e6
"""Microseconds after which wider searches are left out."""


def decided(body, shapes, bounded, least):
    """Which attempts have a grasp, counted by family."""
    cones = PlannedCones(body, shapes, THETA, tilted=False)
    (rooms, make), counts = spanning_blocks(cones, len(body.faces)), Counter()
    for place in range(len(rooms)):
        wide = make(place)
        wide = wide.some(np.flatnonzero(wide.widest >= least))
        for family, construction in CONSTRUCTIONS.items():
            ranked, _ = wide.ranked(construction, construction.least)
            coned, cheap = ranked.coned(slice(None)).ranked(construction)
            row, kind, column = np.nonzero(cheap > construction.least)
            order = np.array(construction.orders)[column]
            some = Attempts(
                np.take_along_axis(coned.faces[row], order, axis=1),
                np.take_along_axis(coned.axes[row, kind], order[:, :, None], axis=1),
                coned.half_angles[row, kind],
            )
            bounds = bounded.of(construction, some, construction.least)
            counts[family] += int((bounds > construction.least).sum())
            counts[family, "asked"] += len(bounds)
    return counts
