"""The flags of every command: one class per command, one field per flag."""

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, get_args

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from grasp_core.checked import MOST_COUNT
from sim_validate.cli.baseline_flags import Baseline
from sim_validate.cli.dataset_flags import Dataset
from sim_validate.cli.flag_bounds import at_least
from sim_validate.cli.flag_groups import (
    Count,
    Edges,
    Fingers,
    Friction,
    Mesh,
    NotNegative,
    Planning,
    Seed,
    Speech,
    Testing,
    Usual,
    Wrench,
)
from sim_validate.cli.showing_flags import Report, View
from sim_validate.parallel.processes import available_cores

RUN_LIMIT = 100
"""Number of grasps that `run` tests by default, which takes some ten seconds."""


@dataclass(frozen=True, slots=True)
class Run:
    """Plan grasps, test each with its negative controls in MuJoCo, and write everything."""

    object: Positional[str]
    """A mesh file (obj, stl, ply, off, glb) or the name of a built-in object."""
    planning: OmitArgPrefixes[Planning] = field(default_factory=partial(Planning, limit=RUN_LIMIT))
    testing: OmitArgPrefixes[Testing] = field(default_factory=Testing)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for the results; graspproof-out/OBJECT if not given."""
    no_report: bool = False
    """Write no pages; `graspproof report` can write them later."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Find force-closure grasps, each with its certificate checked."""

    object: Positional[str]
    """A mesh file (obj, stl, ply, off, glb) or the name of a built-in object."""
    planning: OmitArgPrefixes[Planning] = field(default_factory=Planning)
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes for --optimize and --regions; results do not depend on it."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for grasps.json; nothing is written if not given."""


@dataclass(frozen=True, slots=True)
class Validate:
    """Test the grasps of a file, with negative controls, in MuJoCo."""

    grasps: Positional[Path]
    """The grasps.json to test."""
    friction: Friction | None = None
    """Coulomb coefficient to test at; the one planned for if not given."""
    limit: Count | None = None
    """Test only this many grasps, from the first."""
    seed: Seed | None = None
    """Seed of random wrenches and moved contacts; the plan's if not given."""
    testing: OmitArgPrefixes[Testing] = field(default_factory=Testing)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for verdicts.json; nothing is written if not given."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Write grasps as MuJoCo scenes that open in MuJoCo's own viewer."""

    grasps: Positional[Path]
    """The grasps.json to write scenes of."""
    grasp: str | None = None
    """Id of one grasp; all of them if not given."""
    friction: Friction | None = None
    """Coulomb coefficient; the one planned for if not given."""
    fingers: OmitArgPrefixes[Fingers] = field(default_factory=Fingers)
    surface: Literal["pads", "mesh"] = "pads"
    """What fingertips touch: one pad each, exact on any object, or a convex object's own mesh."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for the scenes; a single scene is printed if not given."""


@dataclass(frozen=True, slots=True)
class Regions:
    """Certify where fingers may stand, each anywhere in its own region, with a proof."""

    grasps: Positional[Path]
    """The grasps.json whose contacts get regions."""
    grasp: str | None = None
    """Id of one grasp; all of them if not given."""
    limit: Count | None = None
    """Certify only this many grasps, from the first."""
    friction: Friction | None = None
    """Coulomb coefficient; the one planned for if not given."""
    reserve: Annotated[float, at_least(0.0, up_to=0.99)] = 0.0
    """Share of the friction that the proof does not count on."""
    balance: Literal["radius", "area"] = "radius"
    """Prefer large discs for all fingers, or much area in total, which may have smaller discs and
    is several times slower."""
    recenter: bool = False
    """Move the regions to where discs inside the faces can be largest; contacts may then lie
    outside their regions."""
    edge_clearance_m: NotNegative = 0.0
    """How far regions stay from the edges of their faces [m]."""
    max_cones: Annotated[int, at_least(64, up_to=1_000_000)] = 10_000
    """Effort: the number of cones that one attempt at a proof may use. More cones enlarge radii by
    some hundredths, or not at all where they are as large as possible."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes; results do not depend on it."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for regions.json and the proofs; nothing is written if not given."""


@dataclass(frozen=True, slots=True)
class Replay:
    """Simulate one trial of a file again and write what moved, sample by sample, and a clip."""

    source: Positional[Path]
    """A baseline, verdicts.json or grasps.json, the folder of a run, or a dataset."""
    grasp: str | None = None
    """Id of the grasp; may be left out where there is only one."""
    wrench: str | None = None
    """Name of the wrench; if not given, the first that was not held, or else the weakest."""
    control: str | None = None
    """Replay a negative control made from the grasp, by name."""
    trial: Annotated[int, at_least(0, up_to=MOST_COUNT)] | None = None
    """Replay the repeat with noise that has this number."""
    grasps: Path | None = None
    """The grasps.json of the verdicts or the baseline, if it is not where they say."""
    out: Path | None = None
    """Folder for scene.xml, trace.csv and, where graphics are available, clip.gif."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Analyze:
    """Judge contacts of any origin: closure with its certificate, quality, wrench limits."""

    contacts: Positional[Path]
    """A contacts file (see docs/files.md), or a grasps.json."""
    friction: Friction | None = None
    """Coulomb coefficient of contacts that have none of their own; the file's if not given."""
    torque_scale_m: Usual | None = None
    """Length that makes a torque comparable with a force [m]; the file's if not given."""
    max_normal_force: Usual = 10.0
    """Largest normal force of each contact [N]."""
    wrench: Annotated[UseAppendAction[tuple[Wrench, ...]], arg(metavar="FX FY FZ TX TY TZ")] = ()
    """An external wrench [N, N m], torque about the center; may be repeated."""
    outward: bool = False
    """Say that the file's normals point out of the object."""
    edges: Edges = 8
    """Number of edges of the pyramids that stand for friction cones in min-weight and hull
    volume."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes; results do not depend on it."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Inspect:
    """Show a mesh as a polyhedron: faces, mass properties, spanning quadruples."""

    object: Positional[str]
    """A mesh file (obj, stl, ply, off, glb) or the name of a built-in object."""
    mesh: OmitArgPrefixes[Mesh] = field(default_factory=Mesh)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Objects:
    """List the built-in objects."""

    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Doctor:
    """Check this installation: versions, solvers, simulator."""

    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


Command = (
    Run
    | Plan
    | Validate
    | Scene
    | View
    | Report
    | Regions
    | Replay
    | Analyze
    | Dataset
    | Baseline
    | Inspect
    | Objects
    | Doctor
)


COMMANDS = {kind.__name__.lower(): kind for kind in get_args(Command)}
"""The classes of flags, by the names of their commands."""
