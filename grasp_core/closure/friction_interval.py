"""Holds the interval of a critical friction, with proofs of both ends in rational arithmetic.

The upper end is proved by forces f_i that balance exactly and lie inside the cones there, the lower
end by a twist whose velocities v_i leave each contact at rest or depart steeply enough.

Solved: whether numbers that a search found prove what they are meant to prove, for positions and
normals exactly as they are given: a float is a rational number.

Forces found in floating point balance but for rounding, and a depth in the cones that falls with
the square of the friction is soon smaller than any bound on that. So the imbalance is removed
exactly: by least squares first, in units of the depths, and what rounding leaves of it by six
columns of the grasp map, those of the contacts deepest in their cones first. The corrected forces
are compared with the cones:

    0 < p = n.f  and  |f|^2 |n|^2 - p^2 < mu^2 p^2.                                     (1)

A twist must leave contacts that balance each other exactly at rest. Contacts that it hardly moves
are put to rest exactly; the others must depart, steeply enough:

    p = n.v <= 0  and  mu^2 (|v|^2 |n|^2 - p^2) <= p^2.                                 (2)

There is one tolerance, `SAME`, for what has no exact answer: contacts whose wrenches are dependent
but for the rounding of their coordinates.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

import numpy as np

from grasp_core.arrays import Array, Indices, Points, UnitVectors, Wrench, cross
from grasp_core.closure.contacts import FEWEST, WRENCH, grasp_map, normal_and_tangential, unit_size
from grasp_core.declared import Declared
from grasp_core.kinds import LARGEST_FRICTION, Range

Exact = list[Fraction]
"""A vector of rational numbers, without rounding."""

INDEPENDENT = (1e-6, 1e-9)
"""Distances of a unit-size wrench from the span of others above which it is independent of them,
tried in turn; the last one defines the rank that force closure asks for."""
NEARLY_AT_REST = 1e-9
"""Speed below which a contact is meant to be at rest, for twists of unit size."""
UNITS: list[Exact] = [[Fraction(int(i == axis)) for i in range(3)] for axis in range(3)]
SAME = Fraction(1, 10**12)
"""Speed at which a contact that cannot be put to rest exactly still counts as at rest, for twists
of unit size: moving it by this share of the contacts' size would put it to rest."""
FRICTIONLESS = 1e-6
"""Smallest friction at which closure is sought: files that keep six digits do not place contacts
more precisely."""
REPORTED_AS_ZERO = 2.0 * FRICTIONLESS
"""Largest critical friction that is reported as zero: where the true value is zero, a proof may
need slightly more than `FRICTIONLESS` on one machine and not on another."""


def closes(forces: Array, positions: Array, normals: Array, friction: float) -> bool:
    """Return whether nearby forces balance exactly, strictly inside cones of full rank."""
    return closing_forces(forces, positions, normals, friction) is not None


def closing_forces(
    forces: Array, positions: Array, normals: Array, friction: float
) -> Array | None:
    """Return the exactly balanced forces that `closes` finds, as floats; None if there are none."""
    if not (np.isfinite(forces).all() and 0.0 < friction < math.inf):
        return None
    arms, _ = _arms(positions)
    along, across = normal_and_tangential(forces, normals)
    # the depth of each force in its cone says how much of the imbalance it may take
    depths = np.maximum(friction * along - across, 0.0)
    columns = _columns(arms, np.argsort(-depths, kind="stable"))
    if columns is None:
        return None
    # nearly balanced by least squares, deeper forces changed by more
    G, room = grasp_map(arms), np.repeat(depths, 3)
    change = np.linalg.lstsq(G * room, G @ forces.ravel(), rcond=INDEPENDENT[-1])[0]
    near = forces - (room * np.asarray(change, dtype=np.float64)).reshape(forces.shape)
    balanced = _balanced(near, positions, columns)
    if balanced is None:
        return None
    steepest = Fraction(friction) ** 2
    for force, normal in zip(balanced, _vectors(normals), strict=True):
        along, across = _squares(force, normal)
        if not (across < steepest * along and _dot(force, normal) > 0):
            return None
    return np.array(balanced, dtype=np.float64)


def separates(twist: Array, positions: Array, normals: Array, friction: float) -> bool:
    """Return whether a twist about the first contact, nearly as given, separates at a friction."""
    arms, size = _arms(positions)
    unit = twist * np.repeat([1.0, size], 3)
    length = float(np.linalg.norm(unit))
    if not (0.0 < length < math.inf and friction >= 0.0):
        return False
    unit /= length
    rows = grasp_map(arms).T
    still = np.flatnonzero(np.linalg.norm((rows @ unit).reshape(-1, 3), axis=1) <= NEARLY_AT_REST)
    wanted = (3 * still[:, None] + np.arange(3)).ravel()
    exact_arms = [
        [(x - o) / Fraction(size) for x, o in zip(point, first, strict=True)]
        for first in _vectors(positions[:1])
        for point in _vectors(positions)
    ]
    # an independent choice of the velocities to be made zero: the others vanish with them
    resting = [divmod(int(wanted[each]), 3) for each in _independent(rows[wanted], INDEPENDENT[-1])]
    exact = _at_rest([Fraction(x) for x in unit.tolist()], exact_arms, resting)
    if exact is None or not any(exact):
        return False
    # what is left of a twist that is put to rest may be short: all speeds are relative to it
    rest = SAME * max(map(abs, exact))
    slope = None if friction == math.inf else Fraction(friction) ** 2
    for arm, normal in zip(exact_arms, _vectors(normals), strict=True):
        velocity = [a + b for a, b in zip(exact[:3], _cross(exact[3:], arm), strict=True)]
        if not _departs(velocity, normal, slope, rest):
            return False
    return True


def _arms(positions: Array) -> tuple[Array, float]:
    """Return arms from the first contact over the longest arm, (k, 3), and that arm's length."""
    arms = positions - positions[0]
    size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
    return arms / size, size


def _vectors(rows: Array) -> list[Exact]:
    return [[Fraction(x) for x in row] for row in rows.tolist()]


def _columns(arms: Array, order: Indices) -> list[tuple[int, int]] | None:
    """Choose six independent columns of the grasp map, (contact, axis), in an order of contacts."""
    wrenches = grasp_map(arms).T.reshape(-1, 3, WRENCH)[order].reshape(-1, WRENCH)
    for least in INDEPENDENT:
        found = _independent(wrenches, least)
        if len(found) == WRENCH:
            return [(int(order[each // 3]), each % 3) for each in found]
    return None


def _independent(rows: Array, least: float) -> list[int]:
    """Choose rows of (n, 6) that are at least `least` away from the span of earlier ones."""
    left, found = rows.copy(), list[int]()
    for row in range(len(left)):
        length = float(np.linalg.norm(left[row]))
        if length > least and len(found) < WRENCH:
            found.append(row)
            direction = left[row] / length
            for _ in range(2):  # once more for what rounding leaves
                left[row + 1 :] -= np.outer(left[row + 1 :] @ direction, direction)
    return found


def _balanced(
    forces: Array, positions: Array, columns: list[tuple[int, int]]
) -> list[Exact] | None:
    """Change components of forces, listed as (contact, axis), until they balance exactly."""
    balanced, points = _vectors(forces), _vectors(positions)
    arms = [[x - o for x, o in zip(point, points[0], strict=True)] for point in points]
    wrenches = [[*force, *_cross(arm, force)] for force, arm in zip(balanced, arms, strict=True)]
    total = [sum(parts, Fraction(0)) for parts in zip(*wrenches, strict=True)]
    changing = [[*UNITS[axis], *_cross(arms[contact], UNITS[axis])] for contact, axis in columns]
    changes = _solution([list(row) for row in zip(*changing, strict=True)], total)
    if changes is None:
        return None
    for (contact, axis), change in zip(columns, changes, strict=True):
        balanced[contact][axis] -= change
    return balanced


def _at_rest(twist: Exact, arms: list[Exact], resting: list[tuple[int, int]]) -> Exact | None:
    """Change a twist so that contacts' velocities along some axes, (contact, axis), are zero."""
    # the product of such a wrench of a unit force with a twist is a contact's speed
    rows: list[Exact] = [
        [*UNITS[axis], *_cross(arms[contact], UNITS[axis])] for contact, axis in resting
    ]
    speeds = [sum((a * b for a, b in zip(row, twist, strict=True)), Fraction(0)) for row in rows]
    changes = _solution(rows, speeds)
    return changes and [part - change for part, change in zip(twist, changes, strict=True)]


def _solution(rows: list[Exact], right: Exact) -> Exact | None:
    """Solve rows @ x = right for six numbers, free ones zero, by Bareiss's elimination; or None."""
    table = [_whole([*row, value]) for row, value in zip(rows, right, strict=True)]
    pivots, before = list[int](), 1
    for i in range(len(table)):
        lead = table[i]
        pivot = max(range(WRENCH), key=lambda column, row=lead: abs(row[column]))
        if not lead[pivot]:
            return None
        pivots.append(pivot)
        for j, row in enumerate(table):
            if j != i:
                pairs = zip(row, lead, strict=True)
                table[j] = [(lead[pivot] * a - row[pivot] * b) // before for a, b in pairs]
        before = lead[pivot]
    x = [Fraction(0)] * WRENCH
    for pivot, row in zip(pivots, table, strict=True):
        x[pivot] = Fraction(row[WRENCH], before)
    return x


def _whole(row: Exact) -> list[int]:
    """Return the least whole numbers in the same ratios, up to a common factor."""
    unit = math.lcm(*(x.denominator for x in row))
    return [x.numerator * (unit // x.denominator) for x in row]


def _departs(velocity: Exact, normal: Exact, slope: Fraction | None, rest: Fraction) -> bool:
    """Return whether a contact departs by (2) with mu^2 = slope, or any if None, or is at rest."""
    if _dot(velocity, velocity) <= rest**2:
        return True
    along, across = _squares(velocity, normal)
    steep = across <= rest**2 if slope is None else slope * across <= along
    return steep and _dot(velocity, normal) <= 0


def _squares(vector: Exact, normal: Exact) -> tuple[Fraction, Fraction]:
    """Return squares of a vector's parts along and across a normal, times the normal's square."""
    along = _dot(vector, normal) ** 2
    return along, _dot(vector, vector) * _dot(normal, normal) - along


def _dot(a: Exact, b: Exact) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Exact, b: Exact) -> Exact:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrictionInterval(Declared):
    """Friction up to `lower`, without force closure, and from `upper` on, with force closure.

    Open means not in force closure. Where wrenches are dependent except for rounding, the proof
    that the contacts are open holds for contacts moved by at most 1e-12 of their size; the proof
    that they are closed holds for the contacts as they are.
    """

    lower: Annotated[float, Range(least=0.0, most=math.inf)]
    """Coulomb coefficient; 0 where nothing is claimed, infinite where no friction is enough."""
    upper: Annotated[float, Range(least=0.0, most=math.inf)]
    """Coulomb coefficient, at most `LARGEST_FRICTION`, or infinite where nothing is claimed."""
    positions: Points
    """Contact points, (k, 3) [m]."""
    normals: UnitVectors
    """Inward unit normals, (k, 3)."""
    forces: Points | None
    """Forces that balance strictly inside cones of friction `upper`, once their imbalance, which is
    rounding, is removed; (k, 3), in any unit of force. None where `upper` is infinite."""
    twist: Wrench | None
    """Velocity of the object at the first contact, and angular velocity, (6,) [m/s, rad/s], along
    which no force inside cones of friction `lower` has positive power. None where `lower` is 0."""

    @property
    def critical_friction(self) -> float:
        """Return the upper end; values up to `REPORTED_AS_ZERO` become 0.0."""
        return 0.0 if self.upper <= REPORTED_AS_ZERO else self.upper

    def verify(self) -> bool:
        """Check both ends again, in rational arithmetic and without any solver."""
        # without a twist nothing is claimed from below, without forces nothing from above
        if not (self.is_sound() and len(self.normals) >= FEWEST and self.lower <= self.upper):
            return False
        contacts = self.positions, self.normals
        if self.twist is None:
            below = self.lower == 0.0
        else:
            below = self.lower > 0.0 and separates(self.twist, *contacts, self.lower)
        if self.forces is None:
            return below and self.upper == math.inf
        bounded = below and self.upper <= LARGEST_FRICTION
        return bounded and closes(self.forces, *contacts, self.upper)


def at_the_first(twist: Array, positions: Array) -> Array:
    """Move a twist at unit size from the mean contact to the first contact, (6,) [m/s, rad/s]."""
    arms, _, size = unit_size(positions)
    velocity = twist[:3] + cross(twist[3:], arms[0])
    return np.concatenate([velocity, twist[3:] / size])
