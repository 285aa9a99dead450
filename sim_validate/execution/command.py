"""Runs the command `execute`, which simulates grasps as a robot executes them."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from grasp_core.planning.result import Plan
from sim_validate.closure.setup_toml import physics_from_file
from sim_validate.execution.asked_executions import check_mass, execution_settings
from sim_validate.execution.executions_json import (
    EXECUTIONS,
    executions_summary,
    executions_to_json,
)
from sim_validate.execution.jobs import ExecutionJob, executed
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    best_executed,
    held_controls_in_words,
    losses_in_words,
)
from sim_validate.kit import command_flags
from sim_validate.kit.console import TABLE_ROWS, Reporter, finished_text, say_cut, warn_of
from sim_validate.kit.exit_codes import Exit
from sim_validate.kit.result_folders import alone_in, remove_results
from sim_validate.planning.asked_objects import asked_grasps

ABSENT = "-"
COLUMNS_MEAN = (
    "least loss: least multiple of a trial's load at which the object is lost, predicted; the "
    "number to choose by (docs/which-number.md)",
    "load: multiple of the weight, in any direction, that the squeeze is certified for",
    "payload kg: that multiple of the mass, for loads that grow slowly",
)
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
    check_mass(command.executing.mass)
    chosen = asked_grasps(
        command.grasps, reporter, grasp=command.grasp, friction=command.friction,
        seed=command.seed, limit=command.limit,
    )  # fmt: skip
    if chosen is None:
        return Exit.NONE
    settings = execution_settings(
        chosen.body, chosen.seed, chosen.finger, command.executing, command.trials, command.down
    )
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
    text_of = partial(executions_to_json, saved.body, saved.friction, settings)
    found, text = finished_text(results, count, text_of, folder and folder / EXECUTIONS, reporter)
    _show(found, settings, reporter)
    if not all(each.controls_let_go for each in found):
        return Exit.INTERNAL, text
    return (Exit.GOOD if all(each.survived for each in found) else Exit.NEGATIVE), text


def _show(found: Sequence[ExecutedGrasp], settings: ExecutionSettings, reporter: Reporter) -> None:
    kinds, shown = settings.trials, found[:TABLE_ROWS]
    columns = ("grasp", "survived", "least loss", "load", "payload kg", "mm moved", "controls")
    reporter.table("executions", columns, [_row(each) for each in shown])
    for meaning in COLUMNS_MEAN:
        reporter.say(meaning)
    for title, cell in (("trials survived", _survived), (SLIPS, _slips)):
        rows = [(each.id, *(cell(each.execution, kind) for kind in kinds)) for each in shown]
        reporter.table(title, ("grasp", *kinds), rows)
    reporter.say(SLIPS_MEAN)
    say_cut(len(found), reporter)
    _say_totals(found, settings, reporter)
    warn_of(list(_losses(found, settings)), EXECUTIONS, reporter)
    if any(each.enough for each in found):
        reporter.say(ENOUGH_MEANS)
    if any(not trial.survived for each in found for trial in each.trials if trial.kind == "knock"):
        reporter.warn(
            f"a knock of {settings.impulse_n_s:g} N s would give a free object of "
            f"{settings.mass_kg:g} kg {settings.impulse_n_s / settings.mass_kg:.3g} m/s; choose it "
            "with --knock-n-s"
        )


def _say_totals(
    found: Sequence[ExecutedGrasp], settings: ExecutionSettings, reporter: Reporter
) -> None:
    left_out = Counter(
        (each.kind, each.reason) for one in found if one.execution for each in one.execution.skipped
    )
    for (kind, reason), count in left_out.items():
        reporter.say(f"no {kind} for {count} of {len(found)} grasps: {reason}")
    totals = executions_summary(found)
    reporter.say(
        f"{totals['grasps_survived']} of {totals['grasps']} grasps survived every trial with "
        f"{settings.mass_kg:g} kg; {totals['trials_survived']} of {totals['trials']} trials were "
        f"survived; {totals['controls_let_go']} of {totals['controls']} negative controls let go "
        "(all should)"
    )
    if (best := best_executed(found)) is not None and best.execution is not None:
        reporter.say(
            f"best for this: {best.id}, predicted to be lost at {best.least_predicted_loss:.3g} "
            f"times the loads of its worst trial; its squeeze carries "
            f"{best.execution.payload_kg:.3g} kg in any direction"
        )


def _row(each: ExecutedGrasp) -> tuple[str, ...]:
    found = each.execution
    if found is None:
        return (each.id, "no", *5 * (ABSENT,))
    moved = max((trial.displacement_m for trial in found.trials), default=0.0)
    let_go = sum(control.let_go for control in found.controls)
    return (
        each.id, "yes" if found.survived else "no", multiple_in_words(found.least_predicted_loss),
        f"{found.load_multiple:.3g}", f"{found.payload_kg:.3g}", f"{1e3 * moved:.3g}",
        f"{let_go} of {len(found.controls)}",
    )  # fmt: skip


def _survived(found: Execution | None, kind: str) -> str:
    survived, count = (0, 0) if found is None else found.survival(kind)
    return f"{survived} of {count}" if count else ABSENT


def _slips(found: Execution | None, kind: str) -> str:
    trials = () if found is None else found.of_kind(kind)
    if not trials:
        return ABSENT
    predicted = min(trial.predicted_first_slip for trial in trials)
    simulated = min(trial.simulated_first_slip for trial in trials)
    return f"{multiple_in_words(predicted)}/{multiple_in_words(simulated)}"


def multiple_in_words(multiple: float) -> str:
    """Write the multiple of a load with three digits, and no more than two behind the point."""
    if math.isinf(multiple):
        return "never"
    return f"{multiple:.{max(0, 2 - math.floor(math.log10(max(multiple, 1.0))))}f}"


def _losses(found: Sequence[ExecutedGrasp], settings: ExecutionSettings) -> Iterator[str]:
    for each in found:
        if each.execution is not None:
            yield from (f"{each.id}: {line}" for line in held_controls_in_words(each.execution))
    for each in found:
        if each.execution is None:
            yield f"{each.id}: not executed: {each.reason}"
        else:
            yield from (f"{each.id}: {line}" for line in losses_in_words(each.execution, settings))
