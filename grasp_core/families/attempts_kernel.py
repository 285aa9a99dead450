"""Holds what the linear programs for concurrent and pencil discs share, in compiled code.

The programs of `concurrent` and `pencil` grow four discs and maximise the smallest radius. Its
optimum alone is found with all four radii equal, since rows only get tighter as a radius grows.
With one radius, the last variable, every program is feasible for a small enough one, so the
multipliers alone, checked here, bound every radius.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop
from grasp_core.families.kernel_tables import Attempts, FaceTable
from grasp_core.solvers.lp_kernel import LOST, Rows, Vertex, proved_bound, solve
from grasp_core.values import FINGERS

ACCURACY = 1e-12
"""Error up to which multipliers give the objective: even if a focus is a thousand object radii
away, the bound changes by less than the accuracy of a program's answer."""


@loop()
def edges_of(faces: FaceTable, attempts: Attempts, a: int) -> int:
    """Count the edges of the four faces of an attempt."""
    count = 0
    for finger in range(FINGERS):
        count += int(faces.edges[attempts.faces[a, finger]])
    return count


@loop()
def facet_sines(half_angle: float, sides: int) -> tuple[float, float]:
    """Compute sine and cosine of the half-angle of the cone that touches a pyramid's facets."""
    tangent = np.tan(half_angle) * np.cos(np.pi / sides)
    return tangent / np.hypot(1.0, tangent), 1.0 / np.hypot(1.0, tangent)


@loop()
def room_for(room: Array, n: int, count: int) -> Rows:
    """Make empty rows for a program of n variables, in memory that is reused."""
    At = room[: n * count].reshape(n, count)
    At[:] = 0.0
    b, norms = room[n * count : (n + 1) * count], room[(n + 1) * count : (n + 2) * count]
    return Rows(At, b, norms, 0)


@loop()
def bounded(rows: Rows, least: float) -> float:
    """Compute an upper bound on the radius; above `least` it is the tightest one."""
    c, vertex = np.zeros(len(rows.At)), vertex_of(len(rows.At))
    c[-1] = 1.0
    measure(rows)
    status, _ = solve(c, rows, least, vertex)
    # checked here: a wrong answer of the solver costs tightness, never correctness
    return np.inf if status == LOST else proved_bound(c, rows, vertex, ACCURACY)


@loop()
def vertex_of(n: int) -> Vertex:
    """Make an empty vertex of a program with n variables."""
    return Vertex(np.empty(n, dtype=np.int64), np.empty(n), np.empty(n))


@loop()
def measure(rows: Rows) -> None:
    """Compute the norm of each row of a linear program; the solver divides violations by it."""
    rows.norms[:] = 0.0
    for i in range(len(rows.At)):
        for k in range(len(rows.norms)):
            rows.norms[k] += rows.At[i, k] * rows.At[i, k]
    for k in range(len(rows.norms)):
        rows.norms[k] = np.sqrt(rows.norms[k])
