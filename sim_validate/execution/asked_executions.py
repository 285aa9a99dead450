"""Turns the flags of a command into the settings and trials of executions."""

from dataclasses import replace
from typing import TypeVar

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.settings import extended
from sim_validate.kit.command_flags import Run
from sim_validate.kit.exit_codes import FlagsError
from sim_validate.planning.asked_objects import asked_finger
from sim_validate.settings.executions import ChosenExecution, ExecutionSettings, Holding

Held = TypeVar("Held", bound=Holding)


def holding(given: Held, body: Polyhedron, finger: Finger | None) -> Held:
    """Complete what holds an object: its mass, and fingertips as planned if no flag gives them."""
    planned = None if finger is None else finger.radius_m
    radius = planned if given.tip_radius_m is None else given.tip_radius_m
    return replace(given.for_body(body), tip_radius_m=radius)


def execution_settings(
    given: ChosenExecution, body: Polyhedron, seed: int, finger: Finger | None
) -> ExecutionSettings:
    """Build the settings of executions."""
    return extended(ExecutionSettings, holding(given, body, finger), seed=seed)


def check_executing(command: Run) -> None:
    """Refuse flags about executions where none are asked for, before any file is read."""
    if not command.execute and command.executing != ChosenExecution():
        raise FlagsError(
            "the flags from --mass-kg to --max-deg say how grasps are executed: add --execute too"
        )


def execution_of_run(command: Run, body: Polyhedron) -> ExecutionSettings | None:
    """Build the settings of the executions that `run` is asked for; None if it is not."""
    if not command.execute:
        return None
    planning = command.planning
    return execution_settings(command.executing, body, planning.seed, asked_finger(planning))
