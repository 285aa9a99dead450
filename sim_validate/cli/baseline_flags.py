"""The flags of the commands about baselines; nothing heavy is imported here."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg, subcommand

from grasp_core.checked import MOST_RANDOM_WRENCHES
from sim_validate.cli.flag_bounds import at_least
from sim_validate.cli.flag_groups import Count, Repeats, Seed, Speech
from sim_validate.parallel.processes import available_cores


@dataclass(frozen=True, slots=True)
class Record:
    """Simulate grasps and keep the results as a file for the repository."""

    grasps: Positional[Path]
    """The grasps.json to simulate."""
    out: Annotated[Path, arg(aliases=("-o",))]
    """The baseline to write."""
    limit: Count | None = None
    """How many grasps to keep; all of them if not given."""
    setup: Path | None = None
    """TOML file of simulation settings (see docs/files.md)."""
    wrenches: Path | None = None
    """JSON file of wrenches to hold beside the usual ones (see docs/files.md)."""
    random_wrenches: Annotated[int, at_least(0, up_to=MOST_RANDOM_WRENCHES)] = 0
    """Number of random wrenches to hold as well."""
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    repeats: OmitArgPrefixes[Repeats] = field(default_factory=Repeats)
    seed: Seed | None = None
    """Seed of everything random; the one planned with if not given."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes; results do not depend on it."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Check:
    """Simulate the grasps of a baseline again and report what changed for each."""

    baseline: Positional[Path]
    """The baseline file to check."""
    grasps: Path | None = None
    """A grasps.json to use in place of the one the baseline names."""
    setup: Path | None = None
    """TOML file of simulation settings to use in place of those the baseline keeps."""
    strict: bool = False
    """Also fail where something is better."""
    bless: bool = False
    """Write the new results over the baseline, whatever they are."""
    junit: Path | None = None
    """Also write a JUnit file, with a case for each grasp."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes; results do not depend on it."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Baseline:
    """Keep verdicts in a repository, and notice when stability changes."""

    action: OmitArgPrefixes[
        Annotated[Record, subcommand("record", prefix_name=False)]
        | Annotated[Check, subcommand("check", prefix_name=False)]
    ]

    @property
    def speech(self) -> Speech:
        """How much the command prints."""
        return self.action.speech
