"""The fields of `executions.json` with their types, for its writer and for its reader."""

from typing import Annotated, Any, Literal, NotRequired

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from sim_validate.execution.settings import TrialKind
from sim_validate.execution.verdict import Fate
from sim_validate.records.verdicts_schema import Count, Finite, ObjectRecord, Positive

SCHEMA = 1
FEWEST_CONTACTS = 2
Force = tuple[Finite, Finite, Finite]


class ExecutionTrialRecord(TypedDict):
    """Fields about one trial; slips and losses are multiples of its load, null where none comes.

    Motions are null where the simulator diverged.
    """

    kind: TrialKind
    name: str
    survived: bool
    fate: Fate
    slip_m: Finite | None
    displacement_m: Finite | None
    turn_rad: Finite | None
    predicted_first_slip: Finite | None
    predicted_loss: Finite | None
    simulated_first_slip: Finite | None
    step_s: Positive


class ExecutionControlRecord(TypedDict):
    """Fields about one negative control, which must slip."""

    name: str
    let_go: bool
    first_slip: Finite | None


class SkippedRecord(TypedDict):
    """Fields about a trial that the grasp cannot go through."""

    kind: TrialKind
    reason: str


class EnoughRecord(TypedDict):
    """Fields about the push that would be enough for the trials; null where none was found."""

    load_multiple: Finite
    push_n: Positive | None
    stiffness_n_per_m: Positive | None
    predicted_loss: Finite | None
    reason: str | None


class ExecutionRecord(TypedDict):
    """Fields about the execution of one grasp, or the reason why no squeeze holds the object."""

    id: str
    family: str
    contacts_sha256: str
    survived: bool
    reason: str | None
    load_multiple: Finite | None
    squeeze_n: Annotated[list[Force], Field(min_length=FEWEST_CONTACTS)] | None
    tip_radius_m: Annotated[list[Positive], Field(min_length=FEWEST_CONTACTS)] | None
    enough: EnoughRecord | None
    trials: list[ExecutionTrialRecord]
    controls: list[ExecutionControlRecord]
    skipped: list[SkippedRecord]
    physics: dict[str, Any] | None


class ExecutionsSummary(TypedDict):
    """Numbers of grasps, trials and negative controls, and how they ended."""

    grasps: Count
    grasps_survived: Count
    grasps_without_squeeze: Count
    trials: Count
    trials_survived: Count
    controls: Count
    controls_let_go: Count


@with_config(ConfigDict(strict=True, extra="allow"))
class ExecutionsFile(TypedDict):
    """The content of `executions.json`; type checking holds its writer to it."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    complete: bool
    settings: dict[str, Any]
    summary: NotRequired[ExecutionsSummary]
    executions: list[ExecutionRecord]
    versions: dict[str, str | None]
