"""The fields of `judgements.json` with their types, for its writer and for whoever reads it."""

from typing import Any, Literal, NotRequired

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

from sim_validate.protocols.published import From
from sim_validate.records.reaches import NotNegative, Triple
from sim_validate.records.verdicts_schema import Count, ObjectRecord, Positive


class SourceRecord(TypedDict):
    """Fields about where a test is stated."""

    repository: str
    commit: str
    paths: list[str]


class StepRecord(TypedDict):
    """Fields about a part of a run."""

    seconds: Positive
    pull_m_s2: Triple
    force_n: Triple
    line_m: Triple
    wave_m: Triple
    turn_deg: float
    rises: bool
    look_s: Positive | None


class PassingRecord(TypedDict):
    """Fields about when a run passes; null for no limit."""

    most_m: Positive | None
    most_deg: Positive | None
    since: From
    fingers: Count
    runs: Count | None
    most_overlap_m: Positive | None


class WeldRecord(TypedDict):
    """Fields about what a hand hangs on."""

    solref: list[float]
    solimp: list[float]


class ProtocolRecord(TypedDict):
    """Fields about a published test."""

    imitation: bool
    name: str
    version: str
    sources: list[SourceRecord]
    imitates: str
    ours: list[str]
    friction: Positive
    timestep_s: Positive
    runs: list[list[StepRecord]]
    passing: PassingRecord
    mass_kg: Positive | None
    density_kg_per_m3: Positive | None
    close_s: NotNegative
    squeeze_s: NotNegative
    servo_n_m_per_rad: Positive
    own_servos: NotRequired[bool]
    weld: NotRequired[WeldRecord | None]
    copies: Count
    noise_m: NotNegative
    noise_deg: NotNegative
    physics: dict[str, Any]


class RunRecord(TypedDict):
    """Fields about one run of a test."""

    number: Count
    copy: Count
    passed: bool
    reason: str
    displacement_m: NotNegative | None
    turn_deg: NotNegative | None
    fingers: Count


class TheirsRecord(TypedDict):
    """Fields about the verdict of a published test."""

    passed: bool
    copies_passed: Count
    runs: list[RunRecord]


class OursRecord(TypedDict):
    """Fields about our verdict on the loads of a test."""

    held: bool
    force_closure: bool
    reason: str


class PredictedRecord(TypedDict):
    """Fields about what is predicted of the loads of a test."""

    resisted: bool
    margin: NotNegative | None
    """Least multiple of the loads that is resisted; null where nothing loads the object."""


class JudgementRecord(TypedDict):
    """Fields about one grasp and one test."""

    id: str
    hand: NotRequired[str]
    protocol: str
    imitation: bool
    mass_kg: Positive
    push_n: float
    theirs: TheirsRecord
    ours: OursRecord
    predicted: PredictedRecord


class TotalsRecord(TypedDict):
    """Numbers of grasps that were judged by one test."""

    grasps: Count
    theirs_passed: Count
    ours_held: Count
    predicted: Count
    agree: Count


@with_config(ConfigDict(strict=True, extra="forbid"))
class JudgementsFile(TypedDict):
    """The content of `judgements.json`."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    complete: bool
    protocols: dict[str, ProtocolRecord]
    summary: dict[str, TotalsRecord]
    judgements: list[JudgementRecord]
    versions: dict[str, str]
