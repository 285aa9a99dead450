"""Grasps of a plan moved to better contacts on their faces, in parallel, with what that gained."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.optimizing.better_contacts import Improvement, optimize_contacts
from grasp_core.optimizing.ceiling import quality_ceiling
from grasp_core.planning.result import Plan
from grasp_core.records.grasps_json import Moved
from grasp_core.values import Grasp, Polyhedron
from sim_validate.cli.console import TABLE_ROWS, Reporter
from sim_validate.parallel.processes import each

SAME_CONTACTS = 0.01
"""Contacts closer than this, in object radii, are the same optimum: searches end some
thousandths from it."""


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """One grasp to move, as it travels to a worker."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    finger_radius: float | None
    seed: int
    parts: int | None
    """How many parts of the faces to bound; None for no bound."""


def improved(
    body: Polyhedron, found: Plan, *, finger_radius: float | None, parts: int | None, jobs: int,
    reporter: Reporter,
) -> tuple[Plan, tuple[Moved, ...]]:  # fmt: skip
    """The plan with its grasps moved, best quality first, and how each one changed.

    Of grasps that end at the same contacts the plan keeps one.
    """
    tasks = [
        _Task(body, grasp, found.friction, finger_radius, found.seed, parts)
        for grasp in found.grasps
    ]
    done: list[tuple[Grasp, Moved]] = []
    with reporter.progress("optimising") as steps:
        for grasp, moved in each(_improve, tasks, jobs=jobs):
            done.append((grasp, moved))
            raised = sum(one.gain > 1.0 for _, one in done)
            steps.update(len(done), len(tasks), f"({raised} raised)")
    done.sort(key=lambda pair: -pair[0].ferrari_canny[0])
    kept: list[Grasp] = []
    for grasp, _ in done:
        if not any(_same_contacts(grasp, other, SAME_CONTACTS * body.radius) for other in kept):
            kept.append(grasp)
    if len(kept) < len(done):
        reporter.say(
            f"{len(done) - len(kept)} optimised grasps are left out: others have the same contacts"
        )
    return replace(found, grasps=tuple(kept)), tuple(moved for _, moved in done)


def _same_contacts(one: Grasp, two: Grasp, slack: float) -> bool:
    """Whether two grasps touch the same faces at the same points, in whatever order."""
    order, other = np.argsort(one.faces), np.argsort(two.faces)
    faces = np.array_equal(np.array(one.faces)[order], np.array(two.faces)[other])
    return faces and float(np.abs(one.positions[order] - two.positions[other]).max()) <= slack


def _improve(task: _Task) -> tuple[Grasp, Moved]:
    found: Improvement = optimize_contacts(
        task.body, task.grasp, task.friction, finger_radius=task.finger_radius, seed=task.seed
    )
    ceiling = None
    if task.parts is not None:
        ceiling = quality_ceiling(
            task.body, task.grasp.faces, task.friction, known=found.after.lower,
            finger_radius=found.clearances, parts=task.parts,
        ).upper  # fmt: skip
    before, after = found.before, found.after
    moved = Moved(
        found.grasp.id, task.grasp.id, (before.lower, before.upper), (after.lower, after.upper),
        ceiling,
    )  # fmt: skip
    return found.grasp, moved


def show_gains(moves: Sequence[Moved], reporter: Reporter) -> None:
    """Tell how the quality changed: grasp by grasp, then how the gains are distributed."""
    rows = [
        (move.id, f"{move.before[0]:.4f}", f"{move.after[0]:.4f}", f"{move.gain:.3f}",
         "" if move.ceiling is None else f"{move.ceiling:.4f}")
        for move in moves[:TABLE_ROWS]
    ]  # fmt: skip
    columns = ("grasp", "quality before", "after", "gain", "none above")
    reporter.table("Ferrari-Canny l1 [N]", columns, rows)
    gains = np.array([move.gain for move in moves])
    low, quarter, middle, upper, high = np.percentile(gains, [0, 25, 50, 75, 100])
    reporter.say(
        f"{int((gains > 1.0).sum())} of {len(gains)} grasps raised; gain from {low:.3f} to "
        f"{high:.3f}, median {middle:.3f}, half of them between {quarter:.3f} and {upper:.3f}"
    )
