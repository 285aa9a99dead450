"""Runs the command `execute`, which simulates grasps as a robot executes them."""

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from grasp_core.figures import NONE, figures
from grasp_core.planning.result import Plan
from sim_validate.closure.setup_toml import physics_from_file
from sim_validate.execution.asked_executions import execution_settings
from sim_validate.execution.jobs import ExecutionJob, executed
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    Executions,
    held_controls_in_words,
    losses_in_words,
    multiple_in_words,
    totals_in_words,
)
from sim_validate.kit import command_flags
from sim_validate.kit.about_object import AboutObject
from sim_validate.kit.console import TABLE_ROWS, Reporter, finished, warn_of
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.result_folders import alone_in, remove_results
from sim_validate.planning.asked_objects import asked_grasps
from sim_validate.settings.executions import ExecutionSettings

EXPLAINED = ("load_multiple", "payload_kg", "least_predicted_loss")
"""Figures whose meaning is said below their table."""
ENOUGH_MEANS = (
    "enough: the least --push-n, with the --tip-stiffness-n-per-m that was used or the least that "
    "it takes; docs/execution.md says what it does not promise"
)
SLIPS = "first slips, predicted/simulated"
SLIPS_MEAN = (
    "first slip: least multiple of the trials' loads at which a contact slips; above one none "
    "does, and in simulation 1.00 also stands for a slip once the whole weight had come"
)


def execute_file(command: command_flags.Execute, reporter: Reporter) -> int:
    """Execute the grasps of a file in simulation and report which of them survive."""
    chosen = asked_grasps(
        command.grasps, reporter, grasp=command.grasp, friction=command.friction,
        seed=command.seed, limit=command.limit,
    )  # fmt: skip
    if chosen is None:
        return Exit.NONE
    settings = execution_settings(command.executing, chosen.body, chosen.seed, chosen.finger)
    physics = {} if command.setup is None else physics_from_file(command.setup)
    with alone_in(command.out):
        code, text = execute_grasps(
            chosen, settings, jobs=command.jobs, folder=command.out, reporter=reporter,
            physics=physics,
        )  # fmt: skip
    reporter.text(text)
    return code


def execute_grasps(
    saved: Plan, settings: ExecutionSettings, *, jobs: int, folder: Path | None,
    reporter: Reporter, physics: Mapping[str, object] | None = None,
) -> tuple[Exit, str]:  # fmt: skip
    """Execute grasps; return the exit code and the text of executions.json."""
    if folder:
        remove_results(folder, "executions")
    changed, count = physics or {}, len(saved.grasps)
    tasks = [ExecutionJob(saved.body, g, saved.friction, settings, changed) for g in saved.grasps]
    results = reporter.counted(
        "executing", executed(tasks, jobs), count, "survived", lambda each: each.survived
    )
    collect = partial(_collected, AboutObject.of(saved.body), saved.friction, settings)
    found = finished(results, count, collect, folder and folder / Executions.FILE, reporter)
    _show(found, reporter)
    if not all(each.controls_let_go for each in found):
        return Exit.INTERNAL, found.text()
    good = all(each.survived for each in found)
    return (Exit.GOOD if good else Exit.NEGATIVE), found.text()


def _collected(
    body: AboutObject, friction: float, settings: ExecutionSettings,
    grasps: tuple[ExecutedGrasp, ...], *, complete: bool,
) -> Executions:  # fmt: skip
    return Executions(body, friction, complete, settings, grasps)


def _show(found: Executions, reporter: Reporter) -> None:
    settings = found.settings
    kinds, shown = settings.trials, found.grasps[:TABLE_ROWS]
    reporter.records("executions", found.grasps)
    for figure in figures(ExecutedGrasp):
        if figure.name in EXPLAINED:
            reporter.say(f"{figure.shown.heading}: {figure.meaning}")
    for title, cell in (("trials survived", _survived), (SLIPS, _slips)):
        rows = [(each.id, *(cell(each.execution, kind) for kind in kinds)) for each in shown]
        reporter.table(title, ("grasp", *kinds), rows)
    reporter.say(SLIPS_MEAN)
    _say_totals(found, reporter)
    warn_of(list(_losses(found)), Executions.FILE, reporter)
    if any(each.enough for each in found):
        reporter.say(ENOUGH_MEANS)
    if any(not trial.survived for each in found for trial in each.trials if trial.kind == "knock"):
        reporter.warn(
            f"a knock of {settings.impulse_n_s:g} N s would give a free object of "
            f"{settings.object_kg:g} kg {settings.impulse_n_s / settings.object_kg:.3g} m/s; "
            "choose it with --knock-n-s"
        )


def _say_totals(found: Executions, reporter: Reporter) -> None:
    left_out = Counter(
        (each.kind, each.reason) for one in found if one.execution for each in one.execution.skipped
    )
    for (kind, reason), count in left_out.items():
        reporter.say(f"no {kind} for {count} of {len(found)} grasps: {reason}")
    for sentence in totals_in_words(found):
        reporter.say(sentence)


def _survived(found: Execution | None, kind: str) -> str:
    survived, count = (0, 0) if found is None else found.survival(kind)
    return f"{survived} of {count}" if count else NONE


def _slips(found: Execution | None, kind: str) -> str:
    trials = () if found is None else found.of_kind(kind)
    if not trials:
        return NONE
    predicted = min(trial.predicted_first_slip for trial in trials)
    simulated = min(trial.simulated_first_slip for trial in trials)
    return f"{multiple_in_words(predicted)}/{multiple_in_words(simulated)}"


def _losses(found: Executions) -> Iterator[str]:
    for each in found:
        if each.execution is not None:
            yield from (f"{each.id}: {line}" for line in held_controls_in_words(each.execution))
    for each in found:
        if each.execution is None:
            yield f"{each.id}: not executed: {each.reason}"
        else:
            said = losses_in_words(each.execution, found.settings)
            yield from (f"{each.id}: {line}" for line in said)
