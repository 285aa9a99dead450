"""The flags of commands that simulate grasps, prove regions around contacts, or write scenes.

They are apart from `flags`, so that other commands need not import the settings of all
this. This module imports nothing that is slow to load, so that help and usage errors answer at
once.
"""

from collections.abc import Mapping
from dataclasses import field
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from grasp_core.allowed_values import Direction, Quantity, Seed, TimeLimit
from grasp_core.declared import declared
from grasp_core.settings import Settings
from scenes.settings import EXPORT_ENDINGS, GraspFormat, ScaledScene
from sim_validate.commands.flags import (
    BARE,
    AtFriction,
    FirstOnly,
    GraspId,
    GraspsPath,
    Jobs,
    ObjectName,
    Planning,
    Positive,
    Spoken,
)
from sim_validate.processes.workers import available_cores
from sim_validate.settings import (
    Certifying,
    ChosenExecution,
    ChosenTrials,
    Holding,
    ProtocolName,
)

WrittenFormat: TypeAlias = GraspFormat | Literal["isaac"]
WRITTEN_ENDINGS: Mapping[WrittenFormat, tuple[str, ...]] = {
    **EXPORT_ENDINGS, "isaac": (".yaml", ".yml"),
}  # fmt: skip
RUN_LIMIT = 100
"""Number of grasps that `run` simulates by default, which takes some ten seconds."""


@declared
class Testing(Settings):
    """Which trials to simulate, and how they are simulated."""

    scene: OmitArgPrefixes[ScaledScene] = field(default_factory=ScaledScene)
    more: Annotated[ChosenTrials, BARE] = field(default_factory=ChosenTrials)
    wrenches: Path | None = None
    """A file of wrenches that each grasp must hold in full (see docs/files.md)."""
    weight_n: Quantity | None = None
    """Also hold the object's weight [N], along and against each axis or in the directions given."""
    weight_down: Annotated[UseAppendAction[tuple[Direction, ...]], arg(metavar="X Y Z")] = ()
    """With --weight-n: a direction in which the weight acts; may be repeated."""
    traces: bool = False
    """With --out: also write how the object and each contact moved over time."""
    setup: Path | None = None
    """A TOML file with settings of the simulation (see docs/files.md)."""
    timeout_s: Positive = 600.0
    """Time after which the trials of one contact set are stopped [s]."""
    jobs: Jobs = field(default_factory=available_cores)


@declared
class RunFlags(Spoken):
    """Flags of the command `run`."""

    object: Positional[ObjectName]
    planning: Annotated[Planning, BARE] = field(default_factory=partial(Planning, limit=RUN_LIMIT))
    testing: Annotated[Testing, BARE] = field(default_factory=Testing)
    out: Path | None = None
    """Folder for the results; if not given, graspproof-out/OBJECT."""
    no_report: bool = False
    """Write no pages about the results; `graspproof report` can write them later."""
    execute: bool = False
    """Also simulate the grasps as a robot executes them, with the object's true mass, springy
    fingers and one fixed squeeze, and write executions.json."""
    executing: Annotated[ChosenExecution, BARE] = field(default_factory=ChosenExecution)


@declared
class ValidateFlags(Spoken):
    """Flags of the command `validate`."""

    grasps: Positional[GraspsPath]
    friction: AtFriction = None
    limit: FirstOnly = None
    seed: Seed | None = None
    """Seed of random wrenches and of moved contacts; if not given, the seed of the plan."""
    protocol: UseAppendAction[tuple[ProtocolName, ...]] = ()
    """Judge the grasps by the published test of another tool, beside our verdict under its loads
    and the predicted margin, instead of by our usual trials; may be repeated."""
    testing: Annotated[Testing, BARE] = field(default_factory=Testing)
    out: Path | None = None
    """Folder for verdicts.json, or for judgements.json with --protocol; if not given, no file is
    written."""


@declared
class ExecuteFlags(Spoken):
    """Flags of the command `execute`."""

    grasps: Positional[GraspsPath]
    grasp: GraspId = None
    friction: AtFriction = None
    limit: FirstOnly = None
    seed: Seed | None = None
    """Seed of the directions of misplaced objects; if not given, the seed of the plan."""
    executing: Annotated[ChosenExecution, BARE] = field(default_factory=ChosenExecution)
    setup: Path | None = None
    """A TOML file whose table `physics` has settings of the simulator (see docs/files.md)."""
    jobs: Jobs = field(default_factory=available_cores)
    out: Path | None = None
    """Folder for executions.json; if not given, no file is written."""


@declared
class SceneFlags(Spoken):
    """Flags of the command `scene`."""

    grasps: Positional[GraspsPath]
    grasp: GraspId = None
    friction: AtFriction = None
    scaled: OmitArgPrefixes[ScaledScene] = field(default_factory=ScaledScene)
    holding: Annotated[Holding, BARE] = field(default_factory=Holding)
    out: Path | None = None
    """Folder for the scenes; if not given, a single scene is printed."""


@declared
class ExportFlags(Spoken):
    """Flags of the command `export`."""

    grasps: Positional[GraspsPath]
    out: Annotated[Path, arg(aliases=("-o",), help=(
        "File to write, which ends in "
        f"{', '.join(f'{ends[0]} for {name}' for name, ends in WRITTEN_ENDINGS.items())}."
    ))]  # fmt: skip
    to: WrittenFormat = "gltf"
    """Format to write: gltf, a binary glTF scene, or isaac, an Isaac grasp file of the hand whose
    poses `graspproof reach --out` has written beside the grasps (see docs/files.md)."""
    grasp: GraspId = None
    limit: FirstOnly = None
    fingertip_radius_m: Quantity | None = None
    """Radius of the fingertips [m]; if not given, the one planned for, or a tenth of the object's
    radius, or less if that does not fit."""


@declared
class RegionFlags(Spoken):
    """Flags of the command `regions`."""

    grasps: Positional[GraspsPath]
    grasp: GraspId = None
    limit: FirstOnly = None
    friction: AtFriction = None
    certifying: Annotated[Certifying, BARE] = field(default_factory=Certifying)
    time_limit_s: TimeLimit | None = None
    """Time after which no more regions are begun; those that are proved are kept [s]."""
    jobs: Jobs = field(default_factory=available_cores)
    out: Path | None = None
    """Folder for regions.json and the proofs; if not given, no file is written."""
