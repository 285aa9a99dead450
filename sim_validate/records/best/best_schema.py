"""The fields of `best.json` with their types, for whoever reads it."""

from typing import Annotated, Literal

from pydantic import Field
from typing_extensions import TypedDict

from grasp_core.values import FINGERS
from sim_validate.records.verdicts_schema import Count, Finite, ObjectRecord, Positive

USUAL, OTHER = 1, 2
"""Schema for the Ferrari-Canny quality, and for other measures."""
Bounds = tuple[Finite, Finite]
Triple = tuple[Finite, Finite, Finite]
FourTriples = tuple[Triple, Triple, Triple, Triple]


class BestGraspRecord(TypedDict):
    """Fields about the best grasp that was found."""

    id: str
    faces: Annotated[list[int], Field(min_length=FINGERS, max_length=FINGERS)]
    positions_m: FourTriples
    normals: FourTriples


class LoadRecord(TypedDict):
    """Fields about a wrench of a task."""

    force_n: Triple
    torque_n_m: Triple


class SearchRecord(TypedDict):
    """Fields about a search for the best grasp, whatever it is best at."""

    object: ObjectRecord
    friction: Positive
    clearance_m: Positive
    grasp: BestGraspRecord
    gap: Annotated[float, Field(ge=0.0, le=1.0)]
    ended: Literal["gap", "time", "interrupt", "undivided"]
    proof: str | None
    proof_nodes: Count
    versions: dict[str, str]


class PlannedRecord(TypedDict):
    """Fields about a planned grasp beside the best one."""

    id: str
    quality_n: Bounds
    share_of_bound: Finite


class StepRecord(TypedDict):
    """Fields about one step by which the gap closed."""

    seconds: Finite
    quality_n: Finite
    bound_n: Finite
    nodes: Count


class BestFile(SearchRecord):
    """All fields for the Ferrari-Canny quality."""

    schema: Literal[1]
    quality_n: Bounds
    bound_n: Positive
    history: list[StepRecord]
    planned: list[PlannedRecord]


class RatedRecord(TypedDict):
    """Fields about a planned grasp beside the best one for some loads."""

    id: str
    quality: Bounds
    share_of_bound: Finite


class LoadStepRecord(TypedDict):
    """Fields about one step by which the gap for some loads closed."""

    seconds: Finite
    quality: Finite
    bound: Finite
    nodes: Count


class BestForLoadsFile(SearchRecord):
    """All fields for another measure."""

    schema: Literal[2]
    measure: Literal["weight", "task"]
    wrenches: list[LoadRecord]
    quality: Bounds
    bound: Positive
    history: list[LoadStepRecord]
    planned: list[RatedRecord]
