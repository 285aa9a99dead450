"""Places pencil grasps for many attempts, with the program of `families.pencil`.

Numbers in comments are those of its derivation.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.attempts_kernel import FINGERS, edges_of
from grasp_core.families.batches.discs_kernel import Program, largest_discs
from grasp_core.families.batches.placed import LEFT, NONE, PLACED, Placed
from grasp_core.families.kernel_tables import Attempts, FaceTable
from grasp_core.families.pencil import BALL, CELL_A, CELL_B, RADII, SMALLEST, VARIABLES, K
from grasp_core.geometry.vectors_kernel import (
    angle_between,
    balancing_weights,
    dotted,
    focus_direction,
)
from grasp_core.solvers.ties import SAME_SHARE

FIRST_RADIUS = RADII.start
SIGN_A, SIGN_B = CELL_A[0], CELL_B[0]
"""Sign of k u in the focus of the first two fingers, for the two orders of the foci."""


@loop("numpy")
def place(
    faces: FaceTable, attempts: Attempts, least_gap: float, least: Array, placed: Placed
) -> None:
    """Place two foci and the largest four equal discs for each attempt.

    Takes `attempts` (0, 1) or (2, 3); `least` (a,).
    """
    x = np.empty(VARIABLES)
    C, s = np.zeros((FINGERS, 2, VARIABLES)), np.zeros((FINGERS, VARIABLES + 1))
    q = np.empty((FINGERS, 2))
    for a in range(len(least)):
        u, edges = focus_direction(attempts.axes[a]), edges_of(faces, attempts, a)
        worth, placed.ends[a] = least[a], NONE
        for sign in (SIGN_A, SIGN_B):
            count = 1 + 3 * FINGERS + edges + (FINGERS if sign == SIGN_B else 0)
            program = Program(
                np.zeros((count + 2, VARIABLES)), np.zeros(count + 2), FIRST_RADIUS, SMALLEST
            )
            # the foci are 2 k apart
            program.A[0, K], program.b[0] = -2.0, -least_gap
            _discs(faces, attempts, (a, sign, u), C, s, q)
            _cone_rows(faces, attempts, a, s, program)
            row = _edge_rows(faces, attempts, a, C, q, program)
            if sign == SIGN_B:
                _near_rows(faces, attempts, (a, row, u), s, program)
            end, merit = largest_discs(program, worth, x)
            if end == LEFT:
                placed.ends[a] = LEFT
                break
            if end == PLACED:
                placed.ends[a], placed.merits[a] = PLACED, merit
                worth = merit + SAME_SHARE * abs(merit)
                _take(faces, attempts, (a, sign, u), (C, q), x, placed)


@loop("numpy")
def _discs(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, float, Array],
    C: Array,
    s: Array,
    q: Array,
) -> None:
    """Fill in depths and disc centres by (1), as linear functions of the variables.

    Takes `C` (4, 2, variables); `s` (4, variables + 1); `q` (4, 2).
    """
    a, cell, u = place
    for finger in range(FINGERS):
        face, axis = attempts.faces[a, finger], attempts.axes[a, finger]
        n, o, T = faces.normals[face], faces.origins[face], faces.frames[face]
        sign, along = (cell if finger < FINGERS // 2 else -cell), dotted(n, axis)
        for j in range(3):
            s[finger, j] = n[j] / along
        s[finger, K], s[finger, VARIABLES] = sign * dotted(n, u) / along, -dotted(n, o) / along
        for t in range(2):
            back, moved, offset = dotted(T[:, t], axis), dotted(T[:, t], u), dotted(T[:, t], o)
            for j in range(3):
                C[finger, t, j] = T[j, t] - back * s[finger, j]
            C[finger, t, K] = sign * moved - back * s[finger, K]
            q[finger, t] = -(back * s[finger, VARIABLES] + offset)


@loop("numpy")
def _cone_rows(faces: FaceTable, attempts: Attempts, a: int, s: Array, program: Program) -> None:
    """Fill in rows (2), (3) and r <= r_ij, four of each."""
    A, b, psi = program.A, program.b, attempts.half_angles[a]
    for finger in range(FINGERS):
        face, r = attempts.faces[a, finger], FIRST_RADIUS + finger
        lean = angle_between(faces.normals[face], attempts.axes[a, finger])
        # (2), with eps off the limit by (6)
        ball, inside, below = 1 + finger, 1 + FINGERS + finger, 1 + 2 * FINGERS + finger
        for j in range(K + 1):
            A[ball, j] = -np.sin(psi) * s[finger, j]
        A[ball, BALL], A[ball, r] = 1.0, 1.0 if lean >= psi else np.cos(psi - lean)
        b[ball] = np.sin(psi) * s[finger, VARIABLES] - faces.depths[face]
        # (3) loses eps in the same way
        A[inside, r], A[inside, BALL], b[inside] = 1.0, -1.0, -faces.depths[face]
        A[below, r], A[below, SMALLEST] = -1.0, 1.0


@loop("numpy")
def _edge_rows(
    faces: FaceTable, attempts: Attempts, a: int, C: Array, q: Array, program: Program
) -> int:
    """Fill in rows that keep the discs inside their faces; return the next place."""
    A, b, row = program.A, program.b, 1 + 3 * FINGERS
    for finger in range(FINGERS):
        face = attempts.faces[a, finger]
        for e in range(faces.edges[face]):
            E = faces.E[face, e]
            for j in range(K + 1):
                A[row, j] = E[0] * C[finger, 0, j] + E[1] * C[finger, 1, j]
            A[row, FIRST_RADIUS + finger] = 1.0
            b[row] = faces.b[face, e] - (E[0] * q[finger, 0] + E[1] * q[finger, 1])
            row += 1
    return row


@loop("numpy")
def _near_rows(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int, Array],
    s: Array,
    program: Program,
) -> None:
    """Fill in the rows (5), which keep the foci of cell B near each other, one per finger."""
    (a, row, u), A, b = place, program.A, program.b
    for finger in range(FINGERS):
        face = attempts.faces[a, finger]
        T, along = faces.frames[face], dotted(attempts.axes[a, finger], u)
        toward = along if finger < FINGERS // 2 else -along
        for j in range(K + 1):
            A[row, j] = -toward * s[finger, j]
        A[row, K] += 2.0
        # r |T'u| of (5)
        A[row, FIRST_RADIUS + finger] = np.hypot(dotted(T[:, 0], u), dotted(T[:, 1], u))
        # eps |n.u| off the limit by (6)
        aside = faces.depths[face] * abs(dotted(faces.normals[face], u))
        b[row] = toward * s[finger, VARIABLES] - aside
        row += 1


@loop("numpy")
def _take(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, float, Array],
    centers: tuple[Array, Array],
    x: Array,
    placed: Placed,
) -> None:
    """Fill in the placement of one attempt from its program's variables."""
    (a, sign, u), (C, q), weights, pushes = place, centers, np.empty(FINGERS), 0.0
    axes = attempts.axes[a]
    balancing_weights(axes, weights)
    for finger in range(FINGERS):
        face = attempts.faces[a, finger]
        pushes += weights[finger] * dotted(axes[finger], faces.normals[face])
        placed.radii[a, finger] = x[FIRST_RADIUS + finger]
        first, second = q[finger, 0], q[finger, 1]
        for j in range(K + 1):
            first += C[finger, 0, j] * x[j]
            second += C[finger, 1, j] * x[j]
        for j in range(3):
            T = faces.frames[face, j]
            placed.positions[a, finger, j] = faces.origins[face, j] + T[0] * first + T[1] * second
    for j in range(3):
        for finger in range(FINGERS):
            placed.forces[a, finger, j] = weights[finger] * axes[finger, j] / pushes
        placed.foci[a, 0, j] = x[j] + sign * x[K] * u[j]
        placed.foci[a, 1, j] = x[j] - sign * x[K] * u[j]
