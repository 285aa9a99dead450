"""The flags of the commands about datasets; nothing heavy is imported here."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, subcommand

from grasp_core.checked import MOST_RANDOM_WRENCHES
from sim_validate.cli.flag_bounds import FINITE, at_least
from sim_validate.cli.flag_groups import Count, Friction, Positive, Seed, Speech
from sim_validate.datasets.columns import ExportFormat, SplitName
from sim_validate.parallel.processes import available_cores


@dataclass(frozen=True, slots=True)
class Planning:
    """Which grasps a dataset holds."""

    family: UseAppendAction[tuple[Literal["concurrent", "pencil", "regulus", "free"], ...]] = ()
    """Construction to try, may be repeated; all if not given."""
    limit: Count = 20
    """Largest number of grasps of each object, friction and family."""
    cones: Literal["normal", "tilted"] = "tilted"
    """Force cones to construct with: only those around the normals, or tilted ones too."""


@dataclass(frozen=True, slots=True)
class Work:
    """Where a dataset is made, and what one object may cost; no row depends on these."""

    engine: Literal["local", "ray", "dask"] = "local"
    """Where to compute: in processes of this machine, or on a Ray or Dask cluster."""
    address: str | None = None
    """Address of the cluster; one is started on this machine if not given."""
    timeout_s: Positive = 3600.0
    """Time after which an attempt at one object and friction is stopped; there are two attempts
    [s]."""
    memory_mb: Count | None = None
    """Memory that a process may use beyond what it needs to start [MiB]."""
    jobs: Count = field(default_factory=available_cores)
    """Number of processes; results do not depend on it."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a dataset is made of, however its grasps are found."""

    friction: UseAppendAction[tuple[Friction, ...]] = ()
    """Coulomb coefficient to prove and try at, may be repeated; 0.5 if not given."""
    unit: Literal["m", "cm", "mm", "in"] = "m"
    """Length of one unit in a mesh file."""
    faces: Literal["auto", "planar", "patches"] = "auto"
    """Exact planar faces, or nearly flat patches of a curved or scanned surface."""
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    random_wrenches: Annotated[int, at_least(0, up_to=MOST_RANDOM_WRENCHES)] = 0
    """Number of random wrenches to hold as well."""
    seed: Annotated[int, at_least(0, up_to=2**63 - 1)] = 0
    """Seed of everything random."""
    scenes: bool = False
    """Also write each grasp as a MuJoCo scene."""
    title: str = "four-finger grasps"
    """Title of the dataset in its card."""
    license: str = ""
    """License of the dataset, such as CC-BY-4.0, for its card."""
    creator: str = ""
    """Who makes the dataset, for its card."""
    url: str = ""
    """Address where the dataset will be found, for its card."""
    published: str = ""
    """Date of publication, such as 2026-11-22, for its card."""


@dataclass(frozen=True, slots=True)
class Build:
    """Plan and try the grasps of many objects, and write tables; run it again to resume."""

    objects: Positional[tuple[str, ...]]
    """Mesh files, folders of mesh files, or names of built-in objects; or one TOML file that gives
    everything but --out (see docs/datasets.md)."""
    out: Path
    """Folder of the dataset."""
    planning: OmitArgPrefixes[Planning] = field(default_factory=Planning)
    settings: OmitArgPrefixes[Settings] = field(default_factory=Settings)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Import:
    """Judge the grasps of another tool, and write them as a dataset."""

    contacts: Positional[Path]
    """A contacts file (JSON) or npz file of four contacts for each grasp (see docs/datasets.md)."""
    object: Positional[str]
    """The mesh file that the contacts are on, or the name of a built-in object."""
    out: Path
    """Folder of the dataset."""
    outward: bool = False
    """Say that the file's normals point out of the object."""
    settings: OmitArgPrefixes[Settings] = field(default_factory=Settings)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Verify:
    """Check a dataset: files, rows, each closure from the contacts, and a sample computed again."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    share: Annotated[float, FINITE, at_least(0.0, up_to=1.0)] = 0.01
    """Share of all objects and frictions that is computed again, at least one; 0 for none."""
    seed: Seed = 0
    """Seed of the choice of what is computed again."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Export:
    """Write a dataset in a format that other tools read."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    to: ExportFormat
    """csv, jsonl: a text file per table. npz: arrays without pickle. hdf5: one file. isaac: an
    Isaac grasp file per object and friction. mjcf: a MuJoCo scene per grasp."""
    out: Path
    """Folder to make; it must not exist, or be empty."""
    split: SplitName | None = None
    """Export only the objects of this split; all if not given."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Dataset:
    """Make a dataset of many objects, check one, or write one in another format."""

    action: OmitArgPrefixes[
        Annotated[Build, subcommand("build", prefix_name=False)]
        | Annotated[Import, subcommand("import", prefix_name=False)]
        | Annotated[Verify, subcommand("verify", prefix_name=False)]
        | Annotated[Export, subcommand("export", prefix_name=False)]
    ]

    @property
    def speech(self) -> Speech:
        """How much the command prints."""
        return self.action.speech
