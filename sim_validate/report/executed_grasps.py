"""Says what executions found, as tables of the first page and of the pages about grasps."""

import math
import shlex
from collections.abc import Iterable
from dataclasses import asdict
from typing import cast

import numpy as np

from scenes.drawing.pages import NOTHING, number
from sim_validate.closure.verdict import Verdict
from sim_validate.execution.executions_json import Executions, executions_summary
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    ExecutionTrial,
    best_executed,
    ended,
)
from sim_validate.report.agreement import BAD, GOOD, QUIET, Record, said_of

MILLI = 1e3
OTHER_FLAGS = {
    "stiffness_n_per_m": "tip-stiffness-n-per-m", "most_mm": "max-mm", "most_deg": "max-deg",
}  # fmt: skip
"""Flags of `graspproof execute` that are not named as their settings."""
ALWAYS = ("mass_kg", "seed")
"""Settings whose usual value depends on the object or on the plan."""
FAILED, LOST = "failed", "lost"
"""Word that begins how many trials were not survived, and the one word for it."""
NEVER = "never"
"""Text that stands for a first slip that no multiple of a load brings about."""


def said_of_execution(found: ExecutedGrasp | None) -> tuple[str, str]:
    """Say in words how the execution of a grasp ended, with the tone: good, bad or neither."""
    if found is None:
        return "not executed", QUIET
    if found.execution is None:
        return "no squeeze", BAD
    if not found.controls_let_go:
        return "a negative control held", BAD
    if not found.execution.trials:
        return "no trial is possible", BAD
    lost = sum(not trial.survived for trial in found.execution.trials)
    if lost:
        return f"{FAILED} {lost} of {len(found.execution.trials)} trials", BAD
    return "survived", GOOD


def said_of_both(
    verdict: Verdict | None, executions: Executions | None, found: ExecutedGrasp | None
) -> tuple[str, str]:
    """Say in words how a grasp ended in the test of its closure and, if any was, in its execution.

    Gives the words, and the tone: good, bad or neither; bad if either ending is.
    """
    closure, tone = said_of(verdict)
    if executions is None:
        return closure, tone
    ended, other = said_of_execution(found)
    tones = {tone, other}
    worst = next(each for each in (BAD, GOOD, QUIET) if each in tones)
    return f"closure: {closure}; execution: {LOST if ended.startswith(FAILED) else ended}", worst


def execution_row(found: ExecutedGrasp | None) -> Record:
    """Build the cells about one grasp in the table of the first page."""
    said, tone = said_of_execution(found)
    execution = None if found is None else found.execution
    trials = () if execution is None else execution.trials
    least = 0.0 if found is None else found.least_predicted_loss
    return {
        "said": said,
        "tone": tone,
        "loss": _slip(None if execution is None else execution.least_predicted_loss),
        "least_loss": "Infinity" if math.isinf(least) else f"{least:.6g}",  # as scripts read it
        "payload": number(None if execution is None else execution.payload_kg, 3),
        "multiple": number(None if execution is None else execution.load_multiple, 3),
        "survived": f"{sum(trial.survived for trial in trials)} of {len(trials)}",
        "predicted": _slip(min((trial.predicted_first_slip for trial in trials), default=None)),
        "simulated": _slip(min((trial.simulated_first_slip for trial in trials), default=None)),
    }


def described_executions(executions: Executions) -> str:
    """Say in one sentence how many grasps survived being executed, and with which mass."""
    counts = executions_summary(executions.grasps)
    lost = counts["grasps_without_squeeze"]
    said = (
        f"Executed with {executions.settings.mass_kg:.4g} kg at friction "
        f"{executions.friction:g}, {counts['grasps_survived']} of {counts['grasps']} grasps "
        f"survived every trial; {counts['controls_let_go']} of {counts['controls']} negative "
        "controls let go, as all should"
    )
    said += f"; no squeeze holds the object in {lost} of them" if lost else ""
    said += "." if executions.complete else "; the executions were interrupted."
    best = best_executed(executions.grasps)
    if best is not None and best.execution is not None:
        said += (
            f" Best for this is {best.id}: predicted to be lost at "
            f"{_slip(best.least_predicted_loss)} times the loads of its hardest trial, and its "
            f"squeeze carries {number(best.execution.payload_kg, 3)} kg in any direction."
        )
    return said


def execution_settings(executions: Executions) -> Iterable[tuple[str, str]]:
    """Yield names and values of everything that the executions of a run were asked for."""
    yield "execution.friction", f"{executions.friction:g}"
    for name, value in _flat(executions.settings).items():
        yield f"execution.{name}", str(value)


def _flat(settings: ExecutionSettings) -> dict[str, object]:
    """Return the settings by name, those of the hand in their place."""
    found = dict[str, object]()
    for name, value in asdict(settings).items():
        inside = {f"hand.{each}": own for each, own in value.items()} if name == "hand" else {}
        found |= inside or {name: value}
    return found


def execution_section(executions: Executions | None, found: ExecutedGrasp | None) -> Record | None:
    """Build the section about the execution of a grasp; None where no grasp was executed."""
    if executions is None:
        return None
    said, tone = said_of_execution(found)
    execution = None if found is None else found.execution
    return {
        "said": said,
        "tone": tone,
        "facts": list(_facts(executions, execution)),
        "reason": None if found is None else found.reason,
        "trials": [] if execution is None else [
            _trial(each, executions.settings) for each in execution.trials
        ],
        "controls": [] if execution is None else [
            {
                "name": each.name,
                "said": "let go" if each.let_go else "held",
                "tone": GOOD if each.let_go else BAD,
                "slip": _slip(each.first_slip),
            }
            for each in execution.controls
        ],
        "skipped": [] if execution is None else execution.skipped,
    }  # fmt: skip


def execute_command(executions: Executions, path: str, grasp_id: str) -> str:
    """Write the shell command that executes a grasp again, with the same settings."""
    words = ["graspproof", "execute", path, "--grasp", grasp_id]
    words += ["--friction", repr(executions.friction)]
    usual = _flat(ExecutionSettings(executions.settings.mass_kg).used)
    for name, value in _flat(executions.settings).items():
        if name in ALWAYS or value != usual[name]:
            own = name.removeprefix("hand.")
            words += [f"--{OTHER_FLAGS.get(own, own.replace('_', '-'))}", *_words(value)]
    return shlex.join(words)


def _words(value: object) -> list[str]:
    """Write the value of a flag: several numbers stand apart, names of trials have commas."""
    if not isinstance(value, tuple):
        return [repr(value)]
    parts = cast("tuple[object, ...]", value)
    if all(isinstance(part, str) for part in parts):
        return [",".join(map(str, parts))]
    return [repr(part) for part in parts]


def _facts(executions: Executions, found: Execution | None) -> Iterable[tuple[str, str]]:
    settings = executions.settings
    yield "Mass", f"{settings.mass_kg:.4g} kg, at friction {executions.friction:g}"
    yield "Push of a finger", f"at most {settings.push_n:.4g} N"
    tips = f"fingertips of {MILLI * settings.hand.tip_mass_kg:.4g} g"
    if found is not None and found.tip_radius_m is not None:
        tips += f" and {MILLI * float(found.tip_radius_m.max()):.4g} mm radius"
    yield "Springs", f"{settings.stiffness_n_per_m:.5g} N/m, {tips}"
    yield "Counts as held", f"up to {settings.most_mm:g} mm and {settings.most_deg:g} deg"
    if found is not None:
        sizes = ", ".join(f"{size:.3g}" for size in np.linalg.norm(found.squeeze, axis=1))
        yield "Squeeze, finger by finger", f"{sizes} N"
        yield (
            "Certified for", f"{found.load_multiple:.3g} times the weight, in any direction: a "
            f"payload of {found.payload_kg:.3g} kg, for loads that grow slowly",
        )  # fmt: skip
        yield "Least predicted loss", f"{_slip(found.least_predicted_loss)} times a trial's load"
        if found.load_multiple >= 1.0:
            spare = f"{found.load_multiple - 1.0:.3g} g in any direction, if it grows slowly"
            yield "So the palm may accelerate by", spare
        if found.enough is not None:
            yield "What would be enough", str(found.enough)


def _trial(trial: ExecutionTrial, settings: ExecutionSettings) -> Record:
    return {
        "name": trial.name,
        "fate": ended(trial, settings),
        "said": "survived" if trial.survived else "failed",
        "tone": GOOD if trial.survived else BAD,
        "slip": number(MILLI * trial.slip_m, 2),
        "displacement": number(MILLI * trial.displacement_m, 2),
        "turn": number(math.degrees(trial.turn_rad), 2),
        "predicted": _slip(trial.predicted_first_slip),
        "loss": _slip(trial.predicted_loss),
        "simulated": _slip(trial.simulated_first_slip),
    }


def _slip(multiple: float | None) -> str:
    if multiple is None:
        return NOTHING
    return NEVER if math.isinf(multiple) else f"{multiple:.2f}"
