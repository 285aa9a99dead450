"""Says what executions found, as tables of the first page and of the pages about grasps."""

import math
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import cast

import numpy as np

from grasp_core.figures import NONE, Figure, figures
from sim_validate.closure.verdict import Verdict
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    ExecutionControl,
    Executions,
    ExecutionTrial,
    multiple_in_words,
    totals_in_words,
)
from sim_validate.report.agreement import BAD, GOOD, QUIET, Record, said_of
from sim_validate.report.pages import records_table
from sim_validate.settings.executions import ExecutionSettings

MILLI = 1e3
ALWAYS = ("mass_kg", "seed")
"""Settings whose usual value depends on the object or on the plan."""
FAILED, LOST = "failed", "lost"
"""Word that begins how many trials were not survived, and the one word for it."""


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
    if lost := found.execution.lost:
        return f"{FAILED} {len(lost)} of {len(found.execution.trials)} trials", BAD
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
    """Build the cells about one grasp in the table of the first page, and on its card."""
    said, tone = said_of_execution(found)
    least = 0.0 if found is None else found.least_predicted_loss
    listed = execution_figures()
    return {
        "said": said,
        "tone": tone,
        "loss": multiple_in_words(least),
        "least_loss": "Infinity" if math.isinf(least) else f"{least:.6g}",  # as scripts read it
        "cells": [(NONE if found is None else each.cell(found), "") for each in listed],
    }


def execution_figures() -> Sequence[Figure]:
    """Return the figures of executed grasps, but for the id, which leads to a grasp's page."""
    return figures(ExecutedGrasp)[1:]


def described_executions(executions: Executions) -> str:
    """Say how many grasps survived being executed, and which is best."""
    ended = [] if executions.complete else ["the executions were interrupted"]
    return " ".join(f"{line[0].upper()}{line[1:]}." for line in totals_in_words(executions) + ended)


def execution_section(executions: Executions | None, found: ExecutedGrasp | None) -> Record | None:
    """Build the section about the execution of a grasp; None where no grasp was executed."""
    if executions is None:
        return None
    said, tone = said_of_execution(found)
    execution = None if found is None else found.execution
    trials, controls = ((), ()) if execution is None else (execution.trials, execution.controls)
    return {
        "said": said,
        "tone": tone,
        "facts": list(_facts(executions, found)),
        "reason": None if found is None else found.reason,
        "trials": records_table(trials, ExecutionTrial),
        "controls": records_table(controls, ExecutionControl),
        "skipped": () if execution is None else execution.skipped,
    }


def execute_command(executions: Executions, path: str, grasp_id: str) -> str:
    """Write the shell command that executes a grasp again, with the same settings."""
    words = ["graspproof", "execute", path, "--grasp", grasp_id]
    words += ["--friction", repr(executions.friction)]
    usual = asdict(ExecutionSettings(executions.settings.object_kg).used)
    for name, value in asdict(executions.settings).items():
        if name in ALWAYS or value != usual[name]:
            words += [f"--{name.replace('_', '-')}", *_words(value)]
    return shlex.join(words)


def _words(value: object) -> list[str]:
    """Write the value of a flag: several numbers stand apart, names of trials have commas."""
    if not isinstance(value, tuple):
        return [repr(value)]
    parts = cast("tuple[object, ...]", value)
    if all(isinstance(part, str) for part in parts):
        return [",".join(map(str, parts))]
    return [repr(part) for part in parts]


def _facts(executions: Executions, found: ExecutedGrasp | None) -> Iterable[tuple[str, str, str]]:
    settings, execution = executions.settings, None if found is None else found.execution
    yield "Mass", f"{settings.object_kg:.4g} kg", f"at friction {executions.friction:g}"
    tips = f"fingertips of {MILLI * settings.tip_mass_kg:.4g} g"
    if execution is not None and execution.tip_radius_m is not None:
        tips += f" and {MILLI * float(execution.tip_radius_m.max()):.4g} mm radius"
    yield "Push of a finger", f"at most {settings.push_n:.4g} N", ""
    yield "Springs", f"{settings.tip_stiffness_n_per_m:.5g} N/m", tips
    yield "Counts as held", f"up to {settings.max_mm:g} mm and {settings.max_deg:g} deg", ""
    if found is None or execution is None:
        return
    sizes = ", ".join(f"{size:.3g}" for size in np.linalg.norm(execution.squeeze, axis=1))
    yield "Squeeze, finger by finger", f"{sizes} N", ""
    for figure in execution_figures():
        yield figure.shown.heading, figure.cell(found), figure.meaning
    if found.enough is not None:
        yield "What would be enough", str(found.enough), ""
