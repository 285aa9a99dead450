"""Settings of trials of closure: durations and thresholds, noise, and which trials there are."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal, TypeAlias

from grasp_core.declared import FieldError
from grasp_core.kinds import Quantity, RandomWrenches, Range, Repeats, Share
from grasp_core.settings import Settings

Duration = Annotated[float, Range(least=0.05, most=60.0)]
Settling = Annotated[float, Range(least=1.0, most=100.0)]
Rounds = Annotated[int, Range(least=1, most=40)]
Spans = tuple[Annotated[float, Range(above=0.0, below=1.0)], ...]


def _check_spans(spans: Spans) -> None:
    if not spans or any(one >= two for one, two in pairwise(spans)):
        raise FieldError("spans", f"must be one or more numbers in rising order, got {spans}")


@dataclass(frozen=True, slots=True, repr=False)
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


@dataclass(frozen=True, slots=True, repr=False)
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


@dataclass(frozen=True, slots=True, repr=False)
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


Tilt = Annotated[float, Range(least=0.0, most=45.0)]
LimitSearch: TypeAlias = Literal["none", "ramp", "bisection"]


@dataclass(frozen=True, slots=True, repr=False)
class Noise(Settings):
    """How uncertain the pose, surface, friction and mass are, as standard deviations.

    Raises:
        InputError: A number is negative or out of its range.
    """

    shift: Share = 0.01
    """Deviation of the object's position along each axis, in object radii."""
    turn_deg: Tilt = 1.0
    """Deviation of the object's orientation about each axis through its centre of mass [deg]."""
    normal_deg: Tilt = 1.0
    """Deviation of the surface normal at each contact, about two axes in the surface [deg]."""
    friction: Share = 0.05
    """Deviation of the friction coefficient, relative to the coefficient."""
    mass: Share = 0.05
    """Deviation of the mass and of every load, relative to the planned values."""


@dataclass(frozen=True, slots=True, repr=False)
class ChosenTrials(Settings):
    """Which trials a grasp goes through besides the usual ones."""

    random_wrenches: RandomWrenches = 0
    """Number of random wrenches to hold as well, each at a share of the largest multiple that is
    resisted according to the analysis."""
    limits: LimitSearch = "none"
    """Also find the largest multiple of each wrench in simulation."""
    repeats: Repeats = 0
    """Number of times to repeat all holds with noise, to see how often the grasp holds."""
    noise: Noise = Noise()
