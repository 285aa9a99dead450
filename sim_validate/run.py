"""Runs the command `run`, which plans grasps, simulates them and writes all results."""

import re
from pathlib import Path

from grasp_core.errors import GraspError
from grasp_core.files.file_kinds import GRASPS
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.grasps_json import plan_to_json
from grasp_core.planning.result import Plan
from grasp_core.stopping import Stop
from sim_validate.closure.command import prepared, simulate_grasps
from sim_validate.closure.validate import checked_for
from sim_validate.commands import simulation_flags
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit, reason_of
from sim_validate.commands.flags import ReportFlags
from sim_validate.engine.setup import Setup
from sim_validate.execution.command import execute_grasps, execution_settings, refuse_executing
from sim_validate.files.output_folders import alone_in
from sim_validate.files.results_folder import REPORT, remove_results, require_report_folder
from sim_validate.planning.asked_objects import asked_finger, object_to_plan
from sim_validate.planning.plan import (
    plan_object,
    ready,
    say_counts,
    say_ended,
    show_gains,
    with_regions,
)
from sim_validate.processes.interrupts import interrupts_end
from sim_validate.report.command import shown_report

RESULTS = Path("graspproof-out")
"""Folder in which each object gets its own folder of results if --out is not given."""
FOLDER_HASH_DIGITS = 8
"""Number of hash digits in a folder's name that tell apart objects with similar names."""
NAME_LETTERS = 60
"""Largest number of characters of an object's name in the name of its folder; with four bytes each
they still fit the limit of file systems."""
REPORTED = 200
"""Largest number of grasps that `run` draws, in about a minute; `report` draws all."""


def run_object(command: simulation_flags.RunFlags, reporter: Reporter) -> int:
    """Plan grasps of an object, simulate them, and write and show all results."""
    planning, testing, executing = command.planning, command.testing, command.executing
    jobs, seed, finger = testing.jobs, planning.seed, asked_finger(planning)
    if not command.execute:
        refuse_executing(executing)
    setup, agenda = prepared(testing, finger, seed)
    body = object_to_plan(command.object, planning, reporter)
    execution = execution_settings(executing, body, seed, finger) if command.execute else None
    folder = command.out or RESULTS / _folder_name(body)
    pages = None if command.no_report else folder
    with alone_in(folder):
        if pages is not None:
            require_report_folder(pages / REPORT)
        checked_for(body, planning.friction, agenda, setup)  # refuses before it takes minutes
        ready(jobs, reporter)
        stop, later = Stop(seconds=planning.time_limit_s), 1 + command.execute
        with interrupts_end(stop):
            found = plan_object(body, planning, jobs, stop, planning.regions + later, reporter)
            remove_results(folder)
            proving = stop.part(1 + later)
            found = with_regions(body, found, planning, folder, jobs, proving, reporter)
            write_text(folder / GRASPS, plan_to_json(body, found))
        ended = _show_plan(body, found, folder, reporter)
        if found.absence:
            return ended or Exit.NONE
        if stop.asked:
            return Exit.INTERRUPTED
        _write_scenes(found, setup, folder / "scenes")
        simulated, verdicts = simulate_grasps(
            found, setup, agenda, jobs=jobs, folder=folder, reporter=reporter, stop=stop.part(later)
        )
        reporter.say(f"results in {folder}/: grasps.json, verdicts.json, scenes/")
        document, complete, survived = verdicts.document(), verdicts.complete, Exit.GOOD
        try:
            if execution is not None:
                survived, executions = execute_grasps(
                    found, execution, jobs=jobs, folder=folder, reporter=reporter, stop=stop
                )
                document["executions"] = executions.document()
                complete = complete and executions.complete
        except GraspError:  # the other results are complete, so that pages can show them
            _write_pages(pages, jobs, reporter)
            raise
        reporter.document(document)
        _write_pages(pages, jobs, reporter)
    if not complete:
        reporter.warn("the time limit ended the trials: not all grasps have results")
        ended = Exit.PARTIAL
    return max(simulated, survived, ended)


def _show_plan(body: Polyhedron, found: Plan, folder: Path, reporter: Reporter) -> int:
    say_counts(body, found, reporter)
    code = say_ended(found, reporter)
    if found.absence:
        reporter.say(found.absence)
        reporter.document({"absence": found.absence, "out": str(folder)})
    elif found.moves:
        show_gains(found.moves, reporter)
    return code


def _write_scenes(found: Plan, setup: Setup, folder: Path) -> None:
    for grasp in found.grasps:
        scene = setup.scene(found.body, grasp, found.friction)
        write_text(folder / f"{grasp.id}.xml", scene.xml)


def _write_pages(folder: Path | None, jobs: int, reporter: Reporter) -> None:
    """Write the results of a folder as pages; if they fail, that is only a warning."""
    if folder is None:
        return
    try:
        shown_report(ReportFlags(folder, limit=REPORTED, jobs=jobs), reporter)
    except (GraspError, OSError) as error:
        reporter.warn(f"no report: {reason_of(error)}")


def _folder_name(body: Polyhedron) -> str:
    """Turn an object's name into a safe folder name; a name that changes gets a hash added."""
    plain = re.sub(r"[^\w-]+", "_", body.name)[:NAME_LETTERS] or "object"
    return plain if plain == body.name else f"{plain}-{body.content_sha256[:FOLDER_HASH_DIGITS]}"
