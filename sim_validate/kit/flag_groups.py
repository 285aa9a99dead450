"""Groups of flags that several commands share.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, UseAppendAction, arg

from grasp_core.checked import (
    BOUNDS,
    LARGEST,
    MOST_EDGES,
    MOST_RANDOM_WRENCHES,
    MOST_TRIALS,
)
from grasp_core.kinds import Count, Friction, Quantity, Range, Seed, Size
from grasp_core.mesh_files import limits as mesh_limits
from grasp_core.settings import Settings
from sim_validate.kit.processes import available_cores

USUAL_MESH = mesh_limits.MeshLimits()
Positive = Annotated[float, Range(above=0.0)]
NotNegative = Annotated[float, Range(least=0.0)]
Gap = Annotated[float, Range(**BOUNDS["gap"])]
Edges = Annotated[int, Range(least=3, most=MOST_EDGES)]
Jobs = Annotated[
    Count, arg(help="Largest number of processes; results do not depend on it.")
]  # fmt: skip
ObjectName = Annotated[
    str, arg(help="A mesh file (obj, stl, ply, off, glb) or the name of a built-in object.")
]
UnitName = Literal["m", "cm", "mm", "in"]
Point = tuple[float, float, float]
Direction = Annotated[Point, Size()]
Wrench = Annotated[tuple[float, float, float, float, float, float], Size()]
ProtocolName = Literal[
    "dexgraspbench",
    "dexgraspbench-paper",
    "dexonomy",
    "mj-grasp-sim",
    "molmospaces",
]
"""Names of the published tests, which `sim_validate/protocols` holds."""
TRIALS = ("weight", "lift", "shake", "stop", "knock", "misplaced")
UPRIGHT = (0.0, 0.0, -1.0)
DENSITY_KG_M3 = 1000.0
"""Density of an object of which neither mass nor density is given: that of water."""


def trials_in(text: str) -> tuple[str, ...]:
    """Split the value of `--trials` into its words."""
    return tuple(word.strip() for word in text.split(","))


@dataclass(frozen=True, slots=True)
class KnownTrials:
    """The condition that a text holds names of trials, separated by commas."""

    def holds(self, value: str) -> bool:
        """Return whether each name is that of a trial."""
        return set(trials_in(value)) <= set(TRIALS)

    def __str__(self) -> str:
        """Return the condition in words."""
        return f"with names among {', '.join(TRIALS)}, separated by commas"


Trials = UseAppendAction[tuple[Annotated[str, KnownTrials()], ...]]
Length = Annotated[float, Range(least=0.0, most=LARGEST)]


@dataclass(frozen=True, slots=True)
class Speech(Settings):
    """How much a command prints, and in which form."""

    json: bool = False
    """Print one JSON document on standard output, and everything else on standard error."""
    quiet: Annotated[bool, arg(aliases=["-q"])] = False
    """Print only errors."""
    verbose: Annotated[bool, arg(aliases=["-v"])] = False
    """Print more, and show where an internal error happened."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spoken(Settings):
    """The flags that every command has."""

    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class MeshLimits(Settings):
    """How large a mesh file and its contents may be."""

    max_mesh_bytes: Count = USUAL_MESH.max_bytes
    """Largest size of a mesh file that is read [bytes]."""
    max_triangles: Count = USUAL_MESH.max_triangles
    """Largest number of triangles of a mesh."""
    max_faces: Count = USUAL_MESH.max_faces
    """Largest number of planar faces of an object."""
    max_parts: Count = USUAL_MESH.max_parts
    """Largest number of separate parts of a surface."""


@dataclass(frozen=True, slots=True)
class Lengths(Settings):
    """What lengths the numbers of a mesh file mean."""

    unit: UnitName = "m"
    """Unit of length in a mesh file."""
    scale: Quantity = 1.0
    """Factor on the coordinates of a mesh file, besides its unit."""


@dataclass(frozen=True, slots=True)
class Mesh(Settings):
    """How a mesh file is read."""

    lengths: OmitArgPrefixes[Lengths] = Lengths()
    faces: Literal["auto", "planar", "patches"] = "auto"
    """Faces to plan on: exact planar faces, or nearly flat patches of a curved or scanned surface,
    which may have holes; auto takes patches where there are more than 200 planar faces."""
    patches: Annotated[int, Range(**BOUNDS["patches"])] = 20
    """Keep at most this many patches, those with the largest inscribed discs."""
    patch_spread_deg: Annotated[float, Range(**BOUNDS["patch_spread_deg"])] = 10.0
    """Largest angle between the surface and a patch's plane [deg]; the friction angle to plan with
    shrinks by as much."""
    patch_depth: Annotated[float, Range(**BOUNDS["patch_depth"])] = 0.01
    """Largest distance of the surface from a patch's plane, relative to the object's extent."""
    center_of_mass_m: Annotated[Point | None, arg(metavar="X Y Z")] = None
    """Centre of mass in the file's frame, in metres. If not given, it is that of uniform density,
    or of the convex hull where the surface has large holes."""
    flatness_m: NotNegative | None = None
    """Distance within which corners count as in one plane [m]. If not given, it is a millionth of
    the extent, or what the rounding of the file's coordinates explains."""
    largest_part: bool = False
    """Use the largest part of the mesh alone; otherwise at most 1 % of its surface is left out."""
    limits: OmitArgPrefixes[MeshLimits] = MeshLimits()


@dataclass(frozen=True, slots=True)
class Planning(Settings):
    """Which grasps to plan."""

    mesh: OmitArgPrefixes[Mesh] = Mesh()
    friction: Friction = 0.5
    """Coulomb coefficient at every contact."""
    theta_deg: Positive | None = None
    """Half-angle of the friction cones to plan with [deg]; if not given, that of the friction
    coefficient."""
    family: UseAppendAction[tuple[Literal["concurrent", "pencil", "regulus", "free"], ...]] = ()
    """Family of grasps to construct; may be repeated; all families if not given. `free` looks for
    grasps of any type on the faces that the other families leave over. For faces without a grasp it
    proves that they have none, or says that it is undecided."""
    cones: Literal["normal", "tilted"] = "tilted"
    """Axes of the force cones that grasps are constructed with: only the face normals, as in the
    paper, or tilted ones too, which serve boxes, prisms and any friction."""
    limit: Count | None = None
    """Keep at most this many grasps, the best ones; if not given, `plan` keeps all."""
    rank_by: Literal["radius", "friction-margin", "ferrari-canny", "payload", "diverse"] = "radius"
    """Which grasps are best: those with the largest discs, of each family in turn; with the least
    critical friction; with the largest quality; that carry the largest mass in any orientation
    under one squeeze of at most 10 N; or each next one the farthest from those before it."""
    max_face_parts: Count = 1
    """Number of parts into which the family `free` may divide the four faces while it is undecided.
    """
    complete: bool = False
    """Divide the faces on which it is undecided whether a grasp exists, until each case is decided.
    """
    approach_m: Positive | None = None
    """With --finger-radius-m: keep only grasps that fingers of that radius reach along straight
    paths of this length that do not meet the object [m]. Take about the object's size where fingers
    come from outside, or a few fingertip radii where they only close."""
    edge_clearance_m: NotNegative = 0.0
    """How far contacts and their regions stay from the edges of their faces [m]."""
    share_faces_m: NotNegative | None = None
    """Let two fingers stand on one face, at least this far apart [m]."""
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
    ceiling: Annotated[int, Range(**BOUNDS["ceiling"])] | None = None
    """With --optimize: also prove an upper bound of the quality that contacts on the same faces can
    reach, as far from edges, within 5 % of what they are known to reach if that takes no more cases
    than this number; 100000 are enough for most grasps."""
    seed: Seed = 0
    """Seed of all random choices."""


@dataclass(frozen=True, slots=True)
class Fingers(Settings):
    """How fingertips are built; values that are not given are chosen to suit the grasp."""

    max_normal_force: Quantity = 10.0
    """Largest normal force of each finger [N]."""
    fingertip_radius_m: Quantity | None = None
    """Radius of the fingertips in trials of closure [m]; if not given, --finger-radius-m of the
    plan, or a tenth of the object's radius, or less if that does not fit."""
    fingertip_mass_kg: Quantity | None = None
    """Mass of a fingertip [kg]; if not given, it is chosen so that similar grasps behave alike."""
    stiffness_n_per_m: Quantity | None = None
    """Stiffness of the servos that drive a fingertip [N/m]; if not given, it is chosen so that
    similar grasps behave alike."""
    torsion_m: Annotated[float, Range(**BOUNDS["torsion_m"])] = 0.0
    """Torsional coefficient of the fingertips [m]: the largest torque about the normal of a contact
    over its normal force. Zero is a hard fingertip; a soft one has a fraction of the size of the
    area that it touches."""
    approach: Annotated[Direction | None, arg(metavar="X Y Z")] = None
    """Direction in which fingers approach in the scene's keyframe; if not given, as planned, or
    else along the normals."""


@dataclass(frozen=True, slots=True)
class Repeats(Settings):
    """Whether to repeat trials with noise, and the standard deviations of the noise."""

    trials: Annotated[int, Range(least=0, most=MOST_TRIALS)] = 0
    """Number of times to repeat all holds with noise, to see how often the grasp holds."""
    noise_shift: Annotated[float, Range(**BOUNDS["noise_shift"])] = 0.01
    """Standard deviation of the object's position along each axis, in object radii."""
    noise_turn_deg: Annotated[float, Range(**BOUNDS["noise_turn_deg"])] = 1.0
    """Standard deviation of the object's orientation about each axis [deg]."""
    noise_normal_deg: Annotated[float, Range(**BOUNDS["noise_normal_deg"])] = 1.0
    """Standard deviation of the direction of the surface normal at each contact [deg]."""
    noise_friction: Annotated[float, Range(**BOUNDS["noise_friction"])] = 0.05
    """Standard deviation of the friction coefficient, relative to the coefficient."""
    noise_mass: Annotated[float, Range(**BOUNDS["noise_mass"])] = 0.05
    """Standard deviation of the mass and of every load, relative to the planned values."""


@dataclass(frozen=True, slots=True)
class Testing(Settings):
    """Which trials to simulate, and how they are simulated."""

    fingers: OmitArgPrefixes[Fingers] = Fingers()
    random_wrenches: Annotated[int, Range(least=0, most=MOST_RANDOM_WRENCHES)] = 0
    """Number of random wrenches to hold as well, each at a share of the largest multiple that is
    resisted according to the analysis."""
    wrenches: Path | None = None
    """A file of wrenches that each grasp must hold in full (see docs/files.md)."""
    weight_n: Quantity | None = None
    """Also hold the object's weight [N], along and against each axis or in the directions given."""
    down: Annotated[UseAppendAction[tuple[Direction, ...]], arg(metavar="X Y Z")] = ()
    """With --weight-n: a direction in which the weight acts; may be repeated."""
    limits: Literal["none", "ramp", "bisection"] = "none"
    """Also find the largest multiple of each wrench in simulation."""
    repeats: OmitArgPrefixes[Repeats] = Repeats()
    traces: bool = False
    """With --out: also write how the object and each contact moved over time."""
    surface: Literal["pads", "mesh"] = "pads"
    """What fingertips touch: flat pads at the contacts, which are exact on any object, or the mesh
    of a convex object."""
    setup: Path | None = None
    """A TOML file with settings of the simulation (see docs/files.md)."""
    timeout_s: Positive = 600.0
    """Time after which the trials of one contact set are stopped [s]."""
    jobs: Jobs = field(default_factory=available_cores)


@dataclass(frozen=True, slots=True)
class Mass(Settings):
    """How heavy the object is: its mass or its density."""

    mass_kg: Quantity | None = None
    """Mass of the object [kg]."""
    density_kg_m3: Quantity | None = None
    """Density of the object, in place of --mass-kg [kg/m^3]. If neither is given, executions take
    1000 kg/m^3, and `scene` writes a scene with scaled masses."""


@dataclass(frozen=True, slots=True)
class Tips(Settings):
    """The springy fingertips that hold the object."""

    push_n: Quantity = 10.0
    """Largest normal force of a finger, at rest and under the loads that are planned for [N]."""
    tip_stiffness_n_per_m: Quantity = 2000.0
    """Stiffness of the springs on which fingertips slide [N/m]."""
    tip_radius_m: Quantity | None = None
    """Radius of the springy fingertips in executions [m]; if not given, --finger-radius-m of the
    plan, or a tenth of the object's radius, or less where that would overlap something."""
    tip_mass_kg: Quantity = 0.05
    """Mass of a fingertip with the part of its finger that moves with it [kg]."""
    damping_ratio: Annotated[float, Range(**BOUNDS["damping_ratio"])] = 0.5
    """Damping ratio of the object between the springs."""


@dataclass(frozen=True, slots=True)
class Executing(Settings):
    """How hard the trials are, and how far an object may move and still count as held."""

    mass: OmitArgPrefixes[Mass] = Mass()
    tips: OmitArgPrefixes[Tips] = Tips()
    lift_m: Quantity = 0.2
    """Height by which the object is lifted off its table [m]."""
    lift_s: Annotated[float, Range(**BOUNDS["lift_s"])] = 0.6
    """Duration of the lift [s]."""
    shake_g: Length = 1.0
    """Largest acceleration of a shake [9.80665 m/s^2]; 0 for no shakes."""
    shake_hz: Annotated[float, Range(**BOUNDS["shake_hz"])] = 5.0
    """Frequency of a shake [Hz]."""
    stop_m_per_s2: Quantity = 10.0
    """Deceleration of a stop [m/s^2]."""
    stop_from_m_per_s: Quantity = 0.5
    """Speed before a stop [m/s]."""
    knock_n_s: Length | None = None
    """Impulse of a knock [N s], 0 for no knocks. If not given, the one that gives a free object of
    that mass 1/6 m/s: 0.05 N s for 0.3 kg."""
    off_mm: Length = 2.0
    """Distance of a misplaced object from where the fingers expect it [mm]."""
    off_deg: Annotated[float, Range(**BOUNDS["off_deg"])] = 2.0
    """Angle by which a misplaced object is turned [deg]."""
    misplacements: Annotated[int, Range(**BOUNDS["misplacements"])] = 5
    """Number of times that the object is misplaced, each time in a random direction."""
    max_mm: Quantity = 5.0
    """Displacement against the palm up to which an object counts as held [mm]."""
    max_deg: Quantity = 5.0
    """Turn against the palm up to which an object counts as held [deg]."""


@dataclass(frozen=True, slots=True)
class Carrying(Settings):
    """How far a face may have moved or turned."""

    distance_m: NotNegative | None = None
    """Largest distance by which a contact may move to the surface of the changed part [m]; if not
    given, a twentieth of the old part's radius."""
    angle_deg: Annotated[float, Range(**BOUNDS["changed_by_deg"])] = 5.0
    """Largest angle between the normals of a face before and after [deg]."""
