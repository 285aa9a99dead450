"""Measures contacts by the largest multiple of a set of loads that they resist, with proofs.

A measure of contacts is the largest multiple of a convex set D of loads, which holds zero, that
they resist with normal forces of sum one newton: the largest m with -m w in W for all w of D, where
W is the set of their wrenches (`l1`, see `wrench_sets`). A convex set holds another if its support
is nowhere smaller, so that m D is resisted if and only if for every twist y

    h(y) >= m d(y),    d(y) = max over w in D of -y.w,                                      (1)

with the support h of W. This *demand* d of a twist is

    ferrari-canny   |y|                      D: wrenches of length one (torques over a length)
    weight          |v|, y = (v, omega)      D: forces of one newton at the centre of mass
    task            max(0, max_j -y.w_j)     D: the hull of zero and the loads w_j

So the measure is the least h(y) / d(y) over twists with d(y) > 0, provided that h is nowhere
negative. Twists are taken as unit ones, with torques over the object's radius; the demand of
ferrari-canny is then one.

The multiple is bounded from both sides.

*From above.* Any twist y bounds the measure by h(y) / d(y), and shows that no multiple is resisted
if h(y) < 0, by (1).

*From below, weight.* The polytope of `ferrari_canny` is grown for torques over a length that is a
thousandth of the object's radius r. The ball that it proves,

    { (f, tau) : |f|^2 + |tau / (r / 1000)|^2 <= m^2 },                                     (2)

holds all forces up to m, so that m is a lower bound for the weight. The twist (v, omega) that
limits this ball has h(y) = m' |(v, omega r / 1000)|, m' the upper bound of its radius, and so
bounds the weight by m' (1 + 5e-7 |omega r|^2 / |v|^2) at most: the two bounds are close.

*From below, task.* For each load w_j, forces with normal parts of sum one and the wrench -m_j w_j,
m_j as large as possible, come from a cone program; its multipliers are the twist that limits m_j.
Programs are not exact. Moved into their cones, the forces have a wrench -m_j w_j + r_j, with a
small rest r_j across w_j. Contacts in force closure resist a ball of wrenches with a radius q > 0
as well. The ball has the wrench -q r_j / |r_j|, which takes away the rest in a mixture:

    -m w_j  is in W  for  m = m_j / (1 + |r_j| / q),                                        (3)

with nothing left of the program's inaccuracy. The least of these is a lower bound, as the ball
holds zero, see (1).

Contacts that are not in force closure may have no such forces. For them

    maximise m_j - `STEEP` |wrench + m_j w_j|                                               (4)

always has an answer; its multipliers are a twist of length up to `STEEP` that bounds m_j.
"""

from dataclasses import field, replace
from typing import Annotated, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.allowed_values import LARGEST, SMALLEST, one_of
from grasp_core.arrays import Array, ProofNumber, Shape, frozen
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.wrench_sets import WrenchSet, contact_program, into_cones
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, SolverError
from grasp_core.names import MeasureName
from grasp_core.quality.ferrari_canny import (
    CHECK_SLACK,
    QUALITY_GAP,
    FerrariCanny,
    UnitTwist,
    are_allowed,
    is_unit,
    wrench_set_quality,
)
from grasp_core.solvers.conic import minimize
from grasp_core.solvers.ties import first_best

MOST_LOADS = 100
"""Most loads of a task: each takes a cone program wherever contacts are measured, and a search
measures thousands of contacts."""
SMALL_DEMAND = 1e-2
"""Demand of a unit twist below which a twist with negative support is compared as if it had this
one: it refutes every multiple, and none better than others do."""
SMALL_LENGTH = 1e-3
"""Length of (2) over the object's radius: what (2) then gives away, 5e-7 for twists that turn and
move alike, is less than the gap between a ball's bounds, and rounding is far from it still."""
STEEP = 1e3
"""Cost of wrenches that are not balanced, over the load's length: a thousandth of a load counts as
none, and programs know twists as long as this to a few digits."""
CLOSED_GAP = 0.5
"""Gap that suffices to see whether contacts are in force closure, and for a ball that takes rests:
any ball does, and half of the largest one is found with the first simplices."""
SAME_BOUND = 1e-7
"""Share by which bounds of twists may differ and count as one: the accuracy of the conic programs
that they come from."""
NONE_SHOWN = -1.0
"""Lower bound where no multiple is shown to be resisted, not even zero."""


@declared
class Measure(Declared):
    """The set of loads whose largest resisted multiple is a measure of contacts."""

    name: MeasureName
    loads: Annotated[Array, Shape(None, WRENCH)] = field(
        default_factory=lambda: np.zeros((0, WRENCH))
    )
    """External wrenches of a task, with torques about the centre of mass over the object's radius,
    (m, 6) [N]; none for other measures."""

    def _check_together(self) -> None:
        count = len(self.loads)
        if self.name != "task":
            if count:
                raise InputError(
                    f"wrenches: expected none with measure {self.name!r}, got {count}; leave them "
                    "out, or take measure 'task'"
                )
            return
        if not 0 < count <= MOST_LOADS:
            raise InputError(
                f"wrenches: expected those of the task with measure 'task', 1 to {MOST_LOADS}, got "
                f"{count}; give an array of shape (m, 6), forces in N and torques in N m, without "
                "those that are mixtures of others"
            )
        sizes = np.linalg.norm(self.loads, axis=1)
        wrong = np.flatnonzero((sizes < SMALLEST) | (sizes > LARGEST))
        if wrong.size:
            raise InputError(
                f"wrenches: row {int(wrong[0])} must be from {SMALLEST:g} to {LARGEST:g} N long, "
                f"torques over the object's radius, got {float(sizes[wrong[0]]):.6g}; leave out "
                "wrenches that ask for nothing, and give others in N and N m"
            )

    @classmethod
    def of(cls, name: MeasureName, wrenches: ArrayLike | None, radius: float) -> "Measure":
        """Make a measure from a user's words and wrenches (force, torque), (m, 6) [N, N m]."""
        one_of(name, get_args(MeasureName), "measure")
        given = np.zeros((0, WRENCH)) if wrenches is None else wrenches
        return cls(name, frozen(given, (None, WRENCH), "wrenches") / np.repeat([1.0, radius], 3))

    @property
    def is_usual(self) -> bool:
        """Return whether this is the Ferrari-Canny quality."""
        return self.name == "ferrari-canny"

    @property
    def size(self) -> float:
        """Return the length of the longest load, torques over the object's radius [N]."""
        return float(np.linalg.norm(self.loads, axis=1).max()) if self.name == "task" else 1.0

    def demands(self, twists: Array) -> Array:
        """Compute the demands (1) of unit twists, (n, 6)."""
        if self.name == "weight":
            return np.asarray(np.linalg.norm(twists[:, :3], axis=1), dtype=np.float64)
        if self.name == "task":
            return np.maximum(-(twists @ self.loads.T).min(axis=1), 0.0)
        return np.ones(len(twists))

    def multiples(self, supports: Array, demands: Array) -> Array:
        """Compute the multiples of the loads that twists allow, negative where supports are."""
        with np.errstate(divide="ignore", invalid="ignore"):
            allowed = np.where(demands > 0.0, supports / demands, np.inf)
        return np.where(supports < 0.0, supports / np.maximum(demands, SMALL_DEMAND), allowed)

    def keeps(self, maps: Array, slack: float) -> NDArray[np.bool_]:
        """Return which orthogonal matrices (g, 3, 3) map the loads to themselves, (g,)."""
        if self.name != "task":
            return np.ones(len(maps), dtype=np.bool_)
        # a reflection turns torques the other way round
        signs = np.sign(np.linalg.det(maps))[:, None, None]
        forces, torques = self.loads[:, :3], self.loads[:, 3:]
        turned = (forces @ maps.transpose(0, 2, 1), signs * (torques @ maps.transpose(0, 2, 1)))
        images = np.concatenate(turned, axis=2)
        apart = np.linalg.norm(images[:, :, None] - self.loads, axis=3).min(axis=2)
        return np.asarray(apart.max(axis=1) <= slack * self.size, dtype=np.bool_)


FERRARI_CANNY = Measure("ferrari-canny")


@declared
class ResistedLoads(Declared):
    """Bounds of the largest multiple of a set of loads that contacts resist, with their proofs."""

    lower: ProofNumber
    """Multiple that is resisted; -1 where none is shown to be, not even zero, as for contacts that
    are not in force closure. There is no ball then, and there are no forces."""
    upper: ProofNumber
    """Multiple beyond which not all loads are resisted."""
    measure: Measure
    """The loads."""
    wrenches: WrenchSet
    """The wrenches of the contacts (`l1`), with torques over the object's radius."""
    direction: UnitTwist
    """Unit twist, (6,), with torques over the object's radius, that allows at most `upper`."""
    ball: FerrariCanny | None
    """Proof of the ball (2) for the weight, or of the one in (3) for a task."""
    forces: Annotated[Array, Shape(None, None)] | None
    """Local forces, (m, 3k), for each load of a task: they resist at least `lower` times the load,
    but for rests that the ball takes by (3)."""

    def verify(self) -> bool:
        """Check both bounds again in plain arithmetic, without any solver.

        They hold to within 1e-12 of the longest wrench; a lower one of -1 claims nothing.
        """
        with np.errstate(all="ignore"):
            if not (
                self.is_sound()
                and not self.measure.is_usual
                and self.wrenches.norm == "l1"
                and self.lower <= self.upper
                and is_unit(self.direction)
            ):
                return False
            demand = float(self.measure.demands(self.direction[None])[0])
            # half of what the bound was raised by, so that two ways to round agree
            support = self.wrenches.support(self.direction)[0] + 0.5 * _rounding(self.wrenches)
            bounded = self.upper >= 0.0 and support <= self.upper * demand
            return bounded and self._proves_lower()

    def _proves_lower(self) -> bool:
        if self.lower == NONE_SHOWN:
            return self.ball is None and self.forces is None
        if self.lower < 0.0 or self.ball is None or not self.ball.verify():
            return False
        if self.measure.name == "weight":
            of_weight = self.ball.wrenches == thin(self.wrenches)
            return self.forces is None and of_weight and self.ball.lower >= self.lower
        loads, forces = self.measure.loads, self.forces
        if forces is None or forces.shape != (len(loads), self.wrenches.G.shape[1]):
            return False
        if self.ball.wrenches != self.wrenches:
            return False
        slack = _rounding(self.wrenches)
        sizes = np.linalg.norm(loads, axis=1)
        shown = sizes * _without_rests(self.wrenches, loads, forces, self.ball)
        resisted = bool((shown >= self.lower * sizes - slack).all())
        return resisted and are_allowed(forces, self.wrenches)


def thin(wrenches: WrenchSet) -> WrenchSet:
    """Return the same wrenches with torques over a thousandth of the length, as in (2)."""
    return replace(wrenches, G=np.vstack([wrenches.G[:3], wrenches.G[3:] / SMALL_LENGTH]))


def resisted_loads(
    wrenches: WrenchSet, measure: Measure, gap: float = QUALITY_GAP
) -> ResistedLoads:
    """Bound the largest multiple of a set of loads that contacts resist, with proofs."""
    if measure.name == "weight":
        ball = wrench_set_quality(thin(wrenches), gap)
        direction, upper = _least(
            wrenches, measure, [ball.direction / np.repeat([1.0, SMALL_LENGTH], 3)]
        )
        if ball.lower <= 0.0:
            return ResistedLoads(NONE_SHOWN, upper, measure, wrenches, direction, None, None)
        lower = min(ball.lower, upper)
        return ResistedLoads(lower, upper, measure, wrenches, direction, ball, None)
    closed = wrench_set_quality(wrenches, CLOSED_GAP)
    if closed.lower <= _rounding(wrenches):
        limiting = [_limiting_twist(wrenches, load) for load in measure.loads]
        direction, upper = _least(wrenches, measure, [closed.direction, *limiting])
        return ResistedLoads(NONE_SHOWN, upper, measure, wrenches, direction, None, None)
    each = task_limits(wrenches, measure)
    direction, upper = _least(wrenches, measure, [limit.twist for limit in each])
    forces = np.array([into_cones(limit.forces, wrenches.friction) for limit in each])
    shown = _without_rests(wrenches, measure.loads, forces, closed)
    lower = min(float(shown.min()), upper)
    return ResistedLoads(lower, upper, measure, wrenches, direction, closed, forces)


def measured_set(
    wrenches: WrenchSet, measure: Measure, gap: float = QUALITY_GAP
) -> FerrariCanny | ResistedLoads:
    """Bound any measure of contacts, also the usual one (see `resisted_loads`)."""
    usual = measure.is_usual
    return wrench_set_quality(wrenches, gap) if usual else resisted_loads(wrenches, measure, gap)


def _without_rests(wrenches: WrenchSet, loads: Array, forces: Array, ball: FerrariCanny) -> Array:
    """Return the multiples of loads that forces and a ball show by (3), (m,), or minus infinity."""
    radius = ball.lower - _rounding(wrenches)
    if not radius > 0.0:
        return np.full(len(loads), -np.inf)
    sizes = np.linalg.norm(loads, axis=1)
    units, made = loads / sizes[:, None], forces @ wrenches.G.T
    along = -np.einsum("mi,mi->m", made, units)
    rests = np.linalg.norm(made + along[:, None] * units, axis=1)
    return along / (1.0 + rests / radius) / sizes


def _least(wrenches: WrenchSet, measure: Measure, twists: list[Array]) -> tuple[Array, float]:
    """Return the twist, at unit length, that allows the least multiple, and the multiple.

    Forces along the axes make it finite. Of multiples that programs find equal the first counts.
    """
    axes = np.eye(WRENCH)[:3]
    every = np.array([*twists, *axes, *-axes])
    every = every / np.linalg.norm(every, axis=1)[:, None]
    # a twist that asks for next to nothing bounds nothing: rounding in its support counts in full
    supports = wrenches.supports(every) + _rounding(wrenches)
    allowed = measure.multiples(supports, measure.demands(every))
    place = first_best(-allowed, SAME_BOUND * abs(float(allowed.min())))
    # a twist with negative support shows that nothing is resisted, whatever its demand
    return every[place], max(float(allowed[place]), 0.0)


def _rounding(wrenches: WrenchSet) -> float:
    """Return by how much supports of unit twists may be rounded."""
    return CHECK_SLACK * wrenches.size


class TaskLimit(NamedTuple):
    """The largest resisted multiple of a load, local forces (3k,), and a twist of demand one."""

    multiple: float
    forces: Array
    twist: Array


def task_limits(wrenches: WrenchSet, measure: Measure) -> list[TaskLimit]:
    """Find the largest multiple of each load of a task that contacts in force closure resist."""
    n = wrenches.G.shape[1]
    forces, multiple_of = np.eye(n, n + 1), np.eye(n + 1)[n]
    pushes = forces[:: wrenches.width].sum(axis=0)
    found = list[TaskLimit]()
    for load in measure.loads:
        size = float(np.linalg.norm(load))
        balance = wrenches.G @ forces + (load / size)[:, None] * multiple_of
        equal = [(balance, 0.0), (pushes[None], 1.0)]
        answer = minimize(contact_program(-multiple_of, wrenches.friction, wrenches.width, equal))
        multiple = float(answer.x[-1]) / size
        if not multiple > 0.0:
            raise SolverError(
                "a load of a task has no resisted multiple although contacts are closed"
            )
        # the multipliers have z.load = |load|, so that their demand is positive the other way
        found.append(TaskLimit(multiple, answer.x[:-1], -answer.z[:WRENCH] / size))
    return found


def _limiting_twist(wrenches: WrenchSet, load: Array) -> Array:
    """Return a twist that bounds the resisted multiple of a load, by the program (4), (6,)."""
    n = wrenches.G.shape[1]
    forces, (multiple_of, distance) = np.eye(n, n + 2), np.eye(n + 2)[n:]
    pushes = forces[:: wrenches.width].sum(axis=0)
    unit = load / np.linalg.norm(load)
    missed = wrenches.G @ forces + unit[:, None] * multiple_of
    program = contact_program(
        STEEP * distance - multiple_of, wrenches.friction, wrenches.width, [(pushes[None], 1.0)],
        cones=[(-np.vstack([distance, missed]), 0.0)],
    )  # fmt: skip
    start = program.zeros + program.nonnegatives + 1
    return minimize(program).z[start : start + WRENCH]
