"""Bounds on how large multiples of many wrenches contacts resist, computed side by side.

The program (1) of `wrench_limits`, without motors and in units of the largest normal force, is
solved by a barrier method. Local forces f of a contact, with all but the normal part n in units of
the friction, are inside their bounds if

    q = f'J f > 0  and  0 < n < 1,  J = diag(1, -1, ..).                                    (1)

Newton's method maximises t lambda + sum log q + log(1 - n) under G f + lambda w = 0, for a t that
rises. Its matrix has one block for each contact, with the inverse

    f f' - (q / 2) J - c p p',  p = n f - (q / 2) e,  c = 1 / ((1 - n)^2 + p_n),            (2)

e = (1, 0, ..), which takes the gradient to c p - f. So a step solves six equations for multipliers
y of the balance, with y.w = t. The support of -y over y.w bounds lambda from above, also in the
limit of a large t. Where a step leaves (1), forces balance lambda w but for some wrench r, and the
set of wrenches holds a ball of some radius s around zero, so that

    lambda / (1 + |r| / s)                                                                  (3)

is a lower bound. If the first forces are d inside (1), s is d times the least singular value of G.
Both bounds hold after every step, and more steps bring them together.

Source: Boyd & Vandenberghe, "Convex Optimization" (2004), chapter 11.
"""

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.quality.allowed_forces import SUM_ROUNDING

MOST_STEPS = 60
"""Most Newton steps; six are usual, and twenty near the critical friction."""
BORDER_SHARE = 0.9
"""Share of the way to the border of (1) that a step may go."""
BARRIERS = 3.0
"""Parameter of each contact's barrier: a central point is at most this over t below the limit."""


@np.errstate(all="ignore")  # what is no number bounds nothing
def limit_bounds(wrenches: WrenchSet, balanced: Array, loads: Array, gap: float) -> Array:
    """Bound the largest multiple of each load (n, 6) that contacts resist, (n, 2).

    Loads are about the centre and in the units of `wrenches`, a `linf` set; `balanced` are local
    forces (k, w) inside the cones that balance each other. Bounds are up to the gap apart, a share
    of the lower one, or more where there is hardly a margin of closure.
    """
    k, width = balanced.shape
    units = np.column_stack([np.ones(k), *[wrenches.friction] * (width - 1)])
    G = wrenches.G * units.ravel()
    each = G.reshape(6, k, width)
    blocks = np.einsum("ika,jkb->kabij", each, each).reshape(-1, 36)
    start = np.divide(balanced, units, out=np.zeros_like(units), where=units > 0.0)
    start /= 2.0 * start[:, 0].max()
    depth = (start[:, 0] - np.linalg.norm(start[:, 1:], axis=1)).min() / np.sqrt(2.0)
    rounding = SUM_ROUNDING * np.abs(G).sum()
    around = np.linalg.norm(G @ start.ravel()) + rounding
    ball = max(depth * np.linalg.svd(G)[1][-1] - around, 0.0)
    forces, multiples = np.tile(start, (len(loads), 1, 1)), np.zeros(len(loads))
    bounds, left = np.tile([0.0, np.inf], (len(loads), 1)), np.arange(len(loads))
    for _ in range(MOST_STEPS):
        if not left.size:
            break
        f, w, multiple, (lower, upper) = forces[left], loads[left], multiples[left], bounds[left].T
        inverse, free = _newton(f)
        matrix = (inverse.reshape(len(left), -1) @ blocks).reshape(-1, 6, 6)
        sums = np.stack([_unbalanced(G, f + free, w, multiple), w], axis=2)
        try:
            solved = np.asarray(np.linalg.solve(matrix, sums), dtype=np.float64)
        except np.linalg.LinAlgError:  # of one load
            left = left[np.linalg.det(matrix) != 0.0]
            continue
        resting, along = solved[..., 0], solved[..., 1]
        upper = np.fmin(upper, _upper(wrenches, along, w))
        t = BARRIERS * k / np.maximum(upper - lower, gap * lower)
        more = (t - _power(resting, w)) / _power(along, w)
        y = resting + more[:, None] * along
        step = free - np.einsum("nkab,nkb->nka", inverse, (y @ G).reshape(f.shape))
        reach = _reach(f, step)
        last = multiple + reach * more
        missed = _unbalanced(G, f + reach[:, None, None] * step, w, last)
        off = np.linalg.norm(missed, axis=1) + rounding
        lower = np.fmax(lower, last / (1.0 + off / ball))  # (3)
        upper = np.fmin(upper, _upper(wrenches, y, w))
        taken = np.minimum(1.0, BORDER_SHARE * reach)
        forces[left] += taken[:, None, None] * step
        multiples[left] += taken * more
        bounds[left] = np.column_stack([lower, upper])
        left = left[~(upper - lower <= gap * lower)]
    return bounds


def _newton(f: Array) -> tuple[Array, Array]:
    """Return the inverse blocks (2) at forces (n, k, w), and the steps if nothing were balanced."""
    normal = f[..., 0]
    half = 0.5 * _product(f, f)
    p = normal[..., None] * f
    p[..., 0] -= half
    c = 1.0 / ((1.0 - normal) ** 2 + p[..., 0])
    J = np.diag([1.0] + [-1.0] * (f.shape[2] - 1))
    scaled = c[..., None] * p
    inverse = f[..., None] * f[..., None, :] - half[..., None, None] * J
    return inverse - scaled[..., None] * p[..., None, :], f - scaled


def _product(one: Array, two: Array) -> Array:
    """Multiply one'J two of forces (n, k, w), (n, k)."""
    return 2.0 * one[..., 0] * two[..., 0] - np.einsum("nka,nka->nk", one, two)


def _unbalanced(G: Array, f: Array, loads: Array, multiples: Array) -> Array:
    return f.reshape(len(f), -1) @ G.T + multiples[:, None] * loads


def _power(twists: Array, loads: Array) -> Array:
    return np.einsum("ni,ni->n", twists, loads)


def _upper(wrenches: WrenchSet, twists: Array, loads: Array) -> Array:
    power = _power(twists, loads)
    return np.where(power > 0.0, wrenches.supports(-twists) / power, np.inf)


def _reach(f: Array, step: Array) -> Array:
    """Find the multiples of steps (n, k, w) after which the first force leaves (1), (n,)."""
    q, mixed, square = _product(f, f), _product(f, step), _product(step, step)
    # the least positive root of q + 2 mixed x + square x^2, if any
    ahead = np.sqrt(mixed**2 - square * q) - mixed
    cones = np.where(ahead > 0.0, q / ahead, np.inf)
    full = np.where(step[..., 0] > 0.0, (1.0 - f[..., 0]) / step[..., 0], np.inf)
    return np.minimum(cones, full).min(axis=1)
