"""Runs the command `validate`, which simulates grasps and writes verdicts on them."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from grasp_core.files.text_files import write_text
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from sim_validate.cli import command_flags
from sim_validate.cli.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.cli.exit_codes import Exit
from sim_validate.commands.asked.objects import chosen_grasps, saved_grasps
from sim_validate.commands.asked.trials import prepared
from sim_validate.commands.judging import judge_grasps
from sim_validate.files.result_folders import alone_in, remove_verdicts
from sim_validate.files.writing import write_arrays
from sim_validate.records.verdicts import summary, trace_arrays, verdicts_to_json
from sim_validate.simulation.gate import require_faithful
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.simulation.traces import Outcome
from sim_validate.validation.validation import Job, validated
from sim_validate.validation.verdict import Verdict


def validate_file(command: command_flags.Validate, reporter: Reporter) -> int:
    """Simulate the grasps of a file and report which of them hold."""
    saved = saved_grasps(command.grasps, reporter)
    if saved is None:
        return Exit.NONE
    chosen = chosen_grasps(saved, friction=command.friction, seed=command.seed, limit=command.limit)
    setup, agenda = prepared(command.testing, saved.finger, chosen.seed, command.out)
    jobs, folder = command.testing.jobs, command.out
    with alone_in(folder):
        if command.protocol:
            code, text = judge_grasps(
                chosen, command.protocol, setup, jobs=jobs, folder=folder, reporter=reporter
            )
        else:
            code, text = simulate_grasps(
                chosen, setup, agenda, jobs=jobs, folder=folder, reporter=reporter
            )
    reporter.text(text)
    return code


def simulate_grasps(
    saved: Plan, setup: Setup, agenda: Agenda, *, jobs: int, folder: Path | None,
    reporter: Reporter,
) -> tuple[Exit, str]:  # fmt: skip
    """Simulate grasps, show the verdicts, and write them even if the run is interrupted.

    Gives the exit code, and the text of verdicts.json.
    """
    gate = require_faithful(setup, saved.friction, saved.body.radius)
    for check in gate.checks:
        reporter.detail(str(check))
    if folder:
        remove_verdicts(folder)
    tasks = [Job(saved.body, g, saved.friction, agenda, setup) for g in saved.grasps]
    verdicts: list[Verdict] = []
    try:
        with reporter.progress("simulating") as steps:
            for verdict in validated(tasks, jobs):
                verdicts.append(verdict)
                if folder and agenda.keep_traces:
                    write_arrays(folder / "traces" / f"{verdict.id}.npz", trace_arrays(verdict))
                held = sum(verdict.held for verdict in verdicts)
                steps.update(len(verdicts), len(tasks), f"({held} held)")
    finally:
        complete = len(verdicts) == len(tasks)
        text = verdicts_to_json(saved.body, saved.friction, verdicts, gate, complete=complete)
        if folder and verdicts:
            path = write_text(folder / "verdicts.json", text)
            reporter.say(f"wrote {path}" if complete else f"wrote what is done to {path}")
    _show(saved.grasps, verdicts, setup, reporter)
    good = all(verdict.good for verdict in verdicts)
    return (Exit.GOOD if good else Exit.NEGATIVE), text


def _show(
    grasps: Sequence[Grasp], verdicts: Sequence[Verdict], setup: Setup, reporter: Reporter
) -> None:
    rows: list[tuple[str, ...]] = []
    for grasp, verdict in zip(grasps[:TABLE_ROWS], verdicts, strict=False):
        # the maximum is NaN if one is
        worst = np.max([trial.hold.displacement_m for trial in verdict.wrenches])
        let_go = sum(control.let_go for control in verdict.controls)
        friction = verdict.critical_friction
        rows.append(
            (grasp.id, grasp.family, f"{friction.predicted:.4f}",
             "-" if friction.simulated is None else f"{friction.simulated:.4f}",
             *([_limit_range(verdict)] if verdict.agenda.limits != "none" else []),
             verdict.outcome.value, f"{1e6 * worst:.2g}", f"{let_go} of {len(verdict.controls)}")
        )  # fmt: skip
    limits = ("limits",) if verdicts and verdicts[0].agenda.limits != "none" else ()
    ends = ("outcome", "um moved", "controls let go")
    columns = ("grasp", "family", "mu*", "in sim", *limits, *ends)
    reporter.table("verdicts", columns, rows)
    say_cut(len(verdicts), reporter)
    _show_robustness(verdicts, reporter)
    totals = summary(verdicts)
    reporter.say(
        f"{totals['grasps_held']} of {totals['grasps']} grasps held all wrenches, at "
        f"{100.0 * setup.hold.load_share:g} % of what they resist; {totals['controls_let_go']} of "
        f"{totals['controls']} negative controls were let go (all should), "
        f"{totals['controls_held']} held"
    )
    for line in _surprises(verdicts):
        reporter.warn(line)
    if not totals["controls"]:
        reporter.warn("there were no negative controls: nothing shows that this test can fail")


def _limit_range(verdict: Verdict) -> str:
    shares = [trial.simulated_limit.share for trial in verdict.wrenches if trial.simulated_limit]
    return f"{min(shares):.3f}-{max(shares):.3f}" if shares else "-"


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


def _surprises(verdicts: Sequence[Verdict]) -> Iterable[str]:
    """Yield a line about each trial that did not end as it should."""
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
    left = len(lines) - TABLE_ROWS
    more = [f"and {left} more: verdicts.json (--out DIR) has all of them"] if left > 0 else []
    return lines[:TABLE_ROWS] + more
