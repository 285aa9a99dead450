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
from itertools import pairwise
from typing import Annotated

import numpy as np

from grasp_core.arrays import Array
from grasp_core.declared import FieldError
from grasp_core.kinds import Quantity, Range
from grasp_core.settings import Settings

Duration = Annotated[float, Range(least=0.05, most=60.0)]
Settling = Annotated[float, Range(least=1.0, most=100.0)]
Rounds = Annotated[int, Range(least=1, most=40)]
Spans = tuple[Annotated[float, Range(above=0.0, below=1.0)], ...]


def _check_spans(spans: Spans) -> None:
    if not spans or any(one >= two for one, two in pairwise(spans)):
        raise FieldError("spans", f"must be one or more numbers in rising order, got {spans}")


@dataclass(frozen=True, slots=True)
class HoldProtocol(Settings):
    """Durations, loads and thresholds of a trial in which the object must hold a wrench.

    Thresholds are relative to the size of the grasp, which is the lever of its contacts about the
    axis they are closest to: 2e-4 is 10 um for contacts that span a decimetre. A servo hides an
    unbalanced force of stiffness times displacement, here a thousandth of the largest normal force,
    so looser thresholds would certify the wrong thing.

    Raises:
        InputError: A number is not positive and finite, or out of its range.
    """

    squeeze_s: Duration = 0.16
    load_s: Duration = 0.16
    settle_s: Duration = 0.10
    hold_s: Annotated[float, Range(least=0.2, most=60.0)] = 0.40
    """Duration of the hold [s]; a shorter one does not see a small imbalance move anything."""
    settling_friction: Settling = 3.0
    """Friction while loading, relative to the friction under test. In trials of negative controls
    (contacts that must fail) it is relative to the larger of that friction and the one that the
    planned forces need."""
    load_share: Annotated[float, Range(least=0.1, most=0.999)] = 0.8
    """Applied wrench, relative to the largest one that is resisted according to the analysis."""
    control_load: Annotated[float, Range(least=0.05, most=2.0)] = 0.2
    """Wrench applied to a negative control (contacts that must fail), relative to the largest
    normal force."""
    least_normal_share: Annotated[float, Range(least=1e-4, most=0.1)] = 0.005
    """Least planned normal force, relative to the largest; it keeps fingers without load in
    contact."""
    hold_threshold: Quantity = 2e-4
    """Largest displacement while the object must be held, in grasp sizes."""
    total_threshold: Quantity = 2e-4
    """Largest displacement from the planned pose, in grasp sizes; a tilt of the object acts like
    that much additional friction."""
    least_excess: Annotated[float, Range(least=1e-4, most=0.01)] = 5e-4
    """Share of the sum of forces by which the forces must leave their friction cones even without a
    load; it equals minus the closure margin. Contacts that need at least this share have to slip
    without a load. With less, the servos, which hide a few thousandths of the largest normal force,
    might hold them."""
    gap_threshold: Quantity = 2e-4
    """A fingertip farther than this from its face has lost contact, in grasp sizes."""


@dataclass(frozen=True, slots=True)
class LimitProtocol(Settings):
    """How the largest wrench that a grasp resists is found in simulation."""

    spans: Spans = (0.02, 0.1, 0.5)
    """Half widths of the intervals around the predicted limit, relative to it. They are searched in
    turn until the limit is found."""
    ramp_s: Duration = 0.5
    """Duration of the slow rise of the load through one interval [s]."""
    ramp_threshold: Quantity = 2e-5
    """Displacement that ends a ramp, in grasp sizes. It is smaller than in a hold, because nothing
    but the load moves the object during a ramp."""
    rounds: Rounds = 4
    """How often bisection halves an interval."""

    def _check_together(self) -> None:
        _check_spans(self.spans)


@dataclass(frozen=True, slots=True)
class FrictionProtocol(Settings):
    """How the critical friction of a grasp is found in simulation."""

    spans: Spans = (0.01, 0.1, 0.5)
    """Half widths of the intervals around the predicted critical friction, relative to it. They are
    searched in turn until the critical friction is found."""
    rounds: Rounds = 4
    """How often bisection halves an interval."""
    settling_friction: Settling = 5.0
    """Friction while the fingers squeeze, relative to the predicted critical friction."""
    least_friction: Annotated[float, Range(least=1e-6, most=0.01)] = 1e-3
    """Least friction that is simulated; the only one tried where the prediction is smaller."""
    settle_s: Duration = 0.10
    hold_s: Annotated[float, Range(least=0.2, most=60.0)] = 0.40
    """Duration of the hold [s]; a shorter one does not see a small imbalance move anything."""
    threshold: Quantity = 2e-5
    """Largest displacement while the object must be held, in grasp sizes. Within it the servos hide
    an imbalance of a ten-thousandth of the largest normal force. Fingers that hardly push let the
    object creep by up to 1e-5 above the critical friction."""

    def _check_together(self) -> None:
        _check_spans(self.spans)


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
