"""Bounds how large a multiple of a set of loads contacts resist, with proofs from both sides.

Solved: the measures of `measures` for given contacts, whose normal forces sum to one newton.

*From above.* Any twist y bounds the measure by h(y) / d(y), and shows that no multiple is resisted
if h(y) < 0, by (1) of `measures`.

*From below, weight.* The polytope of `ferrari_canny` is grown for torques over a length that is a
thousandth of the object's radius r. The ball that it proves,

    { (f, tau) : |f|^2 + |tau / (r / 1000)|^2 <= m^2 },                                     (1)

holds all forces up to m, so that m is a lower bound for the weight. The twist (v, omega) that
limits this ball has h(y) = m' |(v, omega r / 1000)|, m' the upper bound of its radius, and so
bounds the weight by m' (1 + 5e-7 |omega r|^2 / |v|^2) at most: the two bounds are close.

*From below, task.* For each load w_j, forces with normal parts of sum one and the wrench -m_j w_j,
m_j as large as possible, come from a cone program; its multipliers are the twist that limits m_j.
The least m_j is a lower bound, as forces that add up to zero complete the hull, see (1) of
`measures`. Contacts that are not in force closure may have no such forces. For them

    maximise m_j - `STEEP` |wrench + m_j w_j|                                               (2)

always has an answer; its multipliers are a twist of length up to `STEEP` that bounds m_j.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.by_value import ByValue
from grasp_core.closure.wrench_sets import WrenchSet, nearest_wrench
from grasp_core.closure.wrenches import WRENCH
from grasp_core.errors import SolverError
from grasp_core.fields import are_units, is_a, is_array, is_number
from grasp_core.quality.ferrari_canny import CHECK_SLACK, GAP, FerrariCanny, wrench_set_quality
from grasp_core.quality.measures import Measure
from grasp_core.solvers.conic import ConicProgram, minimize

THIN = 1e-3
"""Length of (1) over the object's radius."""
HELD = 1e-7
"""How far the forces of a task may be from balance, and from cones, relative to the longest wrench:
the accuracy of conic programs."""
STEEP = 1e3
"""Cost of wrenches that are not balanced, over the load's length."""
CLOSED_GAP = 0.5
"""Gap that suffices to see whether contacts are in force closure."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ResistedLoads(ByValue):
    """Bounds of the largest multiple of a set of loads that contacts resist, with their proofs."""

    lower: float
    """Multiple that is resisted, if not negative; contacts that are not in force closure have a
    negative one."""
    upper: float
    """Multiple beyond which not all loads are resisted."""
    measure: Measure
    """The loads."""
    wrenches: WrenchSet
    """The wrenches of the contacts (`l1`), with torques over the object's radius."""
    direction: Array
    """Unit twist, (6,), with torques over the object's radius, that allows at most `upper`."""
    ball: FerrariCanny | None
    """Proof of (1), for the weight."""
    forces: Array | None
    """Local forces, (m + 1, 3k), that resist `lower` times each load of a task, and none."""

    def verify(self) -> bool:
        """Check both bounds again in plain arithmetic, without any solver.

        They hold to within 1e-12 of the longest wrench for the weight, and 1e-7 for a task.
        """
        with np.errstate(all="ignore"):
            sound = (
                is_a(self.measure, Measure)
                and self.measure.sound()
                and not self.measure.is_usual
                and is_a(self.wrenches, WrenchSet)
                and self.wrenches.sound()
                and self.wrenches.norm == "l1"
            )
            ordered = is_number(self.lower) and is_number(self.upper) and self.lower <= self.upper
            if not (sound and ordered and are_units(self.direction, WRENCH, slack=CHECK_SLACK)):
                return False
            demand = float(self.measure.demands(self.direction[None])[0])
            # half of what the bound was raised by, so that two ways to round agree
            support = self.wrenches.support(self.direction)[0] + 0.5 * _rounding(self.wrenches)
            bounded = self.upper >= 0.0 and support <= self.upper * demand
            return bounded and (self.lower < 0.0 or self._proves_lower())

    def _proves_lower(self) -> bool:
        if self.measure.name == "weight":
            return (
                self.forces is None
                and isinstance(self.ball, FerrariCanny)
                and self.ball.verify()
                and self.ball.lower >= self.lower
                and self.ball.wrenches == thin(self.wrenches)
            )
        width, count = self.wrenches.G.shape[1], len(self.measure.loads)
        if self.ball is not None or not is_array(self.forces, count + 1, width):
            return False
        slack = HELD * self.wrenches.size
        left = self.forces @ self.wrenches.G.T
        left[:-1] += self.lower * self.measure.loads
        balanced = float(np.linalg.norm(left, axis=1).max()) <= slack
        return balanced and self.wrenches.holds(self.forces, HELD)


def thin(wrenches: WrenchSet) -> WrenchSet:
    """Return the same wrenches with torques over a thousandth of the length, as in (1)."""
    return replace(wrenches, G=np.vstack([wrenches.G[:3], wrenches.G[3:] / THIN]))


def resisted_loads(wrenches: WrenchSet, measure: Measure, gap: float = GAP) -> ResistedLoads:
    """Bound the largest multiple of a set of loads that contacts resist.

    Args:
        wrenches: The wrenches of the contacts (`l1`), with torques over the object's radius.
        measure: The loads, other than those of the Ferrari-Canny quality.
        gap: Wanted relative gap between the bounds, for the weight.

    Raises:
        SolverError: A program's answer failed its check.
    """
    if measure.name == "weight":
        ball = wrench_set_quality(thin(wrenches), gap)
        direction = ball.direction / np.repeat([1.0, THIN], 3)
        direction, upper = _least(wrenches, measure, [direction])
        return ResistedLoads(
            min(ball.lower, upper), upper, measure, wrenches, direction, ball, None
        )
    closed = wrench_set_quality(wrenches, CLOSED_GAP)
    if closed.lower <= 0.0:
        limiting = [_limiting_twist(wrenches, load) for load in measure.loads]
        direction, upper = _least(wrenches, measure, [closed.direction, *limiting])
        return ResistedLoads(
            min(-1.0, closed.lower), upper, measure, wrenches, direction, None, None
        )
    each = task_limits(wrenches, measure)
    lower = min(limit.multiple for limit in each)
    direction, upper = _least(wrenches, measure, [limit.twist for limit in each])
    rest, _ = nearest_wrench(wrenches)
    # less than the largest multiple of a load is a mixture with forces that add up to zero
    shares = [lower / limit.multiple for limit in each]
    forces = [s * limit.forces + (1.0 - s) * rest for s, limit in zip(shares, each, strict=True)]
    return ResistedLoads(
        min(lower, upper), upper, measure, wrenches, direction, None, np.array([*forces, rest])
    )


def _least(wrenches: WrenchSet, measure: Measure, twists: list[Array]) -> tuple[Array, float]:
    """Return the twist, at unit length, that allows the least multiple, and the multiple.

    Forces along the axes are tried as well, so that it is finite.
    """
    axes = np.eye(WRENCH)[:3]
    every = _units(np.array([*twists, *axes, *-axes]))
    # a twist that asks for next to nothing bounds nothing: rounding in its support counts in full
    supports = wrenches.supports(every) + _rounding(wrenches)
    allowed = measure.multiples(supports, measure.demands(every))
    place = int(allowed.argmin())
    # a twist with negative support shows that nothing is resisted, whatever its demand
    return every[place], max(float(allowed[place]), 0.0)


def _rounding(wrenches: WrenchSet) -> float:
    """Return by how much supports of unit twists may be rounded."""
    return CHECK_SLACK * wrenches.size


def _units(rows: Array) -> Array:
    return rows / np.linalg.norm(rows, axis=1)[:, None]


class TaskLimit(NamedTuple):
    """How large a multiple of one load contacts in force closure resist."""

    multiple: float
    forces: Array
    """Local forces that resist the multiple, (3k,)."""
    twist: Array
    """Twist with demand one that limits the multiple, (6,)."""


def task_limits(wrenches: WrenchSet, measure: Measure) -> list[TaskLimit]:
    """Find the largest multiple of each load of a task that contacts in force closure resist.

    Raises:
        SolverError: A program's answer failed its check.
    """
    return [_limit(wrenches, load) for load in measure.loads]


def _limit(wrenches: WrenchSet, load: Array) -> TaskLimit:
    G, mu = wrenches.G, wrenches.friction
    k, n, size = len(mu), G.shape[1], float(np.linalg.norm(load))
    A = np.zeros((WRENCH + 1 + k + n, n + 1))
    A[:WRENCH, :-1], A[:WRENCH, -1] = G, load / size
    A[WRENCH, :n:3] = 1.0
    A[WRENCH + 1 + np.arange(k), np.arange(0, n, 3)] = -1.0
    cones: Indices = np.arange(WRENCH + 1 + k, len(A))
    A[cones, np.arange(n)] = -1.0
    A[cones[::3], np.arange(0, n, 3)] = -mu
    q, b = np.append(np.zeros(n), -1.0), np.zeros(len(A))
    b[WRENCH] = 1.0
    answer = minimize(ConicProgram(q, A, b, WRENCH + 1, k, (3,) * k))
    multiple = float(answer.x[-1]) / size
    if not multiple > 0.0:
        raise SolverError("a load of a task has no resisted multiple although contacts are closed")
    # the multipliers have z.load = |load|, so that their demand is positive the other way
    return TaskLimit(multiple, answer.x[:-1], -answer.z[:WRENCH] / size)


def _limiting_twist(wrenches: WrenchSet, load: Array) -> Array:
    """Return a twist that bounds the resisted multiple of a load, by the program (2), (6,)."""
    G, mu = wrenches.G, wrenches.friction
    k, n = len(mu), G.shape[1]
    A = np.zeros((1 + k + 1 + WRENCH + n, n + 2))
    A[0, :n:3] = 1.0
    A[1 + np.arange(k), np.arange(0, n, 3)] = -1.0
    # rows: distance >= |wrench + m load|, friction cones
    rest = slice(2 + k, 2 + k + WRENCH)
    A[1 + k, -1] = -1.0
    A[rest, :n], A[rest, n] = -G, -load / np.linalg.norm(load)
    cones: Indices = np.arange(2 + k + WRENCH, len(A))
    A[cones, np.arange(n)] = -1.0
    A[cones[::3], np.arange(0, n, 3)] = -mu
    q, b = np.concatenate([np.zeros(n), [-1.0, STEEP]]), np.zeros(len(A))
    b[0] = 1.0
    return minimize(ConicProgram(q, A, b, 1, k, (1 + WRENCH, *(3,) * k))).z[rest]
