"""What is applied to an object in each sample of a trial, and the durations, loads and thresholds.

Every trial is a schedule: the forces planned for the fingers, the external wrench and the friction
in each sample. Loads change smoothly, because long objects spring loose under a sudden start.

Wrench hold. The fingers squeeze with planned forces while friction is raised, so that the
transients of loading cannot slip a contact that would hold at rest. Then the wrench and the forces
planned for it are applied together, the object settles, friction is lowered to the value under
test, and the object must stay where it is.

Largest wrench. The object is either held at several shares of the predicted limit (bisection), or
loaded in one slow rise through it (ramp). It lets go where it has moved by a threshold. The mass
must first be accelerated, so a ramp finds the limit late, never early.

Critical friction. Fingers squeeze the unloaded object with the forces that balance at the predicted
critical friction, friction is lowered to a trial value, and the object must stay; the trial value
is bisected.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from sim_validate.settings.trials import FrictionProtocol, HoldProtocol, LimitProtocol


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """An external wrench with the contact forces planned to balance it."""

    wrench: Array
    """External wrench, (6,) [N, N m], torque about the centre of mass, world axes."""
    forces: Array
    """Contact forces on the object, (k, 3) [N], world axes."""


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Wrench (n, 6), finger forces (n, k, 3) and friction in each of the n samples of a trial."""

    wrenches: Array
    forces: Array
    friction: Array
    watched: int
    """Index of the first sample from which the object must stay where it is."""
    resting: int
    """Index of the first sample from which load and finger forces no longer change."""


def samples(duration_s: float, sample_s: float) -> int:
    """Return the whole number of samples nearest to a duration, at least one."""
    return max(1, round(duration_s / sample_s))


def squeeze(forces: Array, friction: float, sample_s: float, protocol: HoldProtocol) -> Schedule:
    """Schedule the fingers to close on the unloaded object."""
    shares = smooth(samples(protocol.squeeze_s, sample_s))
    closing = shares[:, None, None] * forces
    count = len(shares)
    return Schedule(np.zeros((count, 6)), closing, np.full(count, friction), count, count)


def hold(
    idle: Load, load: Load, frictions: tuple[float, float], sample_s: float, protocol: HoldProtocol
) -> Schedule:
    """Schedule a hold: load the squeezed object at high friction, settle, lower friction, watch."""
    rise, rest = samples(protocol.load_s, sample_s), samples(protocol.settle_s, sample_s)
    shares = np.concatenate([smooth(rise), np.ones(rest + samples(protocol.hold_s, sample_s))])
    return _between(idle, load, shares, frictions, rise + rest, rise)


def ramp(
    idle: Load, limit: Load, shares: tuple[float, float], friction: float, sample_s: float,
    protocols: tuple[HoldProtocol, LimitProtocol],
) -> tuple[Schedule, Array]:  # fmt: skip
    """Schedule a load that rises slowly through the largest one that is resisted.

    The load rises to the first share of the limit as in `hold`, then slowly to the second. The
    forces balance the load all the way, whether the fingers can apply them or not.

    Gives the schedule, and the share of the limit that is applied in each watched sample.
    """
    holding, limiting = protocols
    rise, rest = samples(holding.load_s, sample_s), samples(holding.settle_s, sample_s)
    lower, upper = shares
    count = samples(limiting.ramp_s, sample_s)
    climb = lower + (upper - lower) * np.arange(1, count + 1) / count
    applied = np.concatenate([lower * smooth(rise), np.full(rest, lower), climb])
    high = holding.settling_friction * friction
    return _between(idle, limit, applied, (high, friction), rise + rest, len(applied)), climb


def release(
    still: Load, frictions: tuple[float, float], sample_s: float, protocol: FrictionProtocol, *,
    settled: bool = False,
) -> Schedule:  # fmt: skip
    """Schedule a release: lower the friction of a squeezed object without load, and watch."""
    rest = 0 if settled else samples(protocol.settle_s, sample_s)
    shares = np.ones(rest + samples(protocol.hold_s, sample_s))
    return _between(still, still, shares, frictions, rest, 0)


def settle(still: Load, friction: float, sample_s: float, protocol: FrictionProtocol) -> Schedule:
    """Schedule what comes before a release: a squeezed object without load settles."""
    count = samples(protocol.settle_s, sample_s)
    return _between(still, still, np.ones(count), (friction, friction), count, 0)


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
    wrenches = start.wrench + shares[:, None] * (end.wrench - start.wrench)
    forces = start.forces + shares[:, None, None] * (end.forces - start.forces)
    return Schedule(wrenches, forces, friction, watched, resting)
