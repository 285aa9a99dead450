"""Runs the command `plan`, which finds certified grasps of an object and writes them to a file.

Its flags: `flags.Plan`. What --optimize, --regions and --best alone need is imported late.
"""

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.by_value import counted
from grasp_core.errors import GraspError
from grasp_core.files.file_kinds import GRASPS
from grasp_core.files.text_files import write_text
from grasp_core.names import METHODS, RankBy
from grasp_core.objects.on_faces import nearest_edge
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.plan_search import carried
from grasp_core.planning.planner import search_plan
from grasp_core.planning.result import Moved, Plan, PlanRequest, methods_for
from grasp_core.planning.settings import PlanSettings
from grasp_core.records.grasps_json import plan_to_json
from grasp_core.settings import types
from grasp_core.stopping import Stop
from grasp_core.values import Grasp
from sim_validate.commands import flags
from sim_validate.commands.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.files.output_folders import alone_in
from sim_validate.files.results_folder import remove_results
from sim_validate.planning.asked_objects import asked_finger, object_to_plan
from sim_validate.processes.compiling import PLANNING, compile_loops, must_compile
from sim_validate.processes.interrupts import interrupts_end
from sim_validate.processes.workers import each

if TYPE_CHECKING:
    from grasp_core.optimizing.best_grasp import BestGrasp

SAME_CONTACTS = 0.01
"""Distance below which two optimized contacts count as the same [object radii]; searches for one
optimum end some thousandths from it."""


WRITTEN_S = 2e-3
"""Time in which the figures of a planned grasp are computed and written [s]."""


def ready(jobs: int, reporter: Reporter) -> None:
    """Compile the inner loops of planning before its time begins, where none are kept."""
    if must_compile(PLANNING, jobs):
        reporter.say("compiling inner loops once, which takes a minute of one core")
        compile_loops(PLANNING)


def plan_object(
    body: Polyhedron, planning: flags.Planning, jobs: int, stop: Stop, later: int,
    reporter: Reporter,
) -> Plan:  # fmt: skip
    """Plan the grasps of an object and, if asked for, improve them, with time for later phases."""
    with reporter.progress("planning") as steps:
        asked: dict[str, Any] = {name: getattr(planning, name) for name in types(PlanSettings)}
        if planning.families == METHODS:
            asked["families"] = methods_for(body)
        request = PlanRequest(**asked, finger=asked_finger(planning))

        def tell(done: int, total: int, grasps: int) -> None:
            if request.searched is None:
                steps.update(done, total, f"({grasps} grasps)")
            else:  # bounds end such a search long before all are tried
                steps.update(done, None, f"of at most {total} ({grasps} grasps)")

        found = search_plan(
            body, request, stop.part(1 + planning.optimize + later), tell,
            partial(steps.update, note="grasps", title=f"ranking by {request.rank_by}"),
            jobs, WRITTEN_S,
        )  # fmt: skip
    if planning.optimize and found.grasps:
        found = improved(body, found, planning, jobs, stop.part(1 + later), reporter)
    return found


def improved(
    body: Polyhedron, found: Plan, planning: flags.Planning, jobs: int, stop: Stop,
    reporter: Reporter,
) -> Plan:  # fmt: skip
    """Move contacts to raise the quality; keep one of grasps that end alike, the best first.

    Those for which there is no time come last, as they were planned.
    """
    results = each(partial(_improve, body, planning), found.grasps, jobs=jobs, stop=stop)
    done = list(
        reporter.counted(
            "optimising", results, len(found), "raised", lambda pair: pair[1].gain > 1.0, stop
        )
    )
    left = found.grasps[len(done) :]
    done.sort(key=lambda pair: -pair[0].ferrari_canny[0])
    kept: list[Grasp] = []
    for grasp, _ in done:
        if not any(_same_contacts(grasp, other, SAME_CONTACTS * body.radius) for other in kept):
            kept.append(grasp)
    if left_out := len(done) - len(kept):
        reporter.say(f"{left_out} optimised grasps are left out, equal to others after moving")
    return replace(
        found, grasps=(*kept, *left), moves=tuple(moved for _, moved in done),
        ended=stop.why if left else found.ended,
    )  # fmt: skip


def _same_contacts(one: Grasp, two: Grasp, slack: float) -> bool:
    """Tell whether two grasps touch the same faces at the same points, in any order."""
    order, other = np.argsort(one.faces), np.argsort(two.faces)
    faces = np.array_equal(np.array(one.faces)[order], np.array(two.faces)[other])
    return faces and float(np.abs(one.positions[order] - two.positions[other]).max()) <= slack


def _improve(body: Polyhedron, planning: flags.Planning, grasp: Grasp) -> tuple[Grasp, Moved]:
    from grasp_core.optimizing.best_grasp import quality_ceiling
    from grasp_core.optimizing.better_contacts import optimize_contacts

    found = optimize_contacts(
        body, grasp, planning.friction, finger_radius=planning.finger_radius_m, seed=planning.seed
    )
    ceiling = None
    if planning.ceiling is not None:
        ceiling = quality_ceiling(
            body, grasp.faces, planning.friction, known=found.after.lower,
            finger_radius=found.clearances, parts=planning.ceiling,
        ).upper  # fmt: skip
    before, after = found.before, found.after
    moved = Moved(
        found.grasp.id, grasp.id, (before.lower, before.upper), (after.lower, after.upper), ceiling
    )
    return found.grasp, moved


def with_regions(
    body: Polyhedron, found: Plan, planning: flags.Planning, folder: Path | None, jobs: int,
    stop: Stop, reporter: Reporter,
) -> Plan:  # fmt: skip
    """Certify regions around a plan's contacts if asked for, and write the proofs to a folder."""
    if not (planning.regions and found.grasps):
        return found
    from sim_validate.planning.regions import certified, wider
    from sim_validate.settings import Certifying

    asked = Certifying(edge_clearance_m=planning.edge_clearance_m)
    proved = certified(
        body, found.grasps, found.friction, asked, folder=folder, jobs=jobs, stop=stop,
        reporter=reporter,
    )  # fmt: skip
    left = found.grasps[len(proved.grasps) :]
    grasps = (*map(wider, found.grasps, proved.grasps), *left)
    widened = sum(new is not old for new, old in zip(grasps, found.grasps, strict=True))
    reporter.say(f"{widened} of {len(grasps)} grasps got larger regions, each with its own proof")
    return replace(found, grasps=grasps, ended=stop.why if left else found.ended)


def plan_file(command: flags.Plan, reporter: Reporter) -> int:
    """Plan grasps, write them to a file, and show the best of them."""
    wrenches, planning, failed = _task(command), command.planning, None
    body = object_to_plan(command.object, planning, reporter)
    best: BestGrasp | None = None
    if command.best:
        from sim_validate.planning.best import check_object

        check_object(body, planning)
    ready(command.jobs, reporter)
    stop, later = Stop(seconds=planning.time_limit_s), command.best + planning.regions
    with alone_in(command.out), interrupts_end(stop):
        found = plan_object(body, planning, command.jobs, stop, later, reporter)
        if command.best and not stop.asked:
            from sim_validate.planning.best import search_best

            try:
                best = search_best(body, command, wrenches, stop.part(later), reporter)
            except GraspError as error:  # the planned grasps are kept
                failed = error
        if command.out:
            remove_results(command.out)
        found = with_regions(body, found, planning, command.out, command.jobs, stop, reporter)
        planned, possible = found.grasps, None
        if best is not None:
            found = replace(found, grasps=(best.grasp, *planned), absence=None)
        text = ""
        if stop.asked:
            reporter.warn("interrupted: what is found is kept; interrupt again to drop it")
        if command.out or (reporter.json_only and best is None):
            with reporter.progress(f"writing {len(found)} grasps"):
                text = plan_to_json(body, found)
        if command.out:
            reporter.say(f"wrote {write_text(command.out / GRASPS, text)}")
        if best is not None:
            from sim_validate.planning.best import write_best

            possible = write_best(body, best, planned, command.out, stop, reporter)
        else:
            reporter.text(text)
    code = _show(body, found, planning.rank_by, reporter)
    if failed is not None:
        raise failed
    if possible is None:
        return code
    from sim_validate.planning.best import show_best

    return max(code, show_best(possible, reporter))


def _show(body: Polyhedron, found: Plan, rank_by: RankBy, reporter: Reporter) -> int:
    """Show what was tried and the best grasps; return the exit code."""
    say_counts(body, found, reporter)
    code = say_ended(found, reporter)
    if found.absence:
        reporter.say(found.absence)
        return code or Exit.NONE
    reporter.records(f"{counted(len(found.grasps), 'grasp')} of {body.name}", found.grasps)
    if rank_by == "payload":  # which is not kept with grasps
        masses = (
            carried(body, each.positions - body.center_of_mass, each.normals, found.friction,
                    found.finger) for each in found.grasps[:TABLE_ROWS]
        )  # fmt: skip
        payloads = [(each.id, f"{kg:.4g}") for each, kg in zip(found.grasps, masses, strict=False)]
        reporter.table("what one squeeze carries", ("grasp", "payload kg"), payloads)
    if rank_by == "placement":
        from grasp_core.regions.certify_placement import usual_bound

        bounds = [usual_bound(body, each, found.friction) for each in found.grasps[:TABLE_ROWS]]
        shown = ["not proved" if isinstance(one, str) else f"{one.lower:.3f}" for one in bounds]
        chances = zip((each.id for each in found.grasps), shown, strict=False)
        reporter.table("if the object is off", ("grasp", "closed at least"), list(chances))
    if found.moves:
        show_gains(found.moves, reporter)
    return code


DENT = 3e-3
"""Radius of the dent of a fingertip under the usual pushes, in object radii: those of executions
of built-in objects between 10 g and 2 kg are 1.3e-3 to 2.8e-3."""


def _say_edges(body: Polyhedron, found: Plan, reporter: Reporter) -> None:
    """Name grasps in whose contacts a fingertip also touches the next face."""
    if body.patches is not None:  # a curved surface goes on beyond its patches
        return
    near = [
        f"{grasp.id} ({1e6 * away:.3g} um)"
        for grasp in found.grasps
        if grasp.radius < DENT * body.radius  # discs are on their faces
        and (away := nearest_edge(body, grasp)) < DENT * body.radius
    ]
    if near:
        reporter.say(
            f"{counted(len(near), 'grasp')} with contacts nearer to an edge than "
            f"{1e6 * DENT * body.radius:.3g} um, where fingertips dent in more than one face and "
            "predictions of executions do not hold; --edge-clearance-m keeps contacts away: "
            + ", ".join(near[:TABLE_ROWS])
        )
        say_cut(len(near), reporter)


EARLY = {
    "time": ("the time limit", Exit.PARTIAL),
    "interrupt": ("an interrupt", Exit.INTERRUPTED),
}
"""What ended planning early, in words, and the exit code."""


def say_ended(found: Plan, reporter: Reporter) -> int:
    """Warn of a plan that was ended early; return the exit code for that."""
    if found.ended == "done":
        return Exit.GOOD
    what, code = EARLY[found.ended]
    reporter.warn(
        f"{what} ended planning: the plan is not complete, and says so ({found.ended!r}); there "
        "may be other grasps, and better ones"
    )
    return code


def _task(command: flags.Plan) -> Array | None:
    """Return the wrenches of a task, (m, 6), if it is to be done well."""
    if not command.best and (command.measure != "ferrari-canny" or command.wrenches):
        raise FlagsError(
            "--measure and --wrenches say which grasp is best: give --best too, or leave them out"
        )
    if (command.measure == "task") != (command.wrenches is not None):
        raise FlagsError("--measure task and --wrenches FILE go together: give both, or neither")
    if command.wrenches is None:
        return None
    from sim_validate.engine.setup import wrenches_from_file

    return np.array([each.wrench for each in wrenches_from_file(command.wrenches)])


def say_counts(body: Polyhedron, found: Plan, reporter: Reporter) -> None:
    """Say how many sets of faces were tried, and how many gave a certified grasp."""
    counts = found.counts
    reporter.say(
        f"{body.name}: {counts.faces} faces, {counts.quadruples} face quadruples, "
        + (f"{counts.spanning} with spanning normals (P3), " if counts.spanning is not None else "")
        + f"friction {found.friction:g}, "
        f"cone half-angle {math.degrees(found.theta):.4g} deg"
    )
    known = found.outcomes
    reporter.say(
        f"face quadruples: {known.held} with a certified grasp, {known.absent} proved to have "
        f"none, {len(found.undecided)} undecided, {known.open - len(found.undecided)} left open"
        + (f", {known.out_of_reach} out of reach" if found.unreached else "")
    )
    for method, tally in counts.families.items():
        undecided = f"{tally.undecided} undecided, " if method == "free" else ""
        undecided += f"{tally.unreachable} out of reach, " if found.unreached else ""
        reporter.say(
            f"{method} candidates: {tally.tried} tried, {tally.pruned} pruned, {tally.infeasible} "
            f"infeasible, {undecided}{tally.duplicates} duplicates, {tally.found} found, "
            f"{tally.rejected} rejected, {found.seconds[method]:.2f} s"
        )
    if found.undecided:
        named = [f"{'-'.join(map(str, faces))} ({100.0 * share:.3g} % open)"
                 for faces, share in found.undecided.items()]  # fmt: skip
        reporter.say(f"undecided face quadruples: {', '.join(named[:TABLE_ROWS])}")
        say_cut(len(named), reporter)
    for why, count in found.unranked.items():
        reporter.say(f"{counted(count, 'grasp')} without a figure to rank by come last: {why}")
    reasons = Counter(_whoever(why) for why in found.unreached.values())
    for why, count in reasons.most_common():
        reporter.say(f"out of reach: {why}, on {count} face quadruples")
    _say_edges(body, found, reporter)
    if found.finger is None and found.grasps:
        reporter.say(
            "not checked: whether fingers have room to reach the contacts (reach); give "
            "--finger-radius-m and --approach-m to check it"
        )


def _whoever(why: str) -> str:
    """Remove the finger numbers from a reason, so that equal reasons can be counted together."""
    why = re.sub(r"fingertips \d+ and \d+", "two fingertips", why)
    return re.sub(r"(finger(?:tip)?) \d+", r"a \1", why)


def show_gains(moves: Sequence[Moved], reporter: Reporter) -> None:
    """Show how optimisation changed the quality of each grasp, with percentiles."""
    reporter.records("Ferrari-Canny l1 [N]", moves)
    gains = np.array([move.gain for move in moves])
    low, quarter, middle, upper, high = np.percentile(gains, [0, 25, 50, 75, 100])
    reporter.say(
        f"{int((gains > 1.0).sum())} of {len(gains)} grasps improved; gain from {low:.3f} to "
        f"{high:.3f}, median {middle:.3f}, half of them between {quarter:.3f} and {upper:.3f}"
    )
