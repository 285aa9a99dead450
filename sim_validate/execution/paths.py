"""What is applied in each sample of a trial: the palm's path, loads, and the fingers' commands.

Drives need no simulator. Everything is along the world's axes, which are those of the object as it
rests in the hand, and loads act at its centre of mass.

Accelerations are differences of the path's velocity between samples, so the palm has the path's
velocity at every sample, and rests when the path ends. Loads grow smoothly over `RISE_S`: what
springs and masses do is to be seen, and not the ring of a sudden start.

The direction of gravity in `weight` follows a spiral on the sphere,

    polar angle = pi u,   azimuth = 2 pi N u,   0 <= u <= 1,                              (1)

with N turns, whose neighbouring turns are `TURN_GAP` apart: as close as 42 directions are that
share the sphere evenly. u is chosen so that the speed on the sphere is the same everywhere.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import WRENCH, contact_frames
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from scenes.mujoco.mjcf_text import quaternion
from scenes.settings import SAMPLE_S
from sim_validate.engine import schedules
from sim_validate.engine.misplacement import ObjectPose
from sim_validate.engine.schedules import smooth


@dataclass(frozen=True, eq=False)
class SampleRows:
    """A value with a row for each sample in the fields that `ROWS` names."""

    ROWS: ClassVar[tuple[str, ...]]

    def rows(self, which: slice) -> Self:
        """Return the value in some of its samples."""
        return replace(self, **{name: getattr(self, name)[which] for name in self.ROWS})

    def then(self, later: Self) -> Self:
        """Return this value with the samples of a later one after its own."""
        pairs = ((name, (getattr(self, name), getattr(later, name))) for name in self.ROWS)
        return replace(self, **{name: np.concatenate(pair) for name, pair in pairs})


@dataclass(frozen=True, slots=True, eq=False)
class TablePlane:
    """A table under the object: a plane through a point, facing the object along a unit normal."""

    point: Array
    normal: Array

    @property
    def quaternion(self) -> Array:
        """Orientation of the plane, whose third axis is its normal, (4,)."""
        return quaternion(np.roll(contact_frames(self.normal), -1, axis=1))


@dataclass(frozen=True, eq=False)
class TrialDrive(SampleRows):
    """What is applied in each of the n samples of a trial."""

    ROWS = ("accelerations", "gravity", "wrenches", "grasping", "shares")

    accelerations: Array
    """Acceleration of the palm (linear, angular about its middle), (n, 6) [m/s^2, rad/s^2]."""
    gravity: Array
    wrenches: Array
    """Wrench on the object beside its weight, (n, 6) [N, N m]."""
    grasping: Array
    """Share of the squeeze that is commanded, (n,), or of each finger's part of it, (n, k)."""
    shares: Array
    """Share of the trial's load that is applied, (n,)."""
    velocity: Array
    """Velocity at which hand and object start, (3,) [m/s]."""
    pose: ObjectPose | None = None
    """Where the object lies at the start; None for its planned place."""
    reached: Array | None = None
    """Displacements of the fingertips along their springs at the start, (k, 3) [m], from where
    their commands then count; None for none."""
    table: TablePlane | None = None
    friction: Array | None = None
    """Frictions of the fingertips, (k,); None for those of the scene."""
    lost: tuple[float, float] | None = None
    """How far from its planned place in the hand, or turned, the object ends the trial [m, rad]."""

    def __len__(self) -> int:
        return len(self.shares)


def idle(count: int) -> TrialDrive:
    """Return a drive of some samples in which nothing is applied to a squeezed object."""
    nothing = np.zeros((count, WRENCH))
    return TrialDrive(
        accelerations=nothing, gravity=nothing[:, :3], wrenches=nothing, grasping=np.ones(count),
        shares=np.zeros(count), velocity=np.zeros(3),
    )  # fmt: skip


CLOSE_S = 0.15
"""Time in which the fingers build up the squeeze [s]."""
LAY_S = 0.05
"""Time in which an object on a table gets its weight, before fingers close; laid down at once, it
would sink and rise while they hold on to it [s]."""
STILL_S = 0.1
"""Time before the load comes, and after it has gone [s]."""
RISE_S = 0.15
TURN_GAP = 0.55
"""Angle between neighbouring turns of gravity's spiral [rad]."""
SPIRAL_RATES = (1.0, 20.0)
"""Least and largest speed of gravity's direction [rad/s]."""
SPIRAL_SLOWNESS = 0.15
"""Speed of gravity's direction, relative to the held object's lowest natural frequency: it lags
by some degrees, and gains 2 % at most."""
CYCLES = 2
"""Cycles of a shake at its full size, after one in which it grows."""
STRIKE_S = 0.02
WHOLE_SLACK = 1e-9
"""Difference from a whole number that is rounding."""
TINY_M = 1e-12
"""Rise by which fingers that do not give have taken the weight [m]."""
STOP_RISE_S = 0.02
"""Time in which the deceleration of a stop grows and goes [s]."""


def samples(duration_s: float) -> int:
    """Return the whole number of samples nearest to a duration, at least one."""
    return schedules.samples(duration_s, SAMPLE_S)


def smoother(count: int) -> Array:
    """Return shares that rise from 0 to 1 without a jump of speed or acceleration, (count,)."""
    u = np.arange(1, count + 1) / count
    return u**3 * (10.0 - 15.0 * u + 6.0 * u * u)


WEIGHING = samples(RISE_S)
"""Samples in which the weight comes, before the load of `shake`, `stop` and `knock`."""


def closing(after_s: float = STILL_S) -> TrialDrive:
    """Return the drive in which fingers build up the squeeze on a weightless object."""
    grasping = np.concatenate([smooth(samples(CLOSE_S)), np.ones(samples(after_s))])
    return replace(idle(len(grasping)), grasping=grasping)


def loaded(share: Array, gravity: Array) -> TrialDrive:
    """Return the drive in which a squeezed object comes under gravity, (3,) or (n, 3) [m/s^2]."""
    return replace(idle(len(share)), gravity=share[:, None] * gravity, shares=share)


def turned_weight(slowest_rad_per_s: float) -> TrialDrive:
    """Return the drive of `weight`: gravity turned through all directions."""
    speed = float(np.clip(SPIRAL_SLOWNESS * slowest_rad_per_s, *SPIRAL_RATES))
    turns = math.pi / TURN_GAP
    fine = np.arange(2001) / 2000.0
    points = _spiral(fine, turns)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    count = samples(float(along[-1]) / speed)
    evenly = along[-1] * np.arange(count) / (count - 1.0)
    path = _spiral(np.asarray(np.interp(evenly, along, fine), dtype=np.float64), turns)
    way = np.concatenate([np.broadcast_to(path[0], (WEIGHING, 3)), path])
    return weighed(GRAVITY_M_PER_S2 * way, count)


def _spiral(u: Array, turns: float) -> Array:
    polar, azimuth = math.pi * u, 2.0 * math.pi * turns * u
    flat = np.sin(polar)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(polar)], axis=1)


def weighed(gravity: Array, count: int = WEIGHING) -> TrialDrive:
    """Return the drive in which the weight comes, and stays for so many samples."""
    return loaded(np.concatenate([smooth(WEIGHING), np.ones(count)]), gravity)


def shake(gravity: Array, axis: Array, frequency_hz: float) -> TrialDrive:
    """Return the drive of a shake under weight; `axis` (6,) is its acceleration."""
    rate = 2.0 * math.pi * frequency_hz
    grow, hold = 1.0 / frequency_hz, CYCLES / frequency_hz
    wave = samples(grow + hold)
    times = SAMPLE_S * np.arange(wave + 1)
    size = np.clip(times / grow, 0.0, 1.0)
    size = size * size * (3.0 - 2.0 * size)
    # velocity of a sinusoid about a middle that rests: -cos, whose start is slow as its size is 0
    speeds = -size * np.cos(rate * times) / rate
    accelerations = np.zeros((WEIGHING + wave, 6))
    accelerations[WEIGHING:] = np.diff(speeds)[:, None] / SAMPLE_S * axis
    return replace(weighed(gravity, wave), accelerations=accelerations)


def stop(gravity: Array, way: Array, deceleration: float, speed: float) -> TrialDrive:
    """Return the drive of a stop of a palm that moves in a direction, under weight."""
    rest = samples(STILL_S)
    whole = speed / deceleration / SAMPLE_S  # samples at the full deceleration
    rise = max(1, int(min(STOP_RISE_S / SAMPLE_S, whole) + WHOLE_SLACK))
    flat = max(0, int(whole - rise + WHOLE_SLACK))
    # a rise and its fall are as long as one; what is left of a sample finds its place in the fall
    left = min(max(whole - rise - flat, 0.0), 1.0)
    fall = np.sort(np.append(1.0 - smooth(rise), left))[::-1]
    shape = np.concatenate([smooth(rise), np.ones(flat), fall])
    accelerations = np.zeros((WEIGHING + len(shape) + rest, 6))
    size = speed / (SAMPLE_S * float(shape.sum()))  # the deceleration, but for the shortest stops
    accelerations[WEIGHING : WEIGHING + len(shape), :3] = -size * shape[:, None] * way
    under = weighed(gravity, len(shape) + rest)
    return replace(under, accelerations=accelerations, velocity=speed * way)


def knock(gravity: Array, impulse: Array, point: Array) -> TrialDrive:
    """Return the drive of a knock at a point under weight."""
    strike, rest = samples(STRIKE_S), samples(STILL_S)
    wrenches = np.zeros((WEIGHING + strike + rest, 6))
    shape = np.sin(np.pi * (np.arange(strike) + 0.5) / strike)
    force = impulse / (SAMPLE_S * shape.sum())
    whole = np.concatenate([force, np.cross(point, force)])
    wrenches[WEIGHING : WEIGHING + strike] = shape[:, None] * whole
    return replace(weighed(gravity, strike + rest), wrenches=wrenches)


def lift(
    up: Array, height: float, duration_s: float, give_m: float = 0.0
) -> tuple[TrialDrive, int]:
    """Return the drive of a lift from a table, and the sample at which it begins."""
    laid = samples(LAY_S)
    before, count, rest = laid + samples(CLOSE_S + STILL_S), samples(duration_s), samples(STILL_S)
    u = np.arange(count + 1) / count
    speeds = 30.0 * u**2 * (1.0 - u) ** 2 * height / duration_s  # of the path with least jerk
    accelerations = np.zeros((before + count + rest, 6))
    accelerations[before : before + count, :3] = np.diff(speeds)[:, None] / SAMPLE_S * up
    total = len(accelerations)
    close = smooth(samples(CLOSE_S))
    grasping = np.concatenate([np.zeros(laid), close, np.ones(total - laid - len(close))])
    risen = height * smoother(count)
    share = np.ones(total)
    share[:before] = 0.0
    share[before : before + count] = np.minimum(risen / max(min(give_m, height), TINY_M), 1.0)
    weight = np.concatenate([smooth(laid), np.ones(total - laid)])
    gravity = -GRAVITY_M_PER_S2 * weight[:, None] * up
    drive = TrialDrive(accelerations, gravity, np.zeros((total, 6)), grasping, share, np.zeros(3))
    return drive, before
