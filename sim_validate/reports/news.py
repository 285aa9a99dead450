"""What a verdict in JSON comes to, in a word or two, and whether that is good."""

from collections.abc import Mapping
from typing import Any

from sim_validate.simulation.hold_verdict import LET_GO, Outcome

Record = Mapping[str, Any]
"""An object of a JSON file."""
HELD = Outcome.HELD.value
GONE = tuple(outcome.value for outcome in LET_GO)
GOOD, BAD, QUIET = "good", "bad", "quiet"
"""How news is; classes of it in pages."""


def said_of(verdict: Record | None) -> tuple[str, str]:
    """What became of a grasp, and how good that is."""
    if verdict is None:
        return "not simulated", QUIET
    outcome, controls = str(verdict["outcome"]), verdict["controls"].values()
    if outcome not in (HELD, *GONE):
        return outcome.replace("_", " "), BAD
    if verdict["mismatches"]:
        return "contradicts the analysis", BAD
    if any(control["held"] for control in controls):
        return "a control held", BAD
    if not all(map(let_go, controls)):
        return "a control is undecided", BAD
    return outcome.replace("_", " "), GOOD if verdict["held"] else BAD


def let_go(control: Record) -> bool:
    """Whether each of a control's loads moved it, as the analysis says."""
    return all(trial["outcome"] in GONE for trial in control["wrenches"])
