"""Critical friction: the least coefficient above which contacts are in force closure.

Solved: where the margin of the closure program changes sign as the common friction grows.

Force closure at one friction is force closure at every larger one, so the threshold is unique.
It is bracketed by certificates: balancing forces in all cones bound it from above by their own
steepest angle, a separating twist from below by the friction up to which it separates. On either
side of its zero the margin is nearly linear in the friction. Its slope follows from the program's
answer: with tau the margin over mu, and the tangential forces in units of mu, friction enters the
program only through the balance, whose multiplier is the twist, so that

    d tau / d mu = sum v_i . (tangential part of f_i) / mu,

v_i being the velocity of contact i under the twist. Newton's method says where to try next.

A compiled search of the same kind comes first (see `kernels.critical`). The forces and the twist
that it finds are checked like all others; where there are none, or their bracket is not narrow, the
search is made here, program by program.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.checked import LARGEST_FRICTION
from grasp_core.closure import unit_size
from grasp_core.closure_margin import (
    RANK,
    Answer,
    decide,
    many_prove_closure,
    many_refute_closure,
    proves_closure,
)
from grasp_core.contact_arrays import contact_arrays
from grasp_core.errors import UndecidedError
from grasp_core.kernels import compiled
from grasp_core.many_contacts import many_contact_arrays, unit_sizes
from grasp_core.margin_program import deepest_forces
from grasp_core.values import Grasp
from grasp_core.wrenches import WRENCH, normal_and_tangential

FRICTION_ACCURACY = 5e-8
"""Relative width of the final bracket of a critical friction."""
FRICTIONLESS = 1e-6
"""Critical frictions below this are reported as zero: a contact in a file with six digits is
not placed better."""
FIRST_TRIAL = 0.5
PROOF_SHARES = (0.0, 1e-3, 0.03)
"""Where closure is proved between the friction that forces need and that of the trial."""
GROWTH = 3.0
"""How much farther from an undecided friction the next trial is; twice as far once that is a tenth
of `FRICTIONLESS`."""
NUDGE = 0.4
OVERSHOOT = 1.0
"""Trials pass the expected threshold, to close in from both sides: by this share of the accuracy,
and by this multiple of the error of Newton's method, the step's square over the friction."""
HALVING = 6
"""Every so many trials the bracket is halved, whatever Newton's method says."""
KERNEL = "critical"
WIDTHS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Multiples of the accuracy within which closure is proved above the separating friction: where two
contacts carry nearly everything, the others are deep in their cones only a little above it."""
NO_FORCE = 1e-100
"""Stands in where a contact does not push: no friction is enough there."""
SEARCHED = 0.95
"""Of the accuracy, how narrow a bracket the compiled search is asked for; the rest is rounding."""


def critical_friction(
    positions: ArrayLike | Grasp,
    normals: ArrayLike | None = None,
) -> float:
    """Smallest common Coulomb coefficient above which the contacts are in force closure.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp.
        normals: Unit vectors into the object, (k, 3).

    Returns:
        The upper end of the bracket: every larger coefficient suffices, by balanced forces
        inside the cones. The bracket is as narrow as `FRICTION_ACCURACY` or as proofs allow:
        some 1e-6 where the margin grows with the square of the coefficient, and some per cent
        where contacts lie within a millionth of their size of a line. 0.0 below
        `FRICTIONLESS`; `math.inf` when `LARGEST_FRICTION` does not suffice.

    Raises:
        InputError: Shapes or lengths are wrong.
        UndecidedError: The contacts are so close to degenerate that nothing can be proved.
        SolverError: A program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals)
    found = float(_at_once(points[None], units[None])[0])
    return _bracketed(points, units) if math.isnan(found) else found


def critical_frictions(
    positions: ArrayLike | Iterable[Grasp],
    normals: ArrayLike | None = None,
) -> Array:
    """Critical friction of each of many sets of contacts, as `critical_friction` finds it.

    Args:
        positions: Contact points, (g, k, 3) [m], k >= 2; or grasps.
        normals: Unit vectors into the object, (g, k, 3).

    Returns:
        Upper ends of the brackets, (g,); NaN where nothing can be proved, which is where
        `critical_friction` raises an UndecidedError.

    Raises:
        InputError: Shapes or lengths are wrong.
        SolverError: A program's answer failed its check.
    """
    points, units = many_contact_arrays(positions, normals)
    found = _at_once(points, units)
    for i in np.flatnonzero(np.isnan(found)):
        try:
            found[i] = _bracketed(points[i], units[i])
        except UndecidedError:
            continue
    return found


def _at_once(points: Array, normals: Array) -> Array:
    """Upper ends of narrow brackets that the compiled search finds, both of their ends proved here.

    Returns:
        (g,); NaN where there is none.
    """
    found = np.full(len(points), math.nan)
    kernel = compiled(KERNEL)
    if kernel is None:
        return found
    arms, _, _ = unit_sizes(points)
    units = np.array(normals)  # writable, like all that the search is compiled for
    forces, twists = np.zeros_like(arms), np.zeros((len(arms), WRENCH))
    bounds = np.zeros((len(arms), 2))
    kernel.search(arms, units, SEARCHED * FRICTION_ACCURACY, forces, twists, bounds)
    lower = bounds[:, 0]
    bounded = (lower > FRICTIONLESS) & (lower < 0.5 * LARGEST_FRICTION)
    bounded &= many_refute_closure(twists, arms, units, lower)
    with np.errstate(over="ignore", invalid="ignore"):  # degenerate contacts, proved nothing below
        along, across = normal_and_tangential(forces, units)
    enough = (across / np.maximum(along, NO_FORCE)).max(axis=1) * (1.0 + 0.1 * FRICTION_ACCURACY)
    left = np.flatnonzero(bounded & (enough <= lower * (1.0 + FRICTION_ACCURACY)))
    proved = left[many_prove_closure(forces[left], arms[left], units[left], enough[left])]
    found[proved] = enough[proved]
    for width in WIDTHS:
        left = np.flatnonzero(bounded & np.isnan(found))
        if not left.size:
            break
        enough = lower[left] * (1.0 + width * FRICTION_ACCURACY)
        deep, _, _ = deepest_forces(arms[left], units[left], enough)
        proved = many_prove_closure(deep, arms[left], units[left], enough)
        found[left[proved]] = enough[proved]
    return found


def _bracketed(points: Array, units: Array) -> float:
    """The upper end of the bracket, program by program.

    Raises:
        UndecidedError: Nothing can be proved.
        SolverError: A program's answer failed its check.
    """
    arms, _, _ = unit_size(points)
    if _close_without_friction(arms, units):
        return 0.0
    bracket, trial = _Bracket(), FIRST_TRIAL
    while bracket.upper > FRICTIONLESS and not bracket.settled:
        answer = decide(arms, units, np.full(len(points), trial))
        if answer.closed:
            bracket.closed_at(trial, _least_friction_proved(trial, answer.forces, arms, units))
        elif answer.closed is False:
            bracket.open_at(trial, _least_friction_not_separated(answer.twist, arms, units))
        else:
            bracket.undecided_at(trial)
        if bracket.lower >= LARGEST_FRICTION:
            return math.inf
        trial = bracket.next_trial(trial, answer.margin, _slope(answer, arms, units))
    return 0.0 if bracket.upper <= FRICTIONLESS else bracket.upper


@dataclass(slots=True)
class _Bracket:
    """Proved bounds of the threshold, and where to try next."""

    lower: float = 0.0
    upper: float = math.inf
    share: float = 0.5
    """Of the upper end to try next while nothing is known from below."""
    trials: int = 0
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
            self.center, self.spread = friction, NUDGE * FRICTION_ACCURACY * friction
        else:
            self.spread *= GROWTH if self.spread < 0.1 * FRICTIONLESS else 2.0
        if self.spread > LARGEST_FRICTION:
            raise UndecidedError(
                "neither closure nor its opposite can be proved at any friction; move the contacts "
                "slightly"
            )

    def closed_at(self, friction: float, proved: float) -> None:
        self.upper = min(proved, self.upper)
        if friction < self.center:
            self._forget_center()

    def open_at(self, friction: float, separates: float) -> None:
        self.lower = max(friction, separates, self.lower)
        if friction > self.center:
            self._forget_center()

    def _forget_center(self) -> None:
        """Go on as before: the threshold turned out to be elsewhere."""
        self.center, self.spread = math.nan, 0.0

    def next_trial(self, friction: float, margin: float, slope: float) -> float:
        """Where the margin vanishes if it goes on like this, a little to the wider side."""
        if not math.isnan(self.center):
            above = self.center + self.spread
            return above if self.upper > above else self.center - self.spread
        self.trials += 1
        root = friction - margin / slope if slope > 0.0 and math.isfinite(margin) else math.nan
        if self.lower < root < self.upper and self.trials % HALVING:
            past = NUDGE * FRICTION_ACCURACY * root + OVERSHOOT * (root - friction) ** 2 / root
            if self.upper - root > root - self.lower:
                return root + min(past, 0.5 * (self.upper - root))
            return root - min(past, 0.5 * (root - self.lower))
        if self.lower > 0.0:
            return _between(self.lower, self.upper)
        self.share *= self.share
        return max(2.0 * self.share * self.upper, FRICTIONLESS)


def _close_without_friction(arms: Array, normals: Array) -> bool:
    """Whether pushes along the normals balance: of those that do, the most even ones are tried."""
    along_normals = np.hstack([normals, np.cross(arms, normals)])
    left, values, _ = np.linalg.svd(along_normals)
    free = left[:, int((values > RANK).sum()) :]
    pushes = free @ free.sum(axis=0)
    if pushes.min(initial=math.inf) <= 0.0:
        return False
    forces = (pushes / pushes.sum())[:, None] * normals
    return proves_closure(forces, arms, normals, np.full(len(arms), FRICTIONLESS))


def _between(lower: float, upper: float) -> float:
    """Halve the bracket of cone angles: it treats small and large friction alike."""
    return math.tan(0.5 * (math.atan(lower) + math.atan(min(upper, 4.0 * LARGEST_FRICTION))))


def _least_friction_proved(friction: float, forces: Array, arms: Array, normals: Array) -> float:
    """Just above the friction that closing forces need, if they prove closure there."""
    along, across = normal_and_tangential(forces, normals)
    needed = float((across / along).max()) * (1.0 + 0.1 * FRICTION_ACCURACY)
    for share in PROOF_SHARES:
        enough = needed + share * (friction - needed)
        if enough < friction and proves_closure(forces, arms, normals, np.full(len(arms), enough)):
            return enough
    return friction


def _least_friction_not_separated(twist: Array, arms: Array, normals: Array) -> float:
    """Up to which common friction a twist keeps separating."""
    velocities = twist[:3] + np.cross(twist[3:], arms)
    along, across = normal_and_tangential(velocities, normals)
    with np.errstate(over="ignore"):  # contacts that hardly slide are separated at any friction
        return float(np.min(-along / np.maximum(across, np.finfo(np.float64).tiny)))


def _slope(answer: Answer, arms: Array, normals: Array) -> float:
    """By how much the margin over mu grows with the logarithm of mu."""
    velocities = answer.twist[:3] + np.cross(answer.twist[3:], arms)
    along = np.einsum("ki,ki->k", answer.forces, normals)
    slides = answer.forces - along[:, None] * normals
    return float(np.einsum("ki,ki->", velocities, slides))
