"""The flags of the commands about baselines; this module imports nothing that is slow to load."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg, subcommand

from grasp_core.checked import MOST_RANDOM_WRENCHES
from grasp_core.kinds import Range
from grasp_core.settings import Settings
from sim_validate.kit.flag_groups import (
    Carrying,
    Count,
    Jobs,
    Quantity,
    Repeats,
    Seed,
    Spoken,
    UnitName,
)
from sim_validate.kit.processes import available_cores


@dataclass(frozen=True, slots=True)
class ChangedPart(Settings):
    """Where the mesh file is, and what to do if it has changed since the grasps were planned."""

    object: Path | None = None
    """The mesh file that the grasps were planned from; if not given, a file with the object's name
    beside them or the baseline."""
    refuse_changed_part: bool = False
    """Refuse a mesh file that has changed, in place of carrying the grasps over to it."""
    carrying: OmitArgPrefixes[Carrying] = field(default_factory=Carrying)
    unit: UnitName | None = None
    """Unit of length in a mesh file that has changed; if not given, the one in which the part is
    about as large as it was."""
    scale: Quantity | None = None
    """Factor on the coordinates of a mesh file, besides its unit; if not given, that of the
    baseline."""


@dataclass(frozen=True, slots=True)
class Record(Spoken):
    """Simulate grasps and write a baseline: a file that records how stable each grasp is."""

    grasps: Positional[Path]
    """The grasps.json with the grasps to simulate."""
    out: Annotated[Path, arg(aliases=("-o",))]
    """Path of the baseline to write."""
    limit: Count | None = None
    """Number of grasps to simulate, from the first; all of them if not given."""
    setup: Path | None = None
    """TOML file of simulation settings (see docs/files.md)."""
    wrenches: Path | None = None
    """JSON file of wrenches that each grasp must hold in full (see docs/files.md)."""
    random_wrenches: Annotated[int, Range(least=0, most=MOST_RANDOM_WRENCHES)] = 0
    """Number of random wrenches that each grasp must hold as well."""
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    repeats: OmitArgPrefixes[Repeats] = field(default_factory=Repeats)
    seed: Seed | None = None
    """Seed of all random choices; if not given, the seed that the grasps were planned with."""
    changed: OmitArgPrefixes[ChangedPart] = field(default_factory=ChangedPart)
    jobs: Jobs = field(default_factory=available_cores)


@dataclass(frozen=True, slots=True)
class Check(Spoken):
    """Simulate the grasps of a baseline again, and report how each result has changed."""

    baseline: Positional[Path]
    """Path of the baseline to check."""
    grasps: Path | None = None
    """Use this grasps.json instead of the one that the baseline names."""
    setup: Path | None = None
    """TOML file of simulation settings to use instead of those in the baseline."""
    strict: bool = False
    """Fail also if a grasp has become better."""
    bless: bool = False
    """Write the new results over the baseline, even if grasps have become worse."""
    changed: OmitArgPrefixes[ChangedPart] = field(default_factory=ChangedPart)
    jobs: Jobs = field(default_factory=available_cores)


@dataclass(frozen=True, slots=True)
class Baseline(Settings):
    """Record simulation results of grasps, and notice later when their stability changes."""

    action: OmitArgPrefixes[
        Annotated[Record, subcommand("record", prefix_name=False)]
        | Annotated[Check, subcommand("check", prefix_name=False)]
    ]
