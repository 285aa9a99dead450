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
    """Force cones to construct with."""


@dataclass(frozen=True, slots=True)
class Work:
    """Where a dataset is made, and what an object at a friction may take; decides no row."""

    engine: Literal["local", "ray", "dask"] = "local"
    """Processes of this machine, or a Ray or Dask cluster."""
    address: str | None = None
    """Of the cluster; one is started on this machine if not given."""
    timeout_s: Positive = 3600.0
    """Give an object at one friction up after so long, twice [s]."""
    memory_mb: Count | None = None
    """What a process may ask for beyond what it needs to start."""
    jobs: Count = field(default_factory=available_cores)
    """Number of processes; results do not depend on it."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a dataset is made of, however its grasps are found."""

    friction: UseAppendAction[tuple[Friction, ...]] = ()
    """Coulomb coefficient to prove and try at, may be repeated; 0.5 if not given."""
    unit: Literal["m", "cm", "mm", "in"] = "m"
    """What one unit in a mesh file is."""
    faces: Literal["auto", "planar", "patches"] = "auto"
    """Exact planar faces, or nearly flat patches of a curved or scanned surface."""
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    random_wrenches: Annotated[int, at_least(0, up_to=MOST_RANDOM_WRENCHES)] = 0
    """Also hold so many random wrenches."""
    seed: Annotated[int, at_least(0, up_to=2**63 - 1)] = 0
    """For everything random."""
    scenes: bool = False
    """Also write each grasp as a MuJoCo scene."""
    title: str = "four-finger grasps"
    """What to call the dataset; for its card, as the following."""
    license: str = ""
    """Of the dataset, such as CC-BY-4.0."""
    creator: str = ""
    """Who makes it."""
    url: str = ""
    """Where it is to be found."""
    published: str = ""
    """When, such as 2026-11-22."""


@dataclass(frozen=True, slots=True)
class Build:
    """Plan and try the grasps of many objects, and write them as tables; started again, go on."""

    objects: Positional[tuple[str, ...]]
    """Mesh files, folders of mesh files, or names of built-in objects; or one TOML file that says
    all but where to (see docs/datasets.md)."""
    out: Path
    """Folder of the dataset."""
    planning: OmitArgPrefixes[Planning] = field(default_factory=Planning)
    settings: OmitArgPrefixes[Settings] = field(default_factory=Settings)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Import:
    """Judge grasps of other tools, and write them as a dataset."""

    contacts: Positional[Path]
    """A contacts file (JSON) or npz file of four contacts for each grasp (see docs/datasets.md)."""
    object: Positional[str]
    """The mesh file they are on, or the name of a built-in object."""
    out: Path
    """Folder of the dataset."""
    outward: bool = False
    """The file's normals point out of the object."""
    settings: OmitArgPrefixes[Settings] = field(default_factory=Settings)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Verify:
    """Check a dataset: files, rows, each closure from the contacts, and a sample done again."""

    dataset: Positional[Path]
    """Its folder."""
    share: Annotated[float, FINITE, at_least(0.0, up_to=1.0)] = 0.01
    """Part of all objects and frictions that is done again, at least one; 0 for none."""
    seed: Seed = 0
    """For which ones."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Export:
    """Write a dataset in a format that others read."""

    dataset: Positional[Path]
    """Its folder."""
    to: ExportFormat
    """csv, jsonl: a text file per table. npz: arrays without pickle. hdf5: one file. isaac: an
    Isaac grasp file per object and friction. mjcf: a MuJoCo scene per grasp."""
    out: Path
    """Folder to make; it must not be there, or be empty."""
    split: SplitName | None = None
    """Only the objects of this split; all if not given."""
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
        """How much to say."""
        return self.action.speech
