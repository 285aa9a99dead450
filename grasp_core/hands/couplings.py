"""Couplings of joints: joints whose angle follows that of another, which alone moves freely.

With the number d of the joint that joint k follows (k itself where it moves freely), every joint is

    q_k = c_k + r_k q_d,                                                                  (1)

with r_k = 1 and c_k = 0 for a free joint. The angles of a free joint are those at which all joints
that follow it are in their ranges too. By virtual work the motor of a free joint carries

    tau_d = sum over its followers and itself of r_k tau_k.                               (2)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.declared import Declared
from grasp_core.errors import InputError
from grasp_core.files.records import Key
from grasp_core.kinds import Range

LARGEST_RATIO, SMALLEST_RATIO, LARGEST_OFFSET = 100.0, 0.01, 100.0
"""Sizes of ratios and offsets of couplings, which keep (1) exact to rounding."""
SAME = 1e-9
"""By how much ends of ranges may cross and count as one angle [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Coupling(Declared):
    """A joint that follows another: its angle is `offset + ratio * angle of the driver`."""

    joint: str
    """Name of the joint that follows."""
    driver: str
    """Name of the joint that it follows, which follows none itself."""
    ratio: Annotated[float, Range(least=-LARGEST_RATIO, most=LARGEST_RATIO)]
    """Change of the angle per change of the driver's angle."""
    offset: Annotated[
        float, Range(least=-LARGEST_OFFSET, most=LARGEST_OFFSET), Key("offset_rad")
    ] = 0.0
    """Angle where the driver's is zero [rad]."""

    def _check_together(self) -> None:
        if abs(self.ratio) < SMALLEST_RATIO:
            raise InputError(
                f"ratio must be at least {SMALLEST_RATIO:g} or at most -{SMALLEST_RATIO:g}, got "
                f"{self.ratio:g} for {self.joint}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Drives:
    """All joints of a hand by (1), and the angles that they can have."""

    drivers: Indices  # the joint that each follows, itself where it is free, (j,)
    ratios: Array  # (j,)
    offsets: Array  # (j,) [rad]
    ranges: Array  # lowest and highest angles, as followers allow, (j, 2) [rad]

    @property
    def free(self) -> Indices:
        """Return the numbers of the joints that move freely, (m,)."""
        return np.flatnonzero(self.drivers == np.arange(len(self.drivers)))

    def obeyed(self, angles: Array) -> Array:
        """Return angles (n, j) with those of followers put in by (1)."""
        found = self.offsets + self.ratios * angles[:, self.drivers]
        return np.clip(found, self.ranges[:, 0], self.ranges[:, 1])

    def carried(self, torques: Array) -> Array:
        """Return what free joints carry of the torques of all joints (j, ...) by (2), (m, ...)."""
        found = np.zeros_like(torques)
        np.add.at(found, self.drivers, (self.ratios * torques.T).T)
        return found[self.free]


def drives(names: Sequence[str], ranges: Array, couplings: Sequence[Coupling]) -> Drives:
    """Lay couplings out by the numbers of joints."""
    j = len(names)
    drivers, ratios, offsets = np.arange(j), np.ones(j), np.zeros(j)
    for each in couplings:
        for name in (each.joint, each.driver):
            if list(names).count(name) != 1:
                raise InputError(f"couplings must name single joints of the hand, got {name}")
        k = names.index(each.joint)
        if drivers[k] != k or each.driver in {other.joint for other in couplings}:
            raise InputError(
                f"couplings must let each joint follow one free joint, got {each.joint} after "
                f"{each.driver}, where one of them follows another joint too"
            )
        drivers[k], ratios[k], offsets[k] = names.index(each.driver), each.ratio, each.offset
    ends = np.sort((ranges - offsets[:, None]) / ratios[:, None], axis=1)
    found = ranges.copy()
    for k in np.unique(drivers[drivers != np.arange(j)]).tolist():
        own = np.flatnonzero(drivers == k).tolist()
        low, high = float(ends[own, 0].max()), float(ends[own, 1].min())
        if low > high + SAME:
            raise InputError(
                f"ranges must leave an angle to joints that are coupled, got none for "
                f"{', '.join(names[i] for i in own)}"
            )
        kept = np.array([low, max(low, high)])
        for i in own:
            moved = np.sort(offsets[i] + ratios[i] * kept)
            found[i] = np.clip(moved, *ranges[i]) if i != k else kept
    return Drives(drivers, ratios, offsets, found)
