"""What users choose for executions: mass, springs, trials, and what counts as survival."""

import math
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any, Literal, Self, TypeAlias, get_args

from grasp_core.declared import FieldError, types
from grasp_core.errors import InputError, about
from grasp_core.execution.grips import STIFFNESS_N_PER_M
from grasp_core.files.records import FLAT
from grasp_core.kinds import NotNegative, Quantity, Range, Seed
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.settings import Settings, named
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
class ExecutionSettings(Settings):
    """How grasps are executed, and how far an object may move and still count as held.

    Raises:
        InputError: A number is out of its range, or a trial is unknown.
    """

    mass_kg: Quantity
    """Mass of the object [kg]; `body.mass_at(density_kg_m3)` gives it from a density."""
    push_n: Quantity = 10.0
    """Largest normal force of a finger, at rest and under the loads that are planned for [N]."""
    stiffness_n_per_m: Quantity = STIFFNESS_N_PER_M
    """Stiffness of the fingertips' springs [N/m]."""
    tip_radius_m: Quantity | None = None
    """Radius of the fingertips; None for a tenth of the object's radius, or less where that would
    overlap something [m]."""
    hand: HeldSettings = field(default_factory=HeldSettings)
    """Masses and damping of the fingers, and the direction of gravity."""
    trials: tuple[TrialKind, ...] = KINDS
    lift_m: Quantity = 0.2
    """Height that the object is lifted by [m]."""
    lift_s: Annotated[float, Range(least=0.05, most=LONGEST_S)] = 0.6
    """Duration of the lift, from 0.05 to 100 [s]."""
    shake_g: NotNegative = 1.0
    """Largest acceleration of a shake [9.80665 m/s^2]; a shake about an axis gives it to points at
    the object's radius."""
    shake_hz: Annotated[float, Range(least=0.1, most=25.0)] = 5.0
    """Frequency of a shake, from 0.1 to 25 [Hz]."""
    stop_m_per_s2: Quantity = 10.0
    """Deceleration of a stop [m/s^2]."""
    stop_from_m_per_s: Quantity = 0.5
    """Speed before a stop [m/s]."""
    knock_n_s: NotNegative | None = None
    """Impulse of a knock [N s]; None for the mass times a sixth of a metre per second."""
    off_mm: NotNegative = 2.0
    """Distance of a misplaced object from where the fingers expect it [mm]."""
    off_deg: Annotated[float, Range(least=0.0, most=180.0)] = 2.0
    """Angle by which a misplaced object is turned [degrees]."""
    misplacements: Annotated[int, Range(least=1, most=1000)] = 5
    """How many times the object is misplaced, each in a direction of its own."""
    seed: Seed = 0
    """Seed of these directions."""
    most_mm: Quantity = 5.0
    """Displacement against the palm up to which an object counts as held [mm]."""
    most_deg: Quantity = 5.0
    """Turn against the palm up to which an object counts as held [degrees]."""

    def _check_together(self) -> None:
        if not self.trials:
            raise FieldError("trials", f"must name at least one of {', '.join(KINDS)}, got none")
        object.__setattr__(self, "trials", tuple(kind for kind in KINDS if kind in self.trials))
        stopping = self.stop_from_m_per_s / self.stop_m_per_s2
        if stopping > LONGEST_S:
            raise InputError(
                f"stop_from_m_per_s over stop_m_per_s2 is the duration of a stop, at most "
                f"{LONGEST_S:g} s, got {stopping:.3g} s; start slower, or stop harder"
            )

    @property
    def impulse_n_s(self) -> float:
        """Impulse of a knock: as given, or the usual one for the mass [N s]."""
        if self.knock_n_s is not None:
            return self.knock_n_s
        return float(f"{KNOCK_M_PER_S * self.mass_kg:.12g}")

    @property
    def used(self) -> "ExecutionSettings":
        """Settings with the impulse that is used, as files keep them."""
        return replace(self, knock_n_s=self.impulse_n_s)

    @property
    def most_m(self) -> float:
        """Displacement up to which an object counts as held [m]."""
        return self.most_mm / 1000.0

    @property
    def most_rad(self) -> float:
        """Turn up to which an object counts as held [rad]."""
        return math.radians(self.most_deg)


TABLE = "execution"
"""Name of the table in a settings file."""
MASS, DENSITY = "mass_kg", "density_kg_m3"

ANY_MASS_KG = 1.0
"""Mass that stands in the settings until a density gives each object its own."""


@dataclass(frozen=True, slots=True)
class AskedExecution(Settings):
    """How the grasps of all objects of a file are executed."""

    settings: Annotated[ExecutionSettings, FLAT]
    density_kg_m3: Quantity | None = None
    """Density of every object; None where all objects have the mass of the settings [kg/m^3]."""

    def settings_for(self, body: Polyhedron) -> ExecutionSettings:
        """Return the settings with the mass of an object."""
        if self.density_kg_m3 is None:
            return self.settings
        return replace(self.settings, mass_kg=body.mass_at(self.density_kg_m3))

    @classmethod
    def of_table(cls, table: object, where: str = TABLE, usual: Any = None) -> Self:
        """Read the table `[execution]` of a file: settings, with a density in place of the mass."""
        del usual  # a table says all that differs from the usual settings
        given = named(table, (*types(ExecutionSettings), DENSITY), where)
        if (MASS in given) == (DENSITY in given):
            got = "both" if MASS in given else "neither"
            raise InputError(f"{where}: expected one of {MASS} and {DENSITY}, got {got}")
        density = given.pop(DENSITY, None)
        settings = ExecutionSettings.of_table({MASS: ANY_MASS_KG, **given}, where)
        with about(where):
            return cls(settings, density)


def execution_table(asked: AskedExecution) -> dict[str, Any]:
    """Return every setting as the table that gives the same settings when it is read."""
    given = asdict(asked.settings).items()
    table = {name: value for name, value in given if value is not None}  # TOML has no null
    if asked.density_kg_m3 is None:
        return table
    del table[MASS]
    return {DENSITY: asked.density_kg_m3, **table}
