"""Searches for the best grasp of an object, shows it beside the planned ones, and writes both.

The best grasp, and the bound on all others, are held by `best.json`.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from annotated_types import Interval
from pydantic import computed_field

from grasp_core.allowed_values import Friction, Number, Quantity
from grasp_core.arrays import Array, Shape, Wrench
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.files.file_kinds import BEST
from grasp_core.files.text_files import write_text
from grasp_core.names import Family, MeasureName
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best_grasp import (
    BestEnded,
    BestGrasp,
    GapAt,
    best_until,
    checked_clearance,
    measured,
)
from grasp_core.optimizing.contact_places import grounds_of
from grasp_core.optimizing.support_cuts import write_proof
from grasp_core.stopping import Stop
from grasp_core.values import FINGERS, FaceQuadruple, Grasp
from sim_validate.commands import flags
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.files.result_files import AboutObject, ResultFile
from sim_validate.files.results_folder import BEST_PROOF

MEASURES: Mapping[MeasureName, tuple[str, str, str]] = {
    "ferrari-canny": ("quality", "Ferrari-Canny quality", " N"),
    "weight": ("weight", "weight held in every orientation, for normal forces of sum 1 N", " N"),
    "task": ("multiple", "multiple of the task's loads, for normal forces of sum 1 N", ""),
}
"""What each measure says of a grasp, in a word and in full, and its unit."""


@declared
class Rated(Declared):
    """A grasp beside the bound that no grasp exceeds."""

    id: Annotated[str, Shown("grasp")]
    family: Annotated[Family, Shown("family")]
    quality: Annotated[tuple[float, float], Shown("measure", ".4f")]
    """Proved lower and upper bound of what the measure says of the grasp."""
    share_of_bound: Annotated[float, Shown("of the bound %", ".1f", 100.0)]
    """Share of the bound that the lower one reaches."""


@declared
class StandingFingers(Declared):
    """Where the fingers of the best grasp stand."""

    id: str
    family: Family
    faces: FaceQuadruple
    positions_m: Annotated[Array, Shape(FINGERS, 3)]
    normals: Annotated[Array, Shape(FINGERS, 3, units=True)]


@declared
class Best(ResultFile):
    """The best grasp of an object by one measure, with the proved bound on all others."""

    FILE = BEST
    SCHEMA = 2

    object: AboutObject
    friction: Friction
    measure: MeasureName
    wrenches: tuple[Wrench, ...]
    """The wrenches of a task, force before torque [N, N m]; none for another measure."""
    clearance_m: Quantity
    """Distance of contacts from the edges of faces [m]."""
    grasp: StandingFingers
    quality: tuple[float, float]
    """Proved lower and upper bound of what the measure says of the grasp."""
    bound: Annotated[float, Interval(gt=0.0)]
    """What no four contacts exceed that are as far from edges."""
    ended: BestEnded
    proof: str | None
    """Name of the proof's file; None if it was not kept."""
    proof_nodes: Number
    """Number of cases of the proof."""
    history: tuple[GapAt, ...]
    planned: tuple[Rated, ...]
    """The planned grasps, which may be nearer to edges."""

    @classmethod
    def of(
        cls, body: Polyhedron, best: BestGrasp, planned: Iterable[Rated], proof: str | None
    ) -> Self:
        """Record what a search has found."""
        grasp, measure = best.grasp, best.proof.measure
        loads = () if measure.is_usual else measure.loads * np.repeat([1.0, body.radius], 3)
        return cls(
            object=AboutObject.of(body),
            friction=best.proof.friction,
            measure=measure.name,
            wrenches=tuple(loads),
            clearance_m=best.clearance,
            grasp=StandingFingers(
                grasp.id, grasp.family, grasp.faces, grasp.positions, grasp.normals
            ),
            quality=(best.quality.lower, best.quality.upper),
            bound=best.bound,
            ended=best.ended,
            proof=proof,
            proof_nodes=len(best.proof.deeds),
            history=best.history,
            planned=tuple(planned),
        )

    def _check_together(self) -> None:
        if self.quality[0] > self.bound:
            raise InputError(
                f"bound: expected at least the quality {self.quality[0]:g} of {self.grasp.id}, got "
                f"{self.bound:g}"
            )

    @computed_field
    @property
    def gap(self) -> float:
        """Share of the bound that the grasp does not reach."""
        return 1.0 - self.quality[0] / self.bound

    @property
    def rated(self) -> tuple[Rated, ...]:
        """The best grasp, then the planned ones, beside the bound."""
        share = self.quality[0] / self.bound
        return (Rated(self.grasp.id, self.grasp.family, self.quality, share), *self.planned)

    @property
    def shares(self) -> Mapping[str, float]:
        """How much of the bound each of these grasps reaches, by id."""
        return {each.id: each.share_of_bound for each in reversed(self.rated)}


WHY = {
    "gap": "the gap asked for is reached",
    "time": "the time limit is reached",
    "interrupt": "it was interrupted",
    "undivided": "what is left of the faces is too small, or too much, to be divided further",
}
PLANNED_GAP = 1e-3
"""Gap between the bounds of what planned grasps hold."""


def check_object(body: Polyhedron, planning: flags.Planning) -> None:
    """Refuse an object with too many places for contacts, before anything is searched."""
    grounds_of(body, checked_clearance(body, planning.edge_clearance_m or None))


def search_best(
    body: Polyhedron, command: flags.PlanFlags, wrenches: Array | None, stop: Stop,
    reporter: Reporter,
) -> BestGrasp:  # fmt: skip
    """Search for the best grasp, for wrenches (m, 6) if asked, and show how the gap closes."""
    planning = command.planning
    with reporter.progress("bounding") as steps:
        # what a level costs is not known before it is done
        steps.update(0, None, "(looking for good contacts)")

        def tell(now: GapAt) -> None:
            word, *_ = MEASURES[command.measure]
            note = f"({word} {now.quality:.4f}, bound {now.bound:.4f}, gap {100 * now.gap:.1f} %)"
            steps.update(now.nodes, None, note)

        return best_until(
            stop, body, planning.friction, gap=command.gap,
            clearance=planning.edge_clearance_m or None, seed=planning.seed, jobs=command.jobs,
            measure=command.measure, wrenches=wrenches, progress=tell,
        )  # fmt: skip


def write_best(
    body: Polyhedron, best: BestGrasp, planned: Sequence[Grasp], folder: Path | None, stop: Stop,
    reporter: Reporter,
) -> Best:  # fmt: skip
    """Write result and proof, and return them with the planned grasps by the same measure.

    For all other measures these are the planned grasps that there is time for.
    """
    measure, friction = best.proof.measure, best.proof.friction
    bounds = [grasp.ferrari_canny for grasp in planned]
    if not measure.is_usual:
        found = (measured(body, grasp, friction, measure, PLANNED_GAP) for grasp in planned)
        rating = reporter.counted("rating", found, len(planned), "rated", bool, stop)
        bounds = [(each.lower, each.upper) for each in rating]
    rated = (
        Rated(each.id, each.family, ends, ends[0] / best.bound)
        for each, ends in zip(planned, bounds, strict=False)
    )
    record = Best.of(body, best, rated, BEST_PROOF if folder else None)
    if folder:
        write_proof(folder / BEST_PROOF, best.proof)
        write_text(folder / Best.FILE, record.text())
        reporter.say(f"wrote {folder / Best.FILE} and {folder / BEST_PROOF}")
    reporter.document(record.document())
    return record


def show_best(found: Best, reporter: Reporter) -> int:
    """Show the best grasp, the bound, and how much of the possible each planned grasp reaches."""
    word, _, unit = MEASURES[found.measure]
    reporter.say(
        f"best grasp {found.grasp.id}: {word} {found.quality[0]:.4f}{unit}; no four contacts "
        f"{1e3 * found.clearance_m:.3g} mm from edges exceed {found.bound:.4f}{unit} (gap "
        f"{100.0 * found.gap:.2f} %); {WHY[found.ended]}, after {found.history[-1].nodes} nodes"
    )
    reporter.records(f"the possible, and what {word}{unit} grasps reach of it", found.rated)
    if found.ended == "interrupt":
        return Exit.INTERRUPTED
    return Exit.GOOD if found.ended == "gap" else Exit.PARTIAL
