"""Searches in compiled code for critical frictions, by one margin program after the other.

Solved: for each set of contacts, balanced forces that need little more than the critical friction,
and a twist that separates at little less (see `critical_friction`).

Method. Every program, at whatever friction, gives both: the most friction that any of its forces
needs is enough, and up to the least friction at which its twist meets a cone there is no closure. A
contact that carries a force inside its cone is at rest under the best twist, of which rounding
leaves something; it is put to rest exactly before the twist is judged by the others. The optimum V
of the program falls through one at the critical friction, and 1 / V is nearly linear there;
Newton's method says where to try next, first on the one side and then on the other.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.margin_kernel import SIGN_SHARE, least_cone_sum
from grasp_core.compiled import loop

FIRST_TRIAL = 0.5
MOST_TRIALS = 30
"""Most programs per set of contacts; seven are usual."""
LEAST_FRICTION, MOST_FRICTION = 1e-6, 1e3
"""Smallest and largest friction that is tried."""
AT_REST = 1e-4
"""Share of the largest z_i below which a contact's z_i counts as zero, and the contact as at rest.
"""
SPANNED = 1e-6
"""Sine of the angle between a row and the span of a basis below which the row adds nothing."""
ABOVE, BELOW = 0.75, 0.15
"""Trials pass the root by these shares of the width asked for, to close in from both sides: above
it by more, as the proof of closure is the harder one; and by the error of Newton's method, the
square of its step over the friction."""
NEAR_ONE = 1e-10
"""An optimum this close to one shows nothing: ten times the gap that is left, for rounding."""


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
        for _ in range(MOST_TRIALS):
            _at_friction(rows, mean, friction, columns)
            primal, dual = least_cone_sum(columns, mean, SIGN_SHARE, pair, y)
            needed = _needed(pair, primal, friction)
            if primal < 1.0 - NEAR_ONE and needed < upper:
                upper = needed
                # V below one: the forces close, at the friction that they need
                _in_space(pair, primal, friction, axes, forces[g])
            if dual > 1.0 + NEAR_ONE and friction > lower:
                lower = friction
                twists[g] = y
            twist[:] = y
            # the twist of any program separates up to some friction once contacts are put to rest
            separates = _separates(rows, pair[1], span, twist)
            if separates > lower:
                lower = separates
                twists[g] = twist
            if upper - lower <= width * lower:
                break
            friction = _next(pair, 0.5 * (primal + dual), friction, lower, upper, width)
            if not LEAST_FRICTION <= friction <= MOST_FRICTION:
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
        twists[g] = y
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


@loop("numpy")
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


@loop("numpy")
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


@loop("numpy")
def _separates(rows: Array, z: Array, span: Array, twist: Array) -> float:
    """Return the friction up to which a twist refutes closure, with slow contacts at rest."""
    still = 0.0
    for i in range(len(rows)):
        still = max(still, AT_REST * z[i, 0])
    spanned = 0
    for i in range(len(rows)):
        for a in range(3):
            if z[i, 0] <= still:
                spanned = _add(rows[i, a], span, spanned)
    for a in range(spanned):
        _take_off(twist, span[a])
    return _least_ratio(rows, z, still, twist) if spanned < WRENCH else 0.0


@loop("numpy")
def _least_ratio(rows: Array, z: Array, still: float, twist: Array) -> float:
    least = MOST_FRICTION
    for i in range(len(rows)):
        if z[i, 0] > still:
            along, across = -_dot(rows[i, 0], twist), 0.0
            for a in range(1, 3):
                across += _dot(rows[i, a], twist) ** 2
            across = math.sqrt(across)
            if along < least * across:
                least = along / across
    return least


@loop("numpy")
def _add(row: Array, span: Array, spanned: int) -> int:
    """Add a row to an orthonormal basis unless the basis spans it already; return the new size."""
    if spanned == WRENCH:
        return spanned
    fresh, before = span[spanned], math.sqrt(_dot(row, row))
    fresh[:] = row
    for _ in range(2):  # once more for what rounding leaves
        for a in range(spanned):
            _take_off(fresh, span[a])
    after = math.sqrt(_dot(fresh, fresh))
    if after <= SPANNED * before:
        return spanned
    for w in range(WRENCH):
        fresh[w] /= after
    return spanned + 1


@loop("numpy")
def _take_off(vector: Array, unit: Array) -> None:
    share = _dot(vector, unit)
    for w in range(WRENCH):
        vector[w] -= share * unit[w]


@loop("numpy")
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for w in range(WRENCH):
        total += a[w] * b[w]
    return total


@loop("numpy")
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
        return lower * (1.0 + ABOVE * width) if lower > friction else 0.0
    root = friction * (1.0 - value * (value - 1.0) / slope) if slope < 0.0 else np.nan
    if lower < root < upper:
        error = (root - friction) ** 2 / root
        if upper - root > root - lower:
            return root + min(ABOVE * width * root + error, 0.5 * (upper - root))
        return root - min(BELOW * width * root + error, 0.5 * (root - lower))
    if upper == np.inf:
        return 2.0 * max(friction, lower)
    return math.sqrt(lower * upper) if lower > 0.0 else 0.1 * upper
