"""Keeps what a baseline says: a header, the part, and a summary of the verdict on each grasp.

A baseline is JSON that people can review: a header, then one line per grasp. Once it is written on
a changed part, it holds that shape, so that moves of faces are measured from what was accepted.
"""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, field, fields
from pathlib import Path, PurePath
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from pydantic_core import to_jsonable_python

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import check_schema, complaint, object_of, shown
from grasp_core.files.records import from_record, record_of
from grasp_core.files.text_files import read_text, write_text
from grasp_core.objects.build import MeshChoices
from grasp_core.objects.polyhedron import Polyhedron, polyhedron_from_mesh
from grasp_core.objects.surface import Surface
from grasp_core.records.grasps_json import RECORDED
from grasp_core.values import Grasp
from sim_validate.closure.verdict import Verdict
from sim_validate.engine.setup import WEAKEST
from sim_validate.engine.traces import Outcome
from sim_validate.execution.verdict import ExecutedGrasp

DIGITS = 12
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
Count = Annotated[int, Field(ge=0)]
Size = Annotated[float, Field(ge=0.0)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0)]
SCHEMA = 1
MARK = '"grasps_file"'


@dataclass(frozen=True, slots=True, config=STRICT)
class ExecutionEntry:
    """Summary of the execution of one grasp; None stands for what could not be measured."""

    reason: str | None
    """Why nothing was executed: no squeeze carries the weight; None if trials were run."""
    trials: Count
    lost: tuple[str, ...]
    controls: Count
    controls_let_go: Count
    load_multiple: Size | None
    """Multiple of the object's weight, in any direction, that the squeeze is certified for."""
    predicted_first_slip: Size | None
    """Least multiple of a trial's load at which a contact slips, by analysis; None if none does."""
    simulated_first_slip: Size | None
    """Least multiple of a trial's load at which a contact slips, simulated; None if none does."""
    slip_m: Size | None
    """Farthest that a point of contact slid on the object [m]."""
    displacement_m: Size | None
    """Largest displacement of the object against the palm [m]."""
    turn_rad: Size | None
    """Largest turn of the object against the palm [rad]."""

    def __post_init__(self) -> None:
        if len(self.lost) > self.trials or self.controls_let_go > self.controls:
            raise ValueError(
                "`lost` or `controls_let_go` counts more than `trials` or `controls` of the "
                "execution"
            )

    @property
    def survived(self) -> bool:
        """Whether the object survived every trial, of at least one."""
        return self.trials > 0 and not self.lost


def execution_entry(grasp: ExecutedGrasp) -> ExecutionEntry:
    """Summarise an execution."""
    found = grasp.execution
    trials = () if found is None else found.trials
    controls = () if found is None else found.controls

    def least(values: Iterable[float]) -> float | None:
        return rounded(min(values, default=None))

    def largest(values: Iterable[float]) -> float | None:
        return rounded(max(values, default=None))

    return ExecutionEntry(
        reason=grasp.reason,
        trials=len(trials),
        lost=tuple(trial.name for trial in trials if not trial.survived),
        controls=len(controls),
        controls_let_go=sum(control.let_go for control in controls),
        load_multiple=None if found is None else rounded(found.load_multiple),
        predicted_first_slip=least(trial.predicted_first_slip for trial in trials),
        simulated_first_slip=least(trial.simulated_first_slip for trial in trials),
        slip_m=largest(trial.slip_m for trial in trials),
        displacement_m=largest(trial.displacement_m for trial in trials),
        turn_rad=largest(trial.turn_rad for trial in trials),
    )


def rounded(value: float | None) -> float | None:
    """Round a number to the digits that are kept; None for a number that no file can hold."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}")


@dataclass(frozen=True, slots=True, config=STRICT)
class RecordedPart:
    """The changed part that a baseline was written on."""

    planned_sha256: str
    vertices_m: tuple[tuple[Finite, Finite, Finite], ...]
    triangles: tuple[tuple[Index, Index, Index], ...]
    surface: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """What is known of its triangles, as `Surface` is recorded."""

    def __post_init__(self) -> None:
        from_record(Surface, self.surface, "part.surface")

    def body(self, name: str, content_sha256: str) -> Polyhedron:
        """Build the part, with planar faces."""
        known = from_record(Surface, self.surface, "part.surface")
        try:
            found = polyhedron_from_mesh(
                self.vertices_m,
                self.triangles,
                MeshChoices(faces="planar", limits=RECORDED),
                name=name,
                known=known,
            )
        except (ValueError, InputError) as error:
            raise InputError(f"part: expected the mesh of a solid: {error}") from error
        if found.content_sha256 != content_sha256:
            raise InputError(
                "part: the mesh in the baseline is not the one that its content_sha256 says; write "
                "the baseline again with --grasp-bless"
            )
        return found


def recorded_part(planned: Polyhedron, tested: Polyhedron) -> RecordedPart | None:
    """Record the part that a baseline is written on; None if it is the planned one."""
    if planned.content_sha256 == tested.content_sha256:
        return None
    rows = tested.vertices.tolist()
    return RecordedPart(
        planned_sha256=planned.content_sha256,
        vertices_m=tuple((x, y, z) for x, y, z in rows),
        triangles=tuple((a, b, c) for a, b, c in tested.triangles.tolist()),
        surface=record_of(tested.surface),
    )


@dataclass(frozen=True, slots=True, config=STRICT)
class Entry:
    """Summary of the verdict on one grasp; None stands for what could not be measured."""

    id: str
    contacts_sha256: str
    outcome: Outcome
    wrenches: Count
    not_held: tuple[str, ...]
    controls: Count
    controls_let_go: Count
    mismatches: Count
    critical_friction: Size
    simulated_critical_friction: Size | None
    limit_n: Size
    """Size of the largest wrench that is resisted in the weakest direction, by analysis [N];
    torques are divided by the object's radius."""
    simulated_limit_n: Size | None
    """Size of the largest wrench that is resisted in the weakest direction, in simulation [N]."""
    displacement_m: Size | None
    rotation_rad: Size | None
    noisy_trials: Count
    noisy_not_held: tuple[Count, ...]
    noisy_close: tuple[Count, ...]
    """Indices of the repeats with noise whose load is very close to the largest that can be
    resisted."""
    execution: ExecutionEntry | None = None
    """How the grasp was executed; None if that is not asked for, and then no file mentions it."""

    def __post_init__(self) -> None:
        if self.held == bool(self.not_held):
            raise ValueError(
                f"`outcome` {self.outcome.value} contradicts `not_held`, which is {self.not_held}"
            )
        if self.controls_let_go > self.controls or len(self.not_held) > self.wrenches:
            raise ValueError(
                "`not_held` or `controls_let_go` counts more than `wrenches` or `controls`"
            )
        if any(number >= self.noisy_trials for number in (*self.noisy_not_held, *self.noisy_close)):
            raise ValueError(
                "`noisy_not_held` and `noisy_close` must hold numbers below `noisy_trials`"
            )

    @property
    def held(self) -> bool:
        """Whether the grasp held every wrench."""
        return self.outcome is Outcome.HELD


@dataclass(frozen=True, slots=True, config=STRICT)
class Baseline:
    """Verdicts on the grasps of one object, and all settings and versions that they depend on."""

    grasps_file: str
    limit: Annotated[int, Field(ge=1)] | None
    """Number of grasps that are kept, the first ones of the file; None for all."""
    object: str
    content_sha256: str
    friction: Size
    planned_radius_m: Size | None
    settings: Mapping[str, Any]
    versions: Mapping[str, str]
    arithmetic: str
    entries: tuple[Entry, ...]
    unit: str | None = None
    """Unit of length of the mesh file; None where there is none, or it was not known, and then no
    file mentions it."""
    scale: Size | None = None
    """Factor on the coordinates of the mesh file, besides its unit; None where there is none, and
    then no file mentions it."""
    part: RecordedPart | None = None
    """The part that it was written on; None where that is the one that the grasps were planned on,
    and then no file mentions it."""

    def __post_init__(self) -> None:
        if len({entry.id for entry in self.entries}) < len(self.entries):
            raise ValueError("two grasps of the baseline have the same id")


def plain(entry: Entry) -> dict[str, Any]:
    """Turn an entry into plain values, which processes can send and any file can hold."""
    return to_jsonable_python(fields_of(entry))


def fields_of(entry: Entry) -> dict[str, Any]:
    """Return the fields of an entry by name, without its execution if there is none."""
    found = asdict(entry)
    if entry.execution is None:
        del found["execution"]
    return found


def properties_of(listed: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of an entry by name, those of its execution beside the others."""
    found = {name: value for name, value in listed.items() if name != "execution"}
    executed: Mapping[str, Any] = listed.get("execution") or {}
    return {**found, **{f"execution.{name}": value for name, value in executed.items()}}


def entry_of(
    grasp: Grasp, verdict: Verdict, radius_m: float, executed: ExecutedGrasp | None = None
) -> Entry:
    """Summarise a verdict as an entry of a baseline."""
    weakest = next(trial for trial in verdict.wrenches if trial.name == WEAKEST)
    scaled = weakest.wrench / np.array([1.0] * 3 + [radius_m] * 3)
    predicted = weakest.predicted_limit * float(np.linalg.norm(scaled))
    limit = weakest.let_go_at
    friction, repeats = verdict.critical_friction, verdict.robustness
    noisy = () if repeats is None else repeats.trials
    holds = [trial.hold for trial in verdict.wrenches]
    measured = {
        "critical_friction": friction.predicted,
        "simulated_critical_friction": friction.simulated,
        "limit_n": predicted,
        "simulated_limit_n": None if limit is None else predicted * limit.share,
        "displacement_m": float(np.max([hold.displacement_m for hold in holds])),
        "rotation_rad": float(np.max([hold.rotation_rad for hold in holds])),
    }
    return Entry(
        id=grasp.id,
        contacts_sha256=contacts_sha256(grasp.contacts),
        outcome=verdict.outcome,
        wrenches=len(verdict.wrenches),
        not_held=tuple(trial.name for trial in verdict.failures),
        controls=len(verdict.controls),
        controls_let_go=sum(control.let_go for control in verdict.controls),
        mismatches=len(verdict.mismatches),
        noisy_trials=len(noisy),
        noisy_not_held=tuple(t.number for t in noisy if t.outcome is not Outcome.HELD),
        noisy_close=tuple(trial.number for trial in noisy if trial.close),
        execution=None if executed is None else execution_entry(executed),
        **{name: rounded(value) for name, value in measured.items()},  # pyright: ignore
    )


def baseline_to_json(baseline: Baseline) -> str:
    """Write the text of a baseline; equal verdicts give equal texts."""
    header = {
        "schema": SCHEMA,
        **{each.name: getattr(baseline, each.name) for each in fields(Baseline)},
    }
    del header["entries"], header["part"]
    for name in ("unit", "scale"):
        if header[name] is None:
            del header[name]
    head = json.dumps(header, indent=1, sort_keys=True, allow_nan=False).removesuffix("\n}")
    lines = ",\n  ".join(
        json.dumps(fields_of(entry), allow_nan=False) for entry in baseline.entries
    )
    part = ""
    if (now := baseline.part) is not None:
        record = asdict(now)
        part = f' "part": {json.dumps(record)},\n'
    return f'{head},\n{part} "grasps": [\n  {lines}\n ]\n}}\n'


def baseline_from_json(text: str, path: str) -> Baseline:
    """Parse the text of a baseline."""
    with about(path):
        record = object_of(text, "baseline")
        if "grasps_file" not in record:
            raise InputError("expected a baseline, as `graspproof baseline record` writes it")
        check_schema(record, SCHEMA)
        del record["schema"]
        # an empty list is refused, because it would check nothing
        record["entries"] = record.pop("grasps", None) or None
        try:
            found = TypeAdapter(Baseline).validate_json(json.dumps(record))
        except ValidationError as error:
            said = complaint(error, Baseline)
            if said.startswith("entries"):
                said = "grasps" + said.removeprefix("entries")
            raise InputError(said) from error
        if PurePath(found.grasps_file).is_absolute() or not found.grasps_file.isprintable():
            raise InputError(
                "grasps_file: expected a path relative to this baseline's folder, got "
                f"{shown(found.grasps_file)}; name the file with --grasps"
            )
        return found


def read_baseline(path: Path) -> Baseline:
    """Read the baseline in a file."""
    return baseline_from_json(read_text(path), str(path))


def write_baseline(path: Path, baseline: Baseline) -> None:
    """Write a baseline to a new file, or over another baseline."""
    check_writable(path)
    write_text(path, baseline_to_json(baseline))


def check_writable(path: Path) -> None:
    """Refuse a path where a file stands that is not a baseline of any version."""
    if path.exists() and MARK not in read_text(path):
        raise InputError(
            f"{path}: this file is not a baseline and will not be overwritten; choose another path"
        )
