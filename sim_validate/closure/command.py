"""Simulates the grasps of a file, with trials and settings from flags."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from grasp_core.planning.reach import Finger
from grasp_core.planning.result import Plan
from grasp_core.settings import extended
from grasp_core.stopping import never
from sim_validate.closure.validate import checked_for, validated
from sim_validate.closure.verdict import Verdict, Verdicts, trace_arrays
from sim_validate.commands.console import TABLE_ROWS, Reporter, warn_of
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.commands.simulation_flags import Testing
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.setup import (
    Agenda,
    Setup,
    setup_from_file,
    weights,
    with_planned_radius,
    wrenches_from_file,
)
from sim_validate.files.array_files import write_arrays
from sim_validate.files.results_folder import remove_results
from sim_validate.settings import ChosenTrials, Noise


def simulate_grasps(
    saved: Plan, setup: Setup, agenda: Agenda, *, jobs: int, folder: Path | None,
    reporter: Reporter, stop: Callable[[], bool] = never,
) -> tuple[Exit, Verdicts]:  # fmt: skip
    """Simulate grasps; return the exit code and the verdicts."""
    gate = checked_for(saved.body, saved.friction, agenda, setup)
    for check in gate.checks:
        reporter.detail(str(check))
    if folder:
        remove_results(folder, Verdicts.FILE)

    def kept(verdict: Verdict) -> bool:
        if folder and agenda.keep_traces:
            write_arrays(folder / "traces" / f"{verdict.id}.npz", trace_arrays(verdict))
        return verdict.held

    collect = partial(Verdicts.of, saved.body, saved.friction, gate)
    found = reporter.collected(
        "simulating",
        validated(saved.body, saved.grasps, saved.friction, gate, agenda, setup, jobs),
        len(saved.grasps),
        ("held", kept),
        collect,
        folder,
        stop,
    )
    _show(found, setup, reporter)
    if found.verdicts and all(verdict.not_simulated for verdict in found):
        return Exit.INPUT, found  # of a friction, say, at which no grasp of the file is closed
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
        f"{totals['controls_held']} were not"
    )
    warn_of(_surprises(verdicts.verdicts), Verdicts.FILE, reporter)
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
        started = verdict.outcome not in (Outcome.INVALID_START, Outcome.ERROR)
        if not started:  # for one reason, whatever the wrench
            lines.append(
                f"{verdict.id}: {verdict.outcome.value}: {verdict.failures[0].hold.reason}"
            )
        for trial in verdict.failures if started else ():
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


def check_noise(given: ChosenTrials) -> None:
    """Refuse noise where nothing is repeated with it."""
    if not given.repeats and given.noise != Noise():
        raise FlagsError(
            "the flags --noise... set the noise of repeated trials: give their number with "
            "--repeats too"
        )


def prepared(testing: Testing, planned: Finger | None, seed: int) -> tuple[Setup, Agenda]:
    """Build settings and trials from flags; those of a setup file override them."""
    setup = extended(Setup, testing.scene, timeout_s=testing.timeout_s)
    setup = replace(setup, fingers=with_planned_radius(setup.fingers, planned))
    if testing.setup is not None:
        setup = setup_from_file(testing.setup, setup)
    check_noise(testing.more)
    if testing.weight_down and testing.weight_n is None:
        raise FlagsError(
            "--weight-down is the direction in which the weight acts: give the weight with "
            "--weight-n too"
        )
    own = () if testing.wrenches is None else wrenches_from_file(testing.wrenches)
    weight = () if testing.weight_n is None else weights(testing.weight_n, testing.weight_down)
    agenda = extended(
        Agenda, testing.more, wrenches=(*own, *weight), keep_traces=testing.traces, seed=seed
    )
    return setup, agenda
