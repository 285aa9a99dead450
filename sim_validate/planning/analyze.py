"""Runs the command `analyze`, which judges contacts of any origin and prints tables or JSON."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.closure.friction_interval import FrictionInterval
from grasp_core.errors import about
from grasp_core.files.text_files import read_text
from grasp_core.records.contacts_json import ContactSet, Overrides, contact_sets_from_json
from sim_validate.kit import command_flags
from sim_validate.kit.console import TABLE_ROWS, Reporter, finished_text
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.processes import each
from sim_validate.planning.analysis_json import analyses_to_document, summary
from sim_validate.planning.contact_analysis import (
    Analysis,
    Bounds,
    Outcome,
    Question,
    analyze,
    check_edges,
)

DIGITS = 7
STEP = 10.0**-DIGITS
"""Step to which both ends of a printed interval are rounded; results are reproducible to this step.
"""
UNKNOWN = "?"
"""The word in tables for a value that could not be decided."""


def analyze_file(command: command_flags.Analyze, reporter: Reporter) -> int:
    """Analyse the grasps of a contacts file; an interrupted run still shows its results so far."""
    overrides = Overrides(command.friction, command.torque_scale_m, command.outward)
    text = read_text(command.contacts)
    with about(command.contacts):
        sets = contact_sets_from_json(text, overrides)
    check_edges(sets, command.edges)
    question = Question(command.max_normal_force, command.wrench, command.edges)
    found = each(partial(analyze, question=question), sets, jobs=command.jobs)
    results = reporter.counted(
        "analysing", found, len(sets), "closed", lambda one: one.outcome is Outcome.CLOSED
    )

    def told(done: Sequence[Analysis], *, complete: bool) -> str:
        source = str(command.contacts)
        reporter.document(analyses_to_document(source, question, done, complete=complete))
        return ""

    analyses, _ = finished_text(results, len(sets), told, None, reporter)
    _show(analyses, reporter)
    good = all(found.outcome is Outcome.CLOSED for found in analyses)
    return Exit.GOOD if good else Exit.NEGATIVE


def _show(analyses: Sequence[Analysis], reporter: Reporter) -> None:
    shown = analyses[:TABLE_ROWS]
    if len(analyses) == 1:
        reporter.table(f"grasp {shown[0].contacts.id}", ("property", "value"), _facts(shown[0]))
    else:
        columns = ("grasp", "contacts", "closed", "margin", "mu*", "l1 N", "linf N", "weakest axis")
        reporter.table(f"{len(analyses)} grasps", columns, [_row(found) for found in shown])
    if shown[0].wrenches:
        rows = [row for found in shown for row in _wrench_rows(found)]
        columns = ("grasp", "wrench", "resisted up to", "upper bound", "least-norm forces N")
        reporter.table("wrenches", columns, rows)
    if len(analyses) > TABLE_ROWS:
        reporter.say(f"... and {len(analyses) - TABLE_ROWS} more; --json shows all")
    for found in shown:
        for name, reason in found.undecided.items():
            reporter.say(f"grasp {found.contacts.id}: {name} is undecided: {reason}")
    _say_measures(shown[0].contacts, reporter)
    totals = summary(analyses)
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
    certificate = found.certificate
    rows = [("contacts", str(len(found.contacts.positions))), ("closed", _closed(found))]
    if certificate is not None:
        rows.append(("certificate", "checked"))
        rows.append(("closure margin", f"{certificate.margin:.6g}"))
        if certificate.forces is not None:
            rows.append(("balanced forces", _forces(certificate.forces)))
        if found.separating_wrench is not None:
            rows.append(("separating wrench", _listed(found.separating_wrench)))
    weakest = found.weakest_axis
    return [
        *rows,
        ("critical friction", _friction(found.critical_friction)),
        ("  proved between", _ends(found.friction_interval)),
        ("Ferrari-Canny l1 [N]", _bounds(found.l1)),
        ("Ferrari-Canny linf [N]", _bounds(found.linf)),
        ("min-weight", _number(found.min_weight)),
        ("hull volume", _number(found.hull_volume)),
        ("smallest singular value", _number(found.smallest_singular_value)),
        ("weakest axis wrench", UNKNOWN if weakest is None else _listed(weakest.wrench)),
        ("resisted up to", UNKNOWN if weakest is None else _number(weakest.limit)),
        ("resisted in every direction [N]", _number(found.everywhere)),
        ("centre [m]", _listed(found.contacts.center)),
        ("torque scale [m]", _number(found.contacts.torque_scale)),
    ]


def _row(found: Analysis) -> tuple[str, ...]:
    return (
        found.contacts.id,
        str(len(found.contacts.positions)),
        _closed(found),
        UNKNOWN if found.certificate is None else f"{found.certificate.margin:.3g}",
        _friction(found.critical_friction),
        UNKNOWN if found.l1 is None else _number(found.l1.lower, 4),
        UNKNOWN if found.linf is None else _number(found.linf.lower, 4),
        UNKNOWN if found.weakest_axis is None else _number(found.weakest_axis.limit, 4),
    )


def _wrench_rows(found: Analysis) -> list[tuple[str, ...]]:
    return [
        (
            found.contacts.id,
            UNKNOWN if resisted is None else _listed(resisted.limit.wrench),
            UNKNOWN if resisted is None else _number(resisted.limit.limit),
            UNKNOWN if resisted is None else _number(resisted.limit.upper),
            "-" if resisted is None or resisted.forces is None else _forces(resisted.forces),
        )
        for resisted in found.wrenches
    ]


def _closed(found: Analysis) -> str:
    words = {Outcome.CLOSED: "yes", Outcome.OPEN: "no", Outcome.UNDECIDED: UNKNOWN}
    return words[found.outcome]


def _friction(critical: float | None) -> str:
    if critical is None:
        return UNKNOWN
    return f"{critical:.4f}" if np.isfinite(critical) else "none suffices"


def _ends(found: FrictionInterval | None) -> str:
    """Print a proved interval, with both ends rounded outwards so that it still holds."""
    if found is None:
        return UNKNOWN
    lower, upper = np.array([np.floor(found.lower / STEP), np.ceil(found.upper / STEP)]) * STEP
    return f"{lower:.{DIGITS}f} and {upper:.{DIGITS}f}"


def _bounds(found: Bounds | None) -> str:
    if found is None:
        return UNKNOWN
    checked = "checked" if found.verified else "NOT CHECKED"
    return f"{_number(found.lower)} to {_number(found.upper)}, {checked}"


def _number(value: float | None, digits: int = 6) -> str:
    """Print a number; minus zero is printed as zero."""
    return UNKNOWN if value is None else f"{value + 0.0:.{digits}g}"


def _listed(values: Array) -> str:
    return ", ".join(_number(value, 4) for value in to_digits(values))


def _forces(forces: Array) -> str:
    return "; ".join(_listed(force) for force in to_digits(forces))
