"""Holds what a plan is asked for, and a plan: grasps, what was tried, and what was ruled out."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from textwrap import shorten
from typing import Annotated, Any, Literal, Protocol, TypeAlias, get_args, runtime_checkable

from pydantic import Field

from grasp_core.allowed_values import (
    SMALLEST,
    FaceSets,
    Friction,
    Number,
    Seed,
    function,
    number,
    value_of,
)
from grasp_core.arrays import UNIT_SLACK
from grasp_core.by_value import counted, summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown, figure
from grasp_core.files.records import UNRECORDED
from grasp_core.grasp_tables import ById, frame_of
from grasp_core.names import METHODS, Family, Method
from grasp_core.notebooks import InNotebooks
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.planning.settings import PlanSettings
from grasp_core.values import Bounds, FaceQuadruple, Grasp, HalfAngle

Ended: TypeAlias = Literal["done", "time", "interrupt"]
"""Why a search for grasps ended: all was tried that was asked for, time was up, or it was
interrupted."""
FAMILIES: tuple[Family, ...] = get_args(Family)
"""The three families of grasps in the paper, each with its construction."""
ITS_RADIUS = ", the object's radius in m"
FARTHEST_APPROACH = 1e3
"""Longest free line of a finger, in object radii."""
COMPLETE_PARTS = 20_000
MOST_PLANNED_FACES = 1000
"""Most faces to plan with: tables of pairs and of spanning triples take some hundred megabytes."""


@declared
class PlanRequest(PlanSettings):
    """What is to be planned: the settings, and the fingers that must reach their contacts."""

    finger: Finger | None = None

    def _check_together(self) -> None:
        if self.complete and "free" not in self.families:
            raise InputError(
                "complete needs the free method, which decides all faces; add free to families"
            )
        if self.theta_deg is not None:
            widest = math.degrees(math.atan(self.friction))
            where = f", the angle of friction {self.friction}, or None"
            most = widest * (1.0 + UNIT_SLACK)
            number(self.theta_deg, "theta_deg", ge=SMALLEST, le=most, where=where)

    @property
    def theta(self) -> float:
        """Half-angle of the friction cones to plan with [rad]."""
        theta = math.atan(self.friction)
        return theta if self.theta_deg is None else min(math.radians(self.theta_deg), theta)

    @property
    def searched(self) -> int | None:
        """Return how many grasps each family keeps while searching; None keeps all."""
        return self.limit if self.rank_by == "radius" and not self.complete else None


def methods_for(body: Polyhedron) -> tuple[Method, ...]:
    """Return the methods that commands try by default: all; without `free` on many faces."""
    return METHODS if len(body.faces) <= MAX_FACES else FAMILIES


def check_request(body: Polyhedron, request: PlanRequest) -> None:
    """Refuse keywords out of range, and objects with too many faces for the request."""
    check_body(body)
    size, finger = body.radius, request.finger
    number(request.edge_clearance_m, "edge_clearance_m", lt=size, where=ITS_RADIUS)
    if request.share_faces_m is not None:
        where = ", the object's size, or None"
        number(request.share_faces_m, "share_faces_m", lt=2.0 * size, where=where)
    if finger is not None:
        number(finger.radius_m, "finger.radius_m", le=size, where=ITS_RADIUS)
        farthest, where = FARTHEST_APPROACH * size, ", a thousand radii"
        number(finger.approach_m, "finger.approach_m", le=farthest, where=where)
    faces = len(body.faces)
    if faces > MOST_PLANNED_FACES:
        raise InputError(
            f"{body.name} has {faces} planar faces, over the limit of {MOST_PLANNED_FACES}; "
            "load it with patches for faces (--faces patches)"
        )
    needed = {
        "a limit (--limit)": request.limit is None,
        "families without the free method (--families)": "free" in request.families,
        "radius to rank by (--rank-by)": request.rank_by != "radius",
        "no --share-faces-m": request.share_faces_m is not None,
    }
    missing = [what for what, lacks in needed.items() if lacks]
    if faces > MAX_FACES and missing:
        raise InputError(
            f"{body.name} has {faces} planar faces, and objects with more than {MAX_FACES} need "
            f"simpler plans: give {' and '.join(missing)}; or load the object with patches for "
            "faces (--faces patches)"
        )


LONGEST_REASON = 160
"""Most characters of a reason in the `repr` of a plan, so that it takes two lines at most."""
FREE_IDS = "f-"
"""Beginning of the ids of grasps that the free method made, whose family is that of their lines."""


@runtime_checkable
class Proof(Protocol):
    """A mathematical claim that can be re-checked without any solver."""

    def verify(self) -> bool:
        """Return whether plain arithmetic confirms the claim."""
        ...


@declared
class MethodCounts(Declared):
    """Counts of how the candidates of one planning method ended.

    A candidate is a set of four faces; for pencils and reguli, with one of the three ways to pair
    them. Tried candidates end in one of the last six counts.
    """

    tried: FaceSets = 0
    """Candidates whose programs were set up."""
    pruned: FaceSets = 0
    """Candidates skipped because a bound shows that their discs are too small, their pairs are too
    far from symmetric for a regulus, the free method is not needed on them, or they cannot enter
    the best `limit`; 0 for a method whose search was ended early."""
    solved: FaceSets = 0
    """Choices of one convex piece per face that were considered."""
    infeasible: FaceSets = 0
    """Candidates without a placement that has discs of the least radius at the planned angle, would
    enter the best if there is a limit, and exists on the surface of curved patches; for the free
    method, candidates proved to have no grasp at all."""
    undecided: FaceSets = 0
    """Candidates with neither a grasp nor a proof of absence (free method), or with an unsolved
    program (other methods)."""
    duplicates: FaceSets = 0
    """Grasps found again at the same contacts, with another pairing of the fingers."""
    found: FaceSets = 0
    """Grasps whose witness is of the method's family and which exact force closure certified."""
    unreachable: FaceSets = 0
    """Certified grasps that fingers of the given size cannot reach."""
    rejected: FaceSets = 0
    """Placements that the witness or the exact closure test did not confirm: not 0 means a bug."""


Tally: TypeAlias = Counter[str]
"""The counts of `MethodCounts` by their names, while a search runs."""


@declared
class Outcomes(Declared):
    """Counts of an object's sets of four faces: with a grasp, without, open, out of reach."""

    held: FaceSets
    """Sets of four faces with a certified grasp."""
    absent: FaceSets
    """Sets of four faces proved to hold no grasp, or with a face too small for a contact."""
    open: FaceSets
    """Sets of four faces with neither a grasp nor a proof: undecided or, with a limit, untried."""
    out_of_reach: FaceSets = 0
    """Sets of four faces with certified grasps that fingers of the given size cannot reach."""


@declared
class Moved(Declared):
    """How optimisation changed a grasp's quality, as proved bounds (lower, upper)."""

    id: Annotated[str, Shown("grasp")]
    moved_from: str
    """Id of the planned grasp; equal to `id` where the grasp was not moved."""
    before: Annotated[Bounds, Field(alias="ferrari_canny_before"), Shown("quality before", ".4f")]
    after: Annotated[Bounds, Field(alias="ferrari_canny_after"), Shown("after", ".4f")]
    ceiling: Annotated[
        float | None, Field(alias="ferrari_canny_ceiling"), Shown("upper bound", ".4f")
    ]
    """Quality that no contacts on the same faces exceed; None where no ceiling was asked for."""

    @figure
    def gain(self) -> Annotated[float, Shown("gain", ".3f")]:
        """Return the ratio of the proved lower bounds, after to before."""
        return self.after[0] / self.before[0]


@declared
class PlanCounts(Declared):
    """Counts of what the planner tried on one object."""

    faces: Number
    quadruples: FaceSets
    """Number of sets of four faces; with `share_faces_m` also of sets with two halves of a face."""
    spanning: FaceSets | None
    """Sets whose normals positively span at the least planned angle (P3); None where they were not
    counted, as above 200 faces."""
    families: Mapping[Method, MethodCounts] = field(default_factory=dict[Method, MethodCounts])
    """Counts of each method: the three families and `free`, as far as they were asked for."""


@declared
class Plan(Declared, ById[Grasp], InNotebooks):
    """The grasps found on one object, the best first, and what was tried.

    A plan is a sequence of its grasps: `len(plan)`, `for grasp in plan`, `plan[0]`, and also
    `plan["c-0-1-2-7"]` by id. A slice and `filter` give a plan with fewer grasps, whose counts are
    still those of the whole search. Plans are equal if everything but `seconds`
    and `versions` is.
    """

    body: Annotated[Polyhedron, UNRECORDED]
    """The object."""
    grasps: tuple[Grasp, ...]
    friction: Friction
    theta: Annotated[HalfAngle, Field(alias="theta_rad")]
    """Half-angle of the friction cones planned with, before each quadruple's own limit [rad]."""
    seed: Seed
    counts: PlanCounts
    outcomes: Outcomes
    ended: Ended = "done"
    """Why the search ended. If its time was up or it was interrupted, a clock decided which grasps
    are in the plan: there may be others, and better ones."""
    absence: str | None = None
    """Why there is no grasp, as a sentence; None when there is one."""
    absences: Annotated[Mapping[FaceQuadruple, tuple[Proof, ...]], UNRECORDED] = field(
        default_factory=dict[FaceQuadruple, tuple[Proof, ...]]
    )
    """Face quadruples that the free method proved to hold no grasp with friction tan(theta), with
    a proof for their convex hulls, or for each choice of one convex piece per face. Pieces too
    small for a contact, a millionth of the object, are left out."""
    finger: Finger | None = None
    """The size of the fingers for which free straight paths to the contacts were sought; None if no
    paths were asked for."""
    undecided: Annotated[Mapping[FaceQuadruple, float], UNRECORDED] = field(
        default_factory=dict[FaceQuadruple, float]
    )
    """Face quadruples on which the free method found neither a grasp nor a proof, with the share of
    the choices of contacts that is open, where each cut counts for half."""
    unreached: Annotated[Mapping[FaceQuadruple, str], UNRECORDED] = field(
        default_factory=dict[FaceQuadruple, str]
    )
    """Face quadruples whose grasps the fingers cannot reach, with the reason."""
    unranked: Annotated[Mapping[str, Number], UNRECORDED] = field(default_factory=dict[str, int])
    """Numbers of grasps without a figure to rank by, which come last, by the reason."""
    moves: Annotated[tuple[Moved, ...], Field(alias="optimization")] = ()
    """How optimisation changed each grasp; empty if it was not asked for."""
    seconds: Annotated[Mapping[Method, float], UNRECORDED] = field(
        default_factory=dict[Method, float], compare=False
    )
    """Processor time of each method [s], from its first program to its last grasp."""
    versions: Mapping[str, str] | None = field(default=None, compare=False)
    """Versions of the packages that made a plan from a file; None for those that are installed."""

    def filter(
        self,
        where: Callable[[Grasp], bool] | None = None,
        *,
        family: Method | Sequence[Method] | None = None,
        min_radius_m: float | None = None,
        min_closure_margin: float | None = None,
        max_critical_friction: float | None = None,
        min_ferrari_canny_n: float | None = None,
    ) -> "Plan":
        """Return a plan with the grasps that meet all demands, in the same order.

        Args:
            where: A function that says of a grasp whether it is kept.
            family: The family of the grasps that are kept, or several. `free` keeps what the free
                method made: ids that begin with `f-`, whose `family` is that of their lines.
            min_radius_m: Least radius of the discs in which fingers may stand [m].
            min_closure_margin: Least proved margin of force closure.
            max_critical_friction: Largest critical friction.
            min_ferrari_canny_n: Least proved Ferrari-Canny quality [N].

        Raises:
            InputError: A demand is not a number, or there is no such family.
        """
        listed = (family,) if isinstance(family, str) else family
        families = None if listed is None else value_of(tuple[Method, ...], listed, "family")
        most = max_critical_friction
        for name, bound in (
            ("min_radius_m", min_radius_m), ("min_closure_margin", min_closure_margin),
            ("max_critical_friction", most), ("min_ferrari_canny_n", min_ferrari_canny_n),
        ):  # fmt: skip
            if bound is not None:
                number(bound, name)
        if where is not None:
            function(where, "where")

        def meets(grasp: Grasp) -> bool:
            """Whether a grasp meets the demands; only figures that are asked for are computed."""
            own = {grasp.family, "free"} if grasp.id.startswith(FREE_IDS) else {grasp.family}
            return (
                (families is None or not own.isdisjoint(families))
                and (min_radius_m is None or grasp.radius >= min_radius_m)
                and (min_closure_margin is None or grasp.closure_margin >= min_closure_margin)
                and (most is None or grasp.critical_friction <= most)
                and (min_ferrari_canny_n is None or grasp.ferrari_canny[0] >= min_ferrari_canny_n)
                and (where is None or bool(where(grasp)))
            )

        return replace(self, grasps=tuple(grasp for grasp in self.grasps if meets(grasp)))

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` with a row for each grasp, indexed by id.

        Columns are named as in `grasps.json`, with angles in degrees: `family`, `radius_m`,
        `span_angle_deg`, `critical_friction`, `closure_margin`, `ferrari_canny_lower_n` and
        `_upper_n`; for each finger `face_0`, its contact `position_0_x_m`, its inward normal
        `normal_0_x`, etc.

        Raises:
            InputError: The library pandas is not installed.
        """
        return frame_of([_row(grasp) for grasp in self.grasps], [grasp.id for grasp in self.grasps])

    def __repr__(self) -> str:
        """Return a summary: number of grasps, largest radius, and outcomes of all quadruples."""
        of, known = self.counts.quadruples, self.outcomes
        sets = f"{counted(of, 'face quadruple')} searched: {known.held} held, {known.absent} absent"
        sets += f", {known.open} open, {known.out_of_reach} out of reach"
        parts = [counted(len(self.grasps), "grasp"), sets]
        parts += [] if self.ended == "done" else [f"ended early ({self.ended})"]
        if self.absence is not None:
            parts.append(repr(shorten(self.absence, LONGEST_REASON)))
        radius = max((grasp.radius for grasp in self.grasps), default=0.0)
        return summary("Plan", *parts, friction=self.friction, largest_radius=radius)


def _row(grasp: Grasp) -> Mapping[str, object]:
    lower, upper = grasp.ferrari_canny
    row: dict[str, object] = {
        "family": grasp.family,
        "radius_m": grasp.radius,
        "span_angle_deg": math.degrees(grasp.span_angle),
        "critical_friction": grasp.critical_friction,
        "closure_margin": grasp.closure_margin,
        "ferrari_canny_lower_n": lower,
        "ferrari_canny_upper_n": upper,
    }
    for finger, face in enumerate(grasp.faces):
        row[f"face_{finger}"] = face
    for finger, contact in enumerate(grasp.contacts):
        for axis, at, along in zip("xyz", contact.position, contact.normal, strict=True):
            row[f"position_{finger}_{axis}_m"] = float(at)
            row[f"normal_{finger}_{axis}"] = float(along)
    return row
