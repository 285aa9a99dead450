"""Searches for the best grasp of an object, shows it beside the planned ones, and writes both."""

from collections.abc import Sequence
from pathlib import Path

from grasp_core.arrays import Array
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best_grasp import BestGrasp, GapAt, best_grasp, measured
from grasp_core.optimizing.support_cuts import write_proof
from grasp_core.values import Grasp
from sim_validate.kit import command_flags
from sim_validate.kit.console import Reporter
from sim_validate.kit.exit_codes import Exit
from sim_validate.planning.best_json import MEASURES, PROOF, Best, Rated

STEPS = 100
WHY = {
    "gap": "the gap asked for is reached",
    "time": "the time limit is reached",
    "interrupt": "it was interrupted",
    "undivided": "what is left of the faces is too small, or too much, to be divided further",
}
"""Why a search ended, in words."""
ROUGH = 1e-3
"""Gap between the bounds of what planned grasps hold."""
WORDS = {"ferrari-canny": "quality", "weight": "weight", "task": "multiple"}
"""What each measure gives, in a word."""


def search_best(
    body: Polyhedron, command: command_flags.Plan, wrenches: Array | None, reporter: Reporter
) -> BestGrasp:  # fmt: skip
    """Search for the best grasp, for wrenches (m, 6) if asked, and show how the gap closes."""
    planning = command.planning
    with reporter.progress("bounding") as steps:

        def tell(now: GapAt) -> None:
            closed = round(STEPS * (1.0 - max(now.gap - command.gap, 0.0)))
            word = WORDS[command.measure]
            note = f"({word} {now.quality:.4f}, bound {now.bound:.4f}, gap {100 * now.gap:.1f} %)"
            steps.update(closed, STEPS, note)

        return best_grasp(
            body, planning.friction, gap=command.gap, time_limit_s=command.time_limit_s,
            clearance=planning.edge_clearance_m or None, seed=planning.seed, jobs=command.jobs,
            measure=command.measure, wrenches=wrenches, progress=tell,
        )  # fmt: skip


def write_best(
    body: Polyhedron, best: BestGrasp, planned: Sequence[Grasp], folder: Path | None,
    reporter: Reporter,
) -> Best:  # fmt: skip
    """Write result and proof, and return them with the planned grasps by the same measure."""
    measure, friction = best.proof.measure, best.proof.friction
    bounds = [grasp.ferrari_canny for grasp in planned]
    if not measure.is_usual:
        found = [measured(body, grasp, friction, measure, ROUGH) for grasp in planned]
        bounds = [(each.lower, each.upper) for each in found]
    rated = (
        Rated(each.id, each.family, ends, ends[0] / best.bound)
        for each, ends in zip(planned, bounds, strict=True)
    )
    record = Best.of(body, best, rated, PROOF if folder else None)
    if folder:
        write_proof(folder / PROOF, best.proof)
        write_text(folder / Best.FILE, record.text())
        reporter.say(f"wrote {folder / Best.FILE} and {folder / PROOF}")
    reporter.document(record.document())
    return record


def show_best(found: Best, reporter: Reporter) -> int:
    """Show the best grasp, the bound, and how much of the possible each planned grasp reaches."""
    word, (_, unit) = WORDS[found.measure], MEASURES[found.measure]
    reporter.say(
        f"best grasp {found.grasp.id}: {word} {found.quality[0]:.4f}{unit}; no four contacts "
        f"{1e3 * found.clearance_m:.3g} mm from edges exceed {found.bound:.4f}{unit} (gap "
        f"{100.0 * found.gap:.2f} %); {WHY[found.ended]}, after {found.history[-1].nodes} nodes"
    )
    reporter.records(f"the possible, and what {word}{unit} grasps reach of it", found.rated)
    if found.ended == "interrupt":
        return Exit.INTERRUPTED
    return Exit.GOOD if found.ended == "gap" else Exit.PARTIAL
