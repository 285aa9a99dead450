"""Says what executions found, and where a hand stands in grasps, on cards and pages."""

import math
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from grasp_core.by_value import counted
from grasp_core.figures import NONE, Figure, figures
from grasp_core.files.records import record_of
from grasp_core.hands.obstacles import REASONS
from grasp_core.messages import MILLI
from grasp_core.names import HANDS
from scenes.drawing.pages import (
    BAD_TONE,
    GOOD_TONE,
    QUIET_TONE,
    Fact,
    TemplateData,
    facts_of,
    number,
    records_table,
)
from sim_validate.commands.config_file import flags_from
from sim_validate.commands.simulation_flags import ExecuteFlags
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    ExecutionControl,
    Executions,
    ExecutionTrial,
    multiple_in_words,
    totals_in_words,
)
from sim_validate.hands.flags import Reach
from sim_validate.report.run_folder import Findings, said_of_execution
from sim_validate.settings import ExecutionSettings

if TYPE_CHECKING:
    from sim_validate.hands.reaches import ReachedGrasp, Reaches

EXECUTION_FIGURES: Sequence[Figure] = figures(ExecutedGrasp)[1:]
FINGERS_MEANING = "that touch at the grasp's contacts, by finger of the grasp"
HAND_TITLE_FIGURES = ("grasp", "id")
ALWAYS = ("mass_kg", "seed")
"""Settings of executions whose usual value depends on the object or on the plan."""


def why_not_held(found: Findings) -> str:
    """Say why there is no hand to draw in a grasp."""
    name, reached = found.grasp.id, found.reached
    if reached is None:
        return f"reaches.json holds nothing about {name}; `graspproof reach` looks for a pose"
    return f"{name}: {reached.reach.explanation}"


def said_of_reach(found: Findings) -> tuple[str, str]:
    """Say in words whether the hand reaches a grasp, with the tone; nothing without a hand."""
    reaches = found.run.reaches
    if reaches is None:
        return "", QUIET_TONE
    said, tone = _reach_in_words(found.reached)
    return f"{reaches.hand.name}: {said}", tone


def _reach_in_words(reached: "ReachedGrasp | None") -> tuple[str, str]:
    if reached is None:
        return "not asked", QUIET_TONE
    reach, held, executed = reached.reach, reached.simulated, reached.executed
    if not reach.reached:
        return f"not reached, {REASONS[reach.reason]}", QUIET_TONE
    within = reach.within_regions or ()
    inside = f"{sum(within)} of {len(within)} contacts "
    said = [f"reached, {'' if all(within) else inside}within regions"]
    if held is not None:
        strength = f"held: {number(held.weakest_n)} N with its motors"
        said.append(strength if held.held else "not held in simulation")
    if executed is not None and executed.execution is None:
        said.append("not executed")
    elif executed is not None:
        kept = sum(trial.survived for trial in executed.trials)
        said.append(f"survived {kept} of {len(executed.trials)} trials")
    lost = executed is not None and not all(trial.survived for trial in executed.trials)
    return ", ".join(said), BAD_TONE if lost or (held is not None and not held.held) else GOOD_TONE


def described_reaches(reaches: "Reaches | None") -> str:
    """Say in one sentence how many grasps a hand reaches."""
    if reaches is None:
        return ""
    asked = counted(len(reaches), "grasp")
    said = f"The hand {reaches.hand.name} reaches {reaches.summary['reached']} of {asked}"
    return said + ("." if reaches.complete else "; the search was interrupted.")


def reach_settings(reaches: "Reaches") -> Iterable[tuple[str, str]]:
    """Yield names and values of everything that was asked for."""
    yield "hand.name", reaches.hand.name
    yield "hand.friction", f"{reaches.friction:g}"
    for name, value in record_of(reaches.asked).items():
        yield f"hand.{name}", str(value)
    limits = {joint.torque_limit_n_m for joint in reaches.hand.joints}
    if stated := sorted(limit for limit in limits if limit is not None):
        yield "hand.torque_limits_n_m", ", ".join(f"{limit:g}" for limit in stated)


def reach_section(found: Findings) -> TemplateData | None:
    """Build the section about the hand in a grasp; None where no hand was asked for."""
    reached, reaches = found.reached, found.run.reaches
    if reaches is None or reached is None:
        return None
    said, tone = _reach_in_words(reached)
    return {
        "hand": reaches.hand.name,
        "said": said,
        "tone": tone,
        "facts": list(_reach_facts(reaches, reached)),
        "explanation": reached.reach.explanation,
    }


def _reach_facts(reaches: "Reaches", found: "ReachedGrasp") -> Iterable[Fact]:
    if found.reach.reached:
        names = reaches.finger_names(found.reach)
        yield (
            "Fingers used",
            ", ".join(f"{k}: {name}" for k, name in enumerate(names)),
            FINGERS_MEANING,
        )
    yield from _of_hand(found)
    if found.simulated is not None:
        yield from _of_hand(found.simulated, "With its motors: ")
    if (executed := found.executed) is not None:
        yield from _of_hand(executed, "Executed with the hand: ")
        if executed.reason is not None:
            yield "Not executed", executed.reason, ""
        yield from _enough(executed)


def _enough(found: ExecutedGrasp) -> Iterable[Fact]:
    if found.enough is not None:
        yield "What would be enough", str(found.enough), ""


def _of_hand(record: object, part: str = "") -> Iterable[Fact]:
    for heading, cell, meaning in facts_of(record, HAND_TITLE_FIGURES):
        said = f"{part}{heading}"
        yield f"{said[0].upper()}{said[1:]}", cell, meaning


def reach_commands(found: Findings, path: str) -> Sequence[str]:
    """Write the shell command that seeks the pose again; none for a hand from a file."""
    reaches = found.run.reaches
    if reaches is None or reaches.hand.name not in HANDS or found.reached is None:
        return []
    words = ["graspproof", "reach", path, "--hand", reaches.hand.name, "--grasp", found.grasp.id]
    words += ["--friction", repr(reaches.friction)]
    words += flags_from(_changed(reaches.asked, type(reaches.asked)()), Reach)
    return [shlex.join(words)]


def execution_row(found: ExecutedGrasp | None) -> TemplateData:
    """Build the cells about one grasp in the table of the first page, and on its card."""
    said, tone = said_of_execution(found)
    least = 0.0 if found is None else found.least_predicted_loss
    return {
        "said": said,
        "tone": tone,
        "loss": multiple_in_words(least),
        "least_loss": "Infinity" if math.isinf(least) else f"{least:.6g}",  # as scripts read it
        "cells": [(NONE if found is None else each.cell(found), "") for each in EXECUTION_FIGURES],
    }


def described_executions(executions: Executions) -> str:
    """Say how many grasps survived being executed, and which is best."""
    ended = [] if executions.complete else ["the executions were interrupted"]
    return " ".join(f"{line[0].upper()}{line[1:]}." for line in totals_in_words(executions) + ended)


def execution_section(found: Findings) -> TemplateData | None:
    """Build the section about the execution of a grasp; None where no grasp was executed."""
    executed, executions = found.executed, found.run.executions
    if executions is None:
        return None
    said, tone = said_of_execution(executed)
    execution = None if executed is None else executed.execution
    trials, controls = ((), ()) if execution is None else (execution.trials, execution.controls)
    return {
        "said": said,
        "tone": tone,
        "facts": list(_execution_facts(executions, executed)),
        "reason": None if executed is None else executed.reason,
        "trials": records_table(trials, ExecutionTrial),
        "controls": records_table(controls, ExecutionControl),
        "skipped": () if execution is None else execution.skipped,
    }


def execute_command(executions: Executions, path: str, grasp_id: str) -> str:
    """Write the shell command that executes a grasp again, with the same settings."""
    words = ["graspproof", "execute", path, "--grasp", grasp_id]
    words += ["--friction", repr(executions.friction)]
    usual = ExecutionSettings(executions.settings.object_kg).used
    changed = _changed(executions.settings, usual, ALWAYS)
    return shlex.join([*words, *flags_from(changed, ExecuteFlags)])


def _changed(settings: Any, usual: Any, always: Sequence[str] = ()) -> TemplateData:
    return {name: value for name, value in asdict(settings).items()
            if name in always or value != getattr(usual, name)}  # fmt: skip


def _execution_facts(executions: Executions, found: ExecutedGrasp | None) -> Iterable[Fact]:
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
    for figure in EXECUTION_FIGURES:
        yield figure.shown.heading, figure.cell(found), figure.explained
    yield from _enough(found)
