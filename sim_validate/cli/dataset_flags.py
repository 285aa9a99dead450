"""The flags of the commands about datasets; this module imports nothing that is slow to load."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, subcommand

from grasp_core.checked import MOST_RANDOM_WRENCHES
from sim_validate.cli.flag_bounds import FINITE, at_least, more_than
from sim_validate.cli.flag_groups import Count, Friction, Lengths, Positive, Seed, Speech
from sim_validate.cli.learning_flags import Learned
from sim_validate.datasets.columns import ExportFormat, SplitName
from sim_validate.parallel.processes import available_cores


@dataclass(frozen=True, slots=True)
class Planning:
    """Which grasps of each object a dataset holds."""

    family: UseAppendAction[tuple[Literal["concurrent", "pencil", "regulus", "free"], ...]] = ()
    """Family of grasps to construct; may be repeated; all families if not given."""
    limit: Count = 20
    """Largest number of grasps of each object, friction and family."""
    cones: Literal["normal", "tilted"] = "tilted"
    """Axes of the force cones that grasps are constructed with: only the face normals, or tilted
    ones too."""


@dataclass(frozen=True, slots=True)
class Work:
    """Where a dataset is computed, and how much time and memory; no row depends on these."""

    engine: Literal["local", "ray", "dask"] = "local"
    """Where to compute: in processes of this machine, or on a Ray or Dask cluster."""
    address: str | None = None
    """Address of the Ray or Dask cluster; if not given, one is started on this machine."""
    timeout_s: Positive = 3600.0
    """Time after which an attempt at one object and friction is stopped; each gets two attempts
    [s]."""
    memory_mb: Count | None = None
    """Memory that a process may use beyond that of a process that has just started [MiB]."""
    jobs: Count = field(default_factory=available_cores)
    """Number of processes; results do not depend on it."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a dataset is made of, whether its grasps are planned or given."""

    friction: UseAppendAction[tuple[Friction, ...]] = ()
    """Coulomb coefficient to plan and simulate with; may be repeated; 0.5 if not given."""
    lengths: OmitArgPrefixes[Lengths] = field(default_factory=Lengths)
    faces: Literal["auto", "planar", "patches"] = "auto"
    """Faces to plan on: exact planar faces, or nearly flat patches of a curved or scanned surface.
    """
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    random_wrenches: Annotated[int, at_least(0, up_to=MOST_RANDOM_WRENCHES)] = 0
    """Number of random wrenches that each grasp must hold as well."""
    seed: Annotated[int, at_least(0, up_to=2**63 - 1)] = 0
    """Seed of all random choices."""
    scenes: bool = False
    """Also write each grasp as a MuJoCo scene."""
    title: str = "four-finger grasps"
    """Title of the dataset, for its README.md."""
    license: str = ""
    """License of the dataset, such as CC-BY-4.0, for its README.md."""
    creator: str = ""
    """Who makes the dataset, for its README.md."""
    url: str = ""
    """Web address at which the dataset will be found, for its README.md."""
    published: str = ""
    """Date of publication, such as 2026-11-22, for its README.md."""


@dataclass(frozen=True, slots=True)
class Build:
    """Plan and simulate grasps of many objects and write tables; run it again to resume."""

    objects: Positional[tuple[str, ...]]
    """Mesh files, folders of mesh files, or names of built-in objects; or one TOML file with all
    settings but --out (see docs/datasets.md)."""
    out: Path
    """Folder of the dataset."""
    stats: Path | None = None
    """Folder for a page that shows what the dataset holds, with charts, as `dataset stats` writes
    it; if not given, none is written."""
    planning: OmitArgPrefixes[Planning] = field(default_factory=Planning)
    learned: OmitArgPrefixes[Learned] = field(default_factory=Learned)
    settings: OmitArgPrefixes[Settings] = field(default_factory=Settings)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Import:
    """Judge grasps made by another tool, simulate them, and write them as a dataset."""

    contacts: Positional[Path]
    """A contacts file (JSON) or npz file of four contacts for each grasp (see docs/datasets.md)."""
    object: Positional[str]
    """The mesh file that the contacts are on, or the name of a built-in object."""
    out: Path
    """Folder of the dataset."""
    outward: bool = False
    """Read the file's normals as pointing out of the object, not into it."""
    settings: OmitArgPrefixes[Settings] = field(default_factory=Settings)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Verify:
    """Check files and rows of a dataset, prove force closure again, and redo a sample."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    share: Annotated[float, FINITE, at_least(0.0, up_to=1.0)] = 0.01
    """Share of all objects and frictions that is computed again, at least one; 0 for none."""
    seed: Seed = 0
    """Seed of the random choice of the sample that is computed again."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Export:
    """Write a dataset in a format that other tools read."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    to: ExportFormat
    """csv, jsonl: a text file per table. npz: an archive of arrays without pickle per table. hdf5:
    one file. isaac: an Isaac grasp file per object and friction. mjcf: a MuJoCo scene per grasp."""
    out: Path
    """Folder to write to; it must be empty or not exist."""
    split: SplitName | None = None
    """Export only the objects of this split; if not given, all objects."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Stats:
    """Count a dataset's rows by kind and outcome, and show how its numbers spread."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    out: Path | None = None
    """Folder for a page with charts and for the numbers as JSON; if not given, only counts are
    printed."""
    split: SplitName | None = None
    """Count only the objects of this split; if not given, all objects."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class SampleRows:
    """Show some rows of a dataset on a page, with pictures of their contacts."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    out: Path
    """Folder for the page."""
    count: Annotated[int, at_least(1, up_to=1000)] = 50
    """Number of rows."""
    seed: Seed = 0
    """Seed of the random choice of the rows."""
    split: SplitName | None = None
    """Show only objects of this split; if not given, all objects."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Depth:
    """Draw depth images of the objects, with the poses of the cameras; this needs graphics."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    out: Path
    """Folder to write to; it must be empty or not exist."""
    views: Annotated[int, at_least(1, up_to=1000)] = 8
    """Number of images of each object."""
    on_table: bool = False
    """Have the object lie on a table and look from above it; if not given, look from all around."""
    width: Annotated[int, at_least(1, up_to=4096)] = 128
    """Columns of an image [pixels]."""
    height: Annotated[int, at_least(1, up_to=4096)] = 128
    """Rows of an image [pixels]."""
    field_deg: Annotated[float, FINITE, more_than(0.0, up_to=120.0)] = 40.0
    """Angle between the upper and the lower border of an image [deg]."""
    seed: Seed = 0
    """Seed of the places of cameras, and of the poses on the table."""
    split: SplitName | None = None
    """Draw only objects of this split; if not given, all objects."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Dataset:
    """Build a dataset of grasps of many objects; check, show or export datasets."""

    action: OmitArgPrefixes[
        Annotated[Build, subcommand("build", prefix_name=False)]
        | Annotated[Import, subcommand("import", prefix_name=False)]
        | Annotated[Verify, subcommand("verify", prefix_name=False)]
        | Annotated[Export, subcommand("export", prefix_name=False)]
        | Annotated[Stats, subcommand("stats", prefix_name=False)]
        | Annotated[SampleRows, subcommand("sample", prefix_name=False)]
        | Annotated[Depth, subcommand("depth", prefix_name=False)]
    ]

    @property
    def speech(self) -> Speech:
        """How much the command prints."""
        return self.action.speech
