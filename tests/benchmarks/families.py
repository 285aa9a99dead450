"""The programs of the paper's families on every spanning quadruple of an object.

Ours decides them by compiled bounds, assembly and proofs included. The contenders are handed the
same programs ready made, and only have to solve them. First every verdict has to be that of
HiGHS at its door, with all its checks, and every value the same.
"""

import math

import numpy as np

from grasp_core.attempt_bounds import KERNELS, AttemptBounds
from grasp_core.candidates import NORMAL, spanning_blocks
from grasp_core.concurrent_grasps import BEFORE, BEHIND
from grasp_core.concurrent_grasps import _rows as concurrent_rows
from grasp_core.constructions import CONSTRUCTIONS, LEAST_RADIUS
from grasp_core.face_pieces import face_shapes
from grasp_core.kernels.tables import Attempts
from grasp_core.lp import LinearProgram, _by_highs
from grasp_core.pencil_grasps import CELL_A, CELL_B, _discs, _near_rows
from grasp_core.pencil_grasps import _rows as pencil_rows
from grasp_core.placements import focus_direction
from grasp_core.values import ForceCone
from scenes.objects import example_object
from tests.benchmarks.programs import COMPILED, CONTENDERS
from tests.benchmarks.timing import compared

OBJECTS = ("random-12-1", "icosahedron", "random-30-1")
THETA = math.radians(10.0)
BLOCKS, SAMPLE = 9, 12
"""Blocks in turns, and programs that contenders get of each."""
LEAST = 400
"""Programs that we solve in each block."""
SAME = 1e-7


class Programs:
    """What one family asks of one object: attempts for us, programs for the others."""

    def __init__(self, name, family):
        body = example_object(name)
        shapes = face_shapes(body)
        self.construction, self.discs = CONSTRUCTIONS[family], AttemptBounds(shapes)
        parts = [make() for _, make in spanning_blocks(body, shapes, THETA, len(body.faces))]
        orders = [list(order) for order in self.construction.orders]
        self.attempts = Attempts(
            *(
                np.concatenate([pick(part, order) for part in parts for order in orders])
                for pick in (
                    lambda part, order: part.faces[:, order],
                    lambda part, order: part.axes[:, NORMAL][:, order],
                    lambda part, _: part.half_angles[:, NORMAL],
                )
            )
        )
        self.programs = [self._programs(shapes, family, *each)
                         for each in zip(*self.attempts, strict=True)]  # fmt: skip

    def _programs(self, shapes, family, faces, axes, half_angle):
        """The two programs of an attempt: sides of the focus, or cells."""
        pieces = [shapes[face].hull for face in faces]
        cones = [ForceCone(axis, float(half_angle)) for axis in axes]
        if family == "concurrent":
            rows = [concurrent_rows(pieces, cones, sides) for sides in (BEFORE, BEHIND)]
            return [LinearProgram(np.eye(16)[15], A, b) for A, b in rows]
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
        return self.discs.of(self.construction, self.attempts, -np.inf)

    def values(self):
        """By HiGHS."""
        return np.array([max(_by_highs(p).value for p in both) for both in self.programs])


def rows():
    """A group per object and family."""
    found = []
    for name in OBJECTS:
        for family in KERNELS:
            found += group(name, family)
    return found


def group(name, family):
    every = Programs(name, family)
    bounds, values = every.bounds(), every.values()
    assert np.abs(bounds - values).max() <= SAME
    assert ((bounds > LEAST_RADIUS) == (values > LEAST_RADIUS)).mean() == 1.0
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
    remark = f"{len(flat)} programs, none differs"
    return compared("families", {ours: compiled} | others, samples, {ours: remark})
