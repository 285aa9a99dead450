"""Declares the rows of each table: what its columns are called, hold and mean.

A dataset whose configuration asks for executions has one table and some columns more, and there are
groups of columns on request, which its manifest names. Names end in their unit. Geometry is in the
object's own frame, in float64, with normals into the object and torques about its centre of mass. A
value that could not be measured is null.
"""

from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from annotated_types import Interval

from grasp_core.allowed_values import FLAT, Friction, Number, Seed, Share
from grasp_core.arrays import Array, Indices, Shape, Wrench
from grasp_core.declared import Declared, declared, rules, types
from grasp_core.errors import InputError
from grasp_core.names import Family
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import seat
from grasp_core.values import FINGERS, Contact
from sim_validate.closure.verdict import Verdict
from sim_validate.datasets.config import (
    EXECUTED,
    HAND,
    TABLE_NAMES,
    SplitName,
    TableName,
    id_beginning,
)
from sim_validate.datasets.hand_columns import HandCells
from sim_validate.datasets.parquet import (
    InGroup,
    Known,
    TableColumn,
    Tables,
    Within,
    cells_of,
    columns_of,
    in_columns,
)
from sim_validate.engine.held_or_let_go import HoldVerdict, Outcome
from sim_validate.execution.verdict import Execution, ExecutionTrial
from sim_validate.files.kept_figures import Kept, keeps

FROM_TOOL = "given"
VARIED = "varied"
"""Label of rows that are made from a grasp and may hold or not."""
NOT_TRIED = "not_tried"
"""Outcome of given grasps that cannot be simulated: their `note` says why, and no cell claims
anything else about them."""
UNIT_TOLERANCE = 1e-9
ROUNDOFF = 1e-6
"""Share of any number that processors may round differently."""
CLAIMS = (
    "survived", "mass_kg", "squeeze_n", "load_multiple", "predicted_first_slip",
    "simulated_first_slip", "executed_trials", "execution_mismatches",
)  # fmt: skip
"""Cells that only executed grasps have."""
IN_OWN_COLUMNS = ("load_multiple", "payload_kg", "predicted_first_slip", "simulated_first_slip")
ByFinger: TypeAlias = Annotated[Array, Shape(None, 3, nan=True)]
"""A vector for each finger, (k, 3); tables have four, null after the last."""
FourLengths: TypeAlias = Annotated[Array, Shape(FINGERS, nan=True)]
Four: TypeAlias = Annotated[Indices, Shape(FINGERS, whole=True)]
FourPoints: TypeAlias = Annotated[Array, Shape(FINGERS, 3)]


@declared
class ObjectRow(Declared):
    """An object; its mesh, in metres, is `meshes/OBJECT_ID.obj`."""

    object_id: str
    """SHA-256 hash of the object's mesh; identifies the object."""
    source_name: str
    """File name, or name of the built-in object."""
    source_sha256: str
    """SHA-256 hash of the mesh file or built-in mesh."""
    split: SplitName
    """Part of the dataset: train, validation or test."""
    vertices: Number
    """Number of vertices."""
    triangles: Number
    """Number of triangles."""
    faces: Number
    """Number of planar faces or patches."""
    curved: bool
    """Whether the faces are patches of a curved surface."""
    volume_m3: float
    """Volume."""
    volume_source: Literal["surface", "capped surface", "convex hull"]
    """What volume and centre of mass are of: the surface, the capped surface (small holes were
    closed), or the convex hull (it is open)."""
    radius_m: float
    """Largest distance of a vertex from the centre of mass."""
    center_of_mass_m: Annotated[Array, Shape(3)]
    """Centre of mass."""


@keeps(in_columns(Verdict, ("id", "outcome", "predicted_critical_friction")))
class VerdictCells(Kept):
    """Figures of a verdict."""


@keeps(in_columns(Execution, IN_OWN_COLUMNS, "execution_"))
class ExecutionCells(Kept):
    """Figures of an execution."""


@declared
class GraspRow(Declared):
    """Four contacts on an object at one friction, or a negative control made from them."""

    _: KW_ONLY
    grasp_id: str
    """Identifies the row: made of object, friction and name."""
    object_id: str
    """Object of the grasp."""
    split: SplitName
    """Part of the dataset that the object is in."""
    name: str
    """The grasp's id in the planner's files: family and faces."""
    label: str
    """`grasp`, `given` (from elsewhere), `varied`, or the name of the negative control."""
    control_of: str | None = None
    """The grasp that a negative control was made from."""
    friction: Friction
    """Coulomb coefficient of the plan and of the trials."""
    family: Family | None = None
    """Family of the grasp, given by its lines of force; null for controls."""
    faces: Four | None = None
    """Indices of the faces or patches; null for controls."""
    contacts: Annotated[int, Interval(ge=1, le=FINGERS)]
    """Number of contacts: four, fewer for some controls."""
    contact_points_m: ByFinger
    """Contacts by finger; null after the last."""
    contact_normals: ByFinger
    """Inward unit normals; null after the last."""
    moved_m: Known = None
    """Largest distance by which a given contact was moved."""
    force_closed: bool | None = None
    """Whether it is proved to be in force closure."""
    closure_margin: Annotated[Known, Within(ROUNDOFF, 1e-7)] = None
    """Margin of the exact test of force closure."""
    critical_friction: Annotated[Known, Within(10.0 * ROUNDOFF, 1e-7)] = None
    """Smallest coefficient with force closure."""
    region_radius_m: Known = None
    """Radius of the smallest contact region; 0 for points."""
    region_kind: str | None = None
    """How contact regions were made: cone, disc, or point for none."""
    region_radii_m: FourLengths | None = None
    """Largest disc radius in each contact region."""
    ferrari_canny_lower_n: Known = None
    """Proved lower bound of Ferrari-Canny quality."""
    ferrari_canny_upper_n: Known = None
    """Proved upper bound of Ferrari-Canny quality."""
    held: bool | None = None
    """Whether the grasp held in every trial."""
    outcome: str = NOT_TRIED
    """`held`, or how the first trial that did not hold ended."""
    note: str = ""
    """Why a given grasp was not tried, else empty."""
    trials: Number = 0
    """Number of simulated trials."""
    mismatches: Number = 0
    """Number of contradictions between simulation and analysis."""
    verdict: Annotated[VerdictCells | None, FLAT] = None
    """Figures of the verdict; null for controls."""

    executed: Annotated[bool, InGroup(EXECUTED)] = False
    """Whether trials were simulated; false for negative controls, and where no squeeze carries the
    weight."""
    survived: Annotated[bool | None, InGroup(EXECUTED)] = None
    """Whether the object survived every trial; false also where no squeeze carries the weight; null
    where it is not known."""
    execution_note: Annotated[str | None, InGroup(EXECUTED)] = None
    """Why a grasp was not executed, or which trials were not possible."""
    mass_kg: Annotated[Known, InGroup(EXECUTED), Within(ROUNDOFF)] = None
    """Mass of the object in the execution."""
    squeeze_n: Annotated[ByFinger | None, InGroup(EXECUTED)] = None
    """Contact forces on the object at rest, by finger."""
    load_multiple: Annotated[Known, InGroup(EXECUTED)] = None
    """Multiple of the weight, in any direction, that the squeeze is proved to carry."""
    predicted_first_slip: Annotated[Known, InGroup(EXECUTED)] = None
    """Least multiple of a trial's load at which a contact slips, predicted; null if none ever
    does."""
    simulated_first_slip: Annotated[Known, InGroup(EXECUTED)] = None
    """Least multiple of a trial's load that slips, from simulated contact forces."""
    executed_trials: Annotated[int | None, InGroup(EXECUTED)] = None
    """Number of trials of the execution."""
    execution_mismatches: Annotated[int | None, InGroup(EXECUTED)] = None
    """Number of the execution's own negative controls that did not slip, but must."""
    execution: Annotated[ExecutionCells | None, FLAT, InGroup(EXECUTED)] = None
    """Figures of the execution."""

    kind: Annotated[str | None, InGroup("kinds")] = None
    """`planned`, `given`, the name of a negative control, or `friction_below`, .. `mass_near`."""
    made_from: Annotated[str | None, InGroup("kinds")] = None
    """The grasp that a varied one was made from; null for others."""
    friction_ratio: Annotated[Known, InGroup("kinds")] = None
    """Friction over critical friction; null where none is known."""
    displaced_m: Annotated[FourLengths | None, InGroup("kinds"), Within(0.0, ROUNDOFF)] = None
    """Distance of each contact from that of `made_from`."""
    region_exit_m: Annotated[FourLengths | None, InGroup("kinds")] = None
    """How far the region reached in the direction of that move; null where the contact did not
    move."""
    mass_ratio: Annotated[Known, InGroup("kinds")] = None
    """Mass over the mass at which `made_from` is predicted to lose the object."""

    span_angle_rad: Annotated[Known, InGroup("closure"), Within(ROUNDOFF, ROUNDOFF)] = None
    """Half-angle below which cones positively span."""
    smallest_singular_value: Annotated[Known, InGroup("closure"), Within(ROUNDOFF, ROUNDOFF)] = None
    """Least singular value of the grasp map."""
    closed_share: Annotated[Share | None, InGroup("placement")] = None
    """Proved lower bound of the chance of force closure where the object is off by 2 mm and 2
    degrees (standard deviations); null where no bound was proved."""
    closed_share_reason: Annotated[str | None, InGroup("placement")] = None
    """Why no bound was proved of a grasp in force closure."""
    witness_forces_n: Annotated[FourPoints | None, InGroup("closure")] = None
    """Balanced forces on the object, normal parts sum to one."""

    predicted_loss: Annotated[Known, InGroup("margins")] = None
    """Least multiple of a trial's load that loses it."""
    payload_kg: Annotated[Known, InGroup("margins"), Within(ROUNDOFF)] = None
    """Mass that the squeeze is proved to carry."""
    tip_radius_m: Annotated[Known, InGroup("margins")] = None
    """Radius of the fingertips of the execution."""

    least_push_n: Annotated[Known, InGroup("least_squeeze")] = None
    """Least largest push that carries the weight any way."""
    least_squeeze_n: Annotated[ByFinger | None, InGroup("least_squeeze")] = None
    """Contact forces at rest with that push."""

    hand: Annotated[HandCells | None, FLAT, InGroup(HAND)] = None
    """The pose of a hand and what it does there."""

    def _check_together(self) -> None:
        for name in ("contact_points_m", "contact_normals"):
            there = np.isfinite(getattr(self, name)).all(axis=1)
            if there.sum() != self.contacts or not there[: self.contacts].all():
                raise InputError(f"{name} must have the {self.contacts} that `contacts` says first")
        if not (np.abs(np.linalg.norm(self.normals, axis=1) - 1.0) <= UNIT_TOLERANCE).all():
            raise InputError("contact_normals must be unit vectors")
        if not self.was_tried:
            claims = (self.held, self.force_closed, self.closure_margin)
            if self.label != FROM_TOOL or self.trials or any(claim is not None for claim in claims):
                raise InputError("the row claims results, although the grasp was not tried")
        elif self.held is None or self.force_closed is None or not self.trials:
            raise InputError("a grasp that was tried must have trials, held and force_closed")
        elif self.force_closed and self.closure_margin is None:
            raise InputError("closure_margin must be a number where a grasp is in force closure")
        elif self.held != (self.outcome == Outcome.HELD.value):
            raise InputError(f"held is {self.held}, but `outcome` is {self.outcome!r}")

        self._check_execution()

    def _check_execution(self) -> None:
        claims = [name for name in CLAIMS if getattr(self, name) is not None]
        lost = claims == ["survived"] and not self.survived and self.execution_note
        control = self.executed and self.control_of is not None
        if control or (claims and not self.executed and not lost):
            raise InputError("the row claims results of an execution, although none was simulated")
        if self.executed and (self.squeeze_n is None or None in (self.mass_kg, self.load_multiple)):
            raise InputError("an executed row must have its squeeze, its mass and what it carries")

    @property
    def was_tried(self) -> bool:
        """Whether the contacts were simulated, closed or not."""
        return self.outcome != NOT_TRIED

    @property
    def points(self) -> Array:
        """The contacts that are there, (k, 3) [m]."""
        return self.contact_points_m[: self.contacts]

    @property
    def normals(self) -> Array:
        """Unit normals at them, into the object, (k, 3)."""
        return self.contact_normals[: self.contacts]

    @property
    def placed(self) -> tuple[Contact, ...]:
        """The contacts that are there."""
        return tuple(map(Contact, self.points, self.normals))

    def held_on(self, body: Polyhedron) -> Polyhedron:
        """Return the object; on curved surfaces contacts not planned have faces of their own."""
        other = self.label in (FROM_TOOL, VARIED)
        return seat(body, self.points, self.normals).body if other else body


@declared
class TrialRow(Declared):
    """A grasp or control under one wrench, in simulation."""

    grasp_id: str
    """Grasp that is tried."""
    trial: Number
    """Number of the trial, from 0 for each grasp."""
    name: str
    """Name of the wrench."""
    wrench_n_nm: Wrench
    """Applied force, then torque."""
    predicted_limit: Known
    """Largest multiple of the wrench resisted, by analysis."""
    required_friction: Known
    """Friction that the planned contact forces need."""
    hold: Annotated[HoldVerdict, FLAT]
    simulated_limit: Known
    """Multiple of the wrench that slips in simulation."""


@declared
class ExecutionRow(Declared):
    """A grasp in one trial of its execution, in simulation."""

    grasp_id: str
    """Grasp that is executed."""
    trial: Number
    """Number of the trial, from 0 for each grasp."""
    tried: Annotated[ExecutionTrial, FLAT]
    seed: Annotated[Seed | None, InGroup("margins")] = None
    """Seed that a misplaced trial was drawn by; null for others."""


ROW_CLASSES: Mapping[TableName, type[Any]] = {
    "objects": ObjectRow, "grasps": GraspRow, "trials": TrialRow, "executions": ExecutionRow,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class DatasetRows:
    """Rows of all tables that belong together."""

    objects: tuple[ObjectRow, ...] = ()
    grasps: tuple[GraspRow, ...] = ()
    trials: tuple[TrialRow, ...] = ()
    executions: tuple[ExecutionRow, ...] = ()

    def of(self, name: TableName) -> tuple[Any, ...]:
        """Return the rows of a table."""
        return getattr(self, name)

    def of_unit(self, row: ObjectRow, friction: float) -> "DatasetRows":
        """Return the rows of one object at one friction."""
        beginning = id_beginning(row.object_id, friction)
        own = {
            name: tuple(each for each in self.of(name) if each.grasp_id.startswith(beginning))
            for name in TABLE_NAMES if name != "objects"
        }  # fmt: skip
        return DatasetRows((row,), **own)

    def cells(self, name: TableName, columns: tuple[TableColumn, ...]) -> list[dict[str, Any]]:
        """Return the cells of the rows of a table."""
        return [cells_of(row, columns) for row in self.of(name)]


def groups_asked() -> Iterator[str]:
    """Yield the names of all groups of columns."""
    marks = (
        rule
        for kind in ROW_CLASSES.values()
        for each in types(kind).values()
        for rule in rules(each)
    )
    yield from dict.fromkeys(mark.group for mark in marks if isinstance(mark, InGroup))


def dataset_tables(groups: Mapping[str, int], joints: tuple[str, ...] = ()) -> Tables:
    """Return the tables of a dataset with their columns; groups of columns have their sizes.

    Columns with a number for each joint name the joints where these are known.
    """
    return {
        name: columns_of(ROW_CLASSES[name], groups, {HAND: joints})
        for name in TABLE_NAMES
        if name != "executions" or EXECUTED in groups
    }


TABLES = dataset_tables({})
"""Tables of a dataset without columns on request."""
