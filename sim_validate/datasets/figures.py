"""Computes cells that tables have on request: executions, figures of closure, poses of a hand.

A cell is null where its figure does not exist for the contacts: fewer than four have no span angle,
contacts that are not in force closure no witness forces.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any, TypeAlias

from grasp_core.closure.contacts import contacts_sha256, stacked
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import GraspError, InputError, NoForcesError
from grasp_core.execution.best_squeeze import best_squeeze
from grasp_core.execution.loads import any_direction
from grasp_core.hands.named_hands import load_hand
from grasp_core.hands.reach import reach_with
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.metrics import smallest_singular_value
from grasp_core.values import FINGERS, Contact, Grasp
from sim_validate.datasets.columns import Cells, figures_in
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.rows import ExecutionRow, GraspRow
from sim_validate.execution.execute import execute, tip_radius
from sim_validate.execution.verdict import ExecutedGrasp, ExecutionTrial
from sim_validate.settings import TrialKind

Executed: TypeAlias = ExecutedGrasp | str | None
"""An execution, the reason why it was refused, or None where none is asked for."""
MISPLACED: TrialKind = "misplaced"


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
    config: DatasetConfig, body: Polyhedron, contacts: Sequence[Contact], friction: float,
    name: str, mass_kg: float | None = None,
) -> Executed:  # fmt: skip
    """Execute contacts, and once more for each seed asked for with objects misplaced by it.

    Contacts without a squeeze are a result with a reason.
    """
    if config.execution is None:
        return None
    about = name, "", contacts_sha256(contacts)
    try:
        settings = config.execution.for_body(body)
        if mass_kg is not None:
            settings = replace(settings, mass_kg=mass_kg)
        first = execute(body, contacts, friction, settings, enough=False)
    except NoForcesError as error:
        return ExecutedGrasp(*about, None, str(error))
    except InputError as error:
        return str(error)
    seeds = () if config.learning is None else config.learning.seeds
    trials = list(first.trials)
    for place, seed in enumerate(seeds if MISPLACED in settings.trials else (), start=1):
        again = replace(settings, trials=(MISPLACED,), seed=seed)
        more = execute(body, contacts, friction, again, enough=False).trials
        trials += [
            replace(trial, name=f"{MISPLACED} {place * settings.misplacements + number}")
            for number, trial in enumerate(more)
        ]
    return ExecutedGrasp(*about, replace(first, trials=tuple(trials)))


def execution_rows(name: str, executed: Executed, config: DatasetConfig) -> Iterator[ExecutionRow]:
    """Yield a row for each trial of an execution, each misplaced one with its seed."""
    asked = config.execution
    if asked is None or not isinstance(executed, ExecutedGrasp):
        return
    seeds = (asked.seed, *(() if config.learning is None else config.learning.seeds))
    misplaced = 0
    for number, trial in enumerate(executed.trials):
        seed = None
        if trial.kind == MISPLACED:
            seed = seeds[misplaced // asked.misplacements]
            misplaced += 1
        yield ExecutionRow(name, number, trial, seed)


hand_named = cache(load_hand)
"""Return a built-in hand, one value for all grasps of a process, as searches are kept by it."""


def contact_cells(config: DatasetConfig, body: Polyhedron, contacts: Sequence[Contact]) -> Cells:
    """Return the figures on request that any contacts have, closed or not."""
    if config.learning is None or "closure" not in config.learning.figures:
        return {}
    points, normals = stacked(contacts)
    angle = span_angle(normals) if len(contacts) == FINGERS else None
    smallest = None
    with suppress(GraspError):  # too few contacts span too little
        smallest = smallest_singular_value(
            points, center=body.center_of_mass, torque_scale=body.radius
        )
    return {"span_angle_rad": angle, "smallest_singular_value": smallest}


def closed_cells(config: DatasetConfig, body: Polyhedron, grasp: Grasp, friction: float) -> Cells:
    """Return the figures on request that only grasps in force closure have, and a hand's pose."""
    cells, asked = dict[str, Any](), config.learning
    if asked is not None and "closure" in asked.figures:
        cells["witness_forces_n"] = grasp.witness.forces
    if asked is None or not asked.hand:
        return cells
    found = reach_with(hand_named(asked.hand), body, grasp, friction, seed=config.seed)
    cells |= {"hand_reached": found.reached, "hand_reason": found.reason}
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


def squeeze_cells(
    config: DatasetConfig, body: Polyhedron, contacts: Sequence[Contact], friction: float,
    mass_kg: float,
) -> Cells:  # fmt: skip
    """Return the figures on request that only executed contacts have."""
    if config.learning is None or config.execution is None:
        return {}
    settings = config.execution.for_body(body)
    cells: dict[str, Any] = {"tip_radius_m": tip_radius(body, contacts, settings)}
    if "least_squeeze" in config.learning.figures:
        with suppress(GraspError):  # no push carries the weight every way, or it is unstable
            least = best_squeeze(
                body, contacts, friction, any_direction(mass_kg),
                stiffness=settings.tip_stiffness_n_per_m, tip_radius_m=cells["tip_radius_m"],
            )  # fmt: skip
            cells |= {"least_push_n": least.max_push_n, "least_squeeze_n": least.grip.squeeze}
    return cells
