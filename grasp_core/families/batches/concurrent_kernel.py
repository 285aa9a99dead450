"""Places concurrent grasps for many attempts, with the program of `families.concurrent`.

Numbers in comments are those of its derivation.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.attempts_kernel import FINGERS, edges_of, facet_sines
from grasp_core.families.batches.discs_kernel import Program, largest_discs
from grasp_core.families.batches.placed import LEFT, NONE, PLACED, Placed
from grasp_core.families.concurrent import RADII, SMALLEST
from grasp_core.families.kernel_tables import Attempts, FaceTable
from grasp_core.geometry.vectors_kernel import across, balancing_weights, dotted
from grasp_core.solvers.ties import SAME_SHARE

VARIABLES, FIRST_RADIUS, LEAST = SMALLEST + 1, RADII.start, SMALLEST


@loop("numpy")
def place(
    faces: FaceTable,
    attempts: Attempts,
    turns: Array,
    patterns: Array,
    least: Array,
    placed: Placed,
) -> None:
    """Place a focus and the largest four equal discs for each attempt.

    Takes `turns` (m, 2); `patterns` (p, 4); `least` (a,).
    """
    x = np.empty(VARIABLES)
    for a in range(len(least)):
        count = FINGERS * (len(turns) + 1) + edges_of(faces, attempts, a)
        worth, placed.ends[a] = least[a], NONE
        for p in range(len(patterns)):
            program = Program(
                np.zeros((count + 2, VARIABLES)), np.zeros(count + 2), FIRST_RADIUS, LEAST
            )
            row = 0
            for finger in range(FINGERS):
                place = (a, finger, row)
                row = _finger_rows(faces, attempts, place, (turns, patterns[p, finger]), program)
            end, merit = largest_discs(program, worth, x)
            if end == LEFT:
                placed.ends[a] = LEFT
                break
            if end == PLACED:
                placed.ends[a], placed.merits[a] = PLACED, merit
                worth = merit + SAME_SHARE * abs(merit)
                _take(faces, attempts, a, patterns[p], x, placed)


@loop("numpy")
def _finger_rows(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int, int],
    facets: tuple[Array, float],
    program: Program,
) -> int:
    """Fill in the rows of one finger from a place on; return the next place."""
    (a, finger, row), (turns, side), A, b = place, facets, program.A, program.b
    sine, cosine = facet_sines(attempts.half_angles[a], len(turns))
    # (4): the sign of the facets is the side
    sine, cosine = side * sine, side * cosine
    face, y, r = attempts.faces[a, finger], 3 + 2 * finger, FIRST_RADIUS + finger
    axis, T, o = attempts.axes[a, finger], faces.frames[face], faces.origins[face]
    first, second = across(axis, T)
    for m in range(len(turns)):
        flat, flat_too, height, lean = 0.0, 0.0, 0.0, 0.0
        for j in range(3):
            g = sine * axis[j] - cosine * (turns[m, 0] * first[j] + turns[m, 1] * second[j])
            A[row, j] = -g
            flat += g * T[j, 0]
            flat_too += g * T[j, 1]
            height += g * o[j]
            lean += g * faces.normals[face, j]
        # (1), with the radius r_i of this disc
        A[row, y], A[row, y + 1] = flat, flat_too
        A[row, r] = np.sqrt(flat * flat + flat_too * flat_too)
        # (3) takes eps |g.n| from the limit
        b[row] = -height - faces.depths[face] * abs(lean)
        row += 1
    # (2): the disc stays inside the face
    for e in range(faces.edges[face]):
        A[row, y], A[row, y + 1] = faces.E[face, e, 0], faces.E[face, e, 1]
        A[row, r], b[row] = 1.0, faces.b[face, e]
        row += 1
    # r <= r_i: the program maximises the smallest radius
    A[row, LEAST], A[row, r] = 1.0, -1.0
    return row + 1


@loop("numpy")
def _take(
    faces: FaceTable, attempts: Attempts, a: int, sides: Array, x: Array, placed: Placed
) -> None:
    """Fill in the placement of one attempt from its program's variables."""
    ways, weights, pushes = np.empty((FINGERS, 3)), np.empty(FINGERS), 0.0
    for finger in range(FINGERS):
        face, y = attempts.faces[a, finger], 3 + 2 * finger
        placed.radii[a, finger] = x[FIRST_RADIUS + finger]
        for j in range(3):
            T = faces.frames[face, j]
            placed.positions[a, finger, j] = faces.origins[face, j] + T[0] * x[y] + T[1] * x[y + 1]
            ways[finger, j] = sides[finger] * (x[j] - placed.positions[a, finger, j])
    balancing_weights(ways, weights)
    for finger in range(FINGERS):
        face = attempts.faces[a, finger]
        pushes += weights[finger] * dotted(ways[finger], faces.normals[face])
    for finger in range(FINGERS):
        for j in range(3):
            placed.forces[a, finger, j] = weights[finger] * ways[finger, j] / pushes
    for j in range(3):
        placed.foci[a, 0, j] = x[j]
