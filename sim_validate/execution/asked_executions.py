"""Turns the flags of a command into the settings and trials of executions."""

from dataclasses import fields, replace
from typing import cast

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from scenes.mujoco.held import HeldSettings
from sim_validate.execution.settings import ExecutionSettings, TrialKind
from sim_validate.kit.command_flags import Run
from sim_validate.kit.exit_codes import FlagsError
from sim_validate.kit.flag_groups import (
    DENSITY_KG_M3,
    TRIALS,
    UPRIGHT,
    Executing,
    Mass,
    Tips,
    trials_in,
)
from sim_validate.planning.asked_objects import asked_finger

Down = tuple[float, float, float]


def check_mass(given: Mass) -> None:
    """Refuse a mass beside a density, before any file is read."""
    if given.mass_kg is not None and given.density_kg_m3 is not None:
        raise FlagsError("--mass-kg and --density-kg-m3 exclude each other: leave one of them out")


def mass_of(body: Polyhedron, given: Mass) -> float:
    """Return the mass of an object by the flags, or by its volume and the usual density [kg]."""
    if given.mass_kg is not None:
        return given.mass_kg
    return body.mass_at(DENSITY_KG_M3 if given.density_kg_m3 is None else given.density_kg_m3)


def holding(
    body: Polyhedron, finger: Finger | None, mass: Mass, tips: Tips, down: Down
) -> ExecutionSettings:
    """Build the settings of what holds and is held; trials are the usual ones."""
    planned = None if finger is None else finger.radius_m
    return ExecutionSettings(
        mass_kg=mass_of(body, mass),
        push_n=tips.push_n,
        stiffness_n_per_m=tips.tip_stiffness_n_per_m,
        tip_radius_m=planned if tips.tip_radius_m is None else tips.tip_radius_m,
        hand=HeldSettings(
            tip_mass_kg=tips.tip_mass_kg, damping_ratio=tips.damping_ratio, down=down
        ),
    )


def execution_settings(
    body: Polyhedron,
    seed: int,
    finger: Finger | None,
    given: Executing,
    trials: tuple[str, ...],
    down: Down,
) -> ExecutionSettings:
    """Build the settings of executions; flags of the same names set them."""
    named = {word for text in trials for word in trials_in(text)} or set(TRIALS)
    known = {each.name for each in fields(ExecutionSettings)}
    return replace(
        holding(body, finger, given.mass, given.tips, down),
        trials=cast("tuple[TrialKind, ...]", tuple(sorted(named))),
        **{each.name: getattr(given, each.name) for each in fields(given) if each.name in known},
        seed=seed,
        most_mm=given.max_mm,
        most_deg=given.max_deg,
    )


def check_executing(command: Run) -> None:
    """Refuse flags about executions where none are asked for, before any file is read."""
    check_mass(command.executing.mass)
    given = (command.executing, command.execute_trials, command.execute_down)
    if not command.execute and given != (Executing(), (), UPRIGHT):
        raise FlagsError(
            "the flags from --mass-kg to --max-deg, --execute-trials and --execute-down say how "
            "grasps are executed: add --execute too"
        )


def execution_of_run(command: Run, body: Polyhedron) -> ExecutionSettings | None:
    """Build the settings of the executions that `run` is asked for; None if it is not."""
    if not command.execute:
        return None
    planning = command.planning
    return execution_settings(
        body, planning.seed, asked_finger(planning), command.executing, command.execute_trials,
        command.execute_down,
    )  # fmt: skip
