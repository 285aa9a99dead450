"""Runs `execute`, which simulates grasps as a robot executes them, and `scene`.

`scene` writes models for MuJoCo, with true masses if the flags ask for them.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from grasp_core.errors import InputError, NoForcesError
from grasp_core.figures import NONE, figures
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.grasps_json import load_grasps
from grasp_core.planning.reach import Finger
from grasp_core.planning.result import Plan
from grasp_core.settings import extended
from grasp_core.stopping import never
from grasp_core.values import Grasp
from scenes.settings import ScaledScene
from sim_validate.commands import simulation_flags
from sim_validate.commands.console import TABLE_ROWS, Reporter, warn_of
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.engine.setup import Setup, physics_from_file, with_planned_radius
from sim_validate.execution.execute import ExecutionJob, SpringFingers, executed
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    Executions,
    edges_in_words,
    held_controls_in_words,
    losses_in_words,
    multiple_in_words,
    totals_in_words,
)
from sim_validate.files.output_folders import alone_in
from sim_validate.files.result_files import AboutObject
from sim_validate.files.results_folder import remove_results
from sim_validate.planning.asked_objects import asked_grasps, grasp_with_id
from sim_validate.settings import ChosenExecution, ExecutionSettings, Holding

EXPLAINED_FIGURES = ("load_multiple", "payload_kg", "least_predicted_loss")
"""Figures whose meaning is said below their table."""
ENOUGH_MEANS = (
    "enough: the least --push-n, with the --tip-stiffness-n-per-m that was used or the least that "
    "it takes; docs/simulation.md says what it does not promise"
)
SLIPS_TITLE = "first slips, predicted/simulated"
SLIPS_MEAN = (
    "first slip: least multiple of the trials' loads at which a contact slips; above one none "
    "does, and in simulation 1.00 also stands for a slip once the whole weight had come"
)


def execute_file(command: simulation_flags.ExecuteFlags, reporter: Reporter) -> int:
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
        code, found = execute_grasps(
            chosen, settings, jobs=command.jobs, folder=command.out, reporter=reporter,
            physics=physics,
        )  # fmt: skip
    reporter.document(found.document())
    return code


def execute_grasps(
    saved: Plan, settings: ExecutionSettings, *, jobs: int, folder: Path | None,
    reporter: Reporter, physics: Mapping[str, object] | None = None,
    stop: Callable[[], bool] = never,
) -> tuple[Exit, Executions]:  # fmt: skip
    """Execute grasps; return the exit code and what was found."""
    if folder:
        remove_results(folder, Executions.FILE)
    changed, count = physics or {}, len(saved.grasps)
    tasks = [ExecutionJob(saved.body, g, saved.friction, settings, changed) for g in saved.grasps]
    found = reporter.collected(
        "executing", executed(tasks, jobs), count, ("survived", lambda each: each.survived),
        partial(Executions, AboutObject.of(saved.body), saved.friction, settings), folder, stop,
    )  # fmt: skip
    _show(found, reporter)
    if not all(each.controls_let_go for each in found):
        return Exit.INTERNAL, found
    good = all(each.survived for each in found)
    return (Exit.GOOD if good else Exit.NEGATIVE), found


def _show(found: Executions, reporter: Reporter) -> None:
    settings = found.settings
    kinds, shown = settings.trials, found.grasps[:TABLE_ROWS]
    reporter.records("executions", found.grasps)
    for figure in figures(ExecutedGrasp):
        if figure.name in EXPLAINED_FIGURES:
            reporter.say(f"{figure.shown.heading}: {figure.explained}")
    for title, cell in (("trials survived", _survived), (SLIPS_TITLE, _slips)):
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
        if each.execution is not None:
            yield from (f"{each.id}: {line}" for line in edges_in_words(each.execution))
    for each in found:
        if each.execution is None:
            yield f"{each.id}: not executed: {each.reason}"
        else:
            said = losses_in_words(each.execution, found.settings)
            yield from (f"{each.id}: {line}" for line in said)


SomeHolding = TypeVar("SomeHolding", bound=Holding)


def holding(given: SomeHolding, body: Polyhedron, finger: Finger | None) -> SomeHolding:
    """Complete what holds an object: its mass, and fingertips as planned if no flag gives them."""
    planned = None if finger is None else finger.radius_m
    radius = planned if given.tip_radius_m is None else given.tip_radius_m
    return replace(given.for_body(body), tip_radius_m=radius)


def execution_settings(
    given: ChosenExecution, body: Polyhedron, seed: int, finger: Finger | None
) -> ExecutionSettings:
    """Build the settings of executions."""
    return extended(ExecutionSettings, holding(given, body, finger), seed=seed)


def refuse_executing(executing: ChosenExecution) -> None:
    """Refuse flags about executions where none are asked for, before any file is read."""
    if executing != ChosenExecution():
        raise FlagsError(
            "the flags from --mass-kg to --max-deg say how grasps are executed: add --execute too"
        )


TextOf = Callable[[Grasp], str]


def write_scenes(command: simulation_flags.SceneFlags, reporter: Reporter) -> int:
    """Write a MuJoCo scene for each grasp of a file, or print a single one."""
    _check(command)
    saved = load_grasps(command.grasps)
    chosen = saved.grasps
    if command.grasp is not None:
        chosen = (grasp_with_id(command.grasps, saved, command.grasp),)
    if command.out is None and len(chosen) > 1:
        raise InputError(
            "several scenes cannot be printed: give a folder with --out DIR, or one grasp with "
            "--grasp ID"
        )
    friction = saved.friction if command.friction is None else command.friction
    if command.holding.weighed:
        text_of = _held(command, saved, friction, reporter)
    else:
        text_of = _scaled(command, saved, friction)
    with alone_in(command.out):
        written = [_written(grasp, text_of, command.out, reporter) for grasp in chosen]
    if command.out is not None:
        reporter.document({"scenes": [path for path in written if path]})
    return Exit.GOOD if all(written) else Exit.NEGATIVE


def _written(grasp: Grasp, text_of: TextOf, folder: Path | None, reporter: Reporter) -> str:
    """Write or print the scene of one grasp; return its place, or nothing if it has no scene."""
    try:
        text = text_of(grasp)
    except NoForcesError as error:
        reporter.warn(f"{grasp.id}: no scene: {error}")
        if folder is None:
            reporter.document({"id": grasp.id, "absence": str(error)})
        return ""
    if folder is None:
        reporter.document({"id": grasp.id, "xml": text})
        if not reporter.json_only:
            print(text, end="")  # noqa: T201 - the document itself
        return grasp.id
    path = str(write_text(folder / f"{grasp.id}.xml", text))
    reporter.say(f"wrote {path}")
    return path


def _check(command: simulation_flags.SceneFlags) -> None:
    """Refuse flags that the scene asked for does not use, before any file is read."""
    if command.holding.weighed:
        if command.scaled != ScaledScene():
            raise FlagsError(
                "the flags from --max-normal-force-n to --surface are for scenes with scaled "
                "masses: leave out --mass-kg and --density-kg-m3, or use the flags from "
                "--tip-mass-kg to --tip-radius-m"
            )
    elif command.holding != Holding():
        raise FlagsError(
            "the flags from --tip-mass-kg to --tip-radius-m are for objects of true mass: give "
            "--mass-kg or --density-kg-m3 too"
        )


def _scaled(command: simulation_flags.SceneFlags, saved: Plan, friction: float) -> TextOf:
    setup = extended(Setup, command.scaled)
    setup = replace(setup, fingers=with_planned_radius(setup.fingers, saved.finger))
    return lambda grasp: setup.scene(saved.body, grasp, friction).xml


def _held(
    command: simulation_flags.SceneFlags, saved: Plan, friction: float, reporter: Reporter
) -> TextOf:
    own = holding(command.holding, saved.body, saved.finger)
    settings = extended(ExecutionSettings, own)

    def text_of(grasp: Grasp) -> str:
        fingers = SpringFingers(saved.body, grasp.contacts, friction)
        best = fingers.squeeze(settings)
        if best.scale < 1.0:
            reporter.warn(
                f"{grasp.id}: the squeeze is certified for {best.scale:.3g} of the weight only, so "
                "the object may slip; use a smaller mass, or a larger --push-n"
            )
        return fingers.scene(settings, best).xml

    return text_of
