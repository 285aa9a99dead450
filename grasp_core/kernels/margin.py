"""The margin program of force closure at one friction, by an interior-point method.

Solved (see `closure`): how deep inside their friction cones k contacts can balance each other. In
coordinates (normal, tangent, tangent) with tangential forces in units of the friction, each cone is
K = {s : s_0 >= |(s_1, s_2)|}. Write the forces as s_i + t e with e = (1, 0, 0) and t their common
depth. As their normal parts sum to one, t = (1 - sum s_i0) / k, and what is left is

    minimise  sum s_i0  subject to  sum A_i s_i = -m,  s_i in K,

the columns of A_i being the wrenches of contact i's three axes, with the mean m of the wrenches of
all normals taken off the first. Its dual

    maximise  -m.y      subject to  z_i = e - A_i'y in K

is over twists y. The optimum V is below one for force closure and above one if some y separates:
z_i in K means that the support of cone i in direction y is at most (1 + m.y) / k.

Method. As sum A_i e = 0, the points s_i = e, y = 0, z_i = e are in the middle of the cones, and the
dual one is exact. From there Newton's method follows the points where the products of s_i and z_i
in the algebra of K are equal multiples of e, with Mehrotra's predictor and corrector, in the
coordinates of Nesterov and Todd in which s_i and z_i are the same vector. Each step is found by
orthonormalising six rows: the squares of a Cholesky factorisation would leave an imbalance where
two contacts carry nearly everything.

Source: Vandenberghe, "The CVXOPT linear and quadratic cone program solvers" (2010), sections 4-7.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType, reportMissingTypeStubs]

from grasp_core.arrays import Array

WRENCH = 6
MOST_STEPS = 40
"""Ten are usual."""
SHARE = 0.1
"""The gap between primal and dual that is left, relative to the distance of V from one."""
SMALLEST_GAP = 1e-11
"""Smaller ones are rounding, in programs of order one."""
BALANCED = 1e-10
"""Largest imbalance of the last point; usual is 1e-15."""
SHORTER = 0.99
"""Share of the way to the border of the cones that a step may take."""


class Point(NamedTuple):
    """An iterate, inside the cones."""

    s: Array
    """Forces less their depth, (k, 3)."""
    z: Array
    """(k, 3)"""
    y: Array
    """Twist, (6,)."""


class Scaling(NamedTuple):
    """Symmetric maps W_i of K with W_i z_i = inverse(W_i) s_i, and what they make of a program."""

    W: Array
    """(k, 3, 3)"""
    inverse: Array
    """(k, 3, 3)"""
    middle: Array
    """W_i z_i, (k, 3)."""
    Q: Array
    """Orthonormal rows that span those of all A_i W_i side by side, (6, k, 3)."""
    R: Array
    """Upper triangle, (6, 6), with R'Q = A W."""


class Step(NamedTuple):
    """A direction; `s` and `z` are in the coordinates of the scaling."""

    s: Array
    """(k, 3)"""
    z: Array
    """(k, 3)"""
    y: Array
    """(6,)"""


@njit(cache=True)
def least_cone_sum(columns: Array, mean: Array, point: Point) -> tuple[float, float]:
    """Solve the program, as far as it takes to tell on which side of one its value is.

    Args:
        columns: Those of A_i, as rows, (k, 3, 6).
        mean: m, (6,).
        point: Filled with the last iterate.

    Returns:
        Values of the primal and of the dual program. The optimum lies between them where the
        forces balance.
    """
    k = len(columns)
    scaling = Scaling(
        np.empty((k, 3, 3)), np.empty((k, 3, 3)), np.empty((k, 3)), np.empty((WRENCH, k, 3)),
        np.empty((WRENCH, WRENCH)),
    )  # fmt: skip
    step = Step(np.empty((k, 3)), np.empty((k, 3)), np.empty(WRENCH))
    missing, wanted = np.empty(WRENCH), np.empty((k, 3))
    _start(point)
    primal = dual = 0.0
    for _ in range(MOST_STEPS):
        primal, dual, gap = _values(mean, point)
        off = _missing(columns, mean, point, missing)
        if off <= BALANCED and gap <= max(SHARE * abs(1.0 - primal), SMALLEST_GAP):
            break
        if not (_scale(point, scaling) and _factor(columns, scaling)):
            break
        _towards_the_border(scaling, wanted)
        _direct(scaling, missing, wanted, step)
        reach = min(1.0, _longest(scaling.middle, step.s), _longest(scaling.middle, step.z))
        _towards_the_middle(scaling, step, (1.0 - reach) ** 3 * gap / k, wanted)
        _direct(scaling, missing, wanted, step)
        reach = min(_longest(scaling.middle, step.s), _longest(scaling.middle, step.z))
        _move(point, scaling, step, min(1.0, SHORTER * reach))
    return primal, dual


@njit(cache=True)
def _start(point: Point) -> None:
    for i in range(len(point.s)):
        for j in range(3):
            point.s[i, j] = point.z[i, j] = 1.0 if j == 0 else 0.0
    for w in range(WRENCH):
        point.y[w] = 0.0


@njit(cache=True)
def _values(mean: Array, point: Point) -> tuple[float, float, float]:
    """Values of the primal and the dual program, and the sum of s_i.z_i."""
    primal = dual = gap = 0.0
    for i in range(len(point.s)):
        primal += point.s[i, 0]
        for j in range(3):
            gap += point.s[i, j] * point.z[i, j]
    for w in range(WRENCH):
        dual -= mean[w] * point.y[w]
    return primal, dual, gap


@njit(cache=True)
def _missing(columns: Array, mean: Array, point: Point, missing: Array) -> float:
    """What the forces lack to balance, and its largest part."""
    largest = 0.0
    for w in range(WRENCH):
        missing[w] = -mean[w]
        for i in range(len(columns)):
            for j in range(3):
                missing[w] -= columns[i, j, w] * point.s[i, j]
        largest = max(largest, abs(missing[w]))
    return largest


@njit(cache=True)
def _depth(v: Array, i: int) -> float:
    """v_0^2 - |(v_1, v_2)|^2 of the i-th vector; not positive outside the cone."""
    across = math.sqrt(v[i, 1] ** 2 + v[i, 2] ** 2)
    return (v[i, 0] - across) * (v[i, 0] + across) if v[i, 0] > 0.0 else -1.0


@njit(cache=True)
def _scale(point: Point, scaling: Scaling) -> bool:
    """The scaling of a point; False if rounding has put the point outside the cones."""
    s, z, W, inverse = point.s, point.z, scaling.W, scaling.inverse
    for i in range(len(s)):
        deep_s, deep_z = _depth(s, i), _depth(z, i)
        if not (deep_s > 0.0 and deep_z > 0.0):
            return False
        a, b = 1.0 / math.sqrt(deep_s), 1.0 / math.sqrt(deep_z)
        dot = a * b * (s[i, 0] * z[i, 0] + s[i, 1] * z[i, 1] + s[i, 2] * z[i, 2])
        half = 0.5 / math.sqrt(0.5 + 0.5 * dot)
        w0 = half * (a * s[i, 0] + b * z[i, 0])
        w1, w2 = half * (a * s[i, 1] - b * z[i, 1]), half * (a * s[i, 2] - b * z[i, 2])
        size, bend = math.sqrt(b / a), 1.0 / (1.0 + w0)
        W[i, 0, 0], W[i, 1, 1], W[i, 2, 2] = w0, 1.0 + bend * w1 * w1, 1.0 + bend * w2 * w2
        W[i, 0, 1], W[i, 0, 2], W[i, 1, 2] = w1, w2, bend * w1 * w2
        W[i, 1, 0], W[i, 2, 0], W[i, 2, 1] = w1, w2, bend * w1 * w2
        for j in range(3):
            scaling.middle[i, j] = 0.0
            for h in range(3):
                same_side = (j == 0) == (h == 0)
                inverse[i, j, h] = W[i, j, h] / size if same_side else -W[i, j, h] / size
                W[i, j, h] *= size
                scaling.middle[i, j] += W[i, j, h] * z[i, h]
    return True


@njit(cache=True)
def _factor(columns: Array, scaling: Scaling) -> bool:
    """Fill Q and R; False if the wrenches do not span all six dimensions."""
    Q, R, W = scaling.Q, scaling.R, scaling.W
    for w in range(WRENCH):
        for i in range(len(columns)):
            for j in range(3):
                Q[w, i, j] = (
                    W[i, j, 0] * columns[i, 0, w]
                    + W[i, j, 1] * columns[i, 1, w]
                    + W[i, j, 2] * columns[i, 2, w]
                )
        for v in range(w):
            R[v, w] = _taken_off(Q, v, w)
        for v in range(w):
            R[v, w] += _taken_off(Q, v, w)  # what rounding has left
        R[w, w] = math.sqrt(_dot(Q, w, Q[w]))
        if not R[w, w] > 0.0:
            return False
        for i in range(len(columns)):
            for j in range(3):
                Q[w, i, j] /= R[w, w]
    return True


@njit(cache=True)
def _taken_off(Q: Array, v: int, w: int) -> float:
    """Make row w orthogonal to row v; the share of row v that it had."""
    share = _dot(Q, v, Q[w])
    for i in range(Q.shape[1]):
        for j in range(3):
            Q[w, i, j] -= share * Q[v, i, j]
    return share


@njit(cache=True)
def _dot(Q: Array, w: int, x: Array) -> float:
    total = 0.0
    for i in range(len(x)):
        total += Q[w, i, 0] * x[i, 0] + Q[w, i, 1] * x[i, 1] + Q[w, i, 2] * x[i, 2]
    return total


@njit(cache=True)
def _direct(scaling: Scaling, missing: Array, wanted: Array, step: Step) -> None:
    """The step with step.s + step.z as wanted that supplies what is missing."""
    Q, R, y = scaling.Q, scaling.R, step.y
    for w in range(WRENCH):
        y[w] = missing[w]
        for v in range(w):
            y[w] -= R[v, w] * y[v]
        y[w] /= R[w, w]
    for w in range(WRENCH):
        y[w] -= _dot(Q, w, wanted)
    for i in range(len(wanted)):
        for j in range(3):
            step.z[i, j] = 0.0
            for w in range(WRENCH):
                step.z[i, j] -= Q[w, i, j] * y[w]
            step.s[i, j] = wanted[i, j] - step.z[i, j]
    for w in range(WRENCH - 1, -1, -1):
        for v in range(w + 1, WRENCH):
            y[w] -= R[w, v] * y[v]
        y[w] /= R[w, w]


@njit(cache=True)
def _towards_the_border(scaling: Scaling, wanted: Array) -> None:
    for i in range(len(wanted)):
        for j in range(3):
            wanted[i, j] = -scaling.middle[i, j]


@njit(cache=True)
def _towards_the_middle(scaling: Scaling, ahead: Step, product: float, wanted: Array) -> None:
    """Where the products become `product` e, with those of the step ahead taken into account."""
    s, z = ahead.s, ahead.z
    for i in range(len(wanted)):
        m0, m1, m2 = scaling.middle[i, 0], scaling.middle[i, 1], scaling.middle[i, 2]
        d0 = product - m0 * m0 - m1 * m1 - m2 * m2
        d0 -= s[i, 0] * z[i, 0] + s[i, 1] * z[i, 1] + s[i, 2] * z[i, 2]
        d1 = -2.0 * m0 * m1 - s[i, 0] * z[i, 1] - z[i, 0] * s[i, 1]
        d2 = -2.0 * m0 * m2 - s[i, 0] * z[i, 2] - z[i, 0] * s[i, 2]
        x = (m0 * d0 - m1 * d1 - m2 * d2) / _depth(scaling.middle, i)
        wanted[i, 0], wanted[i, 1], wanted[i, 2] = x, (d1 - x * m1) / m0, (d2 - x * m2) / m0


@njit(cache=True)
def _longest(p: Array, d: Array) -> float:
    """How many times the step d can be taken from p, (k, 3) each, before it leaves the cones."""
    longest = np.inf
    for i in range(len(p)):
        a = d[i, 0] ** 2 - d[i, 1] ** 2 - d[i, 2] ** 2
        b = p[i, 0] * d[i, 0] - p[i, 1] * d[i, 1] - p[i, 2] * d[i, 2]
        c = _depth(p, i)
        if d[i, 0] < 0.0:
            longest = min(longest, -p[i, 0] / d[i, 0])
        if b * b < a * c:
            continue
        root = math.sqrt(b * b - a * c)
        q = -b - root if b > 0.0 else root - b  # a x^2 + 2 b x + c vanishes at c / q and q / a
        if q != 0.0 and c / q > 0.0:
            longest = min(longest, c / q)
        if a != 0.0 and q / a > 0.0:
            longest = min(longest, q / a)
    return longest


@njit(cache=True)
def _move(point: Point, scaling: Scaling, step: Step, share: float) -> None:
    W, inverse = scaling.W, scaling.inverse
    for w in range(WRENCH):
        point.y[w] += share * step.y[w]
    for i in range(len(point.s)):
        for j in range(3):
            for h in range(3):
                point.s[i, j] += share * W[i, j, h] * step.s[i, h]
                point.z[i, j] += share * inverse[i, j, h] * step.z[i, h]
