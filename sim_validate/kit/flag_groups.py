"""Groups of flags that several commands share, beside the classes of settings that are groups.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, UseAppendAction, arg

from grasp_core.kinds import Cases, Count, Direction, Quantity, Range, Size, Vector
from grasp_core.mesh_files.limits import Lengths, MeshChoices
from grasp_core.planning.settings import PlanSettings
from grasp_core.settings import Settings
from scenes.settings import ScaledScene
from sim_validate.kit.processes import available_cores
from sim_validate.settings.trials import ChosenTrials

Positive = Annotated[float, Range(above=0.0)]
NotNegative = Annotated[float, Range(least=0.0)]
Jobs = Annotated[
    Count, arg(help="Largest number of processes; results do not depend on it.")
]  # fmt: skip
ObjectName = Annotated[
    str, arg(help="A mesh file (obj, stl, ply, off, glb) or the name of a built-in object.")
]
Wrench = Annotated[tuple[float, float, float, float, float, float], Size()]
ProtocolName = Literal[
    "dexgraspbench",
    "dexgraspbench-paper",
    "dexonomy",
    "mj-grasp-sim",
    "molmospaces",
]
"""Names of the published tests, which `sim_validate/protocols` holds."""
PLAIN = arg(name="")
"""Mark of a group whose flags have no prefix; groups inside it keep theirs."""


@dataclass(frozen=True, slots=True, repr=False)
class Speech(Settings):
    """How much a command prints, and in which form."""

    json: bool = False
    """Print one JSON document on standard output, and everything else on standard error."""
    quiet: Annotated[bool, arg(aliases=["-q"])] = False
    """Print only errors."""
    verbose: Annotated[bool, arg(aliases=["-v"])] = False
    """Print more, and show where an internal error happened."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Spoken(Settings):
    """The flags that every command has."""

    speech: Annotated[Speech, PLAIN] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True, repr=False)
class Mesh(Settings):
    """How a mesh file is read."""

    lengths: Annotated[Lengths, PLAIN] = field(default_factory=Lengths)
    choices: Annotated[MeshChoices, PLAIN] = field(default_factory=MeshChoices)
    center_of_mass_m: Annotated[Vector | None, arg(metavar="X Y Z")] = None
    """Centre of mass in the file's frame, in metres. If not given, it is that of uniform density,
    or of the convex hull where the surface has large holes."""


@dataclass(frozen=True, slots=True, repr=False)
class Planning(PlanSettings):
    """Which grasps to plan."""

    mesh: Annotated[Mesh, PLAIN] = field(default_factory=Mesh)
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


@dataclass(frozen=True, slots=True, repr=False)
class Testing(Settings):
    """Which trials to simulate, and how they are simulated."""

    scene: OmitArgPrefixes[ScaledScene] = field(default_factory=ScaledScene)
    more: Annotated[ChosenTrials, PLAIN] = field(default_factory=ChosenTrials)
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
