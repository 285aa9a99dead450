"""Finds the largest resisted multiples of many wrenches, one after the other (see `wrench_body`).

Solved by following the central path of program (1): in units of f_max, with d = -w and the cones
s0^2 + s1^2 < (mu n)^2, 0 < n < 1 of each contact (n, s0, s1), Newton's method finds

    maximise  t + m sum_i [log((mu n)^2 - s0^2 - s1^2) + log(1 - n)]  subject to  G f = t d

for ever smaller m. The multipliers u of the equations give the facet y = -u with y.d = 1.
The largest t is at most 3 k m away, by the number of logarithms, those of cones counting twice.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrenches import WRENCH
from grasp_core.compiled import loop

MOST_STEPS = 120
"""Number of Newton steps after which a wrench is given up."""
SMALLER = 0.12
"""Factor between one m and the next."""
SMALLEST = 1e-9
"""The last m: it is a hundredth of the distance that the caller allows."""
INSIDE = 0.95
"""Share of the way to the border that a step may take."""
NEAR = 0.3
"""Square of Newton's decrement below which m is made smaller."""


class Contacts(NamedTuple):
    """The contacts of a grasp."""

    G: Array
    """Matrix from forces in contact frames, normal part first, to wrenches, (6, 3k)."""
    friction: Array
    """Coulomb coefficients, (k,), above zero."""
    start: Array
    """Forces strictly inside the cones with G f = 0 and normal parts below 1, (3k,)."""


class Newton(NamedTuple):
    """The inverse Hessian, the gradient, the condensed system and the step of Newton's method."""

    H: Array
    g: Array
    M: Array
    a: Array
    """Right-hand side, and then the multipliers u, (6,)."""
    b: Array
    step: Array


@loop("numpy")
def limits(contacts: Contacts, loads: Array, found: Array, forces: Array, facets: Array) -> None:
    """Find the largest multiple t with G f = -t w for each wrench w, as far as rounding allows.

    Takes `loads`, `facets` (n, 6); `found` (n,); `forces` (n, 3k).
    """
    count = len(contacts.friction)
    newton = Newton(
        np.empty((count, 3, 3)), np.empty(3 * count), np.empty((WRENCH, WRENCH)),
        np.empty(WRENCH), np.empty(WRENCH), np.empty(3 * count),
    )  # fmt: skip
    for w in range(len(loads)):
        forces[w] = contacts.start
        found[w] = _followed(contacts, newton, -loads[w], forces[w], facets[w])


@loop("numpy")
def _followed(contacts: Contacts, newton: Newton, d: Array, f: Array, facet: Array) -> float:
    """Follow the central path from forces f, which change, and fill in the facet; return t."""
    t, m = 0.0, 1.0
    for _ in range(MOST_STEPS):
        _inverse(f, contacts.friction, m, newton.H, newton.g)
        _condensed(contacts.G, newton, f, t, d)
        newton.b[:] = d
        if not _factored(newton.M):
            break
        _back(newton.M, newton.a)
        _back(newton.M, newton.b)
        longer = (1.0 + _product(d, newton.a)) / _product(d, newton.b)
        for row in range(WRENCH):
            newton.a[row] -= longer * newton.b[row]  # u
            facet[row] = -newton.a[row]
        square = _step(contacts.G, newton) / m
        if not square >= 0.0:  # no digit is left
            break
        share = min(1.0, INSIDE * _room(f, newton.step, contacts.friction))
        for each in range(len(f)):
            f[each] += share * newton.step[each]
        t += share * longer
        if share == 1.0 and square < NEAR:
            if m <= SMALLEST:
                break
            m = max(m * SMALLER, SMALLEST)
    return t


@loop("numpy")
def _product(one: Array, two: Array) -> float:
    value = 0.0
    for each in range(len(one)):
        value += one[each] * two[each]
    return value


@loop("numpy")
def _inverse(f: Array, friction: Array, m: float, H: Array, g: Array) -> None:
    """Fill in the inverse Hessians of the logarithms, (k, 3, 3), and their gradient, (3k,).

    With x = (n, s0, s1), J = diag(mu^2, -1, -1) and q = x'Jx, the inverse Hessian of -log q is
    x x' - (q / 2) J^-1. The logarithm of 1 - n adds a matrix of rank one to the Hessian, which
    Sherman and Morrison's formula takes into its inverse. Cofactors would lose all digits.
    """
    for i in range(len(friction)):
        n, s0, s1 = f[3 * i], f[3 * i + 1], f[3 * i + 2]
        mu2 = friction[i] * friction[i]
        across = s0 * s0 + s1 * s1
        q, rest = mu2 * n * n - across, 1.0 - n
        g[3 * i] = m * (2.0 * mu2 * n / q - 1.0 / rest)
        g[3 * i + 1], g[3 * i + 2] = -m * 2.0 * s0 / q, -m * 2.0 * s1 / q
        top = (mu2 * n * n + across) / (2.0 * mu2)
        cap = rest * rest
        kept, left = cap / (cap + top), (cap - q / (2.0 * mu2)) / (cap + top)
        H[i, 0, 0] = top * kept / m
        H[i, 0, 1] = H[i, 1, 0] = n * s0 * kept / m
        H[i, 0, 2] = H[i, 2, 0] = n * s1 * kept / m
        H[i, 1, 1] = (s0 * s0 * left + 0.5 * q) / m
        H[i, 1, 2] = H[i, 2, 1] = s0 * s1 * left / m
        H[i, 2, 2] = (s1 * s1 * left + 0.5 * q) / m


@loop("numpy")
def _condensed(G: Array, newton: Newton, f: Array, t: float, d: Array) -> None:
    """Fill in M = G H G' and a = G H g + G f - t d, with H the inverse Hessian."""
    M, a, H = newton.M, newton.a, newton.H
    for row in range(WRENCH):
        a[row] = -t * d[row]
        for other in range(WRENCH):
            M[row, other] = 0.0
    for i in range(len(H)):
        for row in range(WRENCH):
            for part in range(3):
                place, turned = 3 * i + part, 0.0
                for other in range(3):
                    turned += G[row, 3 * i + other] * H[i, other, part]
                a[row] += turned * newton.g[place] + G[row, place] * f[place]
                for other in range(row + 1):
                    M[row, other] += turned * G[other, place]


@loop("numpy")
def _factored(M: Array) -> bool:
    """Replace the lower half of M by Cholesky's factor; return whether M is positive definite."""
    for row in range(WRENCH):
        for column in range(row + 1):
            value = M[row, column]
            for each in range(column):
                value -= M[row, each] * M[column, each]
            if row != column:
                M[row, column] = value / M[column, column]
            elif value > 0.0:
                M[row, row] = np.sqrt(value)
            else:
                return False
    return True


@loop("numpy")
def _back(L: Array, x: Array) -> None:
    """Solve L L' y = x for y, which replaces x."""
    for row in range(WRENCH):
        for each in range(row):
            x[row] -= L[row, each] * x[each]
        x[row] /= L[row, row]
    for row in range(WRENCH - 1, -1, -1):
        for each in range(row + 1, WRENCH):
            x[row] -= L[each, row] * x[each]
        x[row] /= L[row, row]


@loop("numpy")
def _step(G: Array, newton: Newton) -> float:
    """Fill in Newton's step H (g - G' u), and return its product with g - G' u."""
    H, square = newton.H, 0.0
    slope = np.empty(3)
    for i in range(len(H)):
        for part in range(3):
            slope[part] = newton.g[3 * i + part]
            for row in range(WRENCH):
                slope[part] -= G[row, 3 * i + part] * newton.a[row]
        for part in range(3):
            value = 0.0
            for other in range(3):
                value += H[i, part, other] * slope[other]
            newton.step[3 * i + part] = value
            square += value * slope[part]
    return square


@loop("numpy")
def _room(f: Array, step: Array, friction: Array) -> float:
    """Find how many steps lead to the border of the cones or of the largest normal forces."""
    room = 1e9
    for i in range(len(friction)):
        n, dn = f[3 * i], step[3 * i]
        if dn > 0.0:
            room = min(room, (1.0 - n) / dn)
        if dn < 0.0:
            room = min(room, -n / dn)
        mu2 = friction[i] * friction[i]
        s0, s1, d0, d1 = f[3 * i + 1], f[3 * i + 2], step[3 * i + 1], step[3 * i + 2]
        # the smaller root of the cone's quadratic c + 2 b x + a x^2 above zero
        a = mu2 * dn * dn - d0 * d0 - d1 * d1
        b = mu2 * n * dn - s0 * d0 - s1 * d1
        c = mu2 * n * n - s0 * s0 - s1 * s1
        inner = b * b - a * c
        if inner >= 0.0 and (a < 0.0 or b < 0.0):
            room = min(room, c / (np.sqrt(inner) - b)) if np.sqrt(inner) > b else room
    return room
