"""Solves margin programs of closure by an interior-point method, and finds critical frictions.

Solved (see `force_closure`): how deep inside their friction cones k contacts can balance each
other. In coordinates (normal, tangent, tangent) with tangential forces in units of the friction,
each cone is K = {s : s_0 >= |(s_1, s_2)|}. Write the forces as s_i + t e with e = (1, 0, 0) and t
their common depth. As their normal parts sum to one, t = (1 - sum s_i0) / k, and what is left is

    minimise  sum s_i0  subject to  sum A_i s_i = -m,  s_i in K,                            (1)

the columns of A_i being the wrenches of contact i's three axes, with the mean m of the wrenches of
all normals taken off the first. Its dual

    maximise  -m.y      subject to  z_i = e - A_i'y in K                                    (2)

is over twists y. The optimum V is below one for force closure and above one if some y separates:
z_i in K means that the support of cone i in direction y is at most (1 + m.y) / k.

Method. As sum A_i e = 0, the points s_i = e, y = 0, z_i = e are in the middle of the cones, and the
dual one is exact. From there Newton's method follows the points where the products of s_i and z_i
in the algebra of K are equal multiples of e, with Mehrotra's predictor and corrector. Symmetric
maps of K take s_i and z_i to coordinates in which both are the same vector, the middle (Nesterov
and Todd). A step is aimed there, at the border of the cones or at equal products, and is taken as
far as the cones reach. Each step is found by reflections: the squares of a Cholesky factorisation
would leave an imbalance where two contacts carry nearly everything. A division by zero gives
infinity or NaN, with which the search ends.

*Critical frictions* of many sets of contacts are bracketed by one program after the other: balanced
forces that need little more, and a twist that separates at little less (see `critical_friction`).
Every program, at whatever friction, gives both: the most friction that any of its forces needs is
enough, and up to the least friction at which its twist meets a cone there is no closure. A contact
that carries a force inside its cone is at rest under the best twist, of which rounding leaves
something; it is put to rest exactly before the twist is judged by the others. The optimum V of the
program falls through one at the critical friction, and 1 / V is nearly linear there; Newton's
method says where to try next, first on the one side and then on the other.

Source: Vandenberghe, "The CVXOPT linear and quadratic cone program solvers" (2010), sections 4-7.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.arrays_kernel import copy
from grasp_core.closure.contacts import WRENCH
from grasp_core.compiled import loop

NEWTON_STEPS_MOST = 40
"""Most Newton steps; ten are usual."""
SIGN_SHARE = 0.1
"""Gap, as a share of the distance of V from one, that leaves no doubt on which side of one V is."""
ROUNDING_GAP = 1e-11
"""Gap below which only rounding is left, in programs of order one."""
MOST_IMBALANCE = 1e-10
"""Largest accepted imbalance of the last point; 1e-15 is usual."""
BORDER_SHARE = 0.99
"""Share of the distance to the border of the cones that a step may use."""
FIRST_TRIAL = 0.5
MOST_PROGRAMS = 30
"""Most programs per set of contacts; seven are usual."""
LEAST_TRIED, MOST_TRIED = 1e-6, 1e3
RESTING_SHARE = 1e-4
"""Share of the largest z_i below which a contact's z_i counts as zero, and the contact as at rest.
"""
SPANNED = 1e-6
"""Sine of the angle between a row and the span of a basis below which the row adds nothing."""
PASSED_ABOVE, PASSED_BELOW = 0.75, 0.15
"""Trials pass the root by these shares of the width asked for, to close in from both sides: above
it by more, as the proof of closure is the harder one; and by the error of Newton's method, the
square of its step over the friction."""
NEAR_ONE = 1e-10
"""An optimum this close to one shows nothing: ten times the gap that is left, for rounding."""


@loop("numpy")
def _depth_in_cone(v: Array, i: int) -> float:
    """Return v_0^2 - |(v_1, v_2)|^2 of the i-th vector; it is not positive outside the cone."""
    across = math.sqrt(v[i, 1] ** 2 + v[i, 2] ** 2)
    return (v[i, 0] - across) * (v[i, 0] + across) if v[i, 0] > 0.0 else -1.0


@loop("numpy", once=True)
def scale_to_middle(pair: Array, W: Array, middle: Array) -> bool:
    """Fill in W_i and their inverses, W_i z_i = inverse(W_i) s_i; False outside the cones."""
    s, z = pair[0], pair[1]
    for i in range(len(s)):
        deep_s, deep_z = _depth_in_cone(s, i), _depth_in_cone(z, i)
        if not (deep_s > 0.0 and deep_z > 0.0):
            return False
        a, b = 1.0 / math.sqrt(deep_s), 1.0 / math.sqrt(deep_z)
        dot = a * b * (s[i, 0] * z[i, 0] + s[i, 1] * z[i, 1] + s[i, 2] * z[i, 2])
        half = 0.5 / math.sqrt(0.5 + 0.5 * dot)
        w0 = half * (a * s[i, 0] + b * z[i, 0])
        w1, w2 = half * (a * s[i, 1] - b * z[i, 1]), half * (a * s[i, 2] - b * z[i, 2])
        bend, size = 1.0 / (1.0 + w0), math.sqrt(b / a)
        for side in range(2):
            turned = size if side == 0 else -1.0 / size
            size_here = abs(turned)
            W[side, i, 0, 0] = size_here * w0
            W[side, i, 0, 1] = W[side, i, 1, 0] = turned * w1
            W[side, i, 0, 2] = W[side, i, 2, 0] = turned * w2
            W[side, i, 1, 1] = size_here * (1.0 + bend * w1 * w1)
            W[side, i, 2, 2] = size_here * (1.0 + bend * w2 * w2)
            W[side, i, 1, 2] = W[side, i, 2, 1] = size_here * bend * w1 * w2
        for j in range(3):
            middle[i, j] = (
                W[0, i, j, 0] * z[i, 0] + W[0, i, j, 1] * z[i, 1] + W[0, i, j, 2] * z[i, 2]
            )
    return True


@loop("numpy", once=True)
def towards_the_middle(middle: Array, ahead: Array, product: float, wanted: Array) -> None:
    """Aim where the products become `product` e, given those of the step ahead."""
    s, z = ahead[0], ahead[1]
    for i in range(len(wanted)):
        m0, m1, m2 = middle[i, 0], middle[i, 1], middle[i, 2]
        d0 = product - m0 * m0 - m1 * m1 - m2 * m2
        d0 -= s[i, 0] * z[i, 0] + s[i, 1] * z[i, 1] + s[i, 2] * z[i, 2]
        d1 = -2.0 * m0 * m1 - s[i, 0] * z[i, 1] - z[i, 0] * s[i, 1]
        d2 = -2.0 * m0 * m2 - s[i, 0] * z[i, 2] - z[i, 0] * s[i, 2]
        x = (m0 * d0 - m1 * d1 - m2 * d2) / _depth_in_cone(middle, i)
        wanted[i, 0], wanted[i, 1], wanted[i, 2] = x, (d1 - x * m1) / m0, (d2 - x * m2) / m0


@loop("numpy")
def longest_step(middle: Array, step: Array) -> float:
    """Return how many times a step can be taken before s or z leaves the cones."""
    longest = np.inf
    for side in range(2):
        p, d = middle, step[side]
        for i in range(len(p)):
            a = d[i, 0] ** 2 - d[i, 1] ** 2 - d[i, 2] ** 2
            b = p[i, 0] * d[i, 0] - p[i, 1] * d[i, 1] - p[i, 2] * d[i, 2]
            c = _depth_in_cone(p, i)
            if d[i, 0] < 0.0:
                longest = min(longest, -p[i, 0] / d[i, 0])
            if b * b < a * c:
                continue
            root = math.sqrt(b * b - a * c)
            q = -b - root if b > 0.0 else root - b  # a x^2 + 2 b x + c vanishes at c / q and q / a
            if c / q > 0.0:
                longest = min(longest, c / q)
            if q / a > 0.0:
                longest = min(longest, q / a)
    return longest


@loop("numpy", once=True)
def take_step(pair: Array, W: Array, step: Array, share: float) -> None:
    """Move s and z by a share of a scaled step, which the maps W take back to their coordinates."""
    for side in range(2):
        for i in range(pair.shape[1]):
            for j in range(3):
                for h in range(3):
                    pair[side, i, j] += share * W[side, i, j, h] * step[side, i, h]


@loop("numpy")
def least_cone_sum(
    columns: Array, mean: Array, share: float, pair: Array, y: Array
) -> tuple[float, float]:
    """Solve the program (1) and its dual (2), up to a share of the distance of their values from 1.

    The columns are (k, 3, 6); s and z are filled in as a pair, (2, k, 3), and y. Gives both values:
    the optimum lies between them where the forces balance.
    """
    k = len(columns)
    W, middle, V = np.empty((2, k, 3, 3)), np.empty((k, 3)), np.empty((WRENCH, k, 3))
    R, missing, wanted = np.empty((WRENCH, WRENCH)), np.empty(WRENCH), np.empty((k, 3))
    step, turn = np.empty((2, k, 3)), np.empty(WRENCH)
    pair[:] = 0.0
    pair[:, :, 0] = 1.0
    y[:] = 0.0
    primal = dual = 0.0
    for _ in range(NEWTON_STEPS_MOST):
        primal, dual, gap = _values(mean, pair, y)
        off = _missing(columns, mean, pair, missing)
        if off <= MOST_IMBALANCE and gap <= max(share * abs(1.0 - primal), ROUNDING_GAP):
            break
        if not (scale_to_middle(pair, W, middle) and _factor(columns, W, V, R)):
            break
        # Mehrotra's predictor aims at the border, where all products are zero; how far it gets says
        # how far to aim at the middle
        for i in range(k):
            for j in range(3):
                wanted[i, j] = -middle[i, j]
        _direct(V, R, missing, wanted, step, turn)
        reach = min(1.0, longest_step(middle, step))
        towards_the_middle(middle, step, (1.0 - reach) ** 3 * gap / k, wanted)
        _direct(V, R, missing, wanted, step, turn)
        reach = min(1.0, BORDER_SHARE * longest_step(middle, step))
        take_step(pair, W, step, reach)
        for w in range(WRENCH):
            y[w] += reach * turn[w]
    return primal, dual


@loop("numpy", once=True)
def _values(mean: Array, pair: Array, y: Array) -> tuple[float, float, float]:
    primal = dual = gap = 0.0
    for i in range(pair.shape[1]):
        primal += pair[0, i, 0]
        for j in range(3):
            gap += pair[0, i, j] * pair[1, i, j]
    for w in range(WRENCH):
        dual -= mean[w] * y[w]
    return primal, dual, gap


@loop("numpy", once=True)
def _missing(columns: Array, mean: Array, pair: Array, missing: Array) -> float:
    """Fill in the wrench that the forces lack to balance; return its largest component."""
    for w in range(WRENCH):
        missing[w] = -mean[w]
    for i in range(len(columns)):
        for j in range(3):
            for w in range(WRENCH):
                missing[w] -= columns[i, j, w] * pair[0, i, j]
    largest = 0.0
    for w in range(WRENCH):
        largest = max(largest, abs(missing[w]))
    return largest


@loop("numpy", once=True)
def _factor(columns: Array, W: Array, V: Array, R: Array) -> bool:
    """Find reflections 1 - v v' that make columns A_i W_i triangular; False if they do not span."""
    for w in range(WRENCH):
        for i in range(len(columns)):
            for j in range(3):
                V[w, i, j] = (
                    W[0, i, j, 0] * columns[i, 0, w]
                    + W[0, i, j, 1] * columns[i, 1, w]
                    + W[0, i, j, 2] * columns[i, 2, w]
                )
        for v in range(w):
            _reflect(V, v, V, w)
            R[v, w] = V[w, v // 3, v % 3]
            V[w, v // 3, v % 3] = 0.0
        rest = _dot(V, w, V, w)
        if not rest > 0.0:
            return False
        first = V[w, w // 3, w % 3]
        R[w, w] = -math.copysign(math.sqrt(rest), first)
        V[w, w // 3, w % 3] = first - R[w, w]
        size = 1.0 / math.sqrt(R[w, w] * (R[w, w] - first))
        for i in range(len(columns)):
            for j in range(3):
                V[w, i, j] *= size
    return True


@loop("numpy")
def _reflect(V: Array, v: int, X: Array, x: int) -> None:
    share = _dot(V, v, X, x)
    for i in range(V.shape[1]):
        for j in range(3):
            X[x, i, j] -= share * V[v, i, j]


@loop("numpy")
def _dot(V: Array, v: int, X: Array, x: int) -> float:
    total = 0.0
    for i in range(V.shape[1]):
        total += V[v, i, 0] * X[x, i, 0] + V[v, i, 1] * X[x, i, 1] + V[v, i, 2] * X[x, i, 2]
    return total


@loop("numpy")
def _direct(V: Array, R: Array, missing: Array, wanted: Array, step: Array, turn: Array) -> None:
    """Compute a Newton step that supplies the missing wrench: for s and z, scaled, and for y."""
    for i in range(len(wanted)):
        for j in range(3):
            step[0, i, j], step[1, i, j] = wanted[i, j], 0.0
    for v in range(WRENCH):
        _reflect(V, v, step, 0)
    for w in range(WRENCH):  # R'x = missing, by forward substitution
        turn[w] = missing[w]
        for v in range(w):
            turn[w] -= R[v, w] * turn[v]
        turn[w] /= R[w, w]
    for w in range(WRENCH):
        turn[w] -= step[0, w // 3, w % 3]
        step[1, w // 3, w % 3] = -turn[w]
    for v in range(WRENCH - 1, -1, -1):
        _reflect(V, v, step, 1)
    for i in range(len(wanted)):
        for j in range(3):
            step[0, i, j] = wanted[i, j] - step[1, i, j]
    for w in range(WRENCH - 1, -1, -1):  # R x = turn, by back substitution
        for v in range(w + 1, WRENCH):
            turn[w] -= R[w, v] * turn[v]
        turn[w] /= R[w, w]


@loop("numpy")
def search(
    arms: Array, normals: Array, width: float, forces: Array, twists: Array, bounds: Array
) -> None:
    """Bracket the critical friction of each of many sets of contacts, with bounds (g, 2)."""
    k = arms.shape[1]
    axes, rows, columns = np.empty((k, 3, 3)), np.empty((k, 3, WRENCH)), np.empty((k, 3, WRENCH))
    mean, twist, span = np.empty(WRENCH), np.empty(WRENCH), np.empty((WRENCH, WRENCH))
    pair, y = np.empty((2, k, 3)), np.empty(WRENCH)
    for g in range(len(arms)):
        _set_up(arms[g], normals[g], axes, rows, mean)
        lower, upper, friction = 0.0, np.inf, FIRST_TRIAL
        for _ in range(MOST_PROGRAMS):
            _at_friction(rows, mean, friction, columns)
            primal, dual = least_cone_sum(columns, mean, SIGN_SHARE, pair, y)
            needed = _needed(pair, primal, friction)
            if primal < 1.0 - NEAR_ONE and needed < upper:
                upper = needed
                # V below one: the forces close, at the friction that they need
                _in_space(pair, primal, friction, axes, forces[g])
            if dual > 1.0 + NEAR_ONE and friction > lower:
                lower = friction
                copy(y, twists[g])
            copy(y, twist)
            # the twist of any program separates up to some friction once contacts are put to rest
            separates = _separates(rows, pair[1], span, twist)
            if separates > lower:
                lower = separates
                copy(twist, twists[g])
            if upper - lower <= width * lower:
                break
            friction = _next(pair, 0.5 * (primal + dual), friction, lower, upper, width)
            if not LEAST_TRIED <= friction <= MOST_TRIED:
                break
        bounds[g, 0], bounds[g, 1] = lower, upper


@loop("numpy")
def deepest(
    contacts: tuple[Array, Array, Array], share: float, forces: Array, twists: Array, values: Array
) -> None:
    """Balance many sets (arms, normals, frictions) with forces as deep in their cones as can be."""
    arms, normals, frictions = contacts
    k = arms.shape[1]
    axes, rows, columns = np.empty((k, 3, 3)), np.empty((k, 3, WRENCH)), np.empty((k, 3, WRENCH))
    mean, pair, y = np.empty(WRENCH), np.empty((2, k, 3)), np.empty(WRENCH)
    for g in range(len(arms)):
        _set_up(arms[g], normals[g], axes, rows, mean)
        _at_friction(rows, mean, frictions[g], columns)
        primal, dual = least_cone_sum(columns, mean, share, pair, y)
        values[g, 0], values[g, 1] = primal, dual
        copy(y, twists[g])
        _in_space(pair, primal, frictions[g], axes, forces[g])


@loop("numpy")
def _set_up(arms: Array, normals: Array, axes: Array, rows: Array, mean: Array) -> None:
    """Fill in the contacts' axes, their wrenches, (k, 3, 6), and the normals' mean wrench."""
    mean[:] = 0.0
    for i in range(len(arms)):
        _orthonormal(normals[i], axes[i])
        for a in range(3):
            for j in range(3):
                u, v = (j + 1) % 3, (j + 2) % 3
                rows[i, a, j] = axes[i, a, j]
                rows[i, a, 3 + j] = arms[i, u] * axes[i, a, v] - arms[i, v] * axes[i, a, u]
        for w in range(WRENCH):
            mean[w] += rows[i, 0, w] / len(arms)


@loop("numpy", once=True)
def _orthonormal(normal: Array, axes: Array) -> None:
    far = 0
    for j in range(3):
        axes[0, j] = normal[j]
        far = j if abs(normal[j]) < abs(normal[far]) else far
    across = math.sqrt(1.0 - normal[far] ** 2)
    for j in range(3):
        axes[1, j] = ((1.0 if j == far else 0.0) - normal[far] * normal[j]) / across
    for j in range(3):
        u, v = (j + 1) % 3, (j + 2) % 3
        axes[2, j] = axes[0, u] * axes[1, v] - axes[0, v] * axes[1, u]


@loop("numpy")
def _at_friction(rows: Array, mean: Array, friction: float, columns: Array) -> None:
    for i in range(len(rows)):
        for w in range(WRENCH):
            columns[i, 0, w] = rows[i, 0, w] - mean[w]
            columns[i, 1, w], columns[i, 2, w] = friction * rows[i, 1, w], friction * rows[i, 2, w]


@loop("numpy", once=True)
def _needed(pair: Array, primal: float, friction: float) -> float:
    """Return the largest friction that any of the forces needs; infinite if a force pulls."""
    share, needed = (1.0 - primal) / pair.shape[1], 0.0
    for i in range(pair.shape[1]):
        along = pair[0, i, 0] + share
        if not along > 0.0:
            return np.inf
        needed = max(needed, friction * math.hypot(pair[0, i, 1], pair[0, i, 2]) / along)
    return needed


@loop("numpy")
def _in_space(pair: Array, primal: float, friction: float, axes: Array, forces: Array) -> None:
    share = (1.0 - primal) / len(axes)
    for i in range(len(axes)):
        for j in range(3):
            forces[i, j] = (pair[0, i, 0] + share) * axes[i, 0, j] + friction * (
                pair[0, i, 1] * axes[i, 1, j] + pair[0, i, 2] * axes[i, 2, j]
            )


@loop("numpy", once=True)
def _separates(rows: Array, z: Array, span: Array, twist: Array) -> float:
    """Return the friction up to which a twist refutes closure, with slow contacts at rest."""
    still = 0.0
    for i in range(len(rows)):
        still = max(still, RESTING_SHARE * z[i, 0])
    spanned = 0
    for i in range(len(rows)):
        for a in range(3):
            if z[i, 0] <= still:
                spanned = _add(rows[i, a], span, spanned)
    for a in range(spanned):
        _take_off(twist, span[a])
    return _least_ratio(rows, z, still, twist) if spanned < WRENCH else 0.0


@loop("numpy", once=True)
def _least_ratio(rows: Array, z: Array, still: float, twist: Array) -> float:
    least = MOST_TRIED
    for i in range(len(rows)):
        if z[i, 0] > still:
            along, across = -_inner(rows[i, 0], twist), 0.0
            for a in range(1, 3):
                across += _inner(rows[i, a], twist) ** 2
            across = math.sqrt(across)
            if along < least * across:
                least = along / across
    return least


@loop("numpy", once=True)
def _add(row: Array, span: Array, spanned: int) -> int:
    """Add a row to an orthonormal basis unless the basis spans it already; return the new size."""
    if spanned == WRENCH:
        return spanned
    fresh, before = span[spanned], math.sqrt(_inner(row, row))
    copy(row, fresh)
    for _ in range(2):  # once more for what rounding leaves
        for a in range(spanned):
            _take_off(fresh, span[a])
    after = math.sqrt(_inner(fresh, fresh))
    if after <= SPANNED * before:
        return spanned
    for w in range(WRENCH):
        fresh[w] /= after
    return spanned + 1


@loop("numpy")
def _take_off(vector: Array, unit: Array) -> None:
    share = _inner(vector, unit)
    for w in range(WRENCH):
        vector[w] -= share * unit[w]


@loop("numpy")
def _inner(a: Array, b: Array) -> float:
    total = 0.0
    for w in range(WRENCH):
        total += a[w] * b[w]
    return total


@loop("numpy", once=True)
def _next(
    pair: Array, value: float, friction: float, lower: float, upper: float, width: float
) -> float:
    """Return the friction to try next: where Newton's method has 1 / V = 1, passed a little.

    Friction enters the program through the tangential columns of A_i only, and y is their
    multiplier: the slope of V over its logarithm is the sum of s_i1 z_i1 and s_i2 z_i2.
    """
    slope = 0.0
    for i in range(pair.shape[1]):
        slope += pair[0, i, 1] * pair[1, i, 1] + pair[0, i, 2] * pair[1, i, 2]
    if abs(value - 1.0) <= NEAR_ONE:
        # 1 / V is linear: d(1/V) = -dV / V^2, over the logarithm of the friction
        return lower * (1.0 + PASSED_ABOVE * width) if lower > friction else 0.0
    root = friction * (1.0 - value * (value - 1.0) / slope) if slope < 0.0 else np.nan
    if lower < root < upper:
        error = (root - friction) ** 2 / root
        if upper - root > root - lower:
            return root + min(PASSED_ABOVE * width * root + error, 0.5 * (upper - root))
        return root - min(PASSED_BELOW * width * root + error, 0.5 * (root - lower))
    if upper == np.inf:
        return 2.0 * max(friction, lower)
    return math.sqrt(lower * upper) if lower > 0.0 else 0.1 * upper
