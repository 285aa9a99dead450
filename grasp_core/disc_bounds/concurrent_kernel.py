"""Bounds the discs of concurrent grasps from above, by a program with one common radius.

Solved: the program of `families.concurrent` for four equal discs, over (x0, y_1 .. y_4, r), for a
focus before and behind all fingers; numbers in comments are those of its derivation. See
`families.attempts_kernel` for why one radius is enough.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.disc_bounds.corner_bounds_kernel import reaches
from grasp_core.families.attempts_kernel import (
    FINGERS,
    bounded,
    edges_of,
    facet_sines,
    room_for,
)
from grasp_core.families.kernel_tables import Attempts, Corners, FaceTable
from grasp_core.geometry.vectors_kernel import across
from grasp_core.solvers.lp_kernel import Rows

VARIABLES = 12  # x0 (3), y (4 x 2), r


@loop()
def concurrent_bounds(
    faces: FaceTable, attempts: Attempts, turns: Array, least: float, bounds: Array
) -> None:
    """Bound the discs of concurrent grasps, with the focus before or behind all fingers.

    Takes `turns` (m, 2); `bounds` (a,).
    """
    corners = Corners(faces.corners, faces.edges)
    room = np.empty((VARIABLES + 2) * FINGERS * (len(turns) + faces.E.shape[1]))
    for a in range(len(bounds)):
        rows = room_for(room, VARIABLES, FINGERS * len(turns) + edges_of(faces, attempts, a))
        before, behind = reaches(corners, attempts.faces[a], attempts.axes[a])
        bounds[a] = -np.inf
        for side, reach in ((1.0, before), (-1.0, behind)):
            # (5): no program is needed where this limit is small enough
            limit = reach * np.tan(attempts.half_angles[a])
            if limit <= max(least, bounds[a]):
                bounds[a] = max(bounds[a], limit)
                continue
            row = 0
            for finger in range(FINGERS):
                row = _aim_rows(faces, attempts, (a, finger), (turns, side), rows, row)
                row = _inside_rows(faces, attempts.faces[a, finger], finger, rows, row)
            bounds[a] = max(bounds[a], bounded(rows, max(least, bounds[a])))


@loop()
def _aim_rows(
    faces: FaceTable,
    attempts: Attempts,
    place: tuple[int, int],
    facets: tuple[Array, float],
    rows: Rows,
    row: int,
) -> int:
    """Fill in rows (1), which keep the focus x0 in the cones of every point of a disc."""
    (a, finger), (turns, side) = place, facets
    sine, cosine = facet_sines(attempts.half_angles[a], len(turns))
    # (4): a focus behind the finger turns the facets round
    sine, cosine = side * sine, side * cosine
    face, y, r = attempts.faces[a, finger], 3 + 2 * finger, VARIABLES - 1
    axis, T, o = attempts.axes[a, finger], faces.frames[face], faces.origins[face]
    first, second = across(axis, T)
    for m in range(len(turns)):
        flat, flat_too, height, lean = 0.0, 0.0, 0.0, 0.0
        for j in range(3):
            g = sine * axis[j] - cosine * (turns[m, 0] * first[j] + turns[m, 1] * second[j])
            rows.At[j, row] = -g
            flat += g * T[j, 0]
            flat_too += g * T[j, 1]
            height += g * o[j]
            lean += g * faces.normals[face, j]
        rows.At[y, row], rows.At[y + 1, row] = flat, flat_too
        # r |T'g| of (1)
        rows.At[r, row] = np.sqrt(flat * flat + flat_too * flat_too)
        # (3) takes eps |g.n| from the limit
        rows.b[row] = -height - faces.depths[face] * abs(lean)
        row += 1
    return row


@loop()
def _inside_rows(faces: FaceTable, face: int, finger: int, rows: Rows, row: int) -> int:
    """Fill in rows (2), which keep a disc inside its face."""
    y, r = 3 + 2 * finger, VARIABLES - 1
    for e in range(faces.edges[face]):
        rows.At[y, row], rows.At[y + 1, row] = faces.E[face, e, 0], faces.E[face, e, 1]
        rows.At[r, row], rows.b[row] = 1.0, faces.b[face, e]
        row += 1
    return row
