"""The flags of the commands about baselines; this module imports nothing that is slow to load."""

from dataclasses import field
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from grasp_core.allowed_values import Seed
from grasp_core.declared import declared
from grasp_core.transferring.settings import IfChanged
from sim_validate.commands.flags import BARE, FirstOnly, GraspsPath, Jobs, Spoken
from sim_validate.processes.workers import available_cores
from sim_validate.settings import ChosenTrials

MeshPath = Annotated[Path | None, arg(help=(
    "The mesh file that the grasps were planned from; if not given, a file with the object's name "
    "beside them or the baseline."
))]  # fmt: skip


@declared
class RecordFlags(Spoken):
    """Flags of the command `baseline record`."""

    grasps: Positional[GraspsPath]
    out: Annotated[Path, arg(aliases=("-o",))]
    """Path of the baseline to write."""
    limit: FirstOnly = None
    setup: Path | None = None
    """TOML file of simulation settings (see docs/files.md)."""
    wrenches: Path | None = None
    """JSON file of wrenches that each grasp must hold in full (see docs/files.md)."""
    more: Annotated[ChosenTrials, BARE] = field(default_factory=ChosenTrials)
    seed: Seed | None = None
    """Seed of all random choices; if not given, the seed that the grasps were planned with."""
    object: MeshPath = None
    changed_part: IfChanged = field(default_factory=IfChanged)
    jobs: Jobs = field(default_factory=available_cores)


@declared
class CheckFlags(Spoken):
    """Flags of the command `baseline check`."""

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
    object: MeshPath = None
    changed_part: IfChanged = field(default_factory=IfChanged)
    jobs: Jobs = field(default_factory=available_cores)
