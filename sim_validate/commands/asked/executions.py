"""Turns the flags about executions into their settings."""

from dataclasses import replace
from typing import cast

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.records.grasps_json import SavedGrasps
from scenes.execution.held import HeldSettings
from sim_validate.cli.command_flags import Run
from sim_validate.cli.flag_bounds import FlagsError
from sim_validate.cli.flag_groups import (
    DENSITY_KG_M3,
    TRIALS,
    UPRIGHT,
    Executing,
    Mass,
    Tips,
    trials_in,
)
from sim_validate.commands.asked.objects import asked_finger
from sim_validate.execution.settings import ExecutionSettings, TrialKind

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


def holding(saved: SavedGrasps, mass: Mass, tips: Tips, down: Down) -> ExecutionSettings:
    """Build the settings of what holds and is held; trials are the usual ones."""
    planned = None if saved.finger is None else saved.finger.radius_m
    return ExecutionSettings(
        mass_kg=mass_of(saved.body, mass),
        push_n=tips.push_n,
        stiffness_n_per_m=tips.tip_stiffness_n_per_m,
        tip_radius_m=planned if tips.tip_radius_m is None else tips.tip_radius_m,
        hand=HeldSettings(
            tip_mass_kg=tips.tip_mass_kg, damping_ratio=tips.damping_ratio, down=down
        ),
    )


def execution_settings(
    saved: SavedGrasps, given: Executing, trials: tuple[str, ...], down: Down
) -> ExecutionSettings:
    """Build the settings of executions."""
    named = {word for text in trials for word in trials_in(text)} or set(TRIALS)
    return replace(
        holding(saved, given.mass, given.tips, down),
        trials=cast("tuple[TrialKind, ...]", tuple(sorted(named))),
        lift_m=given.lift_m,
        lift_s=given.lift_s,
        shake_g=given.shake_g,
        shake_hz=given.shake_hz,
        stop_m_per_s2=given.stop_m_per_s2,
        stop_from_m_per_s=given.stop_from_m_per_s,
        knock_n_s=given.knock_n_s,
        off_mm=given.off_mm,
        off_deg=given.off_deg,
        misplacements=given.misplacements,
        seed=saved.seed,
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
    saved = SavedGrasps(body, planning.friction, planning.seed, (), asked_finger(planning))
    return execution_settings(
        saved, command.executing, command.execute_trials, command.execute_down
    )
