"""Runs the command `run`, which plans grasps, simulates them and writes all results."""

import re
from pathlib import Path

from grasp_core.errors import GraspError
from grasp_core.files.file_kinds import GRASPS
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.grasps_json import plan_to_json
from grasp_core.stopping import Stop
from sim_validate.closure.command import prepared, simulate_grasps
from sim_validate.engine.gate import require_faithful
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.command import check_executing, execute_grasps, execution_of_run
from sim_validate.kit import simulation_flags
from sim_validate.kit.command_flags import Report
from sim_validate.kit.console import Reporter
from sim_validate.kit.exit_codes import Exit, reason_of
from sim_validate.kit.files import (
    REPORT,
    alone_in,
    remove_results,
    require_report_folder,
)
from sim_validate.kit.workers import interrupts_end
from sim_validate.planning.asked_objects import asked_finger, object_to_plan
from sim_validate.planning.plan import (
    plan_object,
    ready,
    say_counts,
    say_ended,
    show_gains,
    with_regions,
)
from sim_validate.report.command import shown_report

RESULTS = Path("graspproof-out")
"""Folder in which each object gets its own folder of results if --out is not given."""
HASHED = 8
"""Number of hash digits in a folder's name that tell apart objects with similar names."""
NAMED = 60
"""Largest number of characters of an object's name in the name of its folder; with four bytes each
they still fit the limit of file systems."""
REPORTED = 200
"""Largest number of grasps that `run` draws, in about a minute; `report` draws all."""


def run_object(command: simulation_flags.Run, reporter: Reporter) -> int:
    """Plan grasps of an object, simulate them, and write and show all results."""
    planning = command.planning
    check_executing(command)
    trials = prepared(
        command.testing, asked_finger(planning), planning.seed, command.out or RESULTS
    )
    body = object_to_plan(command.object, planning, reporter)
    folder = command.out or RESULTS / _folder_name(body)
    with alone_in(folder):
        if not command.no_report:
            require_report_folder(folder / REPORT)
        require_faithful(trials[0], planning.friction, body.radius)
        return _run_in(folder, body, command, trials, reporter)


def _run_in(
    folder: Path,
    body: Polyhedron,
    command: simulation_flags.Run,
    trials: tuple[Setup, Agenda],
    reporter: Reporter,
) -> int:
    (setup, agenda), jobs, planning = trials, command.testing.jobs, command.planning
    execution = execution_of_run(command, body)
    ready(jobs, reporter)
    stop, later = Stop(seconds=planning.time_limit_s), 1 + command.execute
    with interrupts_end(stop):
        found = plan_object(body, planning, jobs, stop, planning.regions + later, reporter)
        remove_results(folder)
        proving = stop.part(1 + later)
        found = with_regions(body, found, planning, folder, jobs, proving, reporter)
        write_text(folder / GRASPS, plan_to_json(body, found))
    say_counts(body, found, reporter)
    early = say_ended(found, reporter)
    if found.absence:
        reporter.say(found.absence)
        reporter.document({"absence": found.absence, "out": str(folder)})
        return early or Exit.NONE
    if found.moves:
        show_gains(found.moves, reporter)
    if stop.asked:
        return Exit.INTERRUPTED
    for grasp in found.grasps:
        scene = setup.scene(body, grasp, found.friction)
        write_text(folder / "scenes" / f"{grasp.id}.xml", scene.xml)
    code, verdicts = simulate_grasps(
        found, setup, agenda, jobs=jobs, folder=folder, reporter=reporter, stop=stop.part(later)
    )
    reporter.say(f"results in {folder}/: grasps.json, verdicts.json, scenes/")
    complete = verdicts.complete
    try:
        document = verdicts.document()
        if execution is not None:
            survival, executions = execute_grasps(
                found, execution, jobs=jobs, folder=folder, reporter=reporter, stop=stop
            )
            document["executions"] = executions.document()
            code, complete = max(code, survival), complete and executions.complete
        reporter.document(document)
    except GraspError:  # the other results are complete, so that pages can show them
        _report(command, folder, reporter)
        raise
    _report(command, folder, reporter)
    if not complete:
        reporter.warn("the time limit ended the trials: not all grasps have results")
        early = Exit.PARTIAL
    return max(code, early)


def _report(command: simulation_flags.Run, folder: Path, reporter: Reporter) -> None:
    """Write the results of a run as pages if asked to; a failure only gives a warning."""
    if command.no_report:
        return
    try:
        shown_report(Report(folder, limit=REPORTED, jobs=command.testing.jobs), reporter)
    except (GraspError, OSError) as error:
        reporter.warn(f"no report: {reason_of(error)}")


def _folder_name(body: Polyhedron) -> str:
    """Turn an object's name into a safe folder name; a name that changes gets a hash added."""
    plain = re.sub(r"[^\w-]+", "_", body.name)[:NAMED] or "object"
    return plain if plain == body.name else f"{plain}-{body.content_sha256[:HASHED]}"
