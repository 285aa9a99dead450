"""Runs the command `validate`, which simulates grasps and writes verdicts on them."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

from grasp_core.files.records import RecordFile
from grasp_core.planning.result import Plan
from sim_validate.closure.asked_trials import prepared
from sim_validate.closure.validate import Job, validated
from sim_validate.closure.verdict import Verdict, Verdicts, trace_arrays
from sim_validate.engine.gate import require_faithful
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import Outcome
from sim_validate.kit import command_flags
from sim_validate.kit.console import TABLE_ROWS, Reporter, finished, warn_of
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.files import write_arrays
from sim_validate.kit.result_folders import alone_in, remove_results
from sim_validate.planning.asked_objects import asked_grasps

Judge: TypeAlias = Callable[[Plan, Setup], tuple[Exit, RecordFile]]
"""Judges grasps by another test; gives the exit code and its results."""


def validate_file(
    command: command_flags.Validate, reporter: Reporter, judge: Judge | None = None
) -> int:
    """Simulate the grasps of a file, or let another test judge them, and report which hold."""
    chosen = asked_grasps(
        command.grasps, reporter, friction=command.friction, seed=command.seed, limit=command.limit
    )
    if chosen is None:
        return Exit.NONE
    setup, agenda = prepared(command.testing, chosen.finger, chosen.seed, command.out)
    jobs, folder = command.testing.jobs, command.out
    with alone_in(folder):
        if judge is not None:
            code, found = judge(chosen, setup)
        else:
            code, found = simulate_grasps(
                chosen, setup, agenda, jobs=jobs, folder=folder, reporter=reporter
            )
    reporter.document(found.document())
    return code


def simulate_grasps(
    saved: Plan, setup: Setup, agenda: Agenda, *, jobs: int, folder: Path | None,
    reporter: Reporter,
) -> tuple[Exit, Verdicts]:  # fmt: skip
    """Simulate grasps; return the exit code and the verdicts."""
    gate = require_faithful(setup, saved.friction, saved.body.radius)
    for check in gate.checks:
        reporter.detail(str(check))
    if folder:
        remove_results(folder, "verdicts")
    tasks = [Job(saved.body, g, saved.friction, agenda, setup) for g in saved.grasps]

    def kept(verdict: Verdict) -> bool:
        if folder and agenda.keep_traces:
            write_arrays(folder / "traces" / f"{verdict.id}.npz", trace_arrays(verdict))
        return verdict.held

    results = reporter.counted("simulating", validated(tasks, jobs), len(tasks), "held", kept)
    collect = partial(Verdicts.of, saved.body, saved.friction, gate)
    path = folder and folder / Verdicts.FILE
    found = finished(results, len(tasks), collect, path, reporter)
    _show(found, setup, reporter)
    good = all(verdict.good for verdict in found)
    return (Exit.GOOD if good else Exit.NEGATIVE), found


def _show(verdicts: Verdicts, setup: Setup, reporter: Reporter) -> None:
    reporter.records("verdicts", verdicts.verdicts)
    _show_robustness(verdicts.verdicts, reporter)
    totals = verdicts.summary
    reporter.say(
        f"{totals['grasps_held']} of {totals['grasps']} grasps held all wrenches, at "
        f"{100.0 * setup.hold.load_share:g} % of what they resist; {totals['controls_let_go']} of "
        f"{totals['controls']} negative controls were let go (all should), "
        f"{totals['controls_held']} held"
    )
    warn_of(_surprises(verdicts.verdicts), "verdicts.json", reporter)
    if not totals["controls"]:
        reporter.warn("there were no negative controls: nothing shows that this test can fail")


def _show_robustness(verdicts: Sequence[Verdict], reporter: Reporter) -> None:
    rows: list[tuple[str, ...]] = []
    for verdict in verdicts[:TABLE_ROWS]:
        if (found := verdict.robustness) is None:
            return
        lower, upper = found.interval
        count = len(found.trials)
        failed = (trial for trial in found.trials if trial.outcome is not Outcome.HELD)
        first = next((f"{one.number}: {one.wrench or one.outcome.value}" for one in failed), "")
        rows.append(
            (verdict.id, f"{found.held} of {count}", str(found.predicted),
             f"{100.0 * lower:.3g} to {100.0 * upper:.3g} %", first)
        )  # fmt: skip
    columns = ("grasp", "held", "predicted", "95 % interval", "first not held")
    reporter.table("repeats with noise", columns, rows)


def _surprises(verdicts: Sequence[Verdict]) -> list[str]:
    lines = list[str]()
    for verdict in verdicts:
        for trial in verdict.failures:
            limit, ended = trial.predicted_limit, trial.hold.outcome.value
            over = f" as predicted, the limit is {limit:.3g} of this" if limit < 1.0 else ""
            lines.append(f"{verdict.id}: {trial.name}: {ended}{over}: {trial.hold.reason}")
    lines += [f"{verdict.id}: {what}" for verdict in verdicts for what in verdict.mismatches]
    lines += [
        f"{verdict.id}: control {control.control.name}: {trial.name}: {trial.hold.outcome.value}"
        for verdict in verdicts
        for control in verdict.controls
        for trial in control.tried
        if not control.let_go
    ]
    return lines
