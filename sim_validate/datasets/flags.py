"""The flags of the commands about datasets; this module imports nothing that is slow to load."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, subcommand

from grasp_core.checked import MOST_RANDOM_WRENCHES
from grasp_core.kinds import Range
from grasp_core.settings import Settings
from sim_validate.datasets.tables import SplitName
from sim_validate.kit.flag_groups import Count, Friction, Lengths, Positive, Seed, Spoken
from sim_validate.kit.processes import available_cores

Varied = Annotated[int, Range(least=0, most=100)]


@dataclass(frozen=True, slots=True)
class Learned(Settings):
    """What a dataset holds besides for learners; a TOML file can ask for more."""

    friction_below: Varied = 0
    """Rows per grasp with its contacts clearly below their critical friction."""
    friction_near: Varied = 0
    """Rows per grasp within some percent of the critical friction, on either side."""
    friction_above: Varied = 0
    """Rows per grasp clearly above the critical friction."""
    moved_out: Varied = 0
    """Rows per grasp with contacts moved on their faces, each out of its region."""
    figures: UseAppendAction[tuple[Literal["closure", "least_squeeze"], ...]] = ()
    """Figures that each grasp has; may be repeated (see docs/datasets.md for what each costs)."""
    synthetic: Annotated[int, Range(least=0, most=5)] = 5
    """Largest number of synthetic negative controls of each grasp."""
    hand: Literal["", "allegro", "allegro-urdf", "leap"] = ""
    """Hand whose pose is looked for in each grasp in force closure."""

    def asked(self) -> dict[str, Any] | None:
        """Return the settings that were given; None if all are the usual ones."""
        return None if self == Learned() else asdict(self)


@dataclass(frozen=True, slots=True)
class Planning(Settings):
    """Which grasps of each object a dataset holds."""

    family: UseAppendAction[tuple[Literal["concurrent", "pencil", "regulus", "free"], ...]] = ()
    """Family of grasps to construct; may be repeated; all families if not given."""
    limit: Count = 20
    """Largest number of grasps of each object, friction and family."""
    cones: Literal["normal", "tilted"] = "tilted"
    """Axes of the force cones that grasps are constructed with: only the face normals, or tilted
    ones too."""


@dataclass(frozen=True, slots=True)
class Work(Settings):
    """Where a dataset is computed, and how much time; no row depends on these."""

    engine: Literal["local", "ray", "dask"] = "local"
    """Where to compute: in processes of this machine, or on a Ray or Dask cluster."""
    address: str | None = None
    """Address of the Ray or Dask cluster; if not given, one is started on this machine."""
    timeout_s: Positive = 3600.0
    """Time after which an attempt at one object and friction is stopped; each gets two attempts
    [s]."""
    jobs: Count = field(default_factory=available_cores)
    """Number of processes; results do not depend on it."""


@dataclass(frozen=True, slots=True)
class Content(Settings):
    """What a dataset is made of, whether its grasps are planned or given."""

    friction: UseAppendAction[tuple[Friction, ...]] = ()
    """Coulomb coefficient to plan and simulate with; may be repeated; 0.5 if not given."""
    lengths: OmitArgPrefixes[Lengths] = field(default_factory=Lengths)
    faces: Literal["auto", "planar", "patches"] = "auto"
    """Faces to plan on: exact planar faces, or nearly flat patches of a curved or scanned surface.
    """
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    random_wrenches: Annotated[int, Range(least=0, most=MOST_RANDOM_WRENCHES)] = 0
    """Number of random wrenches that each grasp must hold as well."""
    seed: Annotated[int, Range(least=0, most=2**63 - 1)] = 0
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
class Build(Spoken):
    """Plan and simulate grasps of many objects and write tables; run it again to resume."""

    objects: Positional[tuple[str, ...]]
    """Mesh files, folders of mesh files, or names of built-in objects; or one TOML file with all
    settings but --out (see docs/datasets.md)."""
    out: Path
    """Folder of the dataset."""
    planning: OmitArgPrefixes[Planning] = field(default_factory=Planning)
    learned: OmitArgPrefixes[Learned] = field(default_factory=Learned)
    settings: OmitArgPrefixes[Content] = field(default_factory=Content)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)


@dataclass(frozen=True, slots=True)
class Import(Spoken):
    """Judge grasps made by another tool, simulate them, and write them as a dataset."""

    contacts: Positional[Path]
    """A contacts file of four contacts for each grasp (see docs/datasets.md)."""
    object: Positional[str]
    """The mesh file that the contacts are on, or the name of a built-in object."""
    out: Path
    """Folder of the dataset."""
    outward: bool = False
    """Read the file's normals as pointing out of the object, not into it."""
    settings: OmitArgPrefixes[Content] = field(default_factory=Content)
    work: OmitArgPrefixes[Work] = field(default_factory=Work)


@dataclass(frozen=True, slots=True)
class Verify(Spoken):
    """Check files and rows of a dataset, prove force closure again, and redo a sample."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    share: Annotated[float, Range(least=0.0, most=1.0)] = 0.01
    """Share of all objects and frictions that is computed again, at least one; 0 for none."""
    seed: Seed = 0
    """Seed of the random choice of the sample that is computed again."""


@dataclass(frozen=True, slots=True)
class Export(Spoken):
    """Write the grasps of a dataset that are in force closure for another program."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    out: Path
    """Folder to write to; it must be empty or not exist."""
    to: Literal["isaac"] = "isaac"
    """Format: Isaac grasp files, one for each object at each friction."""
    split: SplitName | None = None
    """Export only the objects of this split; if not given, all objects."""


@dataclass(frozen=True, slots=True)
class Dataset(Settings):
    """Build a dataset of grasps of many objects; check or export datasets."""

    action: OmitArgPrefixes[
        Annotated[Build, subcommand("build", prefix_name=False)]
        | Annotated[Import, subcommand("import", prefix_name=False)]
        | Annotated[Verify, subcommand("verify", prefix_name=False)]
        | Annotated[Export, subcommand("export", prefix_name=False)]
    ]
