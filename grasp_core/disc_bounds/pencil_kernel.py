"""Bounds the discs of pencil grasps from above, by programs with one common radius.

Solved: the program of `families.pencil` for four equal discs, in both cells; numbers in comments
are those of its derivation. The ball about each focus is no larger than needed, R = r + the largest
depth, which leaves the variables (x0, k, r). See `families.attempts_kernel` for why one radius is
enough.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.attempts_kernel import (
    FINGERS,
    bounded,
    edges_of,
    room_for,
)
from grasp_core.families.kernel_tables import Attempts, FaceTable
from grasp_core.geometry.vectors_kernel import angle_between, dotted, focus_direction
from grasp_core.solvers.lp_kernel import Rows

VARIABLES, K = 5, 3
"""Number of variables, and the index of k, half the distance of the foci, among them."""
CELL_A, CELL_B = -1.0, 1.0
"""Sign of k u in the focus of the first two fingers, for the two orders of the foci."""


@loop()
def pencil_bounds(
    faces: FaceTable, attempts: Attempts, least_gap: float, least: float, bounds: Array
) -> None:
    """Bound the discs of pencil grasps from above, for both orders of the foci.

    Takes `attempts` (0, 1) or (2, 3); `bounds` (a,).
    """
    room = np.empty((VARIABLES + 2) * (1 + FINGERS * (2 + faces.E.shape[1])))
    for a in range(len(bounds)):
        u, edges = focus_direction(attempts.axes[a]), edges_of(faces, attempts, a)
        bounds[a] = -np.inf
        for cell in (CELL_A, CELL_B):
            near = FINGERS if cell == CELL_B else 0
            rows, row = room_for(room, VARIABLES, 1 + FINGERS + edges + near), 1
            # the foci are 2 k apart
            rows.At[K, 0], rows.b[0] = -2.0, -least_gap
            for finger in range(FINGERS):
                depth = _depth_along(faces, attempts, (a, finger), cell, u)
                row = _ball_row(faces, attempts, (a, finger), depth, rows, row)
                row = _edge_rows(faces, attempts, (a, finger, u), depth, rows, row)
                if near:
                    row = _near_row(faces, attempts, (a, finger, u), depth, rows, row)
            bounds[a] = max(bounds[a], bounded(rows, max(least, bounds[a])))


@loop()
def _depth_along(
    faces: FaceTable, attempts: Attempts, place: tuple[int, int], cell: float, u: Array
) -> tuple[Array, float, float]:
    """Express a finger's distance s from its focus by (1), as a linear function.

    Gives its slopes in (x0, k), its constant, and the sign of k u.
    """
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
def _ball_row(
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
def _edge_rows(
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


@loop()
def _near_row(
    faces: FaceTable,
    attempts: Attempts,
    setting: tuple[int, int, Array],
    depth: tuple[Array, float, float],
    rows: Rows,
    row: int,
) -> int:
    """Fill in row (5), by which a focus of cell B does not pass the other pair's crossing point."""
    (a, finger, u), (s, s0, sign) = setting, depth
    face = attempts.faces[a, finger]
    toward = sign * dotted(attempts.axes[a, finger], u)
    across, T = abs(dotted(faces.normals[face], u)), faces.frames[face]
    for j in range(K + 1):
        rows.At[j, row] = -toward * s[j]
    rows.At[K, row] += 2.0
    # r |T'u| of (5)
    rows.At[-1, row] = np.hypot(dotted(T[:, 0], u), dotted(T[:, 1], u))
    # (6) takes eps |n.u| from the limit
    rows.b[row] = toward * s0 - faces.depths[face] * across
    return row + 1
