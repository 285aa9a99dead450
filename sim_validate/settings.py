"""Settings of trials of closure, of executions and of proofs of regions, which users choose.

Commands, files and Python take the same classes. Nothing here is slow to import, since command-line
help waits for it.
"""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Literal, Self, TypeAlias, get_args

from annotated_types import Interval

from grasp_core.allowed_values import (
    MaxCones,
    NotNegative,
    Quantity,
    RandomWrenches,
    Repeats,
    Reserve,
    Seed,
    Share,
    TorqueLimit,
)
from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.messages import FieldError
from grasp_core.settings import Settings
from scenes.settings import SAMPLE_S, HeldSettings

ProtocolName: TypeAlias = Literal[
    "dexgraspbench", "dexgraspbench-paper", "dexonomy", "mj-grasp-sim", "molmospaces"
]
"""Names of published tests of grasps."""
USUAL_FRICTION = 0.5
"""Coulomb coefficient where none is given."""
Duration = Annotated[float, Interval(ge=0.05, le=60.0)]
SettlingFriction = Annotated[float, Interval(ge=1.0, le=100.0)]
Rounds = Annotated[int, Interval(ge=1, le=40)]
Spans = tuple[Annotated[float, Interval(gt=0.0, lt=1.0)], ...]


def _check_spans(spans: Spans) -> None:
    if not spans or any(one >= two for one, two in pairwise(spans)):
        raise FieldError("spans", f"must be one or more numbers in rising order, got {spans}")


@declared
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
    hold_s: Annotated[float, Interval(ge=0.2, le=60.0)] = 0.40
    """Duration of the hold [s]; a shorter one does not see a small imbalance move anything."""
    settling_friction: SettlingFriction = 3.0
    """Friction while loading, relative to the friction under test. In trials of negative controls
    (contacts that must fail) it is relative to the larger of that friction and the one that the
    planned forces need."""
    load_share: Annotated[float, Interval(ge=0.1, le=0.999)] = 0.8
    """Applied wrench, relative to the largest one that is resisted according to the analysis."""
    control_load: Annotated[float, Interval(ge=0.05, le=2.0)] = 0.2
    """Wrench applied to a negative control (contacts that must fail), relative to the largest
    normal force."""
    least_normal_share: Annotated[float, Interval(ge=1e-4, le=0.1)] = 0.005
    """Least planned normal force, relative to the largest; it keeps fingers without load in
    contact."""
    hold_threshold: Quantity = 2e-4
    """Largest displacement while the object must be held, in grasp sizes."""
    total_threshold: Quantity = 2e-4
    """Largest displacement from the planned pose, in grasp sizes; a tilt of the object acts like
    that much additional friction."""
    least_excess: Annotated[float, Interval(ge=1e-4, le=0.01)] = 5e-4
    """Share of the sum of forces by which the forces must leave their friction cones even without a
    load; it equals minus the closure margin. Contacts that need at least this share have to slip
    without a load. With less, the servos, which hide a few thousandths of the largest normal force,
    might hold them."""
    gap_threshold: Quantity = 2e-4
    """A fingertip farther than this from its face has lost contact, in grasp sizes."""


@declared
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


@declared
class FrictionProtocol(Settings):
    """How the critical friction of a grasp is found in simulation."""

    spans: Spans = (0.01, 0.1, 0.5)
    """Half widths of the intervals around the predicted critical friction, relative to it. They are
    searched in turn until the critical friction is found."""
    rounds: Rounds = 4
    """How often bisection halves an interval."""
    settling_friction: SettlingFriction = 5.0
    """Friction while the fingers squeeze, relative to the predicted critical friction."""
    least_friction: Annotated[float, Interval(ge=1e-6, le=0.01)] = 1e-3
    """Least friction that is simulated; the only one tried where the prediction is smaller."""
    settle_s: Duration = 0.10
    hold_s: Annotated[float, Interval(ge=0.2, le=60.0)] = 0.40
    """Duration of the hold [s]; a shorter one does not see a small imbalance move anything."""
    threshold: Quantity = 2e-5
    """Largest displacement while the object must be held, in grasp sizes. Within it the servos hide
    an imbalance of a ten-thousandth of the largest normal force. Fingers that hardly push let the
    object creep by up to 1e-5 above the critical friction."""

    def _check_together(self) -> None:
        _check_spans(self.spans)


Tilt = Annotated[float, Interval(ge=0.0, le=45.0)]
LimitSearch: TypeAlias = Literal["none", "ramp", "bisection"]


@declared
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


@declared
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


TrialKind: TypeAlias = Literal["weight", "lift", "shake", "stop", "knock", "misplaced"]
"""What a trial does: it turns gravity through all directions, lifts the object off a table, shakes
or stops the palm, strikes the object, or closes fingers on an object that is not where it should
be."""
TRIAL_KINDS: tuple[TrialKind, ...] = get_args(TrialKind)
OffBy: TypeAlias = Literal["exactly", "deviation"]
KNOCK_M_PER_S = 1.0 / 6.0
"""Speed that the usual knock gives a free object [m/s], 0.05 N s for 0.3 kg. So its load grows with
the mass, as those of all other trials do, and a screw is not shot away."""

DURATION_SLACK = 1e-9
"""Relative size of differences that are rounding."""
LONGEST_S = 100.0
"""Longest duration of a lift or a stop [s]."""


@declared
class Holding(HeldSettings):
    """What holds the object, and how hard."""

    push_n: Quantity = 10.0
    """Largest normal force of a finger, at rest and under the loads that are planned for [N]."""
    tip_stiffness_n_per_m: Quantity = 2000.0
    """Stiffness of the springs on which fingertips slide [N/m]."""
    tip_radius_m: Quantity | None = None
    """Radius of the springy fingertips in executions [m]; if not given, that of the plan, or a
    tenth of the object's radius, or less where that would overlap something."""


@declared
class ChosenExecution(Holding):
    """How grasps are executed, and how far an object may move and still count as held."""

    trials: tuple[TrialKind, ...] = TRIAL_KINDS
    """Names of the trials."""
    lift_m: Quantity = 0.2
    """Height by which the object is lifted off its table [m]."""
    lift_s: Annotated[float, Interval(ge=0.05, le=LONGEST_S)] = 0.6
    """Duration of the lift [s]."""
    shake_g: NotNegative = 1.0
    """Largest acceleration of a shake [9.80665 m/s^2], 0 for no shakes; a shake about an axis gives
    it to points at the object's radius."""
    shake_hz: Annotated[float, Interval(ge=0.1, le=25.0)] = 5.0
    """Frequency of a shake [Hz]."""
    stop_m_per_s2: Quantity = 10.0
    """Deceleration of a stop [m/s^2], which takes at least 0.005 s: at most 200 times the speed."""
    stop_from_m_per_s: Quantity = 0.5
    """Speed before a stop [m/s]."""
    knock_n_s: NotNegative | None = None
    """Impulse of a knock [N s], 0 for no knocks. If not given, the one that gives a free object of
    that mass 1/6 m/s: 0.05 N s for 0.3 kg."""
    off_by: OffBy = "exactly"
    """Whether a misplaced object is off by exactly `off_mm` and `off_deg`, in random directions, or
    by normal errors along and about each axis with these standard deviations, as in `regions`."""
    off_mm: NotNegative = 2.0
    """Distance of a misplaced object from where the fingers expect it [mm]."""
    off_deg: Annotated[float, Interval(ge=0.0, le=180.0)] = 2.0
    """Angle by which a misplaced object is turned [deg]."""
    misplacements: Annotated[int, Interval(ge=1, le=1000)] = 5
    """Number of times that the object is misplaced, each time in a random direction."""
    max_mm: Quantity = 5.0
    """Displacement against the palm up to which an object counts as held [mm]."""
    max_deg: Quantity = 5.0
    """Turn against the palm up to which an object counts as held [deg]."""

    def _check_together(self) -> None:
        HeldSettings._check_together(self)
        if not self.trials:
            known = ", ".join(TRIAL_KINDS)
            raise FieldError("trials", f"must name at least one of {known}, got none")
        ordered = tuple(kind for kind in TRIAL_KINDS if kind in self.trials)
        object.__setattr__(self, "trials", ordered)
        stopping = self.stop_from_m_per_s / self.stop_m_per_s2
        if stopping > LONGEST_S:
            raise InputError(
                f"stop_from_m_per_s over stop_m_per_s2 is the duration of a stop, at most "
                f"{LONGEST_S:g} s, got {stopping:.3g} s; start slower, or stop harder"
            )
        if stopping < SAMPLE_S * (1.0 - DURATION_SLACK):
            raise InputError(
                f"stop_from_m_per_s over stop_m_per_s2 is the duration of a stop, at least the "
                f"{SAMPLE_S:g} s of a sample, got {stopping:.3g} s; start faster, or stop with at "
                f"most {self.stop_from_m_per_s / SAMPLE_S:.6g} m/s^2"
            )


@declared
class ExecutionSettings(ChosenExecution):
    """How grasps are executed, and how far an object may move and still count as held.

    Raises:
        InputError: A number is out of its range, or a trial is unknown.
    """

    seed: Seed = 0
    """Seed of the directions in which objects are misplaced."""

    @property
    def impulse_n_s(self) -> float:
        """Impulse of a knock: as given, or the usual one for the mass [N s]."""
        if self.knock_n_s is not None:
            return self.knock_n_s
        return float(f"{KNOCK_M_PER_S * self.object_kg:.12g}")

    @property
    def used(self) -> Self:
        """Settings with the impulse that is used, as files keep them."""
        return replace(self, knock_n_s=self.impulse_n_s)

    @property
    def most_m(self) -> float:
        """Displacement up to which an object counts as held [m]."""
        return self.max_mm / 1000.0

    @property
    def most_rad(self) -> float:
        """Turn up to which an object counts as held [rad]."""
        return math.radians(self.max_deg)


@declared
class HandTrials(Settings):
    """What a hand does in simulation in each grasp that it reaches, and how strong its motors are.

    Raises:
        InputError: A mass and a density are given.
    """

    torque_limit_n_m: TorqueLimit | None = None
    """Torque limit of every joint [N m], instead of those of the hand."""
    simulate: bool = False
    """Hold test wrenches in simulation with the hand's links and motors, and try negative controls;
    every joint needs a torque limit."""
    mass_kg: Quantity | None = None
    """Mass of the object [kg], with which the hand also executes each grasp that it reaches, as
    `execute` does with fingertips on springs; every joint needs a torque limit."""
    density_kg_m3: Quantity | None = None
    """Density of the object [kg/m^3], with which the hand executes grasps, in place of a mass."""

    def _check_together(self) -> None:
        if self.mass_kg is not None and self.density_kg_m3 is not None:
            raise InputError("mass_kg and density_kg_m3 exclude each other: leave one of them out")

    @property
    def needs_motors(self) -> str:
        """Name of a setting for which motors must have torque limits; empty if there is none."""
        executing = "mass_kg" if self.density_kg_m3 is None else "density_kg_m3"
        if self.simulate:
            return "simulate"
        return executing if getattr(self, executing) is not None else ""


@declared
class Certifying(Settings):
    """How regions are certified."""

    reserve: Reserve = 0.0
    """Share of the friction that the proof does not count on."""
    recenter: bool = False
    """Move the regions to where discs inside the faces can be largest; contacts may then lie
    outside their regions."""
    edge_clearance_m: NotNegative = 0.0
    """How far regions stay from the edges of their faces [m]."""
    max_cones: MaxCones = 10_000
    """Number of cones that one attempt at a proof may use. More cones take longer and enlarge radii
    by some hundredths, or not at all where they are as large as possible."""
    off_mm: NotNegative = 0.0
    """Standard deviation of the object's place along each axis [mm]. With this or another deviation
    above zero, the chance that each grasp is closed is bounded from below."""
    off_deg: Annotated[float, Interval(ge=0.0, le=45.0)] = 0.0
    """Standard deviation of the object's turn about each axis through its centre of mass [deg]."""
    finger_mm: NotNegative = 0.0
    """Standard deviation of each finger in each direction across its own [mm]."""
    friction_sigma: NotNegative = 0.0
    """Standard deviation of the friction, which all contacts share."""

    @property
    def misplacing(self) -> bool:
        """Whether anything may be off what was planned."""
        return max(self.off_mm, self.off_deg, self.finger_mm, self.friction_sigma) > 0.0
