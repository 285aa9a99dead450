"""Critical friction: the least coefficient above which contacts are in force closure.

Solved: where the margin of the closure program changes sign as the common friction grows.

Force closure at one friction is force closure at every larger one, so the threshold is unique.
It is bracketed by certificates: balancing forces in all cones bound it from above by their own
steepest angle, a separating twist from below by the friction up to which it separates. Near
its zero the margin is nearly linear in the friction, which says where to try next.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen
from grasp_core.closure import LARGEST_FRICTION, unit_size
from grasp_core.closure_margin import ROUNDING, decide, proves_closure
from grasp_core.errors import UndecidedError
from grasp_core.values import Grasp, contact_arrays
from grasp_core.wrenches import normal_and_tangential

FRICTION_ACCURACY = 1e-8
"""Relative width of the final bracket of a critical friction."""
FRICTIONLESS = 1e-6
"""Critical frictions below this are reported as zero: a contact in a file with six digits is
not placed better."""
FIRST_TRIAL = 0.5
GROWTH = 8.0
"""How much farther from an undecided friction the next trial is."""
CAUTION = 0.02
"""A trial keeps this share of the bracket away from both ends."""


def critical_friction(
    positions: ArrayLike | Grasp,
    normals: ArrayLike | None = None,
    *,
    balanced: ArrayLike | None = None,
) -> float:
    """Smallest common Coulomb coefficient above which the contacts are in force closure.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp.
        normals: Unit vectors into the object, (k, 3).
        balanced: Forces known to balance, (k, 3), such as a witness: where they need no friction
            the answer is zero at once.

    Returns:
        The upper end of the bracket: every larger coefficient suffices, by balanced forces
        inside the cones. The bracket is as narrow as `FRICTION_ACCURACY` or, where the margin
        grows with the square of the coefficient, as proofs allow: some 1e-6 wide. 0.0 below
        `FRICTIONLESS`; `math.inf` when `LARGEST_FRICTION` does not suffice.

    Raises:
        InputError: Shapes or lengths are wrong.
        UndecidedError: The contacts are so close to degenerate that nothing can be proved.
        SolverError: A program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals)
    arms, _, _ = unit_size(points)
    if balanced is not None and _close_without_friction(balanced, arms, units):
        return 0.0
    bracket = _Bracket()
    trial = FIRST_TRIAL
    while bracket.upper > FRICTIONLESS and not bracket.settled:
        answer = decide(arms, units, np.full(len(points), trial))
        if answer.forces is not None:
            bracket.closed_at(trial, answer.margin, _steepest(answer.forces, units))
        elif answer.twist is not None:
            separates = _least_friction_not_separated(answer.twist, arms, units)
            bracket.open_at(trial, answer.margin, separates)
        else:
            bracket.undecided_at(trial)
        if bracket.lower >= LARGEST_FRICTION:
            return math.inf
        trial = bracket.next_trial()
    return 0.0 if bracket.upper <= FRICTIONLESS else bracket.upper


@dataclass(slots=True)
class _Bracket:
    """Proved bounds of the threshold, and the margins on either side that suggest where it is.

    When one side moves twice in a row, the margin of the other is halved, so that both keep
    moving (the Illinois variant of false position).
    """

    lower: float = 0.0
    upper: float = math.inf
    below: tuple[float, float] | None = None
    """A friction without closure and its margin."""
    above: tuple[float, float] | None = None
    """A friction with closure and its margin."""
    last_closed: bool | None = None
    share: float = 0.5
    """Of the upper end to try next while nothing is known from below."""
    center: float = math.nan
    """A friction at which neither side could be proved: the threshold, to all appearance."""
    spread: float = 0.0
    """How far from there proofs are looked for."""

    @property
    def settled(self) -> bool:
        """Whether the bracket is as narrow as asked for, or as proofs allow."""
        narrow = self.upper - self.lower <= FRICTION_ACCURACY * self.lower
        return narrow or (
            self.upper <= self.center + self.spread and self.lower >= self.center - self.spread
        )

    def undecided_at(self, friction: float) -> None:
        if math.isnan(self.center):
            self.center, self.spread = friction, 0.4 * FRICTION_ACCURACY * friction
        else:
            self.spread *= GROWTH
        if self.spread > LARGEST_FRICTION:
            raise UndecidedError(
                "neither closure nor its opposite can be proved at any friction; move the contacts "
                "slightly"
            )

    def closed_at(self, friction: float, margin: float, steepest: float) -> None:
        self.upper = min(friction, steepest, self.upper)
        self.above = friction, margin
        if self.below is not None and self.last_closed is True:
            self.below = self.below[0], 0.5 * self.below[1]
        self.last_closed = True
        if friction < self.center:
            self._forget_center()

    def open_at(self, friction: float, margin: float, separates: float) -> None:
        self.lower = max(friction, separates, self.lower)
        self.below = friction, margin
        if self.above is not None and self.last_closed is False:
            self.above = self.above[0], 0.5 * self.above[1]
        self.last_closed = False
        if friction > self.center:
            self._forget_center()

    def _forget_center(self) -> None:
        """Go on as before: the threshold turned out to be elsewhere."""
        self.center, self.spread = math.nan, 0.0

    def next_trial(self) -> float:
        if not math.isnan(self.center):
            above = self.center + self.spread
            return above if self.upper > above else self.center - self.spread
        if self.below is None:
            self.share *= self.share
            return max(2.0 * self.share * self.upper, FRICTIONLESS)
        if self.above is None or not -math.inf < self.below[1] < -ROUNDING:
            return _between(self.lower, self.upper)
        (low, negative), (high, positive) = self.below, self.above
        root = (low * positive - high * negative) / (positive - negative)
        away = CAUTION * (self.upper - self.lower)
        return min(max(root, self.lower + away), self.upper - away)


def _close_without_friction(balanced: ArrayLike, arms: Array, normals: Array) -> bool:
    forces = frozen(balanced, normals.shape, "balanced")
    pushes = float(np.einsum("ki,ki->", forces, normals))
    friction = np.full(len(arms), FRICTIONLESS)
    return pushes > 0.0 and proves_closure(forces / pushes, arms, normals, friction)


def _between(lower: float, upper: float) -> float:
    """Halve the bracket of cone angles: it treats small and large friction alike."""
    return math.tan(0.5 * (math.atan(lower) + math.atan(min(upper, 4.0 * LARGEST_FRICTION))))


def _steepest(forces: Array, normals: Array) -> float:
    along, across = normal_and_tangential(forces, normals)
    return float((across / along).max())


def _least_friction_not_separated(twist: Array, arms: Array, normals: Array) -> float:
    """Up to which common friction a twist keeps separating."""
    velocities = twist[:3] + np.cross(twist[3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    return float(np.min(-along / np.maximum(across, np.finfo(np.float64).tiny)))
