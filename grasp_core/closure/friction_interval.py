"""Defines the interval in which the critical friction of contacts is proved to lie.

Its upper end is proved by forces f_i that balance exactly and lie inside the cones there, its lower
end by a twist whose velocities v_i leave each contact at rest or depart steeply enough:

    0 < n_i.f_i,     |tangential part of f_i|  <  upper n_i.f_i,                              (1)
    n_i.v_i <= 0,    lower |tangential part of v_i|  <=  -n_i.v_i.                            (2)

`rational_proofs` checks both in rational arithmetic.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, are_units, cross, is_array, is_number, real_array
from grasp_core.by_value import ByValue
from grasp_core.checked import LARGEST_FRICTION
from grasp_core.closure.contact_arrays import FEWEST, unit_size
from grasp_core.closure.rational_proofs import closes, separates
from grasp_core.closure.wrenches import WRENCH

FRICTIONLESS = 1e-6
"""Smallest friction at which closure is sought: files that keep six digits do not place contacts
more precisely."""
REPORTED_AS_ZERO = 2.0 * FRICTIONLESS
"""Largest critical friction that is reported as zero: where the true value is zero, a proof may
need slightly more than `FRICTIONLESS` on one machine and not on another."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrictionInterval(ByValue):
    """Friction up to `lower`, without force closure, and from `upper` on, with force closure.

    Open means not in force closure. Where wrenches are dependent except for rounding, the proof
    that the contacts are open holds for contacts moved by at most 1e-12 of their size; the proof
    that they are closed holds for the contacts as they are.
    """

    lower: float
    """Coulomb coefficient; 0 where nothing is claimed, infinite where no friction is enough."""
    upper: float
    """Coulomb coefficient, at most `LARGEST_FRICTION`, or infinite where nothing is claimed."""
    positions: Array
    """Contact points, (k, 3) [m]."""
    normals: Array
    """Inward unit normals, (k, 3)."""
    forces: Array | None
    """Forces that balance strictly inside cones of friction `upper`, once their imbalance, which is
    rounding, is removed; (k, 3), in any unit of force. None where `upper` is infinite."""
    twist: Array | None
    """Velocity of the object at the first contact, and angular velocity, (6,) [m/s, rad/s], along
    which no force inside cones of friction `lower` has positive power. None where `lower` is 0."""

    def __post_init__(self) -> None:
        for name in ("positions", "normals", "forces", "twist"):
            array = getattr(self, name)
            if array is not None:
                kept = real_array(array, name)
                kept.setflags(write=False)
                object.__setattr__(self, name, kept)

    @property
    def critical_friction(self) -> float:
        """Return the upper end; values up to `REPORTED_AS_ZERO` become 0.0."""
        return 0.0 if self.upper <= REPORTED_AS_ZERO else self.upper

    def verify(self) -> bool:
        """Check both ends again, in rational arithmetic and without any solver."""
        return self._fits() and self._open_below() and self._closed_above()

    def _fits(self) -> bool:
        count = len(self.normals) if is_array(self.normals, None, 3) else 0
        return (
            count >= FEWEST
            and are_units(self.normals, count, 3)
            and is_array(self.positions, count, 3)
            and (self.forces is None or is_array(self.forces, count, 3))
            and (self.twist is None or is_array(self.twist, WRENCH))
            and is_number(self.lower, most=math.inf)
            and is_number(self.upper, most=math.inf)
        )

    def _open_below(self) -> bool:
        if not 0.0 <= self.lower <= self.upper:  # nor if one is not a number
            return False
        # without a twist nothing is claimed from below
        if self.twist is None:
            return self.lower == 0.0
        return self.lower > 0.0 and separates(self.twist, self.positions, self.normals, self.lower)

    def _closed_above(self) -> bool:
        # without forces nothing is claimed from above
        if self.forces is None:
            return self.upper == math.inf
        return self.upper <= LARGEST_FRICTION and closes(
            self.forces, self.positions, self.normals, self.upper
        )


def at_the_first(twist: Array, positions: Array) -> Array:
    """Move a twist at unit size from the mean contact to the first contact, (6,) [m/s, rad/s].

    Takes `twist` (6,); `positions` (k, 3) [m].
    """
    arms, _, size = unit_size(positions)
    velocity = twist[:3] + cross(twist[3:], arms[0])
    return np.concatenate([velocity, twist[3:] / size])
