"""Solves one small dense linear program by the dual simplex method, in compiled code.

    maximise c.x  subject to  a_k.x <= b_k (or = b_k).

Solved: which n rows hold with equality at a best vertex, or with which of them another row is in
contradiction. `lp` solves for the vertex and the multipliers afresh and checks them; loops that
only ask for a bound have it proved here, from the multipliers alone.

Method. Any n independent rows, the basis, meet in a point x and give c = y_1 a_1 + .. + y_n a_n. As
long as y >= 0 (of any sign for equalities), c.x is at least the optimum. The corner on the side of
c of the box |x_i| <= BOX is such a basis, with which the search begins. If x violates a row r,
write a_r = alpha_1 a_1 + .. + alpha_n a_n: r enters, and a row of positive alpha_j leaves, which
lowers c.x. The one with the least y_j / alpha_j would keep y >= 0. Small alpha_j spoil the inverse
of the basis, so that of those that lower no y_j below -SLACK the largest alpha_j is taken (Harris,
"Pivot selection methods of the Devex LP code", Mathematical Programming 5, 1973). Without a
positive alpha_j no point meets both r and the basis. Of the violated rows the one that is violated
most enters; after many steps that lower nothing the first one does, which leaves most circles.

If x violates no row, but a y_j is negative, c.x rises on the edge where x moves off row j alone.
The first row that is met there enters in its place, as in the primal simplex method. Steps of
either kind are limited: a circle ends as `NOT_SOLVED`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop
from grasp_core.solvers.lp import EXCLUDED_SIZE

BOX_SIZE = 1e3
"""Half the side of the box in which the search begins: data are of order one, and a program whose
search ends at the box is left to another solver."""
BEYOND_ROW = 1e-10
"""Distance beyond a row's plane at which a point violates the row."""
LEAST_PIVOT = 1e-9
MULTIPLIER_SLACK = 1e-10
"""Size below zero that multipliers may reach on the way."""
NEGATIVE = 1e-13
"""Size below zero from which a multiplier's row has to leave the basis in the end."""
STEP_BEYOND = 1e-12
"""Distance beyond a row's plane at which a step along an edge may end."""
UNCHANGED = 1e-13
"""Decrease of c.x in one step below which the step counts as no progress."""
LP_PATIENCE, LP_STEPS = 3, 60
"""Steps without progress until the first violated row is chosen, and largest number of steps, both
per variable."""
REFINEMENTS = 3
LEAST_ROW = 1e-8
"""Least length of a row that violations are divided by."""
OPTIMAL, INFEASIBLE, BELOW_BOUND, NOT_SOLVED = 0, 1, 2, 3


class LpRows(NamedTuple):
    """The rows of a program; equalities come last, and the search may change their signs."""

    At: Array
    """Transpose of the matrix A of rows, (n, rows): loops over rows then read adjacent memory."""
    b: Array
    """Right-hand sides, (rows,)."""
    equalities: int


class Vertex(NamedTuple):
    """The basis that the search has reached, with its vertex and multipliers."""

    basis: Indices
    """Rows of the basis, (n,); the numbers rows + 2 i and rows + 2 i + 1 stand for the upper and
    the lower side of the box."""
    y: Array
    """Multipliers of the basis, (n,); if a row contradicts the basis, its coefficients alpha
    instead."""
    x: Array
    """Point at which the rows of the basis meet, (n,)."""


@loop("numpy")
def empty_rows(n: int, count: int, equalities: int) -> LpRows:
    """Make rows of zeros for a program of n variables."""
    return LpRows(np.zeros((n, count)), np.zeros(count), equalities)


@loop("numpy")
def vertex_of(n: int) -> Vertex:
    """Make an empty vertex of a program with n variables."""
    return Vertex(np.empty(n, dtype=np.int64), np.empty(n), np.empty(n))


@loop("numpy")
def bounded(c: Array, rows: LpRows, cutoff: float, accuracy: float, vertex: Vertex) -> float:
    """Prove an upper bound on c.x that is the tightest one if it is above the cutoff.

    It is minus infinity where nothing is feasible, and infinite where nothing is proved.
    """
    # a basis that is nearly singular proves nothing; another rule reaches another one
    for first in (False, True):
        status, against = solve(c, rows, cutoff, vertex, first)
        if status == INFEASIBLE and proved_empty(rows, vertex, against, EXCLUDED_SIZE):
            return -np.inf
        if status in (OPTIMAL, BELOW_BOUND):
            # a wrong answer of the search costs tightness, never correctness
            bound = proved_bound(c, rows, vertex, accuracy)
            if bound < np.inf:
                return bound
    return np.inf


@loop("numpy")
def solve(c: Array, rows: LpRows, cutoff: float, vertex: Vertex, first: bool) -> tuple[int, int]:
    """Find a best vertex: how that ended, and the row that contradicts the basis, if one does.

    The row that is violated most enters the basis, or the first that is violated.
    """
    n, count, idle = len(c), len(rows.b), 0
    basis, y, x = vertex
    inverse, value, norms = *_corner(c, count, vertex), _lengths(rows)
    alpha, excess, inside = np.empty(n), np.empty(count), np.zeros(count, dtype=np.bool_)
    for _ in range(LP_STEPS * n):
        if value < cutoff and not _is_held_up(y, basis, rows):
            _refine(c, rows, basis, inverse, y)
            if not _is_held_up(y, basis, rows):
                return BELOW_BOUND, -1
        _exceeded(x, rows, excess)
        entering = _violated(excess, rows, norms, inside, first or idle > LP_PATIENCE * n)
        if entering >= 0:
            if excess[entering] < 0.0:
                _turn(rows, excess, entering)
            _combined(rows, entering, inverse, alpha)
            leaving = _leaving(y, alpha, basis, rows)
            if leaving < 0:
                _refine(rows.At[:, entering].copy(), rows, basis, inverse, y)
                return INFEASIBLE, entering
        else:
            _refine(c, rows, basis, inverse, y)
            leaving = _negative(y, basis, rows)
            if leaving < 0:
                return OPTIMAL, -1
            entering = _blocking(inverse[:, leaving], rows, excess, inside)
            if entering < 0:
                return NOT_SOLVED, -1
            _combined(rows, entering, inverse, alpha)
        drop = max(y[leaving] / alpha[leaving], 0.0)
        idle = idle + 1 if drop * abs(excess[entering]) < UNCHANGED else 0
        value -= drop * excess[entering]
        _exchange(inverse, x, alpha, leaving, excess[entering])
        for j in range(n):
            y[j] -= drop * alpha[j]
        y[leaving] = drop
        if basis[leaving] < count:
            inside[basis[leaving]] = False
        inside[entering] = True
        basis[leaving] = entering
    return NOT_SOLVED, -1


@loop("numpy")
def proved_bound(c: Array, rows: LpRows, vertex: Vertex, accuracy: float) -> float:
    """Return y.b, a bound of feasible values, if y >= 0 gives c closely enough; else infinity."""
    bound, left = 0.0, c.copy()
    for j in range(len(c)):
        share = vertex.y[j]
        if not _may_weigh(share, vertex.basis[j], rows):
            continue  # left out, it shows in what is left
        bound += share * rows.b[vertex.basis[j]]
        _subtract(left, share, rows, vertex.basis[j])
    proved = np.abs(left).max() <= accuracy and bound < np.inf  # which no bound is that is none
    return bound if proved else np.inf


@loop("numpy")
def proved_empty(rows: LpRows, vertex: Vertex, against: int, farthest: float) -> bool:
    """Return whether a row and a basis it contradicts exclude all |x|_1 up to `farthest`.

    Where a_r = alpha_1 a_1 + .. with alpha <= 0, the excess of a_r.x over b_r is at least that of
    alpha_1 b_1 + .. .
    """
    gap, left = -rows.b[against], rows.At[:, against].copy()
    for j in range(len(left)):
        share = vertex.y[j]
        if not _may_weigh(-share, vertex.basis[j], rows):
            continue
        gap += share * rows.b[vertex.basis[j]]
        _subtract(left, share, rows, vertex.basis[j])
    return gap > farthest * np.abs(left).max() + BEYOND_ROW


@loop("numpy")
def _may_weigh(share: float, k: int, rows: LpRows) -> bool:
    """Return whether a proof may use row k this much: never the box, equalities always."""
    return k < len(rows.b) and (share > 0.0 or _is_equality(k, rows))


@loop("numpy")
def _is_equality(k: int, rows: LpRows) -> bool:
    return len(rows.b) - rows.equalities <= k < len(rows.b)


@loop("numpy", once=True)
def _corner(c: Array, count: int, vertex: Vertex) -> tuple[Array, float]:
    """Return the inverse basis of the box's corner on the side of c, and its value c.x."""
    n = len(c)
    inverse, value = np.zeros((n, n)), 0.0
    for i in range(n):
        side = 1.0 if c[i] >= 0.0 else -1.0
        vertex.basis[i] = count + 2 * i + (0 if side > 0.0 else 1)
        inverse[i, i], vertex.x[i], vertex.y[i] = side, side * BOX_SIZE, abs(c[i])
        value += c[i] * vertex.x[i]
    return inverse, value


@loop("numpy", once=True)
def _lengths(rows: LpRows) -> Array:
    norms = np.zeros(len(rows.b))
    for i in range(len(rows.At)):
        for k in range(len(norms)):
            norms[k] += rows.At[i, k] * rows.At[i, k]
    for k in range(len(norms)):
        norms[k] = max(np.sqrt(norms[k]), LEAST_ROW)
    return norms


@loop("numpy")
def _is_held_up(y: Array, basis: Indices, rows: LpRows) -> bool:
    """Return whether the value is no bound: it leans on the box, or a multiplier is negative."""
    leans = _negative(y, basis, rows) >= 0
    for j in range(len(y)):
        leans |= basis[j] >= len(rows.b) and y[j] > 0.0
    return leans


@loop("numpy")
def _negative(y: Array, basis: Indices, rows: LpRows) -> int:
    """Return the place in the basis with the most negative multiplier, -1 if there is none."""
    least, found = -NEGATIVE, -1
    for j in range(len(y)):
        if y[j] < least and not _is_equality(basis[j], rows):
            least, found = y[j], j
    return found


@loop("numpy", once=True)
def _blocking(column: Array, rows: LpRows, excess: Array, inside: NDArray[np.bool_]) -> int:
    """Return the row that is met first on the edge against a column; -1 if there is none.

    Of rows that are met with the first one, the steepest is taken.
    """
    count = len(excess) - rows.equalities
    rates, farthest, steepest, found = np.zeros(count), np.inf, LEAST_PIVOT, -1
    for i in range(len(column)):
        for k in range(count):
            rates[k] -= rows.At[i, k] * column[i]
    for k in range(count):
        if rates[k] > LEAST_PIVOT and not inside[k]:
            farthest = min(farthest, (max(-excess[k], 0.0) + STEP_BEYOND) / rates[k])
    for k in range(count):
        if rates[k] > steepest and not inside[k] and -excess[k] <= farthest * rates[k]:
            steepest, found = rates[k], k
    return found


@loop("numpy", once=True)
def _exceeded(x: Array, rows: LpRows, excess: Array) -> None:
    for k in range(len(excess)):
        excess[k] = -rows.b[k]
    for i in range(len(x)):
        at, column = x[i], rows.At[i]
        for k in range(len(excess)):
            excess[k] += column[k] * at


@loop("numpy", once=True)
def _violated(
    excess: Array, rows: LpRows, norms: Array, inside: NDArray[np.bool_], first: bool
) -> int:
    """Return the row that is violated most, or the first violated row; -1 if none is violated."""
    worst, found, inequalities = BEYOND_ROW, -1, len(excess) - rows.equalities
    for k in range(len(excess)):
        beyond = excess[k] if k < inequalities else abs(excess[k])
        if beyond > worst * norms[k] and not inside[k]:
            worst, found = beyond / norms[k], k
            if first:
                break
    return found


@loop("numpy", once=True)
def _turn(rows: LpRows, excess: Array, k: int) -> None:
    """Change the sign of an equality, so that points below it violate it."""
    rows.b[k], excess[k] = -rows.b[k], -excess[k]
    for i in range(len(rows.At)):
        rows.At[i, k] = -rows.At[i, k]


@loop("numpy", once=True)
def _combined(rows: LpRows, entering: int, inverse: Array, alpha: Array) -> None:
    """Write a row as a combination of the rows of the basis."""
    alpha[:] = 0.0
    for i in range(len(alpha)):
        share = rows.At[i, entering]
        if share != 0.0:
            for j in range(len(alpha)):
                alpha[j] += share * inverse[i, j]


@loop("numpy")
def _refine(c: Array, rows: LpRows, basis: Indices, inverse: Array, y: Array) -> None:
    """Compute the multipliers afresh, without the rounding errors that steps have added up."""
    y[:] = 0.0
    for _ in range(REFINEMENTS):
        left = c.copy()
        for j in range(len(c)):
            _subtract(left, y[j], rows, basis[j])
        for i in range(len(c)):
            for j in range(len(c)):
                y[j] += left[i] * inverse[i, j]


@loop("numpy")
def _subtract(left: Array, share: float, rows: LpRows, k: int) -> None:
    """Subtract a multiple of a row, or of a side of the box, from `left`."""
    side = k - len(rows.b)
    if side >= 0:
        left[side // 2] -= share if side % 2 == 0 else -share
        return
    for i in range(len(left)):
        left[i] -= share * rows.At[i, k]


@loop("numpy", once=True)
def _leaving(y: Array, alpha: Array, basis: Indices, rows: LpRows) -> int:
    """Return the place in the basis that leaves, -1 if no alpha is positive.

    Of the quotients y / alpha that lower no multiplier below -`MULTIPLIER_SLACK`, the one with the
    largest alpha is taken: small ones spoil the inverse. Equalities stay in the basis.
    """
    most, largest, found = np.inf, LEAST_PIVOT, -1
    for j in range(len(y)):
        if alpha[j] > LEAST_PIVOT and not _is_equality(basis[j], rows):
            most = min(most, (max(y[j], 0.0) + MULTIPLIER_SLACK) / alpha[j])
    for j in range(len(y)):
        if alpha[j] > largest and y[j] <= most * alpha[j] and not _is_equality(basis[j], rows):
            largest, found = alpha[j], j
    return found


@loop("numpy", once=True)
def _exchange(inverse: Array, x: Array, alpha: Array, leaving: int, excess: float) -> None:
    """Put a row in the place of another in the basis: the point moves onto it along the others."""
    n = len(x)
    for i in range(n):
        step = inverse[i, leaving] / alpha[leaving]
        for j in range(n):
            inverse[i, j] -= alpha[j] * step
        inverse[i, leaving] = step
        x[i] -= excess * step
