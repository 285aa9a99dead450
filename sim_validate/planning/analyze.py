"""Runs the command `analyze`, which judges contacts of any origin and prints tables or JSON."""

from functools import partial

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.errors import about
from grasp_core.figures import NONE, figures
from grasp_core.files.text_files import read_text
from grasp_core.records.contacts_json import ContactSet, Overrides, contact_sets_from_json
from sim_validate.kit import command_flags
from sim_validate.kit.console import TABLE_ROWS, Reporter, finished
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.processes import each
from sim_validate.planning.contact_analysis import (
    Analyses,
    Analysis,
    Outcome,
    Question,
    analyze,
    check_edges,
)

DIGITS = 7
STEP = 10.0**-DIGITS
"""Step to which both ends of a printed interval are rounded; results are reproducible to this step.
"""


def analyze_file(command: command_flags.Analyze, reporter: Reporter) -> int:
    """Analyse the grasps of a contacts file; an interrupted run still shows its results so far."""
    overrides = Overrides(command.friction, command.torque_scale_m, command.outward)
    text = read_text(command.contacts)
    with about(command.contacts):
        sets = contact_sets_from_json(text, overrides)
    check_edges(sets, command.edges)
    question = Question(command.max_normal_force_n, command.wrench, command.edges)
    found = each(partial(analyze, question=question), sets, jobs=command.jobs)
    results = reporter.counted(
        "analysing", found, len(sets), "closed", lambda one: one.outcome is Outcome.CLOSED
    )

    def told(done: tuple[Analysis, ...], *, complete: bool) -> Analyses:
        analyses = Analyses(str(command.contacts), question, done, complete)
        reporter.text(analyses.text())
        return analyses

    analyses = finished(results, len(sets), told, None, reporter)
    _show(analyses, reporter)
    good = all(found.outcome is Outcome.CLOSED for found in analyses.grasps)
    return Exit.GOOD if good else Exit.NEGATIVE


def _show(analyses: Analyses, reporter: Reporter) -> None:
    shown = analyses.grasps[:TABLE_ROWS]
    if len(analyses.grasps) == 1:
        name = shown[0].contacts.id
        reporter.table(f"grasp {name}", ("property", "value"), _facts(shown[0]))
    else:
        reporter.records(f"{len(analyses.grasps)} grasps", analyses.grasps)
    if shown[0].wrenches:
        rows = [row for found in shown for row in _wrench_rows(found)]
        columns = ("grasp", "wrench", "resisted up to", "upper bound", "least-norm forces N")
        reporter.table("wrenches", columns, rows)
    for found in shown:
        for name, reason in found.undecided.items():
            reporter.say(f"grasp {found.contacts.id}: {name} is undecided: {reason}")
        for name in (name for name, good in found.verified.items() if not good):
            reporter.say(f"grasp {found.contacts.id}: {name} is NOT CHECKED")
    _say_measures(shown[0].contacts, reporter)
    totals = analyses.summary
    reporter.say(
        f"{totals['closed']} of {totals['grasps']} grasps are in force closure, "
        f"{totals['open']} are not, {totals['undecided']} are undecided"
    )


def _say_measures(contacts: ContactSet, reporter: Reporter) -> None:
    """Say which centre and torque scale were used; they are the same for all grasps of a file."""
    centers = {
        "file": "the center_m of the file",
        "mean contact": "the mean contact (no center_m given)",
        "center of mass": "the object's centre of mass",
    }
    scales = {
        "flag": "--torque-scale-m",
        "file": "the torque_scale_m of the file",
        "farthest contact": "the distance of the farthest contact (no torque_scale_m given)",
        "object radius": "the object's radius",
    }
    reporter.say(
        f"torques are about {centers[contacts.center_from]}, and are divided by "
        f"{scales[contacts.torque_scale_from]} to compare them with forces"
    )


def _facts(found: Analysis) -> list[tuple[str, str]]:
    rows = [(figure.shown.heading, figure.cell(found)) for figure in figures(Analysis)[1:]]
    if found.critical_friction_interval is not None:
        rows.append(("mu* is proved between", _ends(*found.critical_friction_interval)))
    if found.forces is not None:
        rows.append(("balanced forces", _listed(found.forces)))
    if found.separating_wrench is not None:
        rows.append(("separating wrench", _listed(found.separating_wrench)))
    if found.weakest_axis_wrench is not None:
        rows.append(("weakest axis wrench", _listed(found.weakest_axis_wrench.wrench)))
    rows.append(("centre [m]", _listed(found.contacts.center)))
    return [*rows, ("torque scale [m]", f"{found.contacts.torque_scale:.6g}")]


def _wrench_rows(found: Analysis) -> list[tuple[str, ...]]:
    name = found.contacts.id
    return [
        (name, NONE, NONE, NONE, NONE)
        if one is None
        else (
            name,
            _listed(one.wrench),
            f"{one.limit:.6g}",
            f"{one.upper:.6g}",
            NONE if one.least_norm_forces_n is None else _listed(one.least_norm_forces_n),
        )
        for one in found.wrenches
    ]


def _ends(lower: float, upper: float) -> str:
    """Print a proved interval, with both ends rounded outwards so that it still holds."""
    low, high = np.array([np.floor(lower / STEP), np.ceil(upper / STEP)]) * STEP
    return f"{low:.{DIGITS}f} and {high:.{DIGITS}f}"


def _listed(values: Array) -> str:
    """Print a vector, or several of them."""
    rows = np.atleast_2d(to_digits(values) + 0.0).tolist()
    return "; ".join(", ".join(f"{value:.4g}" for value in row) for row in rows)
