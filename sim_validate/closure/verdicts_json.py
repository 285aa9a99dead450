"""Writes and reads `verdicts.json`, with units in the keys and all settings that were used.

Type checking holds the writer to the fields; reading checks every one that is there, keeps keys
that are not listed, and refuses verdicts that contradict themselves. Fields that may be absent are
those that no reader relies on.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, NotRequired, cast

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.arrays import Array
from grasp_core.checked import MOST_RANDOM_WRENCHES, path_of
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.declared import ByValue
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import record_of, text_of
from grasp_core.files.text_files import read_text
from grasp_core.grasp_tables import ById, frame_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from grasp_core.settings import for_users
from scenes.mujoco.closure_scene import Surface
from scenes.mujoco.fingertips import FingerSettings
from sim_validate.closure.controls import ControlVerdict
from sim_validate.closure.verdict import Robustness, Verdict, WrenchVerdict
from sim_validate.engine.gate import Gate
from sim_validate.engine.traces import LET_GO, HoldVerdict, Outcome
from sim_validate.kit.fields import (
    Count,
    Finite,
    ObjectRecord,
    Positive,
    Wrench,
    finite,
    object_record,
)

SCHEMA = 1


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


def verdicts_to_json(
    body: Polyhedron, friction: float, verdicts: Iterable[Verdict], gate: Gate, *, complete: bool
) -> str:
    """Write the text of `verdicts.json`; equal verdicts give equal texts."""
    listed = list(verdicts)
    document: VerdictsFile = {
        "schema": SCHEMA,
        "object": object_record(body),
        "friction": friction,
        "complete": complete,
        "gate": gate_record(gate),
        "summary": summary(listed),
        "verdicts": [_verdict_record(body, verdict) for verdict in listed],
    }
    return text_of(finite(document))


def gate_record(gate: Gate) -> GateRecord:
    """Record the gate's results: checks of the simulator on cases with known answers."""
    return {
        "passed": gate.passed,
        "mujoco": gate.mujoco,
        "checks": [
            {"name": each.name, "value": each.value, "least": each.least, "largest": each.largest}
            for each in gate.checks
        ],
    }


def summary(verdicts: Iterable[Verdict]) -> Summary:
    """Count grasps that held, negative controls that let go, and contradictions."""
    return _summary([
        (each.held, [(one.held, one.let_go) for one in each.controls], len(each.mismatches))
        for each in verdicts
    ])  # fmt: skip


def recorded_summary(verdicts: Iterable[VerdictRecord]) -> Summary:
    """Count the same in recorded verdicts."""
    return _summary([
        (each["held"], [(one["held"], let_go(one)) for one in each["controls"].values()],
         len(each["mismatches"]))
        for each in verdicts
    ])  # fmt: skip


def _summary(ended: Sequence[tuple[bool, Sequence[tuple[bool, bool]], int]]) -> Summary:
    """Count grasps by whether each held, its controls (held, let go), and its contradictions."""
    controls = [control for _, own, _ in ended for control in own]
    return {
        "grasps": len(ended),
        "grasps_held": sum(held for held, _, _ in ended),
        "controls": len(controls),
        "controls_held": sum(held for held, _ in controls),
        "controls_let_go": sum(let_go for _, let_go in controls),
        "mismatches": sum(count for _, _, count in ended),
    }


def let_go(control: Mapping[str, Any]) -> bool:
    """Tell whether every load moved the object of a recorded negative control, as it must."""
    return all(trial["outcome"] in LET_GO for trial in control["wrenches"])


def _verdict_record(body: Polyhedron, verdict: Verdict) -> VerdictRecord:
    friction = verdict.critical_friction
    return {
        "id": verdict.id,
        "contacts_sha256": contacts_sha256(verdict.contacts),
        "outcome": verdict.outcome,
        "held": verdict.held,
        "mismatches": list(verdict.mismatches),
        "critical_friction": {
            "predicted": friction.predicted,
            "simulated": friction.simulated,
            "bracket": friction.bracket,
        },
        "wrenches": [_wrench_record(trial) for trial in verdict.wrenches],
        "controls": {
            control.control.name: _control_record(body, control) for control in verdict.controls
        },
        "robustness": _robustness_record(verdict.robustness),
        "settings": _settings(verdict),
        "versions": {**versions()},
    }


def _wrench_record(trial: WrenchVerdict) -> TrialRecord:
    found, predicted = trial.simulated_limit, trial.predicted_limit
    return {
        "name": trial.name,
        "wrench": trial.wrench.tolist(),
        "predicted_limit": predicted,
        "simulated_limit": None if found is None else found.share * predicted,
        "simulated_limit_bracket": (
            None if found is None else (found.lower * predicted, found.upper * predicted)
        ),
        "required_friction": trial.required_friction,
        **_hold_record(trial.hold),
    }


def _hold_record(hold: HoldVerdict) -> HoldRecord:
    return {
        "outcome": hold.outcome,
        "reason": hold.reason,
        "displacement_m": hold.displacement_m,
        "start_displacement_m": hold.start_displacement_m,
        "rotation_rad": hold.rotation_rad,
        "slip_m": hold.slip_m.tolist(),
        "failed_after_s": hold.failed_after_s,
    }


def _control_record(body: Polyhedron, verdict: ControlVerdict) -> ControlRecord:
    control = verdict.control
    return {
        "held": verdict.held,
        "friction": control.friction,
        "contacts": [
            {"position_m": contact.position.tolist(), "normal": contact.normal.tolist()}
            for contact in control.contacts
        ],
        "closure_margin": control.certificate.margin,
        "separating_wrench": control.separating_wrench(body.center_of_mass).tolist(),
        "wrenches": [
            {
                "name": trial.name,
                "wrench": trial.wrench.tolist(),
                "required_friction": trial.required_friction,
                **_hold_record(trial.hold),
            }
            for trial in verdict.tried
        ],
    }


def _robustness_record(found: Robustness | None) -> RobustnessRecord | None:
    if found is None:
        return None
    return {
        "trials": len(found.trials),
        "held": found.held,
        "predicted": found.predicted,
        "pass_rate": found.held / len(found.trials),
        "pass_rate_interval": found.interval,
        "noise": asdict(found.noise),
        "not_held": [
            {"trial": each.number, "predicted": each.predicted, "outcome": each.outcome,
             "wrench": each.wrench, "reason": each.reason}
            for each in found.trials if each.outcome is not Outcome.HELD
        ],
    }  # fmt: skip


def _settings(verdict: Verdict) -> SettingsRecord:
    layout, setup = verdict.scene.layout, verdict.setup
    fingers = {name: getattr(setup.fingers, name) for name in for_users(FingerSettings)}
    return {
        "physics": setup.physics.record(),
        "fingers": cast("FingersRecord", fingers),
        "hold": asdict(setup.hold),
        "limit": asdict(setup.limit),
        "friction": asdict(setup.friction),
        "flags": setup.physics.flags(),
        "drive": asdict(layout.drive),
        "surface": setup.surface,
        "grasp_size_m": layout.grasp_size_m,
        "object_mass_kg": layout.mass_kg,
        "object_inertia_kg_m2": layout.inertia_kg_m2.tolist(),
        "random_wrenches": verdict.agenda.random_wrenches,
        "limits": verdict.agenda.limits,
        "seed": verdict.agenda.seed,
    }


def trace_arrays(verdict: Verdict) -> dict[str, Array]:
    """Collect the recorded motion of every contact as arrays, named by trial and quantity."""
    fields = ("times_s", "displacements_m", "shifts_m", "rotations_rad", "slips_m", "gaps_m")
    kept: Sequence[tuple[str, Any]] = [
        *((trial.name, trial.trace) for trial in verdict.wrenches if trial.trace is not None),
        *((f"{control.control.name}.{trial.name}", trial.trace)
          for control in verdict.controls for trial in control.tried if trial.trace is not None),
    ]  # fmt: skip
    return {f"{name}.{field}": getattr(trace, field) for name, trace in kept for field in fields}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SavedVerdict(ByValue):
    """The verdict on one grasp, as a file holds it."""

    id: str
    contacts_sha256: str
    """Hash of the contacts, which tells grasps of one id apart."""
    held: bool
    """Whether the grasp held every wrench, of at least one."""
    outcome: Outcome
    """How the first wrench that was not held ended, or `Outcome.HELD`."""
    mismatches: tuple[str, ...]
    """Contradictions between simulation and analysis, as sentences."""
    controls_let_go: bool
    """Whether every negative control let go, as it must; True where there is none."""
    predicted_critical_friction: float
    simulated_critical_friction: float | None
    """Least friction at which the grasp held; None if it was not measured."""
    displacement_m: float
    """Largest displacement of the object in the trials that say it; 0 if none does [m]."""
    record: Mapping[str, Any] = field(repr=False)
    """All fields of the verdict, by the names in docs/files.md."""

    @property
    def good(self) -> bool:
        """Whether all wrenches held, negative controls let go, and nothing was contradicted."""
        return self.held and self.controls_let_go and not self.mismatches


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SavedVerdicts(ByValue, ById[SavedVerdict]):
    """The verdicts on an object's grasps, as a file holds them.

    They are a sequence, as a plan is: `len`, iteration, `[0]`, `["c-0-1-2-7"]` and slices.
    """

    ITEMS = "verdicts"

    object_sha256: str
    """Hash of the object's canonical mesh, as in `Polyhedron.content_sha256`."""
    friction: float
    complete: bool
    """Whether every grasp that was asked for was tested."""
    verdicts: tuple[SavedVerdict, ...]

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` with a row for each verdict, indexed by the grasp's id.

        Columns are `good`, `held`, `outcome`, `controls_let_go`, `mismatches` (how many),
        `predicted_critical_friction`, `simulated_critical_friction` (NaN where it was not
        measured) and `displacement_m`.

        Raises:
            InputError: The library pandas is not installed.
        """
        rows = [
            {
                "good": each.good,
                "held": each.held,
                "outcome": each.outcome.value,
                "controls_let_go": each.controls_let_go,
                "mismatches": len(each.mismatches),
                "predicted_critical_friction": each.predicted_critical_friction,
                "simulated_critical_friction": math.nan if found is None else found,
                "displacement_m": each.displacement_m,
            }
            for each in self.verdicts
            for found in [each.simulated_critical_friction]
        ]
        return frame_of(rows, [each.id for each in self.verdicts])


def load_verdicts(path: str | Path) -> SavedVerdicts:
    """Read verdicts, as `graspproof validate` and `graspproof run` write them.

    Args:
        path: A `verdicts.json`.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    with about(path):
        record = verdicts_of(text)
    return SavedVerdicts(
        object_sha256=record["object"]["content_sha256"],
        friction=record["friction"],
        complete=record["complete"],
        verdicts=tuple(map(_verdict, record["verdicts"])),
    )


def _verdict(record: VerdictRecord) -> SavedVerdict:
    friction, trials = record["critical_friction"], record["wrenches"]
    return SavedVerdict(
        id=record["id"],
        contacts_sha256=record["contacts_sha256"],
        held=record["held"],
        outcome=record["outcome"],
        mismatches=tuple(record["mismatches"]),
        controls_let_go=all(map(let_go, record["controls"].values())),
        predicted_critical_friction=friction["predicted"],
        simulated_critical_friction=friction["simulated"],
        displacement_m=max((trial["displacement_m"] or 0.0 for trial in trials), default=0.0),
        record=record,
    )


def verdicts_of(text: str) -> VerdictsFile:
    """Read the text of a `verdicts.json`."""
    record = record_of(VerdictsFile, text, "verdicts.json", schema=SCHEMA)
    verdicts = record["verdicts"]
    for number, verdict in enumerate(verdicts):
        for name, found, why in _contradictions(verdict):
            raise InputError(
                f"verdicts[{number}].{name}: {found} contradicts {why}; write the file again, or "
                "remove it"
            )
    for name, count in recorded_summary(verdicts).items():
        if record["summary"][name] != count:
            raise InputError(
                f"summary.{name}: expected {count}, as the verdicts say, got "
                f"{record['summary'][name]}; write the file again, or remove it"
            )
    return record


def _contradictions(verdict: VerdictRecord) -> Iterator[tuple[str, object, str]]:
    """Yield fields that the trials contradict, with their values and what says otherwise."""
    ended = [trial["outcome"] for trial in verdict["wrenches"]]
    first = next((each for each in ended if each is not Outcome.HELD), Outcome.HELD)
    if verdict["outcome"] is not first:
        yield "outcome", verdict["outcome"].value, f"the trials, which say {first.value}"
    if verdict["held"] != (verdict["outcome"] is Outcome.HELD):
        yield "held", verdict["held"], f"the outcome {verdict['outcome'].value}"
    for name, control in verdict["controls"].items():
        held = any(trial["outcome"] is Outcome.HELD for trial in control["wrenches"])
        if control["held"] != held:
            yield f"controls.{name}.held", control["held"], "the trials of this control"
    repeats = verdict.get("robustness")
    if repeats and repeats["held"] + len(repeats["not_held"]) != repeats["trials"]:
        yield "robustness.held", repeats["held"], "the number of repeats and those not held"
