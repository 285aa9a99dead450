"""Steps of an interior-point method in cones of three dimensions, as compiled code.

Each cone is K = {s : s_0 >= |(s_1, s_2)|}. Points s_i and z_i inside their cones are brought, by
symmetric maps of K, to coordinates in which both are the same vector, the middle (Nesterov & Todd).
A step is aimed there, at the border of the cones or at points where the products of s_i and z_i in
the algebra of K are equal multiples of (1, 0, 0), and is taken as far as the cones reach. A
division by zero gives infinity or NaN.

Source: Vandenberghe, "The CVXOPT linear and quadratic cone program solvers" (2010), sections 4-5.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import loop


@loop("numpy")
def _depth_in_cone(v: Array, i: int) -> float:
    """Return v_0^2 - |(v_1, v_2)|^2 of the i-th vector; it is not positive outside the cone."""
    across = math.sqrt(v[i, 1] ** 2 + v[i, 2] ** 2)
    return (v[i, 0] - across) * (v[i, 0] + across) if v[i, 0] > 0.0 else -1.0


@loop("numpy")
def scale_to_middle(pair: Array, W: Array, middle: Array) -> bool:
    """Fill in symmetric maps W_i of K and their inverses: W_i z_i = inverse(W_i) s_i = middle_i.

    Gives false if rounding has put the point outside the cones.
    """
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


@loop("numpy")
def towards_the_border(middle: Array, wanted: Array) -> None:
    """Aim where all products are zero: the scaled parts of the step sum to minus the middle."""
    for i in range(len(wanted)):
        for j in range(3):
            wanted[i, j] = -middle[i, j]


@loop("numpy")
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


@loop("numpy")
def take_step(pair: Array, W: Array, step: Array, share: float) -> None:
    """Move s and z by a share of a scaled step, which the maps W take back to their coordinates."""
    for side in range(2):
        for i in range(pair.shape[1]):
            for j in range(3):
                for h in range(3):
                    pair[side, i, j] += share * W[side, i, j, h] * step[side, i, h]
