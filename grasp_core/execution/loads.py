"""Sets of loads that a grip must survive: an offset, and every direction of an ellipsoid about it.

    w = w0 + scale E z,   |z| <= 1                                                        (1)

with wrenches (force, torque about the centre of mass), along the world's axes. The weight of an
object in any orientation is the ball of forces of radius m g; an acceleration a in any direction
beside it makes the radius m (g + a); an upright object that is shaken has the offset -m g e_z.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Shape, frozen
from grasp_core.checked import LARGEST, SMALLEST, number, positive
from grasp_core.closure.contacts import WRENCH
from grasp_core.declared import Declared
from grasp_core.errors import InputError

GRAVITY_M_PER_S2 = 9.80665
"""Standard gravity."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LoadSet(Declared):
    """Loads offset + E z with |z| <= 1, the torques about the centre of mass."""

    offset: Annotated[Array, Shape(WRENCH, least=-LARGEST, most=LARGEST)]
    """Load in the middle, (6,) [N, N m]."""
    axes: Annotated[Array, Shape(WRENCH, None, least=-LARGEST, most=LARGEST)]
    """Columns E of the ellipsoid, (6, m) [N, N m]."""

    def _check_together(self) -> None:
        axes = self.axes
        if not 1 <= axes.shape[1] <= WRENCH:
            raise InputError(f"axes must have 1 to {WRENCH} columns, got {axes.shape[1]}")
        if float(np.abs(axes).max()) < SMALLEST:
            raise InputError(
                f"axes must not be zero: the largest entry is from {SMALLEST:g} to {LARGEST:g}, "
                f"got {float(np.abs(axes).max()):.3g}"
            )


def any_direction(
    mass_kg: float, acceleration_m_per_s2: float = 0.0, *, gravity: ArrayLike | None = None
) -> LoadSet:
    """Make the loads of an object's weight and of accelerations of the palm in every direction.

    Args:
        mass_kg: Mass of the object [kg].
        acceleration_m_per_s2: Largest acceleration of the palm, in any direction [m/s^2].
        gravity: Gravity in the palm's frame, (3,) [m/s^2], where the palm does not turn; None for
            gravity in any direction.

    Raises:
        InputError: A number is out of range, or there is nothing that has any direction.
    """
    mass = positive(mass_kg, "mass_kg")
    most = number(acceleration_m_per_s2, "acceleration_m_per_s2", least=0.0, most=LARGEST)
    offset, axes = np.zeros(WRENCH), np.zeros((WRENCH, 3))
    if gravity is None:
        axes[:3] = mass * (GRAVITY_M_PER_S2 + most) * np.eye(3)
        return LoadSet(offset, axes)
    if most == 0.0:
        raise InputError(
            "acceleration_m_per_s2 must be above zero where the direction of gravity is given; "
            "leave gravity out for gravity in any direction"
        )
    offset[:3] = mass * frozen(gravity, (3,), "gravity", most=LARGEST)
    axes[:3] = mass * most * np.eye(3)
    return LoadSet(offset, axes)
