"""Searches for the best grasp of an object, shows it beside the planned ones, and writes both."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from grasp_core.files.json_text import text_of
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.best_grasp import BestGrasp, GapAt, best_grasp
from grasp_core.optimizing.best.proof_file import write_proof
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from sim_validate.cli import command_flags
from sim_validate.cli.console import TABLE_ROWS, Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.commands.best.best_json import best_to_document

FILE, PROOF = "best.json", "best-proof.npz"
STEPS = 100
WHY = {
    "gap": "the gap asked for is reached",
    "time": "the time limit is reached",
    "interrupt": "it was interrupted",
    "undivided": "what is left of the faces is too small to be divided further",
}
"""Why a search ended, in words."""


def search_best(
    body: Polyhedron, command: command_flags.Plan, reporter: Reporter
) -> BestGrasp:  # fmt: skip
    """Search for the best grasp, and show how the gap closes.

    Raises:
        InputError: A setting is refused, or there is no grasp.
    """
    planning = command.planning
    with reporter.progress("bounding") as steps:

        def tell(now: GapAt) -> None:
            closed = round(STEPS * (1.0 - max(now.gap - command.gap, 0.0)))
            note = f"(quality {now.quality:.4f}, bound {now.bound:.4f}, gap {100 * now.gap:.1f} %)"
            steps.update(closed, STEPS, note)

        return best_grasp(
            body, planning.friction, gap=command.gap, time_limit_s=command.time_limit_s,
            clearance=planning.edge_clearance_m or None, seed=planning.seed, jobs=command.jobs,
            progress=tell,
        )  # fmt: skip


def with_best(found: Plan, best: BestGrasp) -> Plan:
    """Put the best grasp before the planned ones."""
    return replace(found, grasps=(best.grasp, *found.grasps), absence=None)


def write_best(
    body: Polyhedron, best: BestGrasp, planned: Sequence[Grasp], folder: Path | None,
    reporter: Reporter,
) -> None:  # fmt: skip
    """Write the search's result and its proof to a folder, and to standard output with --json."""
    document = best_to_document(body, best, planned, PROOF if folder else None)
    if folder:
        write_proof(folder / PROOF, best.proof)
        write_text(folder / FILE, text_of(document))
        reporter.say(f"wrote {folder / FILE} and {folder / PROOF}")
    reporter.document(document)


def show_best(best: BestGrasp, planned: Sequence[Grasp], reporter: Reporter) -> int:
    """Show the best grasp, the bound, and how much of the possible each planned grasp reaches."""
    last = best.history[-1]
    reporter.say(
        f"best grasp {best.grasp.id}: quality {best.quality.lower:.4f} N; no four contacts "
        f"{1e3 * best.clearance:.3g} mm from edges exceed {best.bound:.4f} N (gap "
        f"{100.0 * best.gap:.2f} %); {WHY[best.ended]}, after {last.nodes} nodes"
    )
    rows = [
        (grasp.id, grasp.family, f"{grasp.ferrari_canny[0]:.4f}",
         f"{100.0 * grasp.ferrari_canny[0] / best.bound:.1f}")
        for grasp in (best.grasp, *planned)[:TABLE_ROWS]
    ]  # fmt: skip
    reporter.table(
        "the possible, and what grasps reach of it",
        ("grasp", "family", "quality N", "of the bound %"), rows,
    )  # fmt: skip
    if best.ended == "interrupt":
        return Exit.INTERRUPTED
    return Exit.GOOD if best.ended == "gap" else Exit.PARTIAL
