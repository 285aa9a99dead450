"""What users choose for executions: mass, springs, trials, and what counts as survival."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self, TypeAlias, get_args

from grasp_core.declared import FieldError
from grasp_core.errors import InputError
from grasp_core.kinds import NotNegative, Quantity, Range, Seed
from scenes.mujoco.held import HeldSettings

TrialKind: TypeAlias = Literal["weight", "lift", "shake", "stop", "knock", "misplaced"]
"""What a trial does: it turns gravity through all directions, lifts the object off a table, shakes
or stops the palm, strikes the object, or closes fingers on an object that is not where it should
be."""
KINDS: tuple[TrialKind, ...] = get_args(TrialKind)
KNOCK_M_PER_S = 1.0 / 6.0
"""Speed that the usual knock gives a free object [m/s], 0.05 N s for 0.3 kg. So its load grows with
the mass, as those of all other trials do, and a screw is not shot away."""

LONGEST_S = 100.0
"""Longest duration of a lift or a stop [s]."""


@dataclass(frozen=True, slots=True, repr=False)
class Holding(HeldSettings):
    """What holds the object, and how hard."""

    push_n: Quantity = 10.0
    """Largest normal force of a finger, at rest and under the loads that are planned for [N]."""
    tip_stiffness_n_per_m: Quantity = 2000.0
    """Stiffness of the springs on which fingertips slide [N/m]."""
    tip_radius_m: Quantity | None = None
    """Radius of the springy fingertips in executions [m]; if not given, that of the plan, or a
    tenth of the object's radius, or less where that would overlap something."""


@dataclass(frozen=True, slots=True, repr=False)
class ChosenExecution(Holding):
    """How grasps are executed, and how far an object may move and still count as held."""

    trials: tuple[TrialKind, ...] = KINDS
    """Names of the trials."""
    lift_m: Quantity = 0.2
    """Height by which the object is lifted off its table [m]."""
    lift_s: Annotated[float, Range(least=0.05, most=LONGEST_S)] = 0.6
    """Duration of the lift [s]."""
    shake_g: NotNegative = 1.0
    """Largest acceleration of a shake [9.80665 m/s^2], 0 for no shakes; a shake about an axis gives
    it to points at the object's radius."""
    shake_hz: Annotated[float, Range(least=0.1, most=25.0)] = 5.0
    """Frequency of a shake [Hz]."""
    stop_m_per_s2: Quantity = 10.0
    """Deceleration of a stop [m/s^2]."""
    stop_from_m_per_s: Quantity = 0.5
    """Speed before a stop [m/s]."""
    knock_n_s: NotNegative | None = None
    """Impulse of a knock [N s], 0 for no knocks. If not given, the one that gives a free object of
    that mass 1/6 m/s: 0.05 N s for 0.3 kg."""
    off_mm: NotNegative = 2.0
    """Distance of a misplaced object from where the fingers expect it [mm]."""
    off_deg: Annotated[float, Range(least=0.0, most=180.0)] = 2.0
    """Angle by which a misplaced object is turned [deg]."""
    misplacements: Annotated[int, Range(least=1, most=1000)] = 5
    """Number of times that the object is misplaced, each time in a random direction."""
    max_mm: Quantity = 5.0
    """Displacement against the palm up to which an object counts as held [mm]."""
    max_deg: Quantity = 5.0
    """Turn against the palm up to which an object counts as held [deg]."""

    def _check_together(self) -> None:
        HeldSettings._check_together(self)
        if not self.trials:
            raise FieldError("trials", f"must name at least one of {', '.join(KINDS)}, got none")
        object.__setattr__(self, "trials", tuple(kind for kind in KINDS if kind in self.trials))
        stopping = self.stop_from_m_per_s / self.stop_m_per_s2
        if stopping > LONGEST_S:
            raise InputError(
                f"stop_from_m_per_s over stop_m_per_s2 is the duration of a stop, at most "
                f"{LONGEST_S:g} s, got {stopping:.3g} s; start slower, or stop harder"
            )


@dataclass(frozen=True, slots=True, repr=False)
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
