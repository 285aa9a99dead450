"""Places and bounds pencil grasps for many attempts, with the program of `pencil`.

Numbers in comments are those of its derivation. Bounds are those of programs with one common
radius, in both cells; `discs_kernel` says why one radius is enough. Their ball about each focus is
no larger than needed, R = r + the largest depth, which leaves the variables (x0, k, r).
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
from grasp_core.solvers.lp_kernel import Rows
from grasp_core.solvers.ties import SAME_SHARE
from grasp_core.values import FINGERS

FIRST_RADIUS = RADII.start
SIGN_A, SIGN_B = CELL_A[0], CELL_B[0]
"""Sign of k u in the focus of the first two fingers, for the two orders of the foci."""
BOUND_VARIABLES = 5
"""Number of variables (x0, k, r) of a bound's program."""


@loop("numpy")
def place(
    faces: FaceTable, attempts: Attempts, least_gap: float, least: Array, placed: Placed
) -> None:
    """Place two foci and the largest four equal discs for each attempt."""
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
                for finger in range(FINGERS):
                    depth = (
                        s[finger],
                        s[finger, VARIABLES],
                        (1.0 if finger < FINGERS // 2 else -1.0),
                    )
                    place, r = (a, finger, row + finger), FIRST_RADIUS + finger
                    _near_row(faces, attempts, place, u, depth, program.A, program.b, r)
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
def _near_row(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int, int],
    u: Array,
    depth: tuple[Array, float, float],
    A: Array,
    b: Array,
    r: int,
) -> None:
    """Fill in row (5), by which a focus of cell B does not pass the other pair's crossing point.

    Takes `depth`, the finger's s as a linear function: slopes, constant and the sign of k u.
    """
    (a, finger, row), (s, s0, sign) = place, depth
    face = attempts.faces[a, finger]
    T, toward = faces.frames[face], sign * dotted(attempts.axes[a, finger], u)
    for j in range(K + 1):
        A[row, j] = -toward * s[j]
    A[row, K] += 2.0
    # r |T'u| of (5)
    A[row, r] = np.hypot(dotted(T[:, 0], u), dotted(T[:, 1], u))
    # (6) takes eps |n.u| from the limit
    b[row] = toward * s0 - faces.depths[face] * abs(dotted(faces.normals[face], u))


@loop("numpy")
def _take(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, float, Array],
    centers: tuple[Array, Array],
    x: Array,
    placed: Placed,
) -> None:
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


@loop()
def pencil_bounds(
    faces: FaceTable, attempts: Attempts, least_gap: float, least: float, bounds: Array
) -> None:
    """Bound the discs of pencil grasps from above, for both orders of the foci."""
    room = np.empty((BOUND_VARIABLES + 2) * (1 + FINGERS * (2 + faces.E.shape[1])))
    for a in range(len(bounds)):
        u, edges = focus_direction(attempts.axes[a]), edges_of(faces, attempts, a)
        bounds[a] = -np.inf
        for cell in (SIGN_A, SIGN_B):
            near = FINGERS if cell == SIGN_B else 0
            rows, row = room_for(room, BOUND_VARIABLES, 1 + FINGERS + edges + near), 1
            # the foci are 2 k apart
            rows.At[K, 0], rows.b[0] = -2.0, -least_gap
            for finger in range(FINGERS):
                depth = _depth_along(faces, attempts, (a, finger), cell, u)
                row = _bound_ball_row(faces, attempts, (a, finger), depth, rows, row)
                row = _bound_edge_rows(faces, attempts, (a, finger, u), depth, rows, row)
                if near:
                    place, r = (a, finger, row), BOUND_VARIABLES - 1
                    _near_row(faces, attempts, place, u, depth, rows.At.T, rows.b, r)
                    row += 1
            bounds[a] = max(bounds[a], bounded(rows, max(least, bounds[a])))


@loop()
def _depth_along(
    faces: FaceTable, attempts: Attempts, place: tuple[int, int], cell: float, u: Array
) -> tuple[Array, float, float]:
    """Return a finger's s by (1): slopes in (x0, k), constant, and the sign of k u."""
    a, finger = place
    face, s = attempts.faces[a, finger], np.empty(K + 1)
    n, o = faces.normals[face], faces.origins[face]
    along = dotted(n, attempts.axes[a, finger])
    sign = cell if finger < FINGERS // 2 else -cell
    for j in range(3):
        s[j] = n[j] / along
    s[K] = sign * dotted(n, u) / along
    return s, -dotted(n, o) / along, sign


@loop()
def _bound_ball_row(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int],
    depth: tuple[Array, float, float],
    rows: Rows,
    row: int,
) -> int:
    """Fill in row (2), which keeps the ball about a focus in the cones of a disc's points."""
    (a, finger), (s, s0, _) = place, depth
    face, psi, largest = attempts.faces[a, finger], attempts.half_angles[a], 0.0
    for other in range(FINGERS):
        largest = max(largest, faces.depths[attempts.faces[a, other]])
    lean = angle_between(faces.normals[face], attempts.axes[a, finger])
    for j in range(K + 1):
        rows.At[j, row] = -np.sin(psi) * s[j]
    rows.At[-1, row] = 2.0 if lean >= psi else 1.0 + np.cos(psi - lean)  # 1 + kappa
    # (6), for this disc in (2) and for the largest R of (3)
    rows.b[row] = np.sin(psi) * s0 - faces.depths[face] - largest
    return row + 1


@loop()
def _bound_edge_rows(
    faces: FaceTable,
    attempts: Attempts,
    setting: tuple[int, int, Array],
    depth: tuple[Array, float, float],
    rows: Rows,
    row: int,
) -> int:
    """Fill in rows that keep the disc around a contact inside its face."""
    (a, finger, u), (s, s0, sign) = setting, depth
    face, axis = attempts.faces[a, finger], attempts.axes[a, finger]
    T, o = faces.frames[face], faces.origins[face]
    for e in range(faces.edges[face]):
        back, far, high = 0.0, 0.0, 0.0
        for j in range(3):
            edge = T[j, 0] * faces.E[face, e, 0] + T[j, 1] * faces.E[face, e, 1]
            rows.At[j, row] = edge
            back += edge * axis[j]
            far += edge * u[j]
            high += edge * o[j]
        # along u, k moves the focus c
        rows.At[K, row], rows.At[-1, row] = sign * far, 1.0
        # the disc lies s back from c along the axis
        for j in range(K + 1):
            rows.At[j, row] -= back * s[j]
        rows.b[row] = faces.b[face, e] + back * s0 + high
        row += 1
    return row
