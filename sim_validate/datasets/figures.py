"""Computes cells that tables have on request: executions, figures of closure, poses of a hand.

A cell is null where its figure does not exist for the contacts: fewer than four have no span angle,
contacts that are not in force closure no witness forces.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, TypeAlias

from grasp_core.closure.contacts import stacked
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import GraspError
from grasp_core.execution.best_squeeze import best_squeeze
from grasp_core.execution.loads import any_direction
from grasp_core.hands.hand import Hand
from grasp_core.hands.named_hands import load_hand
from grasp_core.hands.reach import reach_with
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.metrics import smallest_singular_value
from grasp_core.values import FINGERS, Contact, Grasp
from sim_validate.datasets.columns import figures_in
from sim_validate.datasets.config import Learning
from sim_validate.datasets.rows import ExecutionRow, GraspRow
from sim_validate.execution.execute import tip_radius
from sim_validate.execution.verdict import ExecutedGrasp, ExecutionTrial
from sim_validate.settings.executions import ExecutionSettings, TrialKind

Executed: TypeAlias = ExecutedGrasp | str | None
"""An execution, the reason why it was refused, or None where none is asked for."""
MISPLACED: TrialKind = "misplaced"
Cells: TypeAlias = Mapping[str, Any]


def execution_cells(executed: Executed) -> dict[str, Any]:
    """Return the cells of a grasp's row that are about its execution, by column.

    Where no squeeze holds the object, the grasp did not survive. Where the execution was refused,
    or no trial is possible, it is not known whether the grasp survives.
    """
    if executed is None:
        return {}
    if isinstance(executed, str):
        return {"executed": False, "execution_note": executed}
    found = executed.execution
    if found is None:
        return {"executed": False, "survived": False, "execution_note": executed.reason}
    trials = found.trials
    return {
        "executed": True,
        "execution_note": "; ".join(f"{each.kind}: {each.reason}" for each in found.skipped),
        "mass_kg": found.mass_kg,
        "squeeze_n": found.squeeze,
        "load_multiple": found.load_multiple,
        **trial_cells(trials),
        "payload_kg": found.payload_kg,
        "execution_mismatches": sum(not each.let_go for each in found.controls),
        "execution": figures_in(GraspRow, "execution", found),
    }


def trial_cells(trials: Sequence[ExecutionTrial]) -> dict[str, Any]:
    """Return the cells of a grasp's row that follow from the trials of its execution."""
    return {
        "survived": all(each.survived for each in trials) if trials else None,
        "predicted_first_slip": min((each.predicted_first_slip for each in trials), default=None),
        "simulated_first_slip": min((each.simulated_first_slip for each in trials), default=None),
        "predicted_loss": min((each.predicted_loss for each in trials), default=None),
        "executed_trials": len(trials),
    }


def executed_by(
    execute: Callable[[ExecutionSettings], ExecutedGrasp], settings: ExecutionSettings,
    seeds: Sequence[int],
) -> ExecutedGrasp:  # fmt: skip
    """Execute contacts, and once more for each seed with objects misplaced by it."""
    first = execute(settings)
    if first.execution is None or MISPLACED not in settings.trials:
        return first
    trials = list(first.execution.trials)
    for place, seed in enumerate(seeds, start=1):
        more = execute(replace(settings, trials=(MISPLACED,), seed=seed)).execution
        of_seed = () if more is None else more.trials
        trials += [
            replace(trial, name=f"{MISPLACED} {place * settings.misplacements + number}")
            for number, trial in enumerate(of_seed)
        ]
    return replace(first, execution=replace(first.execution, trials=tuple(trials)))


def execution_rows(
    name: str, executed: Executed, seeds: Sequence[int] = (), misplacements: int = 1
) -> Iterator[ExecutionRow]:
    """Yield a row for each trial of an execution, each misplaced one with its seed."""
    found = executed.execution if isinstance(executed, ExecutedGrasp) else None
    misplaced = 0
    for number, trial in enumerate(() if found is None else found.trials):
        seed = None
        if trial.kind == MISPLACED:
            seed = seeds[misplaced // misplacements] if seeds else None
            misplaced += 1
        yield ExecutionRow(name, number, trial, seed)


@cache
def hand_named(name: str) -> Hand:
    """Return a built-in hand, one value for all grasps of a process, as searches are kept by it."""
    return load_hand(name)


def hand_cells(hand: Hand, body: Polyhedron, grasp: Grasp, friction: float, seed: int) -> Cells:
    """Look for a pose of a hand in a grasp, and return the cells that tell of it."""
    found = reach_with(hand, body, grasp, friction, seed=seed)
    cells: dict[str, Any] = {"hand_reached": found.reached, "hand_reason": found.reason}
    if not found.reached:
        return cells
    contacts = found.contacts or ()
    return {
        **cells,
        "hand_fingers": found.fingers,
        "hand_joints_rad": found.joints,
        "T_object_palm_m": found.palm_pose,
        "hand_open_joints_rad": found.pregrasp,
        "hand_approach": found.approach,
        "hand_points_m": [contact.position.tolist() for contact in contacts],
        "hand_normals": [contact.normal.tolist() for contact in contacts],
    }


@dataclass(frozen=True, slots=True, eq=False)
class Figures:
    """Which figures are asked for, and how strong fingers are."""

    asked: Learning
    execution: ExecutionSettings | None
    seed: int = 0
    """Seed of the postures from which a hand looks for its pose."""

    def of_contacts(self, body: Polyhedron, contacts: Sequence[Contact]) -> Cells:
        """Return the figures that any contacts have, closed or not."""
        if "closure" not in self.asked.figures:
            return {}
        points, normals = stacked(contacts)
        angle = span_angle(normals) if len(contacts) == FINGERS else None
        cells: dict[str, Any] = {"span_angle_rad": angle, "smallest_singular_value": None}
        with suppress(GraspError):  # too few contacts span too little
            cells["smallest_singular_value"] = smallest_singular_value(
                points, center=body.center_of_mass, torque_scale=body.radius
            )
        return cells

    def of_grasp(self, body: Polyhedron, grasp: Grasp, friction: float) -> Cells:
        """Return the figures that only grasps in force closure have."""
        cells = dict[str, Any]()
        if "closure" in self.asked.figures:
            cells["witness_forces_n"] = grasp.witness.forces
        if self.asked.hand:
            cells |= hand_cells(hand_named(self.asked.hand), body, grasp, friction, self.seed)
        return cells

    def of_executed(
        self, body: Polyhedron, contacts: Sequence[Contact], friction: float, mass_kg: float
    ) -> Cells:
        """Return the figures that only executed contacts have."""
        if self.execution is None:
            return {}
        settings = self.execution.for_body(body)
        cells: dict[str, Any] = {"tip_radius_m": tip_radius(body, contacts, settings)}
        if "least_squeeze" not in self.asked.figures:
            return cells
        try:
            least = best_squeeze(
                body, contacts, friction, any_direction(mass_kg),
                stiffness=settings.tip_stiffness_n_per_m, tip_radius_m=cells["tip_radius_m"],
            )  # fmt: skip
        except GraspError:  # no push carries the weight in every direction, or it is unstable
            return cells
        return {
            **cells,
            "least_push_n": least.max_push_n,
            "least_squeeze_n": least.grip.squeeze,
        }
