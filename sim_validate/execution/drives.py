"""What is applied in each sample of a trial: the palm's motion, loads, and the fingers' commands.

Drives need no simulator. Everything is along the world's axes, which are those of the object as it
rests in the hand, and loads act at its centre of mass.
"""

from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import WRENCH


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where the object lies, against its planned place in the hand."""

    moved: Array
    """Displacement of the centre of mass, (3,) [m]."""
    quaternion: Array
    """Orientation (w, x, y, z), (4,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A table under the object: a plane through a point, facing along a unit normal."""

    point: Array
    """A point of the plane, (3,) [m]."""
    normal: Array
    """Unit normal towards the object, (3,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """What is applied in each of the n samples of a trial."""

    accelerations: Array
    """Acceleration of the palm (linear, angular about its middle), (n, 6) [m/s^2, rad/s^2]."""
    gravity: Array
    """Acceleration of gravity, (n, 3) [m/s^2]."""
    wrenches: Array
    """Wrench on the object beside its weight, (n, 6) [N, N m]."""
    grasping: Array
    """Share of the squeeze that is commanded, (n,), or of each finger's part of it, (n, k)."""
    shares: Array
    """Share of the trial's load that is applied, (n,)."""
    velocity: Array
    """Velocity at which hand and object start, (3,) [m/s]."""
    pose: Pose | None = None
    """Where the object lies at the start; None for its planned place."""
    reached: Array | None = None
    """Displacements of the fingertips along their springs at the start, (k, 3) [m], from where
    their commands then count; None for none."""
    table: Table | None = None

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.shares)


def idle(count: int) -> Drive:
    """Return a drive of some samples in which nothing is applied to a squeezed object."""
    nothing = np.zeros((count, WRENCH))
    return Drive(
        accelerations=nothing, gravity=nothing[:, :3], wrenches=nothing, grasping=np.ones(count),
        shares=np.zeros(count), velocity=np.zeros(3),
    )  # fmt: skip


def joined(first: Drive, second: Drive) -> Drive:
    """Return one drive after another; start and table are those of the first."""
    both = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in SERIES}
    return replace(first, **both)


def parted(drive: Drive, count: int) -> tuple[Drive, Drive]:
    """Return the first samples of a drive, and the others; both have its start and table."""
    first = {name: getattr(drive, name)[:count] for name in SERIES}
    second = {name: getattr(drive, name)[count:] for name in SERIES}
    return replace(drive, **first), replace(drive, **second)


SERIES = ("accelerations", "gravity", "wrenches", "grasping", "shares")
"""Fields that have a row for each sample."""
