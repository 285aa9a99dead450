"""Writes and reads `executions.json`: each executed grasp, with all settings that were used.

Type checking holds the writer to the fields. Numbers that JSON lacks are null: a first slip that
never comes is infinite.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, cast

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.arrays import frozen
from grasp_core.checked import path_of
from grasp_core.declared import ByValue
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import place, record_of, text_of
from grasp_core.files.text_files import read_text
from grasp_core.grasp_tables import ById, frame_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from scenes.mujoco.physics import PhysicsSettings
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
from sim_validate.kit.fields import Count, Finite, ObjectRecord, Positive, finite, object_record

SCHEMA = 1
FEWEST_CONTACTS = 2
Force = tuple[Finite, Finite, Finite]
EXECUTIONS = "executions.json"
"""Name of the file in a folder of results."""
RESULTS = {
    "load_multiple", "squeeze_n", "tip_radius_m", "physics", "trials", "controls", "skipped",
}  # fmt: skip
"""Fields that say nothing about a grasp that was not executed."""
Where = tuple[str | int, ...]
"""Keys that lead to a record in its file."""
Filled = TypeVar("Filled", ExecutionSettings, PhysicsSettings)
Value = TypeVar("Value", ExecutionTrial, ExecutionControl, Skipped)


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
    summary: ExecutionsSummary
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
        "trials": [cast("Any", asdict(each)) for each in grasp.trials],
        "controls": [] if found is None else [cast("Any", asdict(c)) for c in found.controls],
        "skipped": [] if found is None else [cast("Any", asdict(s)) for s in found.skipped],
        "physics": None if found is None or found.physics is None else found.physics.record(),
    }


def tip_radii(found: Execution | None) -> list[float] | None:
    """Return the radii of the fingertips that were used [m]; None where they are not known."""
    radii = None if found is None else found.tip_radius_m
    return None if radii is None else radii.tolist()


def enough_record(found: Enough | None) -> EnoughRecord | None:
    """Write the push that would be enough; a loss that never comes is null."""
    if found is None:
        return None
    return cast("EnoughRecord", finite(asdict(found)))


def load_executions(path: str | Path) -> Executions:
    """Read executions, as `graspproof execute` and `graspproof run --execute` write them.

    Args:
        path: An `executions.json`.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    with about(path):
        return executions_from_json(text)


def executions_from_json(text: str) -> Executions:
    """Read the text of an `executions.json`."""
    record = record_of(ExecutionsFile, text, EXECUTIONS, schema=SCHEMA)
    settings = _filled(ExecutionSettings, record["settings"], ("settings",))
    grasps = tuple(
        _grasp(each, settings, ("executions", row)) for row, each in enumerate(record["executions"])
    )
    for name, count in executions_summary(grasps).items():
        if record["summary"][name] != count:
            raise InputError(
                f"summary.{name}: expected {count}, as the executions say, got "
                f"{record['summary'][name]}; write the file again, or remove it"
            )
    return Executions(
        object_sha256=record["object"]["content_sha256"],
        friction=record["friction"],
        settings=settings,
        complete=record["complete"],
        grasps=grasps,
    )


def _filled(kind: type[Filled], given: dict[str, Any], where: Where) -> Filled:
    """Make settings of a class from their record, in which none may be missing."""
    found = kind.of_table(given, place(where))
    written = found.record() if isinstance(found, PhysicsSettings) else asdict(found)
    _require_all(written, given, where)
    return found


def _require_all(written: Mapping[str, Any], given: Mapping[str, Any], where: Where) -> None:
    """Refuse a record that lacks a setting, whose usual value may not be the one that was used."""
    for name, value in written.items():
        if name not in given:
            raise InputError(f"{place([*where, name])}: missing; add it")
        if isinstance(value, dict):
            _require_all(cast("dict[str, Any]", value), given[name], (*where, name))


def _grasp(record: ExecutionRecord, settings: ExecutionSettings, where: Where) -> ExecutedGrasp:
    enough, found = enough_of(record["enough"], (*where, "enough")), None
    if record["reason"] is None:
        found = replace(_execution(record, settings, where), enough=enough)
    else:
        for name, result in record.items():
            if name in RESULTS and result not in (None, []):
                raise InputError(
                    f"{place([*where, name])}: expected nothing (null or an empty list) beside a "
                    "reason"
                )
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
    with about(place(where)):
        return Enough(
            record["load_multiple"], push, record["stiffness_n_per_m"],
            loss if push is None or loss is not None else math.inf, record["reason"],
        )  # fmt: skip


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
        trials=tuple(_value(ExecutionTrial, each) for each in record["trials"]),
        controls=tuple(_value(ExecutionControl, each) for each in record["controls"]),
        skipped=tuple(_value(Skipped, each) for each in record["skipped"]),
        physics=None if physics is None else _filled(PhysicsSettings, physics, (*where, "physics")),
        tip_radius_m=radii,
    )


def _value(kind: type[Value], record: Mapping[str, Any]) -> Value:
    """Make a value from its record, in which a number that is null is infinite."""
    given: dict[str, Any] = {
        each.name: math.inf if record[each.name] is None else record[each.name]
        for each in fields(kind)
    }
    return kind(**given)
