"""The flags of the commands about datasets; this module imports nothing that is slow to load."""

from dataclasses import field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional

from grasp_core.allowed_values import Count, Seed, Share
from grasp_core.declared import declared
from grasp_core.settings import Settings
from sim_validate.commands.flags import BARE, Positive, Spoken
from sim_validate.datasets.config import (
    Content,
    DatasetHand,
    Learning,
    PlannedContent,
    SplitName,
)
from sim_validate.processes.workers import available_cores


@declared
class Working(Settings):
    """Where units of work are computed, and in which time; no result depends on these."""

    engine: Literal["local", "ray", "dask"] = "local"
    """Where to compute: in processes of this machine, or on a Ray or Dask cluster."""
    address: str | None = None
    """Address of the Ray or Dask cluster; if not given, one is started on this machine."""
    timeout_s: Positive = 3600.0
    """Time after which an attempt at one unit of work is stopped, an object at a friction or some
    records of an object; each gets two attempts [s]."""
    jobs: Count = field(default_factory=available_cores)
    """Number of processes; results do not depend on it."""


@declared
class BuildFlags(Spoken):
    """Flags of the command `dataset build`."""

    objects: Positional[tuple[str, ...]]
    """Mesh files, folders of mesh files, or names of built-in objects; or one TOML file with all
    settings but --out (see docs/datasets.md)."""
    out: Path
    """Folder of the dataset."""
    content: Annotated[PlannedContent, BARE] = field(default_factory=PlannedContent)
    learning: Annotated[Learning, BARE] = field(default_factory=Learning)
    hand: Annotated[DatasetHand, BARE] = field(default_factory=DatasetHand)
    work: Annotated[Working, BARE] = field(default_factory=Working)


@declared
class ImportFlags(Spoken):
    """Flags of the command `dataset import`."""

    contacts: Positional[Path]
    """A contacts file of four contacts for each grasp (see docs/datasets.md)."""
    object: Positional[str]
    """The mesh file that the contacts are on, or the name of a built-in object."""
    out: Path
    """Folder of the dataset."""
    outward: bool = False
    """Read the file's normals as pointing out of the object, not into it."""
    content: Annotated[Content, BARE] = field(default_factory=Content)
    work: Annotated[Working, BARE] = field(default_factory=Working)


@declared
class VerifyFlags(Spoken):
    """Flags of the command `dataset verify`."""

    dataset: Positional[Path]
    """Folder of the dataset, or of the judgements that `judge` has written."""
    share: Share = 0.01
    """Share of all objects and frictions that is computed again, at least one; 0 for none. Of
    judgements all is checked, and nothing simulated again."""
    seed: Seed = 0
    """Seed of the random choice of the sample that is computed again."""


@declared
class ExportFlags(Spoken):
    """Flags of the command `dataset export`."""

    dataset: Positional[Path]
    """Folder of the dataset, which was built with --hand."""
    out: Path
    """Folder for a file of each object; it must be empty or not exist."""
    split: SplitName | None = None
    """Export only the objects of this split; if not given, all objects."""
