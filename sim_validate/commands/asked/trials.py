"""Turns the flags and files of a command into the settings and trials of the simulator."""

from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.settings import extended
from sim_validate.cli.command_flags import Run
from sim_validate.cli.exit_codes import FlagsError
from sim_validate.cli.flag_groups import Testing
from sim_validate.commands.asked.objects import asked_finger
from sim_validate.execution.settings import ChosenExecution, ExecutionSettings, Holding
from sim_validate.records.setup_toml import setup_from_file
from sim_validate.records.wrenches import weights, wrenches_from_file
from sim_validate.simulation.settings import ChosenTrials, Noise
from sim_validate.simulation.setup import Agenda, Setup, with_planned_radius

Held = TypeVar("Held", bound=Holding)


def check_noise(given: ChosenTrials) -> None:
    """Refuse noise where nothing is repeated with it."""
    if not given.repeats and given.noise != Noise():
        raise FlagsError(
            "the flags --noise... set the noise of repeated trials: give their number with "
            "--repeats too"
        )


def prepared(
    testing: Testing, planned: Finger | None, seed: int, folder: Path | None
) -> tuple[Setup, Agenda]:
    """Build settings and trials from flags; those of a setup file override them."""
    setup = extended(Setup, testing.scene, timeout_s=testing.timeout_s)
    setup = replace(setup, fingers=with_planned_radius(setup.fingers, planned))
    if testing.setup is not None:
        setup = setup_from_file(testing.setup, setup)
    check_noise(testing.more)
    if testing.weight_down and testing.weight_n is None:
        raise FlagsError(
            "--weight-down is the direction in which the weight acts: give the weight with "
            "--weight-n too"
        )
    if testing.traces and folder is None:
        raise FlagsError("--traces writes files: give their folder with --out DIR too")
    own = () if testing.wrenches is None else wrenches_from_file(testing.wrenches)
    weight = () if testing.weight_n is None else weights(testing.weight_n, testing.weight_down)
    agenda = extended(
        Agenda, testing.more, wrenches=(*own, *weight), keep_traces=testing.traces, seed=seed
    )
    return setup, agenda


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
