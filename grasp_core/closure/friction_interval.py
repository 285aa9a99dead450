"""Holds the interval of a critical friction, with proofs of both ends in rational arithmetic.

The upper end is proved by forces f_i that balance exactly and lie inside the cones there, the lower
end by a twist whose velocities v_i leave each contact at rest or depart steeply enough.

Solved: whether numbers that a search found prove what they are meant to prove, for positions and
normals exactly as they are given: a float is a rational number, a whole one over a power of two.

Forces found in floating point balance but for rounding, and a depth in the cones that falls with
the square of the friction is soon smaller than any bound on that. So the imbalance is removed
exactly: by least squares first, in units of the depths, and what rounding leaves of it by six
columns of the grasp map, those of the contacts deepest in their cones first. The corrected forces
are compared with the cones:

    0 < p = n.f  and  |f|^2 |n|^2 - p^2 < mu^2 p^2.                                     (1)

A twist must leave contacts that balance each other exactly at rest. Contacts that it hardly moves
are put to rest exactly; the others must depart, steeply enough:

    p = n.v <= 0  and  mu^2 (|v|^2 |n|^2 - p^2) <= p^2.                                 (2)

There is one tolerance, `RESTING_INVERSE`, for what has no exact answer: contacts whose wrenches are
dependent but for the rounding of their coordinates.
"""

import math
from typing import Annotated, TypeAlias

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from grasp_core.allowed_values import LARGEST_FRICTION
from grasp_core.arrays import Array, Indices, Points, UnitVectors, Wrench, cross
from grasp_core.closure.contacts import (
    LEAST_CONTACTS,
    WRENCH,
    grasp_map,
    normal_and_tangential,
    unit_size,
)
from grasp_core.declared import Declared, declared

Whole: TypeAlias = NDArray[np.object_]
"""Whole numbers of any size: numerators over a denominator that all share."""

INDEPENDENT = (1e-6, 1e-9)
"""Distances of a unit-size wrench from the span of others above which it is independent of them,
tried in turn; the last one defines the rank that force closure asks for."""
NEARLY_AT_REST = 1e-9
"""Speed below which a contact is meant to be at rest, for twists of unit size."""
UNIT_VECTORS: Whole = np.eye(3, dtype=np.int64).astype(np.object_)
RESTING_INVERSE = 10**12
"""One over the speed at which a contact that cannot be put to rest exactly still counts as at rest,
for twists of unit size: moving it by that share of the contacts' size would put it to rest."""
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
    exact, unit = balanced
    pushes, across, _ = _split(exact, normals)
    above, below = friction.as_integer_ratio()
    inside = (pushes > 0) & (below**2 * across < above**2 * pushes**2)  # (1)
    return (exact / unit).astype(np.float64) if inside.all() else None


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
    # an independent choice of the velocities to be made zero: the others vanish with them
    resting = wanted[_independent(rows[wanted], INDEPENDENT[-1])]
    lengths, _ = _whole(np.append(positions, size))
    exact_arms, length = lengths[:-1].reshape(-1, 3) - lengths[:3], lengths[-1]
    exact = _at_rest(_whole(unit)[0], exact_arms, length, resting)
    if exact is None or not exact.any():
        return False
    # all speeds are `length` times as large
    velocities = length * exact[:3] + _cross(exact[3:], exact_arms)
    # what is left of a twist that is put to rest may be short: all speeds are relative to it
    rest = (length * np.abs(exact).max()) ** 2
    along, across, squares = _split(velocities, normals)
    at_rest = RESTING_INVERSE**2 * (velocities**2).sum(axis=1) <= rest
    if friction == math.inf:
        steep = RESTING_INVERSE**2 * across <= rest * squares
    else:
        above, below = friction.as_integer_ratio()
        steep = above**2 * across <= below**2 * along**2  # (2)
    return bool((at_rest | (steep & (along <= 0))).all())


def _arms(positions: Array) -> tuple[Array, float]:
    """Return arms from the first contact over the longest arm, (k, 3), and that arm's length."""
    arms = positions - positions[0]
    size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
    return arms / size, size


def _whole(values: Array) -> tuple[Whole, int]:
    """Return floats as whole numbers over a power of two, and that power."""
    pairs = [x.as_integer_ratio() for x in values.ravel().tolist()]
    unit = max(below for _, below in pairs)
    whole = [above * (unit // below) for above, below in pairs]
    return np.array(whole, dtype=np.object_).reshape(values.shape), unit


def _columns(arms: Array, order: Indices) -> Indices | None:
    """Choose six independent columns of the grasp map, in an order of contacts."""
    places = (3 * order[:, None] + np.arange(3)).ravel()
    for least in INDEPENDENT:
        found = _independent(grasp_map(arms).T[places], least)
        if len(found) == WRENCH:
            return places[found]
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


def _balanced(forces: Array, positions: Array, columns: Indices) -> tuple[Whole, int] | None:
    """Change components of forces until they balance exactly; they are over a whole number."""
    exact, unit = _whole(forces)
    points, _ = _whole(positions)
    arms = points - points[0]
    total = np.append(exact.sum(axis=0), _cross(arms, exact).sum(axis=0))
    contacts, axes = np.divmod(columns, 3)
    changing = np.hstack([UNIT_VECTORS[axes], _cross(arms[contacts], UNIT_VECTORS[axes])])
    found = _solution(changing.T, total)
    if found is None:
        return None
    changes, shared = found
    exact = shared * exact
    exact[contacts, axes] -= changes
    return exact, shared * unit


def _at_rest(twist: Whole, arms: Whole, length: int, resting: Indices) -> Whole | None:
    """Change a twist so that some components of contacts' velocities are zero; its size changes."""
    # the product of such a wrench of a unit force with a twist is a contact's speed
    contacts, axes = np.divmod(resting, 3)
    rows = np.hstack([length * UNIT_VECTORS[axes], _cross(arms[contacts], UNIT_VECTORS[axes])])
    found = _solution(rows, (rows * twist).sum(axis=1))
    if found is None:
        return None
    changes, shared = found
    return shared * twist - changes


def _solution(rows: Whole, right: Whole) -> tuple[Whole, int] | None:
    """Solve rows @ x = right for six numbers, free ones zero, by Bareiss's elimination; or None.

    The numbers are numerators, with the denominator that they share, which is positive.
    """
    table, pivots, before = np.column_stack([rows, right]), list[int](), 1
    for i in range(len(table)):
        lead = table[i].copy()
        pivot = int(np.abs(lead[:WRENCH]).argmax())
        if not lead[pivot]:
            return None
        table = (lead[pivot] * table - np.outer(table[:, pivot], lead)) // before
        table[i], before = lead, lead[pivot]
        pivots.append(pivot)
    x = np.zeros(WRENCH, dtype=np.object_)
    x[pivots] = table[:, WRENCH]
    sign = 1 if before > 0 else -1
    return sign * x, sign * before


def _split(vectors: Whole, normals: Array) -> tuple[Whole, Whole, Whole]:
    """Return vectors' parts along normals, the squares of those across, and of the normals.

    A part is times the normal's length, a square times the normal's square.
    """
    units, _ = _whole(normals)
    along, squares = (vectors * units).sum(axis=1), (units**2).sum(axis=1)
    return along, (vectors**2).sum(axis=1) * squares - along**2, squares


def _cross(a: Whole, b: Whole) -> Whole:
    ahead = np.roll(a, -1, axis=-1) * np.roll(b, -2, axis=-1)
    return ahead - np.roll(a, -2, axis=-1) * np.roll(b, -1, axis=-1)


@declared
class FrictionInterval(Declared):
    """Friction up to `lower`, without force closure, and from `upper` on, with force closure.

    Open means not in force closure. Where wrenches are dependent except for rounding, the proof
    that the contacts are open holds for contacts moved by at most 1e-12 of their size; the proof
    that they are closed holds for the contacts as they are.
    """

    lower: Annotated[float, Interval(ge=0.0, le=math.inf)]
    """Coulomb coefficient; 0 where nothing is claimed, infinite where no friction is enough."""
    upper: Annotated[float, Interval(ge=0.0, le=math.inf)]
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
        if not (
            self.is_sound() and len(self.normals) >= LEAST_CONTACTS and self.lower <= self.upper
        ):
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
