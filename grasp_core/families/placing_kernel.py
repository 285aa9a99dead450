"""Places and bounds discs for many attempts, by the programs of concurrent and pencil grasps.

A pattern has one sign for each finger: the sides of `concurrent_kernel`, or the order of the foci
in `pencil_kernel`. Of several patterns the one with the largest discs counts.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.concurrent_kernel import (
    concurrent_program,
    reach_limit,
    take_concurrent,
)
from grasp_core.families.discs_kernel import Program, largest_discs, largest_last, of_equal_radii
from grasp_core.families.pencil_kernel import pencil_program, take_pencil
from grasp_core.families.placements import LEFT, NONE, PLACED, Attempts, FaceTable, Placed
from grasp_core.solvers.lp import RESIDUAL
from grasp_core.solvers.ties import SAME_SHARE
from grasp_core.values import FINGERS


@loop("numpy")
def program_of(
    pencil: bool, faces: FaceTable, attempts: Attempts, a: int, pattern: Array
) -> Program:
    """Build the program of one attempt."""
    if pencil:
        return pencil_program(faces, attempts, a, pattern)
    return concurrent_program(faces, attempts, a, pattern)


@loop("numpy")
def take(
    pencil: bool,
    faces: FaceTable,
    attempts: Attempts,
    a: int,
    pattern: Array,
    x: Array,
    radius: float,
    placed: Placed,
) -> None:
    """Enter what a program's variables say, less the error that its answer may have."""
    if pencil:
        take_pencil(faces, attempts, a, pattern, x, placed)
    else:
        take_concurrent(faces, attempts, a, pattern, x, placed)
    for finger in range(FINGERS):
        placed.radii[a, finger] = max(x[len(x) - FINGERS + finger] - RESIDUAL, 0.0)
    placed.ends[a], placed.merits[a] = PLACED, radius - RESIDUAL


@loop("numpy")
def place(
    pencil: bool,
    faces: FaceTable,
    attempts: Attempts,
    patterns: Array,
    least: Array,
    placed: Placed,
) -> None:
    """Place the largest four equal discs for each attempt."""
    for a in range(len(least)):
        worth, placed.ends[a] = least[a], NONE
        for p in range(len(patterns)):
            # no program is needed where this limit is too small
            if not pencil and reach_limit(faces, attempts, a, patterns[p]) < worth:
                continue
            program = program_of(pencil, faces, attempts, a, patterns[p])
            x = np.empty(program.A.shape[1])
            end, radius = largest_discs(program, worth, x)
            if end == LEFT:
                placed.ends[a] = LEFT
                break
            if end == PLACED:
                take(pencil, faces, attempts, a, patterns[p], x, radius, placed)
                worth = placed.merits[a] + SAME_SHARE * abs(placed.merits[a])


@loop("numpy")
def bounds(
    pencil: bool,
    faces: FaceTable,
    attempts: Attempts,
    patterns: Array,
    least: float,
    found: Array,
) -> None:
    """Bound the smallest disc of each attempt from above; above `least` tightly, (a,)."""
    for a in range(len(found)):
        found[a] = -np.inf
        for p in range(len(patterns)):
            worth = max(least, found[a])
            if not pencil:
                limit = reach_limit(faces, attempts, a, patterns[p])
                if limit <= worth:
                    found[a] = max(found[a], limit)
                    continue
            program = program_of(pencil, faces, attempts, a, patterns[p])
            found[a] = max(found[a], largest_last(of_equal_radii(program), worth))
