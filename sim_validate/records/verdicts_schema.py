"""The fields of `verdicts.json` and `regions.json` that reports use, with their types."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from sim_validate.simulation.hold_verdict import Outcome

Finite = Annotated[float, Field(allow_inf_nan=False)]
Triple = tuple[Finite, Finite, Finite]
Wrench = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]


class _Record(BaseModel):
    """Base class of records that keep unknown fields unchanged."""

    model_config = ConfigDict(frozen=True, extra="allow", strict=True)


class _Object(_Record):
    content_sha256: str


class _Check(_Record):
    name: str
    value: Finite
    least: Finite
    largest: Finite


class _Gate(_Record):
    checks: list[_Check]


class _Summary(_Record):
    grasps: Count
    grasps_held: Count
    controls: Count
    controls_let_go: Count
    mismatches: Count


class _CriticalFriction(_Record):
    predicted: Finite
    simulated: Finite | None


class _ControlTrial(_Record):
    name: str
    wrench: Wrench
    outcome: Outcome


class _Trial(_ControlTrial):
    predicted_limit: Finite | None
    simulated_limit: Finite | None
    required_friction: Finite | None
    displacement_m: Finite | None


class _Control(_Record):
    held: bool
    friction: Finite
    wrenches: Annotated[list[_ControlTrial], Field(min_length=1)]


class _Fingers(_Record):
    max_normal_force_n: Positive


class _Settings(_Record):
    fingers: _Fingers
    grasp_size_m: Positive


class _Robustness(_Record):
    trials: Count
    held: Count
    pass_rate_interval: tuple[Finite, Finite]


class _Verdict(_Record):
    id: str
    contacts_sha256: str
    outcome: Outcome
    held: bool
    mismatches: list[str]
    critical_friction: _CriticalFriction
    wrenches: list[_Trial]
    controls: dict[str, _Control]
    robustness: _Robustness | None = None
    settings: _Settings
    versions: dict[str, str | None]


class VerdictsFile(_Record):
    """The content of `verdicts.json`, as `validate` writes it."""

    schema_: Literal[1] = Field(alias="schema")
    object: _Object
    friction: Positive
    complete: bool
    gate: _Gate
    summary: _Summary
    verdicts: list[_Verdict]


class _Region(_Record):
    polygon_m: Annotated[list[Triple], Field(min_length=3)]
    inscribed_radius_m: Finite


class _Proof(_Record):
    file: Annotated[str, Field(pattern=r"^proofs/[A-Za-z0-9][A-Za-z0-9_-]{0,99}\.npz$")]
    """Path of the proof, relative to the folder of the document."""


class _GraspRegions(_Record):
    id: str
    contacts_sha256: str
    disc_radius_m: Finite | None
    regions: Annotated[list[_Region], Field(min_length=4, max_length=4)] | None
    reason: str = ""
    proof: _Proof | None = None


class RegionsFile(_Record):
    """The content of `regions.json`, as `regions` writes it."""

    schema_: Literal[3] = Field(alias="schema")
    object: _Object
    friction: Positive
    grasps: list[_GraspRegions]
