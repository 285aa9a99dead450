"""Finds the nearest point of a polyhedron by a dual active-set method, and checks it.

    minimise |x|  subject to  C x <= d.

A point x is nearest iff C x <= d and x = -C'u for some u >= 0 that vanishes off the active rows,
where equality holds. Whoever asks is told by how much x and u miss these conditions.

Method. With the rows a_1 .. a_q active, x is the nearest point of where these hold with equality,
and their multipliers are not negative: x = 0 without any. If x violates a row a, write
a = r_1 a_1 + .. + r_q a_q + z with z orthogonal to the active rows: a step t along -z lowers
the multipliers by t r and gives a itself the multiplier t. The step ends where a holds with
equality, and a becomes active, or before, where a multiplier vanishes, whose row then leaves. |x|
grows with every full step, so no active rows recur. Where z = 0 and no multiplier falls, nothing is
feasible. The row that is violated most comes first. In the end x is computed afresh from its active
rows.

Source: Goldfarb & Idnani, "A numerically stable dual method for solving strictly convex quadratic
programs", Mathematical Programming 27, 1983.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import loop

ROW_VIOLATED = 1e-13
"""Distance beyond a row's plane, relative to |x| or 1, at which a point violates the row."""
INDEPENDENT_SHARE = 1e-9
"""Share of its length that a row must keep orthogonal to the active rows to be independent of them.
"""
SMALLEST_DIVISOR = 1e-300
NEAREST_STEPS = 20


class Active(NamedTuple):
    """The active rows A of one problem, factored as A = R'Q."""

    rows: Indices
    """Indices of the active rows, followed by the one that enters, (v + 1,)."""
    inside: NDArray[np.bool_]
    """Whether each row is active, (m,)."""
    Q: Array
    """Orthonormal rows that span the active rows, (v, v)."""
    R: Array
    """Upper triangular factor, (v, v + 1); its last column belongs to the row that enters."""
    u: Array
    """Multipliers of the active rows, then of the row that enters, (v + 1,)."""
    z: Array
    """Part of the entering row that is orthogonal to the active rows, (v,)."""
    r: Array
    """Coefficients of the active rows in the entering row, (v,)."""


@loop()
def nearest(C: Array, d: Array, x: Array) -> tuple[float, float]:
    """Find the nearest point, (v,), of the polyhedron C x <= d.

    Gives by how much it misses the conditions, where the farthest row is at one and relative to x
    if that is larger, and by how much it misses a row; infinite where none was found.
    """
    (m, v), size = C.shape, 0.0
    for k in range(m):
        size = max(size, -d[k])
    x.fill(0.0)
    if size == 0.0:  # the origin is nearest to itself
        return 0.0, -d.min()
    unit, norms, u = d / size, np.empty(m), np.zeros(m)
    for k in range(m):
        norms[k] = max(np.sqrt(_dot(C[k], C[k])), SMALLEST_DIVISOR)
    active = Active(
        np.empty(v + 1, np.int64), np.zeros(m, np.bool_), np.empty((v, v)),
        np.empty((v, v + 1)), np.empty(v + 1), np.empty(v), np.empty(v),
    )  # fmt: skip
    count = _active_at(C, unit, norms, active, x)
    if count < 0:
        return np.inf, np.inf
    _recompute(unit, active, count, x)
    largest = 1.0
    for j in range(count):
        u[active.rows[j]] = active.u[j]
    for j in range(v):
        largest = max(largest, abs(x[j]))
    unmet, excess = _unmet(C, unit, x, u)
    for j in range(v):
        x[j] *= size
    return unmet / largest, excess * size


@loop(once=True)
def _active_at(C: Array, d: Array, norms: Array, active: Active, x: Array) -> int:
    """Find the rows that are active at the nearest point; return their number, or -1."""
    count = 0
    for _ in range(NEAREST_STEPS * (len(x) + 1)):
        entering, excess = _violated(C, d, norms, active.inside, x)
        if entering < 0:
            return count
        active.rows[count], active.u[count] = entering, 0.0
        count = _enter(C, active, count, excess, INDEPENDENT_SHARE * norms[entering], x)
        if count < 0:
            break
    return -1


@loop(once=True)
def _unmet(C: Array, d: Array, x: Array, u: Array) -> tuple[float, float]:
    """Return by how much x and u miss the conditions of a nearest point, and a row C x <= d."""
    unmet, excess, every = 0.0, -np.inf, 0.0
    for j in range(len(x)):
        total = x[j]
        for k in range(len(d)):
            total += u[k] * C[k, j]
        unmet, every = max(unmet, abs(total)), every + total
    for k in range(len(d)):
        slack = d[k] - _dot(C[k], x)
        excess, every = max(excess, -slack), every + slack
        unmet = max(unmet, max(-slack, -u[k]))
        if u[k] != 0.0:
            unmet = max(unmet, slack)
    # a sum shows whether any of them is not a number, which a comparison may not
    return (unmet if abs(every) < np.inf else np.inf), excess


@loop(once=True)
def _enter(C: Array, active: Active, count: int, excess: float, least: float, x: Array) -> int:
    """Step until the entering row is active; return the number of active rows, -1 on failure."""
    entering, z = active.rows[count], active.z
    for _ in range(count + 1):
        square = _split(C[entering], active, count)
        whole = excess / square if square > least * least else np.inf
        leaving, part = _leaving(active, count)
        step = min(whole, part)
        if step == np.inf:
            break
        _move(active, count, step)
        if whole < np.inf:
            for j in range(len(x)):
                x[j] -= step * z[j]
            excess -= step * square
        if whole <= part:
            _append(active, count, square)
            active.inside[entering] = True
            return count + 1
        count = _drop(C, active, count, leaving)
    return -1


@loop(once=True)
def _violated(
    C: Array, d: Array, norms: Array, inside: NDArray[np.bool_], x: Array
) -> tuple[int, float]:
    """Return the row that x violates most, and its excess; the row is -1 if none is violated."""
    size = 1.0
    for j in range(len(x)):
        size = max(size, abs(x[j]))
    found, worst, most = -1, ROW_VIOLATED * size, 0.0
    for k in range(len(d)):
        excess = _dot(C[k], x) - d[k]
        if excess > worst * norms[k] and not inside[k]:
            found, worst, most = k, excess / norms[k], excess
    return found, most


@loop()
def _split(row: Array, active: Active, count: int) -> float:
    """Write a row as R[:, count] on Q plus a remainder z orthogonal to Q; return z.z.

    This is done twice, because once leaves rounding errors of the size of the row.
    """
    Q, R, z = active.Q, active.R, active.z
    for j in range(len(row)):
        z[j] = row[j]
    for again in range(2):
        for i in range(count):
            along = _dot(Q[i], z)
            R[i, count] = R[i, count] + along if again else along
            for j in range(len(row)):
                z[j] -= along * Q[i, j]
    return _dot(z, z)


@loop()
def _append(active: Active, count: int, square: float) -> None:
    """Add the remainder z, with its square, to the orthonormal rows."""
    length = max(np.sqrt(square), SMALLEST_DIVISOR)
    active.R[count, count] = length
    for j in range(len(active.z)):
        active.Q[count, j] = active.z[j] / length


@loop(once=True)
def _leaving(active: Active, count: int) -> tuple[int, float]:
    """Return the active row whose multiplier vanishes first, and after which step; fill in r."""
    R, r, u, found, least = active.R, active.r, active.u, -1, np.inf
    for i in range(count - 1, -1, -1):
        r[i] = R[i, count]
        for j in range(i + 1, count):
            r[i] -= R[i, j] * r[j]
        r[i] /= R[i, i]
    for i in range(count):
        if r[i] > 0.0 and u[i] < least * r[i]:
            found, least = i, u[i] / r[i]
    return found, least


@loop(once=True)
def _move(active: Active, count: int, step: float) -> None:
    """Change the multipliers of the active rows and of the entering row by one step."""
    for j in range(count):
        active.u[j] = max(active.u[j] - step * active.r[j], 0.0)
    active.u[count] += step


@loop(once=True)
def _drop(C: Array, active: Active, count: int, leaving: int) -> int:
    """Remove a row from the active rows; return how many are left."""
    active.inside[active.rows[leaving]] = False
    for j in range(leaving, count):
        active.rows[j], active.u[j] = active.rows[j + 1], active.u[j + 1]
    for j in range(leaving, count - 1):
        _append(active, j, _split(C[active.rows[j]], active, j))
    return count - 1


@loop(once=True)
def _recompute(d: Array, active: Active, count: int, x: Array) -> None:
    """Compute the point at which the active rows hold with equality: Q'y, R'y = d, R u = -y."""
    rows, Q, R, u = active.rows, active.Q, active.R, active.u
    x.fill(0.0)
    for i in range(count):
        u[i] = d[rows[i]]
        for j in range(i):
            u[i] -= R[j, i] * u[j]
        u[i] /= R[i, i]
        for j in range(len(x)):
            x[j] += u[i] * Q[i, j]
    for i in range(count - 1, -1, -1):
        u[i] = -u[i]
        for j in range(i + 1, count):
            u[i] -= R[i, j] * u[j]
        u[i] /= R[i, i]


@loop()
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total
