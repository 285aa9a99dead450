"""Reads `verdicts.json` for all who read it, and refuses verdicts that contradict themselves."""

from collections.abc import Iterator, Sequence

from grasp_core.errors import InputError
from grasp_core.files.complaints import record_of
from sim_validate.records.verdicts_schema import SCHEMA, VerdictRecord, VerdictsFile
from sim_validate.simulation.hold_verdict import LET_GO, Outcome


def verdicts_of(text: str) -> VerdictsFile:
    """Read the text of a `verdicts.json`.

    Raises:
        InputError: The text is no such file, or a part of it contradicts another one; the message
            names the field.
    """
    record = record_of(VerdictsFile, text, "verdicts.json", schema=SCHEMA)
    verdicts = record["verdicts"]
    for number, verdict in enumerate(verdicts):
        for field, found, why in _contradictions(verdict):
            raise InputError(
                f"verdicts[{number}].{field}: {found} contradicts {why}; write the file again, or "
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
