"""Finds four discs of the largest common radius in compiled code, and bounds them from above.

The rows of a program are those that `placements` gets, and so are the steps: the largest
smallest radius, the largest sum of radii, and of its optima the point nearest to the origin. Every
answer is checked here by its residuals, with the limits of `solvers.lp`, `solvers.qp`
and `solvers.ties`. Nothing is claimed where a check fails: such a program is left to these modules.

The programs of `concurrent` and `pencil` grow four discs and maximise the smallest radius. Its
optimum alone is found with all four radii equal, since rows only get tighter as a radius grows.
With one radius, the last variable, every program is feasible for a small enough one, so the
multipliers alone, checked here, bound every radius.

Before any program, discs are bounded by the corners of the faces alone. Numbers in comments of
these bounds are those of the derivation in `disc_bounds`.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.families.placements import (
    KEPT,
    LEFT,
    NONE,
    PAIRINGS,
    PLACED,
    Attempts,
    Corners,
    FaceTable,
)
from grasp_core.geometry.vectors_kernel import balancing_weights, cross, dotted
from grasp_core.solvers.lp import RESIDUAL
from grasp_core.solvers.lp_kernel import BELOW, LOST, OPTIMAL, Rows, Vertex, proved_bound, solve
from grasp_core.solvers.nearest_point_kernel import solve as solve_nearest
from grasp_core.solvers.ties import FEASIBLE, FOUND, SAME_VALUE
from grasp_core.values import FINGERS

ACCURACY = 1e-12
"""Error up to which multipliers give the objective: even if a focus is a thousand object radii
away, the bound changes by less than the accuracy of a program's answer."""
SINGULAR = 1e-13
"""Pivot, in a matrix of order one, below which a vertex is left to other solvers."""


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


class Program(NamedTuple):
    """A disc program: rows A x <= b, with room for the two rows that later steps add."""

    A: Array
    """Rows, (rows + 2, n); the last two are zeros, filled in by `largest_discs`."""
    b: Array
    """Limits of the rows, (rows + 2,)."""
    radii: int
    """Place of the first of the four radii in x."""
    smallest: int
    """Place of the radii's lower bound in x."""


@loop("numpy")
def largest_discs(program: Program, least: float, x: Array) -> tuple[int, float]:
    """Find the largest four equal discs, then enlarge each; return the end and the radius."""
    A, b, radii, smallest = program
    count, n = len(b) - 2, len(x)
    c = np.zeros(n)
    c[smallest] = 1.0
    status, first = optimum(c, A[:count], b[:count], least, x)
    if status != PLACED or first < least:
        return (NONE if status == PLACED else status), first
    # the sum of the radii, where the smallest one stays nearly as large
    A[count, smallest], b[count] = -1.0, -first * (1.0 - KEPT)
    c[smallest] = 0.0
    for finger in range(4):
        c[radii + finger] = 1.0
        A[count + 1, radii + finger] = -1.0
    status, second = optimum(c, A[: count + 1], b[: count + 1], -np.inf, x)
    if status != PLACED:
        return LEFT, first
    b[count + 1] = -(second - SAME_VALUE * (1.0 + abs(second)))
    if not _nearest(A, b, x):
        return LEFT, first
    for finger in range(4):
        x[radii + finger] = max(x[radii + finger] - RESIDUAL, 0.0)
    return PLACED, first - RESIDUAL


@loop("numpy")
def optimum(c: Array, A: Array, b: Array, cutoff: float, x: Array) -> tuple[int, float]:
    """Maximise c.x subject to A x <= b, with the checks of `solvers.lp`.

    Gives `PLACED` and the optimum; `NONE` where a bound below the cutoff is proved; or `LEFT`.
    """
    count, n = A.shape
    rows = Rows(np.empty((n, count)), np.empty(count), np.empty(count), 0)
    for k in range(count):
        rows.b[k], rows.norms[k] = b[k], max(np.sqrt(_dot(A[k], A[k])), RESIDUAL)
        for j in range(n):
            rows.At[j, k] = A[k, j]
    vertex = Vertex(np.empty(n, np.int64), np.empty(n), np.empty(n))
    status, _ = solve(c, rows, cutoff, vertex)
    if status == BELOW:
        bound = proved_bound(c, rows, vertex, RESIDUAL)
        return (NONE if bound <= cutoff else LEFT), bound
    if status != OPTIMAL:
        return LEFT, 0.0
    if not _at_vertex(c, A, b, vertex, x):
        return LEFT, 0.0
    return _checked(c, A, b, vertex.basis, x, vertex.y)


@loop("numpy")
def _at_vertex(c: Array, A: Array, b: Array, vertex: Vertex, x: Array) -> bool:
    """Solve for the point and the multipliers of a basis; return False if it leans on the box."""
    n, basis, y = len(x), vertex.basis, vertex.y
    corner, turned = np.empty((n, n)), np.empty((n, n))
    for j in range(n):
        if basis[j] >= len(b):  # a side of the box in which the search begins
            return False
        x[j], y[j] = b[basis[j]], c[j]
        for i in range(n):
            corner[j, i] = turned[i, j] = A[basis[j], i]
    return _solved(corner, x) and _solved(turned, y)


@loop("numpy")
def _checked(c: Array, A: Array, b: Array, basis: Indices, x: Array, y: Array) -> tuple[int, float]:
    """Return `PLACED` and the value of an optimum if its residuals prove it, else `LEFT`."""
    count, n = A.shape
    scale, value, bound, worst, every = 1.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        scale = max(scale, 1.0 + abs(x[j]))
        value += c[j] * x[j]
        bound += y[j] * b[basis[j]]
    for k in range(count):
        excess = _dot(A[k], x) - b[k]
        worst, every = max(worst, excess), every + excess
    for j in range(n):
        left = c[j]
        for i in range(n):
            left -= y[i] * A[basis[i], j]
        worst, every = max(worst, max(abs(left), -y[j])), every + left
    worst, every = max(worst, abs(bound - value)), every + bound + value
    # a sum shows whether any of them is not a number, which a comparison may not
    proved = worst <= RESIDUAL * scale and abs(every) < np.inf
    return (PLACED if proved else LEFT), value


@loop("numpy")
def _solved(matrix: Array, x: Array) -> bool:
    """Solve matrix @ y = x in place by elimination; return False if the matrix is near singular."""
    n = len(x)
    for i in range(n):
        _exchange(matrix, x, i)
        if not abs(matrix[i, i]) > SINGULAR:
            return False
        for k in range(i + 1, n):
            share = matrix[k, i] / matrix[i, i]
            if share != 0.0:
                x[k] -= share * x[i]
                for j in range(i + 1, n):
                    matrix[k, j] -= share * matrix[i, j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= matrix[i, j] * x[j]
        x[i] /= matrix[i, i]
    return True


@loop("numpy")
def _exchange(matrix: Array, x: Array, i: int) -> None:
    """Exchange row i for the row below with the largest entry in column i."""
    n, pivot = len(x), i
    for k in range(i + 1, n):
        if abs(matrix[k, i]) > abs(matrix[pivot, i]):
            pivot = k
    if pivot != i:
        x[i], x[pivot] = x[pivot], x[i]
        for j in range(i, n):
            matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]


@loop("numpy")
def _nearest(A: Array, b: Array, x: Array) -> bool:
    """Move an optimum to the one nearest to the origin; return False if that is not proved.

    The last row of A x <= b keeps the value.
    """
    count, n = A.shape
    size, d, largest = 0.0, np.empty((1, count)), 1.0
    for k in range(count):
        size = max(size, -b[k])
    if size <= 0.0:  # the origin is nearest to itself, which no disc program asks for
        return False
    for k in range(count):
        d[0, k] = b[k] / size
    near, u = np.zeros((1, n)), np.zeros((1, count))
    solve_nearest(A, d, near, u)
    unmet, excess = _unmet(A, d[0], near[0], u[0])
    for j in range(n):
        largest = max(largest, abs(near[0, j]))
    if not unmet <= FOUND * largest:
        return False
    if excess * size <= FEASIBLE:
        for j in range(n):
            x[j] = size * near[0, j]
    return True


@loop("numpy")
def _unmet(A: Array, d: Array, x: Array, u: Array) -> tuple[float, float]:
    """Return by how much x and u miss the conditions of a nearest point, and a row A x <= d."""
    unmet, excess, every = 0.0, -np.inf, 0.0
    for j in range(len(x)):
        total = x[j]
        for k in range(len(d)):
            total += u[k] * A[k, j]
        unmet, every = max(unmet, abs(total)), every + total
    for k in range(len(d)):
        slack = d[k] - _dot(A[k], x)
        excess, every = max(excess, -slack), every + slack
        unmet = max(unmet, max(-slack, -u[k]))
        if u[k] != 0.0:
            unmet = max(unmet, slack)
    # a sum shows whether any of them is not a number, which a comparison may not
    return (unmet if abs(every) < np.inf else np.inf), excess


@loop("numpy")
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


SAME_AXIS = 1e-6
"""Axes with 1 - a_i.a_j up to this are so nearly parallel that (2) bounds no width."""
NO_CROSSING = 1e-6
"""Axes whose cross product is no longer than this leave the direction N undefined."""
NO_LEAN = 1e-6
"""Smallest factor of r in (3) and (4) that is divided by: below it discs hardly reach along N."""


@loop()
def fill(
    corners: Corners, normals: Array, faces: Indices, axes: Array, half_angles: Array, limits: Array
) -> None:
    """Bound the discs of many quadruples from above (see `disc_limits`)."""
    for q in range(len(faces)):
        if half_angles[q] <= 0.0:  # there are no such cones, and so no discs
            limits[q] = 0.0
            continue
        before, behind = reaches(corners, faces[q], axes[q])
        reach, half = max(before, behind), np.tan(0.5 * half_angles[q])
        # (5) of `concurrent`: the least s_i is at most the weighted mean of all s_i
        limits[q, 0] = reach * np.tan(half_angles[q])
        for pairing, (i, j, k, m) in enumerate(PAIRINGS):
            # see `pencil_radius_bounds`: reach first, then the widths of both pairs
            limit = 2.0 * reach * half
            for first, second, third, fourth in ((i, j, k, m), (k, m, i, j)):
                width = _width(corners, faces[q], axes[q], (first, second))
                limit = min(limit, 0.5 * width * half)
                if limit > 0.0:
                    places = (first, second, third, fourth)
                    limit = min(limit, _across(corners, normals, faces[q], axes[q], places, half))
            limits[q, 1 + pairing] = limit


@loop()
def reaches(corners: Corners, faces: Indices, axes: Array) -> tuple[float, float]:
    """Bound the mean distance of contacts from a focus before and behind them, by (1)."""
    weights, before, behind = np.empty(FINGERS), 0.0, 0.0
    balancing_weights(axes, weights)
    for i in range(FINGERS):
        low, high = _extent(corners, faces[i], axes[i])
        before, behind = before - weights[i] * low, behind + weights[i] * high
    return before, behind


@loop()
def _width(corners: Corners, faces: Indices, axes: Array, pair: tuple[int, int]) -> float:
    """Bound the sum of two contacts' distances s_i and s_j from a common focus, by (2)."""
    (i, j), apart = pair, np.empty(3)
    for d in range(3):
        apart[d] = axes[i, d] - axes[j, d]
    share = 0.5 * dotted(apart, apart)  # 1 - a_i.a_j of (2)
    if share <= SAME_AXIS:
        return np.inf
    return (_extent(corners, faces[j], apart)[1] - _extent(corners, faces[i], apart)[0]) / share


@loop()
def _across(
    corners: Corners,
    normals: Array,
    faces: Indices,
    axes: Array,
    places: tuple[int, int, int, int],
    half: float,
) -> float:
    """Bound a disc's radius by the faces' heights across the axes of two fingers, (3) and (4)."""
    N, limit, pair = np.empty(3), np.inf, FINGERS // 2
    cross(axes[places[0]], axes[places[1]], N)
    length = np.sqrt(dotted(N, N))
    if length <= NO_CROSSING:
        return limit
    for d in range(3):
        N[d] /= length
    for e in range(pair):
        one = places[e]
        low, high = _extent(corners, faces[one], N)
        lean = _lean(normals[faces[one]], N)
        for f in range(e + 1, FINGERS):
            other = places[f]
            lower, higher = _extent(corners, faces[other], N)
            # (4), with its sign: it tells which of the two discs is higher
            away = dotted(axes[other], N) / half if f >= pair else 0.0
            # left sides of (3) and (4) per unit of r
            total = lean + _lean(normals[faces[other]], N) + abs(away)
            if total <= NO_LEAN:
                continue
            if away >= 0.0:
                limit = min(limit, (high - lower) / total)
            if away <= 0.0:
                limit = min(limit, (higher - low) / total)
    return limit


@loop()
def _lean(normal: Array, N: Array) -> float:
    """Compute |T'N|, which is how far a disc of radius one reaches along N."""
    return np.sqrt(max(1.0 - dotted(normal, N) ** 2, 0.0))


@loop()
def _extent(corners: Corners, face: int, direction: Array) -> tuple[float, float]:
    """Find the least and largest height of a face's corners along a direction."""
    low, high = np.inf, -np.inf
    for k in range(corners.counts[face]):
        height = 0.0
        for d in range(3):
            height += corners.points[face, k, d] * direction[d]
        low, high = min(low, height), max(high, height)
    return low, high
