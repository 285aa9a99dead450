"""The fields of `reaches.json` with their types, for its writer and for whoever reads it."""

from typing import Annotated, Any, Literal, NotRequired

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.hands.hand import FEWEST_FINGERS
from grasp_core.hands.reach import ReachReason
from grasp_core.values import FINGERS
from sim_validate.records.executions_schema import EnoughRecord
from sim_validate.records.hand_model import ModelRecord
from sim_validate.records.verdicts_schema import Count, Finite, ObjectRecord, Positive

NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Contact = Annotated[int, Field(ge=0, lt=FINGERS)]
Triple = tuple[Finite, Finite, Finite]
Row = tuple[Finite, Finite, Finite, Finite]


class HandRecord(TypedDict):
    """Fields about the hand."""

    name: str
    joints: list[str]
    fingers: list[str]
    sources: list[str]
    torque_source: str
    model: ModelRecord


class ReachedContactRecord(TypedDict):
    """Fields about one contact that is reached."""

    finger: str
    position_m: Triple
    normal: Triple
    within_region: bool


class PoseRecord(TypedDict):
    """Fields about a pose in which the hand stands in a grasp."""

    palm_pose: tuple[Row, Row, Row, Row]
    joints_rad: list[Finite]
    used: Annotated[list[Contact], Field(min_length=FEWEST_FINGERS)]
    """Indices of the grasp's contacts at which fingers stand."""
    contacts: Annotated[
        list[ReachedContactRecord], Field(min_length=FEWEST_FINGERS, max_length=FINGERS)
    ]  # fmt: skip
    closure_margin: Finite
    pregrasp_joints_rad: list[Finite] | None
    approach: Triple | None


class HandControlRecord(TypedDict):
    """Fields about one negative control of a hand."""

    name: str
    explanation: str
    let_go: bool


class SimulatedHandRecord(TypedDict):
    """Fields about the trials of a hand in its pose, with its motors."""

    held: bool
    wrenches: Count
    """Number of wrenches that were to be held."""
    not_held: list[str]
    """Names of the wrenches that were not held."""
    weakest_n: NotNegative
    """Size of the weakest wrench at its predicted limit, torques over the object's radius."""
    controls: list[HandControlRecord]
    contradictions: list[str]
    """Where the simulation contradicts the analysis, a sentence each."""


class HandExecutionRecord(TypedDict):
    """Fields about the trials of one grasp, executed with a hand."""

    mass_kg: Positive
    survived: bool
    trials: Count
    lost: list[str]
    """Names of the trials that the object did not survive."""
    skipped: list[str]
    """Kinds of trials that were left out, with the reasons."""
    least_predicted_loss: Annotated[float, Field(ge=0.0)] | None
    """Least multiple of a trial's load at which the object is predicted to be lost; null without a
    trial."""
    payload_kg: NotNegative
    """Largest mass that the squeeze is certified to carry slowly, in any direction."""
    squeeze_n: list[Triple]
    """Contact forces at rest, on the object."""
    tip_radius_m: list[Positive] | None
    """Radii of the fingertips, one for each force."""
    controls_held: list[str]
    """Names of negative controls that did not slip, though they must; empty if all did."""


class ExecutedHandRecord(TypedDict):
    """Fields about executing one grasp with a hand."""

    refused: str
    """Why the grasp cannot be executed; empty if it was."""
    enough: EnoughRecord | None
    """The push within the motors' torques that would be enough; null where all was survived."""
    execution: HandExecutionRecord | None


class HandPayloadRecord(TypedDict):
    """Fields about the largest mass that a hand holds in any orientation, its links included."""

    lower_kg: NotNegative
    """Mass that is held in every orientation, with forces chosen anew for each."""
    upper_kg: NotNegative
    """Mass above which some orientation is not held."""
    weakest_gravity: Triple
    """Direction of gravity in which the hand lets go first, of unit length, object axes."""


class ReachRecord(TypedDict):
    """Fields about one grasp."""

    id: str
    contacts_sha256: str
    """Hash of the planned contacts."""
    reached: bool
    reason: ReachReason
    explanation: str
    starts: Count
    pose: PoseRecord | None
    payload: NotRequired[HandPayloadRecord]
    """What the hand carries; absent where motors or links are unknown, or too weak."""
    simulated: NotRequired[SimulatedHandRecord]
    """What the hand held in simulation; absent where no simulation was asked for."""
    executed: NotRequired[ExecutedHandRecord]
    """What came of executing the grasp with the hand; absent where it was not asked for."""


class ReachesSummary(TypedDict):
    """Numbers of grasps by how the search ended."""

    grasps: Count
    reached: Count
    limit: Count
    collision: Count
    not_found: Count
    no_closure: Count
    """Grasps no three of whose contacts close, for a hand with three fingers."""
    complete: bool


class AskedRecord(TypedDict):
    """Fields about what was asked for."""

    regions: bool
    table_down: Triple | None
    clearance_m: NotNegative
    starts: Count
    seed: Count
    execution: NotRequired[dict[str, Any]]
    """Settings of the executions, as in `executions.json`; absent where none were asked for."""


@with_config(ConfigDict(strict=True, extra="forbid"))
class ReachesFile(TypedDict):
    """The content of `reaches.json`; type checking holds its writer to it."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    hand: HandRecord
    asked: AskedRecord
    summary: ReachesSummary
    reaches: list[ReachRecord]
    versions: dict[str, str]
