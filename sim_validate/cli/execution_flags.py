"""The flags of executions: the object's mass, the fingers, the trials, and what counts as held.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from grasp_core.checked import LARGEST
from sim_validate.cli.flag_bounds import Bound, at_least, within
from sim_validate.cli.flag_groups import Count, Direction, Friction, Seed, Speech, Usual
from sim_validate.parallel.processes import available_cores

TRIALS = ("weight", "lift", "shake", "stop", "knock", "misplaced")
UPRIGHT = (0.0, 0.0, -1.0)
DENSITY_KG_M3 = 1000.0
"""Density of an object of which neither mass nor density is given: that of water."""


def trials_in(text: str) -> tuple[str, ...]:
    """Split the value of `--trials` into its words."""
    return tuple(word.strip() for word in text.split(","))


KNOWN_TRIALS = Bound(
    f"must be names among {', '.join(TRIALS)}, separated by commas",
    lambda text: set(trials_in(text)) <= set(TRIALS),
)
Trials = UseAppendAction[tuple[Annotated[str, KNOWN_TRIALS], ...]]
Length = Annotated[float, at_least(0.0, up_to=LARGEST)]


@dataclass(frozen=True, slots=True)
class Mass:
    """How heavy the object is: its mass or its density."""

    mass_kg: Usual | None = None
    """Mass of the object [kg]."""
    density_kg_m3: Usual | None = None
    """Density of the object, in place of --mass-kg [kg/m^3]. If neither is given, executions take
    1000 kg/m^3, and `scene` writes a scene with scaled masses."""


@dataclass(frozen=True, slots=True)
class Tips:
    """The springy fingertips that hold the object."""

    push_n: Usual = 10.0
    """Largest normal force of a finger, at rest and under the loads that are planned for [N]."""
    tip_stiffness_n_per_m: Usual = 2000.0
    """Stiffness of the springs on which fingertips slide [N/m]."""
    tip_radius_m: Usual | None = None
    """Radius of the springy fingertips in executions [m]; if not given, --finger-radius-m of the
    plan, or a tenth of the object's radius, or less where that would overlap something."""
    tip_mass_kg: Usual = 0.05
    """Mass of a fingertip with the part of its finger that moves with it [kg]."""
    damping_ratio: Annotated[float, within("damping_ratio")] = 0.5
    """Damping ratio of the object between the springs."""


@dataclass(frozen=True, slots=True)
class Executing:
    """How hard the trials are, and how far an object may move and still count as held."""

    mass: OmitArgPrefixes[Mass] = Mass()
    tips: OmitArgPrefixes[Tips] = Tips()
    lift_m: Usual = 0.2
    """Height by which the object is lifted off its table [m]."""
    lift_s: Annotated[float, within("lift_s")] = 0.6
    """Duration of the lift [s]."""
    shake_g: Length = 1.0
    """Largest acceleration of a shake [9.80665 m/s^2]; 0 for no shakes."""
    shake_hz: Annotated[float, within("shake_hz")] = 5.0
    """Frequency of a shake [Hz]."""
    stop_m_per_s2: Usual = 10.0
    """Deceleration of a stop [m/s^2]."""
    stop_from_m_per_s: Usual = 0.5
    """Speed before a stop [m/s]."""
    knock_n_s: Length | None = None
    """Impulse of a knock [N s], 0 for no knocks. If not given, the one that gives a free object of
    that mass 1/6 m/s: 0.05 N s for 0.3 kg."""
    off_mm: Length = 2.0
    """Distance of a misplaced object from where the fingers expect it [mm]."""
    off_deg: Annotated[float, within("off_deg")] = 2.0
    """Angle by which a misplaced object is turned [deg]."""
    misplacements: Annotated[int, within("misplacements")] = 5
    """Number of times that the object is misplaced, each time in a random direction."""
    max_mm: Usual = 5.0
    """Displacement against the palm up to which an object counts as held [mm]."""
    max_deg: Usual = 5.0
    """Turn against the palm up to which an object counts as held [deg]."""


@dataclass(frozen=True, slots=True)
class Execute:
    """Simulate grasps as a robot executes them: true mass, springy fingers, one fixed squeeze."""

    grasps: Positional[Path]
    """The grasps.json with the grasps to execute."""
    grasp: str | None = None
    """Id of the grasp to execute; if not given, all grasps are executed."""
    friction: Friction | None = None
    """Coulomb coefficient to simulate with; if not given, the one planned for."""
    limit: Count | None = None
    """Execute only this many grasps, from the first."""
    trials: Annotated[Trials, arg(metavar="NAME,NAME,...")] = ()
    """Names of the trials: weight, lift, shake, stop, knock, misplaced, separated by commas; all if
    not given."""
    down: Annotated[Direction, arg(metavar="X Y Z")] = UPRIGHT
    """Direction of gravity in the object's frame, in the trials that do not choose their own."""
    seed: Seed | None = None
    """Seed of the directions of misplaced objects; if not given, the seed of the plan."""
    executing: OmitArgPrefixes[Executing] = Executing()
    setup: Path | None = None
    """A TOML file whose table `physics` has settings of the simulator (see docs/files.md)."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes; results do not depend on it."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for executions.json; if not given, no file is written."""
