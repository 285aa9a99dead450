"""Reads `verdicts.json` for all who read it, and refuses verdicts that contradict themselves."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from grasp_core.by_value import ByValue
from grasp_core.checked import path_of
from grasp_core.errors import InputError
from grasp_core.files.json_text import record_of
from grasp_core.files.text_files import read_text
from grasp_core.grasp_tables import ById, frame_of
from sim_validate.records.verdicts_schema import SCHEMA, VerdictRecord, VerdictsFile
from sim_validate.simulation.hold_verdict import LET_GO, Outcome


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
        return frame_of(list(map(_row, self.verdicts)), [each.id for each in self.verdicts])


def _row(verdict: SavedVerdict) -> Mapping[str, object]:
    simulated = verdict.simulated_critical_friction
    return {
        "good": verdict.good,
        "held": verdict.held,
        "outcome": verdict.outcome.value,
        "controls_let_go": verdict.controls_let_go,
        "mismatches": len(verdict.mismatches),
        "predicted_critical_friction": verdict.predicted_critical_friction,
        "simulated_critical_friction": math.nan if simulated is None else simulated,
        "displacement_m": verdict.displacement_m,
    }


def load_verdicts(path: str | Path) -> SavedVerdicts:
    """Read verdicts, as `graspproof validate` and `graspproof run` write them.

    Args:
        path: A `verdicts.json`.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    try:
        record = verdicts_of(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
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
        controls_let_go=all(
            trial["outcome"] in LET_GO
            for control in record["controls"].values()
            for trial in control["wrenches"]
        ),
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
    for name, count in _counts(verdicts).items():
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


def _counts(verdicts: Sequence[VerdictRecord]) -> dict[str, int]:
    controls = [control for verdict in verdicts for control in verdict["controls"].values()]
    return {
        "grasps": len(verdicts),
        "grasps_held": sum(each["held"] for each in verdicts),
        "controls": len(controls),
        "controls_held": sum(each["held"] for each in controls),
        "controls_let_go": sum(
            all(trial["outcome"] in LET_GO for trial in each["wrenches"]) for each in controls
        ),
        "mismatches": sum(len(each["mismatches"]) for each in verdicts),
    }
