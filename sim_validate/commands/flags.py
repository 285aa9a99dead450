"""The flags of commands: one class per command, one field per flag, and groups that they share.

The range of a flag is that of its type; ranges that several flags share are in `allowed_values`.
This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import KW_ONLY, field
from pathlib import Path
from typing import Annotated

from annotated_types import Interval
from pydantic import AfterValidator
from tyro.conf import Positional, UseAppendAction, arg

from grasp_core.allowed_values import (
    MOST_COUNT,
    Cases,
    Count,
    Edges,
    Friction,
    FrictionOrZero,
    Gap,
    Quantity,
    Share,
    TimeLimit,
    Vector,
    ending,
    nonzero,
)
from grasp_core.declared import declared
from grasp_core.mesh_files.limits import MESH_FORMATS, FileLengths, MeshChoices, MeshLimits
from grasp_core.names import RANKINGS, MeasureName, RankBy
from grasp_core.planning.settings import PlanSettings
from grasp_core.settings import Settings
from grasp_core.transferring.settings import Carrying
from sim_validate.processes.workers import available_cores

Positive = Annotated[float, Interval(gt=0.0)]
Jobs = Annotated[Count, arg(help="Largest number of processes; results do not depend on it.")]
ObjectName = Annotated[
    str, arg(help=f"A mesh file ({', '.join(MESH_FORMATS)}) or the name of a built-in object.")
]
GraspsPath = Annotated[Path, arg(help="A grasps.json, as `plan` writes it.")]
GraspId = Annotated[
    str | None, arg(help="Id of the only grasp to take; if not given, all grasps are taken.")
]
AtFriction = Annotated[
    Friction | None, arg(help="Coulomb coefficient; if not given, the one planned for.")
]
FirstOnly = Annotated[Count | None, arg(help="Take only this many grasps, from the first.")]
SixNumbers = Annotated[tuple[float, float, float, float, float, float], AfterValidator(nonzero)]
BARE = arg(name="", help="")
"""Mark of a group whose flags have no prefix; groups inside it keep theirs."""


@declared
class Speech(Settings):
    """How much a command prints, and in which form."""

    json: bool = False
    """Print one JSON document on standard output, and everything else on standard error."""
    quiet: Annotated[bool, arg(aliases=["-q"])] = False
    """Print only errors."""
    verbose: Annotated[bool, arg(aliases=["-v"])] = False
    """Print more, and show where an internal error happened."""


@declared
class Spoken(Settings):
    """The flags that every command has."""

    _: KW_ONLY
    speech: Annotated[Speech, BARE] = field(default_factory=Speech)


@declared
class MeshFlags(Settings):
    """How a mesh file is read."""

    lengths: Annotated[FileLengths, BARE] = field(default_factory=FileLengths)
    choices: Annotated[MeshChoices, BARE] = field(default_factory=MeshChoices)
    center_of_mass_m: Annotated[Vector | None, arg(metavar="X Y Z")] = None
    """Centre of mass in the file's frame, in metres. If not given, it is that of uniform density,
    or of the convex hull where the surface has large holes."""


@declared
class Planning(PlanSettings):
    """Which grasps to plan."""

    time_limit_s: TimeLimit | None = None
    """Time after which the command ends with what is found by then, within some seconds [s]. Its
    phases, such as those of --optimize, --best and --regions, share it, and the files say if they
    are not complete. If not given, there is no limit."""
    rank_by: Annotated[RankBy, arg(help=(
        "What the best grasps have. "
        f"{'; '.join(f'{name}: {what}' for name, what in RANKINGS.items())}."
    ))] = "radius"  # fmt: skip
    mesh: Annotated[MeshFlags, BARE] = field(default_factory=MeshFlags)
    approach_m: Positive | None = None
    """With --finger-radius-m: keep only grasps that fingers of that radius reach along straight
    paths of this length that do not meet the object [m]. Take about the object's size where fingers
    come from outside, or a few fingertip radii where they only close."""
    optimize: bool = False
    """Move the contacts of each grasp on their faces to raise its Ferrari-Canny quality."""
    regions: bool = False
    """After the grasps are chosen, prove regions around their contacts, as the command `regions`
    does. They replace the regions of the construction if the discs in them around all contacts are
    larger."""
    finger_radius_m: Positive | None = None
    """Radius of your fingertips, whose path --approach-m keeps free [m]. It goes into the plan, and
    the fingertips in simulation have it, too, unless --fingertip-radius-m (in trials of closure) or
    --tip-radius-m (in executions) says otherwise. With --optimize, moved
    contacts stay this far from edges, or half the radius of the largest disc in a face if that is
    less. If not given, they stay a twentieth of the object's radius from edges, or as far as
    planned."""
    ceiling: Cases | None = None
    """With --optimize: also prove an upper bound of the quality that contacts on the same faces can
    reach, as far from edges, within 5 % of what they are known to reach if that takes no more cases
    than this number; 100000 are enough for most grasps."""


PICTURE_TYPES, CLIP_TYPES, PAGE_TYPES = (".svg", ".png"), (".gif", ".webp"), (".html", ".htm")


@declared
class PlanFlags(Spoken):
    """Flags of the command `plan`."""

    object: Positional[ObjectName]
    planning: Annotated[Planning, BARE] = field(default_factory=Planning)
    best: bool = False
    """Also search for the grasp of the largest --measure on any faces, and prove how much better
    any other can be. It comes first; best.json and best-proof.npz hold the proof. Its
    contacts stay --edge-clearance-m from edges, or half the radius of the largest disc in a face
    where that is less; a twentieth of the object's radius if not given."""
    gap: Gap = 0.05
    """With --best: share of the proved bound that the quality may be below it."""
    measure: MeasureName = "ferrari-canny"
    """With --best: what is largest. The Ferrari-Canny quality; the weight that is held in every
    orientation; or the multiple of a task's --wrenches that is resisted."""
    wrenches: Path | None = None
    """With --measure task: JSON file of the task's wrenches (see docs/files.md)."""
    jobs: Jobs = field(default_factory=available_cores)
    out: Path | None = None
    """Folder for grasps.json; if not given, no file is written."""


@declared
class ViewFlags(Spoken):
    """Flags of the command `view`."""

    grasps: Positional[Path]
    """The grasps.json with the grasp to show, or the folder of a run."""
    grasp: str | None = None
    """Id of the grasp to show; if not given, the first one."""
    friction: AtFriction = None
    picture: Annotated[Annotated[Path, ending(*PICTURE_TYPES)] | None, arg(help=(
        f"Write the grasp as a picture like the paper's ({', '.join(PICTURE_TYPES)})."
    ))] = None  # fmt: skip
    page: Annotated[Annotated[Path, ending(*PAGE_TYPES)] | None, arg(help=(
        f"Write a page ({', '.join(PAGE_TYPES)}) on which the grasp can be turned."
    ))] = None  # fmt: skip
    clip: Annotated[Annotated[Path, ending(*CLIP_TYPES)] | None, arg(help=(
        f"Write a clip ({', '.join(CLIP_TYPES)}) of fingers that close, which MuJoCo renders where "
        "there are graphics."
    ))] = None  # fmt: skip
    hand: bool = True
    """Show the hand of the reaches.json beside the grasps, where it reaches the grasp, in the
    picture and on the page."""


@declared
class ReportFlags(Spoken):
    """Flags of the command `report`."""

    folder: Positional[Path]
    """Folder of a run, with its grasps.json; or a folder of such folders."""
    limit: Count | None = None
    """Draw only this many grasps per run, those with problems before others; if not given, all."""
    clips: Annotated[int, Interval(ge=0, le=MOST_COUNT)] = 0
    """Number of grasps per run of which clips of trials are made, those with problems first, if
    graphics are available."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes."""
    out: Path | None = None
    """Folder for the pages; if not given, `report` in the run's folder."""


@declared
class ReplayFlags(Spoken):
    """Flags of the command `replay`."""

    source: Positional[Path]
    """Where the trial is recorded: a verdicts.json, the folder of a run, or a dataset."""
    grasp: str | None = None
    """Id of the grasp; may be left out if there is only one."""
    wrench: str | None = None
    """Name of the wrench; if not given, the first one that was not held, or else the one that is
    hardest to hold."""
    control: str | None = None
    """Name of a negative control (contacts made from the grasp that must fail) to replay instead of
    the grasp."""
    trial: Annotated[int, Interval(ge=0, le=MOST_COUNT)] | None = None
    """Number of a repeat with noise to replay instead of the trial without noise."""
    grasps: Path | None = None
    """The grasps.json that the verdicts are about, if it is not beside them."""
    out: Path | None = None
    """Folder for scene.xml, trace.csv and, where graphics are available, clip.gif."""


@declared
class AnalyzeFlags(Spoken):
    """Flags of the command `analyze`."""

    contacts: Positional[Path]
    """A contacts file (see docs/files.md), or a grasps.json."""
    friction: FrictionOrZero | None = None
    """Coulomb coefficient of contacts without one of their own; if not given, the file's."""
    torque_scale_m: Quantity | None = None
    """Length by which torques are divided to compare them with forces [m]; if not given, the one in
    the file."""
    max_normal_force_n: Quantity = 10.0
    """Largest normal force of each contact [N]."""
    torsion_m: Share = 0.0
    """Torsional coefficient of soft fingertips [m]: the largest torque about the normal of a
    contact over its normal force. Figures that are defined for hard fingertips only are then left
    out."""
    wrench: Annotated[
        UseAppendAction[tuple[SixNumbers, ...]], arg(metavar="FX FY FZ TX TY TZ")
    ] = ()
    """An external wrench whose largest resisted multiple is wanted [N, N m], torque about the
    center; may be repeated."""
    outward: bool = False
    """Read the file's normals as pointing out of the object, not into it."""
    edges: Edges = 8
    """Number of edges of the pyramids that replace friction cones in two quality measures,
    min-weight and hull volume."""
    jobs: Jobs = field(default_factory=available_cores)


@declared
class TransferFlags(Spoken):
    """Flags of the command `transfer`."""

    grasps: Positional[GraspsPath]
    part: Annotated[Positional[str], arg(help=(
        f"The changed part, in the same frame: a mesh file ({', '.join(MESH_FORMATS)}) or the name "
        "of a built-in object."
    ))]  # fmt: skip
    carrying: Annotated[Carrying, BARE] = field(default_factory=Carrying)
    friction: AtFriction = None
    lengths: Annotated[FileLengths, BARE] = field(default_factory=FileLengths)
    center_of_mass_m: Annotated[Vector | None, arg(metavar="X Y Z")] = None
    """Centre of mass of the changed part in the file's frame, in metres; if not given, that of
    uniform density, or the old part's if that was given."""
    limits: Annotated[MeshLimits, BARE] = field(default_factory=MeshLimits)
    out: Path | None = None
    """Folder for transfer.json and the grasps.json of the changed part; if not given, no file is
    written."""


@declared
class InspectFlags(Spoken):
    """Flags of the command `inspect`."""

    object: Positional[ObjectName]
    picture: Annotated[Annotated[Path, ending(*PICTURE_TYPES)] | None, arg(help=(
        f"Write the object as a picture ({', '.join(PICTURE_TYPES)})."
    ))] = None  # fmt: skip
    mesh: Annotated[MeshFlags, BARE] = field(default_factory=MeshFlags)


@declared
class ObjectsFlags(Spoken):
    """Flags of the command `objects`."""


@declared
class DoctorFlags(Spoken):
    """Flags of the command `doctor`."""

    compile: bool = False
    """Compile all inner loops first, on two cores if there are two, as for an image."""


@declared
class SchemaFlags(Spoken):
    """Flags of the command `schema`."""

    kind: Positional[str | None] = None
    """A kind of files, such as `verdicts`, `verdicts.json` or `setup`; if not given, all kinds are
    listed."""
