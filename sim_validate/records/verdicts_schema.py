"""The fields of `verdicts.json` with their types, for its writer and for all of its readers.

Type checking holds the writer to these fields; reading checks every one that is there, and keeps
keys that are not listed. Fields that may be absent are those that no reader relies on.
"""

from typing import Annotated, Any, Literal, NotRequired

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.checked import MOST_RANDOM_WRENCHES
from scenes.mjcf import Surface
from sim_validate.simulation.traces import Outcome

SCHEMA = 1
Finite = Annotated[float, Field(allow_inf_nan=False)]
Wrench = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0)]


class ObjectRecord(TypedDict):
    """Fields about the object that a `verdicts.json` is about."""

    name: NotRequired[str]
    source_sha256: NotRequired[str | None]
    content_sha256: str


class CheckRecord(TypedDict):
    """Fields about one check of the simulator: the measured figure and its allowed interval."""

    name: str
    value: Finite
    least: Finite
    largest: Finite


class GateRecord(TypedDict):
    """Fields about the checks of the simulator on cases with known answers."""

    passed: NotRequired[bool]
    mujoco: NotRequired[str]
    checks: list[CheckRecord]


class Summary(TypedDict):
    """Numbers of grasps and of negative controls, and of those that held or let go."""

    grasps: Count
    grasps_held: Count
    controls: Count
    controls_held: Count
    controls_let_go: Count
    mismatches: Count


class CriticalFrictionRecord(TypedDict):
    """Fields about the critical friction by analysis and in simulation."""

    predicted: Finite
    simulated: Finite | None
    bracket: NotRequired[tuple[Finite, Finite] | None]


class HoldRecord(TypedDict):
    """Fields about how a trial ended."""

    outcome: Outcome
    reason: NotRequired[str]
    displacement_m: Finite | None
    start_displacement_m: NotRequired[Finite | None]
    rotation_rad: NotRequired[Finite | None]
    slip_m: NotRequired[list[Finite | None]]
    failed_after_s: NotRequired[Finite | None]


class ControlTrialRecord(HoldRecord):
    """Fields about a trial of a negative control."""

    name: str
    wrench: Wrench
    required_friction: NotRequired[Finite | None]


class TrialRecord(HoldRecord):
    """Fields about a trial of a grasp; limits are multiples of the wrench."""

    name: str
    wrench: Wrench
    predicted_limit: Finite | None
    simulated_limit: Finite | None
    simulated_limit_bracket: NotRequired[tuple[Finite | None, Finite | None] | None]
    required_friction: Finite | None


class ContactRecord(TypedDict):
    """Fields about a contact, in the object's frame."""

    position_m: tuple[Finite, Finite, Finite]
    normal: tuple[Finite, Finite, Finite]


class ControlRecord(TypedDict):
    """Fields about a negative control and its trials."""

    held: bool
    friction: Finite
    contacts: NotRequired[list[ContactRecord]]
    closure_margin: NotRequired[Finite | None]
    separating_wrench: NotRequired[Wrench]
    wrenches: Annotated[list[ControlTrialRecord], Field(min_length=1)]


class LostRecord(TypedDict):
    """Fields about a repeat with noise in which the grasp did not hold."""

    trial: Count
    predicted: NotRequired[bool | None]
    outcome: Outcome
    wrench: str
    reason: NotRequired[str]


class RobustnessRecord(TypedDict):
    """Fields about the repeats with noise."""

    trials: Count
    held: Count
    predicted: NotRequired[Count]
    pass_rate: NotRequired[Finite]
    pass_rate_interval: tuple[Finite, Finite]
    noise: dict[str, Finite]
    not_held: list[LostRecord]


class FingersRecord(TypedDict):
    """Fields about fingertips; the code that replays a trial checks further ones by name."""

    max_normal_force_n: Positive


class SettingsRecord(TypedDict):
    """Fields about the settings of a verdict's trials; `--setup` accepts its tables."""

    physics: dict[str, Any]
    fingers: FingersRecord
    hold: dict[str, Any]
    limit: dict[str, Any]
    friction: dict[str, Any]
    flags: NotRequired[dict[str, str]]
    drive: NotRequired[dict[str, Any]]
    surface: Surface
    grasp_size_m: Positive
    object_mass_kg: NotRequired[Finite]
    object_inertia_kg_m2: NotRequired[list[list[Finite]]]
    random_wrenches: Annotated[int, Field(ge=0, le=MOST_RANDOM_WRENCHES)]
    limits: NotRequired[str]
    seed: Count


class VerdictRecord(TypedDict):
    """Fields about the verdict on one grasp."""

    id: str
    contacts_sha256: str
    outcome: Outcome
    held: bool
    mismatches: list[str]
    critical_friction: CriticalFrictionRecord
    wrenches: list[TrialRecord]
    controls: dict[str, ControlRecord]
    robustness: NotRequired[RobustnessRecord | None]
    settings: SettingsRecord
    versions: dict[str, str | None]


@with_config(ConfigDict(strict=True, extra="allow"))
class VerdictsFile(TypedDict):
    """The content of `verdicts.json`, as `validate` writes it."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    complete: bool
    gate: GateRecord
    summary: Summary
    verdicts: list[VerdictRecord]
