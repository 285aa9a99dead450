"""Lists the fields of a `grasps.json`, with their units, types and bounds."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from grasp_core.checked import LARGEST_FRICTION, MOST_SEED, SMALLEST
from grasp_core.settings import Family, Method
from grasp_core.values import RegionKind

Finite = Annotated[float, Field(allow_inf_nan=False)]
Triple = tuple[Finite, Finite, Finite]
FourTriples = tuple[Triple, Triple, Triple, Triple]


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class MeshRecord(_Record):
    """The triangles of the object's surface."""

    vertices_m: list[Triple]
    triangles: list[tuple[int, int, int]]


class PatchesRecord(_Record):
    """How flat patches of a curved surface must be, and how many patches are kept."""

    spread_deg: Finite
    depth: Finite
    most: int


class SurfaceRecord(_Record):
    """What is known of the triangles; see `Surface`."""

    closed: bool = True
    """Whether they enclose a solid; if not, the centre of mass is that of the convex hull unless it
    was given."""
    caps: list[Annotated[int, Field(ge=0)]] = []
    """Numbers of the triangles that close small holes, where no finger may stand."""
    holes: Annotated[int, Field(ge=0)] = 0
    largest_hole_m: Annotated[Finite, Field(ge=0.0)] = 0.0
    volume_error: Annotated[Finite, Field(ge=0.0)] = 0.0
    """Share of the volume that the holes may hide."""
    dropped: Annotated[Finite, Field(ge=0.0, le=1.0)] = 0.0
    """Share of the surface that was left out."""
    flatness_m: Annotated[Finite, Field(ge=0.0)] = 0.0
    """Distance within which corners count as in one plane, where rounding explains it."""
    center_given: bool = False
    repairs: list[str] = []


class ObjectRecord(_Record):
    """The object that the grasps were planned on."""

    name: str
    source_sha256: str
    content_sha256: str
    mesh: MeshRecord
    center_of_mass_m: Triple
    surface: SurfaceRecord = SurfaceRecord()
    patches: PatchesRecord | None = None
    """Limits of patches on a curved surface; None where faces are exactly planar."""


class ContactRecord(_Record):
    """The point where a fingertip touches, and the inward normal there."""

    position_m: Triple
    normal: Triple


class ConeRecord(_Record):
    """The force cone that the construction used for one finger."""

    axis: Triple
    half_angle_deg: Finite


class RegionRecord(_Record):
    """The region in which one finger may stand."""

    kind: RegionKind
    polygon_m: list[Triple]
    inscribed_radius_m: Finite


class WitnessRecord(_Record):
    """Balanced forces along four lines; their normal parts sum to one."""

    points_m: FourTriples
    directions: FourTriples
    forces: FourTriples


class GraspRecord(_Record):
    """One grasp, with all that is needed to check its claims again."""

    id: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,99}$")
    """Id of the grasp; it also names the grasp's scene file, so it has no dots or slashes."""
    family: Family
    faces: tuple[int, int, int, int]
    contacts: tuple[ContactRecord, ContactRecord, ContactRecord, ContactRecord]
    focus_points_m: list[Triple]
    force_cones: tuple[ConeRecord, ConeRecord, ConeRecord, ConeRecord]
    radius_m: Finite
    regions: tuple[RegionRecord, RegionRecord, RegionRecord, RegionRecord]
    span_angle_deg: Finite
    critical_friction: Finite
    closure_margin: Finite
    ferrari_canny: tuple[Finite, Finite]
    witness: WitnessRecord
    approach_directions: FourTriples | None = None
    """Direction in which each finger moves in along its free line; None if no free lines were asked
    for."""


class MovedRecord(_Record):
    """How a grasp was moved on its faces, with bounds on its quality before and after."""

    id: str
    moved_from: str
    ferrari_canny_before: tuple[Finite, Finite]
    ferrari_canny_after: tuple[Finite, Finite]
    ferrari_canny_ceiling: Finite | None


class FingerRecord(_Record):
    """The size of the fingers whose free approach lines were planned."""

    radius_m: Annotated[Finite, Field(gt=0.0)]
    approach_m: Annotated[Finite, Field(gt=0.0)]


Count = Annotated[int, Field(ge=0)]


class MethodCountsRecord(_Record):
    """How the candidates of one planning method ended; see `MethodCounts`."""

    tried: Count
    pruned: Count
    solved: Count
    infeasible: Count
    undecided: Count
    duplicates: Count
    found: Count
    unreachable: Count
    rejected: Count


class CountsRecord(_Record):
    """What the planner tried; see `PlanCounts`."""

    faces: Count
    quadruples: Count
    spanning: Count | None
    families: dict[Method, MethodCountsRecord]


class OutcomesRecord(_Record):
    """How many sets of four faces hold a grasp, hold none, are open or out of reach."""

    held: Count
    absent: Count
    open: Count
    out_of_reach: Count


class GraspsRecord(_Record):
    """The contents of a whole `grasps.json`."""

    schema_version: Literal[1] = Field(alias="schema")
    object: ObjectRecord
    friction: Annotated[Finite, Field(ge=SMALLEST, le=LARGEST_FRICTION)]
    theta_deg: Finite
    seed: Annotated[int, Field(ge=0, le=MOST_SEED)]
    finger: FingerRecord | None = None
    """The finger whose free approach lines were planned; None if none were planned."""
    versions: dict[str, str]
    counts: CountsRecord
    outcomes: OutcomesRecord
    absence: str | None
    optimization: list[MovedRecord] = []
    grasps: list[GraspRecord]
