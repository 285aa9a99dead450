"""Schedules say what is applied to an object in each sample of a trial; they need no simulator.

Every trial is a schedule: the forces planned for the fingers, the external wrench and the friction
in each sample. Loads change smoothly, because long objects spring loose under a sudden start.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from sim_validate.simulation.protocol import FrictionProtocol, HoldProtocol, LimitProtocol


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """An external wrench with the contact forces planned to balance it."""

    wrench: Array
    """External wrench, (6,) [N, N m], torque about the centre of mass, world axes."""
    forces: Array
    """Contact forces on the object, (k, 3) [N], world axes."""


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """The wrench, the finger forces and the friction in each of the n samples of a trial."""

    wrenches: Array
    """External wrench in each sample, (n, 6) [N, N m]."""
    forces: Array
    """Planned finger forces in each sample, (n, k, 3) [N]."""
    friction: Array
    """Friction coefficient in each sample, (n,)."""
    watched: int
    """Index of the first sample from which the object must stay where it is."""
    resting: int
    """Index of the first sample from which load and finger forces no longer change."""


@dataclass(frozen=True, slots=True)
class Clock:
    """The duration of a sample; it converts durations to numbers of samples."""

    sample_s: float

    def samples(self, duration_s: float) -> int:
        """Return the whole number of samples nearest to a duration, at least one."""
        return max(1, round(duration_s / self.sample_s))


def squeeze(forces: Array, friction: float, clock: Clock, protocol: HoldProtocol) -> Schedule:
    """Schedule the fingers to close on the unloaded object."""
    shares = smooth(clock.samples(protocol.squeeze_s))
    closing = shares[:, None, None] * forces
    count = len(shares)
    return Schedule(np.zeros((count, 6)), closing, np.full(count, friction), count, count)


def hold(
    idle: Load, load: Load, frictions: tuple[float, float], clock: Clock, protocol: HoldProtocol
) -> Schedule:
    """Schedule a hold: load the squeezed object at high friction, settle, lower friction, watch."""
    rise, rest = clock.samples(protocol.load_s), clock.samples(protocol.settle_s)
    shares = np.concatenate([smooth(rise), np.ones(rest + clock.samples(protocol.hold_s))])
    return _between(idle, load, shares, frictions, rise + rest, rise)


def ramp(
    idle: Load, limit: Load, shares: tuple[float, float], friction: float, clock: Clock,
    protocols: tuple[HoldProtocol, LimitProtocol],
) -> tuple[Schedule, Array]:  # fmt: skip
    """Schedule a load that rises slowly through the largest one that is resisted.

    The load rises to the first share of the limit as in `hold`, then slowly to the second. The
    forces balance the load all the way, whether the fingers can apply them or not.

    Gives the schedule, and the share of the limit that is applied in each watched sample.
    """
    hold_protocol, limit_protocol = protocols
    rise, rest = clock.samples(hold_protocol.load_s), clock.samples(hold_protocol.settle_s)
    lower, upper = shares
    count = clock.samples(limit_protocol.ramp_s)
    climb = lower + (upper - lower) * np.arange(1, count + 1) / count
    applied = np.concatenate([lower * smooth(rise), np.full(rest, lower), climb])
    high = hold_protocol.settling_friction * friction
    return _between(idle, limit, applied, (high, friction), rise + rest, len(applied)), climb


def release(
    forces: Array, settling_friction: float, friction: float, clock: Clock,
    protocol: FrictionProtocol, *, settled: bool = False,
) -> Schedule:  # fmt: skip
    """Schedule a release: lower the friction of a squeezed object without load, and watch.

    Takes `forces` (k, 3) [N].
    """
    rest = 0 if settled else clock.samples(protocol.settle_s)
    shares = np.ones(rest + clock.samples(protocol.hold_s))
    still = Load(np.zeros(6), forces)
    return _between(still, still, shares, (settling_friction, friction), rest, 0)


def settle(
    forces: Array, settling_friction: float, clock: Clock, protocol: FrictionProtocol
) -> Schedule:
    """Schedule what comes before a release: a squeezed object without load settles."""
    still = Load(np.zeros(6), forces)
    count = clock.samples(protocol.settle_s)
    return _between(still, still, np.ones(count), (settling_friction, settling_friction), count, 0)


def smooth(count: int) -> Array:
    """Return numbers that rise from zero to one with no slope at either end, (count,)."""
    time = np.arange(1, count + 1) / count
    return time**2 * (3.0 - 2.0 * time)


def _between(
    start: Load, end: Load, shares: Array, frictions: tuple[float, float], watched: int,
    resting: int,
) -> Schedule:  # fmt: skip
    friction = np.full(len(shares), frictions[0])
    friction[watched:] = frictions[1]
    return Schedule(
        wrenches=start.wrench + shares[:, None] * (end.wrench - start.wrench),
        forces=start.forces + shares[:, None, None] * (end.forces - start.forces),
        friction=friction,
        watched=watched,
        resting=resting,
    )
