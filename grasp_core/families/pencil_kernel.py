"""Places and bounds pencil grasps for many attempts, with the program of `pencil`.

Numbers in comments are those of its derivation. Bounds are those of programs with one common
radius, in both cells; `discs_kernel` says why one radius is enough. Their rows are those of the
placements with the columns of all radii added. Their ball about each focus is no larger than
needed, R = r + the largest depth, which leaves the variables (x0, k, r).
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.discs_kernel import Program, bounded, edges_of, largest_discs, room_for
from grasp_core.families.pencil import BALL, CELL_A, CELL_B, RADII, SMALLEST, VARIABLES, K
from grasp_core.families.placements import LEFT, NONE, PLACED, Attempts, FaceTable, Placed
from grasp_core.geometry.vectors_kernel import (
    angle_between,
    balancing_weights,
    dotted,
    focus_direction,
)
from grasp_core.solvers.ties import SAME_SHARE
from grasp_core.values import FINGERS

FIRST_RADIUS = RADII.start
SIGN_A, SIGN_B = CELL_A[0], CELL_B[0]
"""Sign of k u in the focus of the first two fingers, for the two orders of the foci."""
FIRST_BALL, FIRST_EDGE = 1, 1 + 3 * FINGERS
"""Places of the first row (2), after the row of the gap, and of the first edge's row."""
BOUND_VARIABLES = 5
"""Number of variables (x0, k, r) of a bound's program."""


@loop("numpy")
def place(
    faces: FaceTable, attempts: Attempts, least_gap: float, least: Array, placed: Placed
) -> None:
    """Place two foci and the largest four equal discs for each attempt."""
    x, discs = np.empty(VARIABLES), _room_for_discs()
    for a in range(len(least)):
        u, edges = focus_direction(attempts.axes[a]), edges_of(faces, attempts, a)
        worth, placed.ends[a] = least[a], NONE
        for sign in (SIGN_A, SIGN_B):
            count = FIRST_EDGE + edges + (FINGERS if sign == SIGN_B else 0)
            program = Program(
                np.zeros((count + 2, VARIABLES)), np.zeros(count + 2), FIRST_RADIUS, SMALLEST
            )
            _fill(faces, attempts, (a, sign, u), least_gap, discs, program.A, program.b)
            end, merit = largest_discs(program, worth, x)
            if end == LEFT:
                placed.ends[a] = LEFT
                break
            if end == PLACED:
                placed.ends[a], placed.merits[a] = PLACED, merit
                worth = merit + SAME_SHARE * abs(merit)
                _take(faces, attempts, (a, sign, u), discs, x, placed)


@loop()
def pencil_bounds(
    faces: FaceTable, attempts: Attempts, least_gap: float, least: float, bounds: Array
) -> None:
    """Bound the discs of pencil grasps from above, for both orders of the foci."""
    most, discs = FIRST_EDGE + FINGERS * (1 + faces.E.shape[1]), _room_for_discs()
    room, A, b = np.empty((BOUND_VARIABLES + 2) * most), np.empty((most, VARIABLES)), np.empty(most)
    for a in range(len(bounds)):
        u, bounds[a], largest = focus_direction(attempts.axes[a]), -np.inf, 0.0
        for finger in range(FINGERS):
            largest = max(largest, faces.depths[attempts.faces[a, finger]])
        for sign in (SIGN_A, SIGN_B):
            A[:], b[:] = 0.0, 0.0
            count, row = _fill(faces, attempts, (a, sign, u), least_gap, discs, A, b), 0
            rows = room_for(room, BOUND_VARIABLES, count - 2 * FINGERS)
            for k in range(count):
                if FIRST_BALL + FINGERS <= k < FIRST_EDGE:  # rows of single radii
                    continue
                for j in range(K + 1):
                    rows.At[j, row] = A[k, j]
                # R of (3) is r and the largest depth, by (6)
                rows.At[-1, row] = A[k, BALL]
                for finger in range(FINGERS):
                    rows.At[-1, row] += A[k, FIRST_RADIUS + finger]
                rows.b[row] = b[k] - largest * A[k, BALL]
                row += 1
            bounds[a] = max(bounds[a], bounded(rows, max(least, bounds[a])))


@loop("numpy")
def _room_for_discs() -> tuple[Array, Array, Array]:
    """Make room for C (4, 2, variables), s (4, variables + 1) and q (4, 2) of `_discs`."""
    return (
        np.zeros((FINGERS, 2, VARIABLES)), np.zeros((FINGERS, VARIABLES + 1)),
        np.empty((FINGERS, 2)),
    )  # fmt: skip


@loop("numpy")
def _fill(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, float, Array],
    least_gap: float,
    discs: tuple[Array, Array, Array],
    A: Array,
    b: Array,
) -> int:
    """Fill in the rows for one order of the foci; return their number."""
    (a, sign, u), (_, s, _) = place, discs
    # the foci are 2 k apart
    A[0, K], b[0] = -2.0, -least_gap
    _discs(faces, attempts, place, discs)
    _cone_rows(faces, attempts, a, s, A, b)
    row = _edge_rows(faces, attempts, a, discs, A, b)
    if sign == SIGN_A:
        return row
    for finger in range(FINGERS):
        # (5): a focus of cell B does not pass the other pair's crossing point
        face, axis = attempts.faces[a, finger], attempts.axes[a, finger]
        T = faces.frames[face]
        toward = (1.0 if finger < FINGERS // 2 else -1.0) * dotted(axis, u)
        for j in range(K + 1):
            A[row, j] = -toward * s[finger, j]
        A[row, K] += 2.0
        # r |T'u| of (5)
        A[row, FIRST_RADIUS + finger] = np.hypot(dotted(T[:, 0], u), dotted(T[:, 1], u))
        # (6) takes eps |n.u| from the limit
        off = faces.depths[face] * abs(dotted(faces.normals[face], u))
        b[row] = toward * s[finger, VARIABLES] - off
        row += 1
    return row


@loop("numpy")
def _discs(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, float, Array],
    discs: tuple[Array, Array, Array],
) -> None:
    """Fill in depths s and disc centres C, q by (1), as linear functions of the variables."""
    (a, cell, u), (C, s, q) = place, discs
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
def _cone_rows(faces: FaceTable, attempts: Attempts, a: int, s: Array, A: Array, b: Array) -> None:
    """Fill in rows (2), (3) and r <= r_ij, four of each."""
    psi = attempts.half_angles[a]
    for finger in range(FINGERS):
        face, r = attempts.faces[a, finger], FIRST_RADIUS + finger
        lean = angle_between(faces.normals[face], attempts.axes[a, finger])
        # (2), with eps off the limit by (6)
        ball = FIRST_BALL + finger
        inside, below = ball + FINGERS, ball + 2 * FINGERS
        for j in range(K + 1):
            A[ball, j] = -np.sin(psi) * s[finger, j]
        A[ball, BALL], A[ball, r] = 1.0, 1.0 if lean >= psi else np.cos(psi - lean)
        b[ball] = np.sin(psi) * s[finger, VARIABLES] - faces.depths[face]
        # (3) loses eps in the same way
        A[inside, r], A[inside, BALL], b[inside] = 1.0, -1.0, -faces.depths[face]
        A[below, r], A[below, SMALLEST] = -1.0, 1.0


@loop("numpy")
def _edge_rows(
    faces: FaceTable,
    attempts: Attempts,
    a: int,
    discs: tuple[Array, Array, Array],
    A: Array,
    b: Array,
) -> int:
    """Fill in rows that keep the discs inside their faces; return the next place."""
    (C, _, q), row = discs, FIRST_EDGE
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
def _take(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, float, Array],
    discs: tuple[Array, Array, Array],
    x: Array,
    placed: Placed,
) -> None:
    (a, sign, u), (C, _, q), weights, pushes = place, discs, np.empty(FINGERS), 0.0
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
