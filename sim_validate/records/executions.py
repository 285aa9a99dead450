"""Writes and reads `executions.json`: each executed grasp, with all settings that were used.

Type checking holds the writer to the fields. Numbers that JSON lacks are null: a first slip that
never comes is infinite.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal, NotRequired, TypeVar, cast

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.arrays import frozen
from grasp_core.by_value import ByValue
from grasp_core.checked import path_of
from grasp_core.errors import InputError
from grasp_core.files.json_text import place, record_of, settings_of, text_of
from grasp_core.files.text_files import read_text
from grasp_core.grasp_tables import ById, frame_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from scenes.physics import PhysicsSettings
from sim_validate.execution.enough import Enough
from sim_validate.execution.settings import ExecutionSettings, TrialKind
from sim_validate.execution.trials import Skipped
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    ExecutionControl,
    ExecutionTrial,
    Fate,
)
from sim_validate.records.fields import Count, Finite, ObjectRecord, Positive, finite, object_record

SCHEMA = 1
FEWEST_CONTACTS = 2
Force = tuple[Finite, Finite, Finite]
EXECUTIONS = "executions.json"
"""Name of the file in a folder of results."""
Where = tuple[str | int, ...]
"""Keys that lead to a record in its file."""
Settings = TypeVar("Settings", ExecutionSettings, PhysicsSettings)


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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Executions(ByValue, ById[ExecutedGrasp]):
    """The executions of an object's grasps, as a file holds them.

    They are a sequence, as a plan is: `len`, iteration, `[0]`, `["c-0-1-2-7"]` and slices.
    """

    object_sha256: str
    """Hash of the object's canonical mesh, as in `Polyhedron.content_sha256`."""
    friction: float
    settings: ExecutionSettings
    complete: bool
    """Whether every grasp that was asked for was executed."""
    grasps: tuple[ExecutedGrasp, ...]

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` with a row for each grasp, indexed by its id.

        Columns are `family`, `survived`, `controls_let_go`, `trials`, `trials_survived`,
        `least_predicted_loss`, `load_multiple` and `payload_kg`; the last two are NaN where no
        squeeze holds the object.

        Raises:
            InputError: The library pandas is not installed.
        """
        rows = [
            {
                "family": each.family,
                "survived": each.survived,
                "controls_let_go": each.controls_let_go,
                "trials": len(each.trials),
                "trials_survived": sum(trial.survived for trial in each.trials),
                "least_predicted_loss": each.least_predicted_loss,
                "load_multiple": math.nan if found is None else found.load_multiple,
                "payload_kg": math.nan if found is None else found.payload_kg,
            }
            for each in self.grasps
            for found in [each.execution]
        ]
        return frame_of(rows, [each.id for each in self.grasps])


def executions_to_json(
    body: Polyhedron, friction: float, settings: ExecutionSettings,
    grasps: Iterable[ExecutedGrasp], *, complete: bool,
) -> str:  # fmt: skip
    """Write the text of `executions.json`; equal executions give equal texts."""
    listed = list(grasps)
    document: ExecutionsFile = {
        "schema": SCHEMA,
        "object": object_record(body),
        "friction": friction,
        "complete": complete,
        "settings": asdict(settings.used),
        "summary": executions_summary(listed),
        "executions": [_record(grasp) for grasp in listed],
        "versions": {**versions()},
    }
    return text_of(finite(document))


def executions_summary(grasps: Iterable[ExecutedGrasp]) -> ExecutionsSummary:
    """Count grasps, trials and negative controls, and how they ended."""
    listed = list(grasps)
    found = [grasp.execution for grasp in listed if grasp.execution is not None]
    trials = [trial.survived for execution in found for trial in execution.trials]
    controls = [control.let_go for execution in found for control in execution.controls]
    return {
        "grasps": len(listed),
        "grasps_survived": sum(grasp.survived for grasp in listed),
        "grasps_without_squeeze": len(listed) - len(found),
        "trials": len(trials),
        "trials_survived": sum(trials),
        "controls": len(controls),
        "controls_let_go": sum(controls),
    }


def _record(grasp: ExecutedGrasp) -> ExecutionRecord:
    found = grasp.execution
    return {
        "id": grasp.id,
        "family": grasp.family,
        "contacts_sha256": grasp.contacts_sha256,
        "survived": grasp.survived,
        "reason": grasp.reason,
        "load_multiple": None if found is None else found.load_multiple,
        "squeeze_n": None if found is None else found.squeeze.tolist(),
        "tip_radius_m": tip_radii(found),
        "enough": enough_record(grasp.enough),
        "trials": [] if found is None else [_trial_record(trial) for trial in found.trials],
        "controls": [] if found is None else [
            {"name": each.name, "let_go": each.let_go, "first_slip": each.first_slip}
            for each in found.controls
        ],
        "skipped": [] if found is None else [
            {"kind": each.kind, "reason": each.reason} for each in found.skipped
        ],
        "physics": None if found is None or found.physics is None else found.physics.record(),
    }  # fmt: skip


def tip_radii(found: Execution | None) -> list[float] | None:
    """Return the radii of the fingertips that were used [m]; None where they are not known."""
    radii = None if found is None else found.tip_radius_m
    return None if radii is None else radii.tolist()


def enough_record(found: Enough | None) -> EnoughRecord | None:
    """Write the push that would be enough; a loss that never comes is null."""
    if found is None:
        return None
    return cast("EnoughRecord", finite(asdict(found)))


def _trial_record(trial: ExecutionTrial) -> ExecutionTrialRecord:
    return {
        "kind": trial.kind,
        "name": trial.name,
        "survived": trial.survived,
        "fate": trial.fate,
        "slip_m": trial.slip_m,
        "displacement_m": trial.displacement_m,
        "turn_rad": trial.turn_rad,
        "predicted_first_slip": trial.predicted_first_slip,
        "predicted_loss": trial.predicted_loss,
        "simulated_first_slip": trial.simulated_first_slip,
        "step_s": trial.step_s,
    }


def load_executions(path: str | Path) -> Executions:
    """Read executions, as `graspproof execute` and `graspproof run --execute` write them.

    Args:
        path: An `executions.json`.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    try:
        return executions_from_json(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def executions_from_json(text: str) -> Executions:
    """Read the text of an `executions.json`."""
    record = record_of(ExecutionsFile, text, EXECUTIONS, schema=SCHEMA)
    settings = _filled(ExecutionSettings, record["settings"], ("settings",))
    grasps = tuple(
        _grasp(each, settings, ("executions", row)) for row, each in enumerate(record["executions"])
    )
    summary: Mapping[str, object] = record.get("summary") or {}
    for name, count in executions_summary(grasps).items():
        if summary.get(name, count) != count:
            raise InputError(
                f"summary.{name}: expected {count}, as the executions say, got {summary[name]}; "
                "write the file again, or remove it"
            )
    return Executions(
        object_sha256=record["object"]["content_sha256"],
        friction=record["friction"],
        settings=settings,
        complete=record["complete"],
        grasps=grasps,
    )


def _filled(kind: type[Settings], given: dict[str, Any], where: Where) -> Settings:
    """Make settings of a class from their record, with every field checked."""
    known = [each.name for each in fields(kind)]
    for name in given:
        if name not in known:
            said = f"unknown key; known keys are {', '.join(known)}"
            raise InputError(f"{place([*where, name])}: {said}")
    return settings_of(kind, given, where)


def _grasp(record: ExecutionRecord, settings: ExecutionSettings, where: Where) -> ExecutedGrasp:
    if record["reason"] is None:
        found = _execution(record, settings, where)
    else:
        found = None
        _require_nothing(record, where)
    enough = enough_of(record["enough"], (*where, "enough"))
    found = None if found is None else replace(found, enough=enough)
    grasp = ExecutedGrasp(
        record["id"], record["family"], record["contacts_sha256"], found, record["reason"], enough
    )
    if grasp.survived != record["survived"]:
        said = "true" if grasp.survived else "false"
        raise InputError(
            f"{place([*where, 'survived'])}: expected {said}, by the trials, got the opposite"
        )
    if grasp.survived and enough is not None:
        raise InputError(f"{place([*where, 'enough'])}: expected null, as every trial was survived")
    return grasp


def enough_of(record: EnoughRecord | None, where: Where) -> Enough | None:
    """Make the push that would be enough from its record."""
    if record is None:
        return None
    push, loss = record["push_n"], record["predicted_loss"]
    try:
        return Enough(
            record["load_multiple"], push, record["stiffness_n_per_m"],
            loss if push is None else _or_infinite(loss), record["reason"],
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{place(where)}: {error}") from error


def _require_nothing(record: ExecutionRecord, where: Where) -> None:
    """Refuse results of a grasp that was not executed."""
    results = {name: record[name] for name in (
        "load_multiple", "squeeze_n", "tip_radius_m", "physics", "trials", "controls", "skipped",
    )}  # fmt: skip
    for name, result in results.items():
        if result not in (None, []):
            raise InputError(
                f"{place([*where, name])}: expected nothing (null or an empty list) beside a reason"
            )


def _execution(record: ExecutionRecord, settings: ExecutionSettings, where: Where) -> Execution:
    multiple, squeeze = record["load_multiple"], record["squeeze_n"]
    if multiple is None or squeeze is None:
        name = "load_multiple" if multiple is None else "squeeze_n"
        raise InputError(f"{place([*where, name])}: null is not allowed where reason is null")
    physics, radii = record["physics"], record["tip_radius_m"]
    if radii is not None:
        radii = frozen(radii, (len(squeeze),), place([*where, "tip_radius_m"]))
    return Execution(
        mass_kg=settings.mass_kg,
        squeeze=frozen(squeeze, (None, 3), place([*where, "squeeze_n"])),
        load_multiple=multiple,
        trials=tuple(
            ExecutionTrial(
                kind=each["kind"],
                name=each["name"],
                survived=each["survived"],
                fate=each["fate"],
                slip_m=_or_infinite(each["slip_m"]),
                displacement_m=_or_infinite(each["displacement_m"]),
                turn_rad=_or_infinite(each["turn_rad"]),
                predicted_first_slip=_or_infinite(each["predicted_first_slip"]),
                predicted_loss=_or_infinite(each["predicted_loss"]),
                simulated_first_slip=_or_infinite(each["simulated_first_slip"]),
                step_s=each["step_s"],
            )
            for each in record["trials"]
        ),
        controls=tuple(
            ExecutionControl(each["name"], each["let_go"], _or_infinite(each["first_slip"]))
            for each in record["controls"]
        ),
        skipped=tuple(Skipped(each["kind"], each["reason"]) for each in record["skipped"]),
        physics=None if physics is None else _filled(PhysicsSettings, physics, (*where, "physics")),
        tip_radius_m=radii,
    )


def _or_infinite(value: float | None) -> float:
    return math.inf if value is None else value
