"""Turns the flags and files of a command into the settings and trials of the simulator."""

from dataclasses import fields, replace
from pathlib import Path
from typing import cast

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from scenes.execution.held import HeldSettings
from scenes.fingertips import FingerSettings
from scenes.physics import PhysicsSettings
from sim_validate.cli import flag_groups
from sim_validate.cli.command_flags import Run
from sim_validate.cli.exit_codes import FlagsError
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
from sim_validate.records.setup_toml import setup_from_file
from sim_validate.records.wrenches import weights, wrenches_from_file
from sim_validate.simulation.setup import Agenda, Noise, Setup, with_planned_radius

Down = tuple[float, float, float]


def finger_settings(given: flag_groups.Fingers) -> FingerSettings:
    """Build fingertip settings from the flags."""
    return FingerSettings(
        max_normal_force_n=given.max_normal_force,
        radius_m=given.fingertip_radius_m,
        mass_kg=given.fingertip_mass_kg,
        stiffness_n_per_m=given.stiffness_n_per_m,
        approach=given.approach,
    )


def noise_of(given: flag_groups.Repeats) -> Noise:
    """Build noise settings from the flags."""
    if not given.trials and given != flag_groups.Repeats():
        raise FlagsError(
            "the flags --noise-... set the noise of repeated trials: give their number with "
            "--trials too"
        )
    return Noise(**{each.name: getattr(given, f"noise_{each.name}") for each in fields(Noise)})


def prepared(
    testing: flag_groups.Testing, planned: Finger | None, seed: int, folder: Path | None
) -> tuple[Setup, Agenda]:
    """Build settings and trials from flags; those of a setup file override them."""
    setup = Setup(
        fingers=with_planned_radius(finger_settings(testing.fingers), planned),
        physics=PhysicsSettings(torsion_m=testing.fingers.torsion_m),
        surface=testing.surface,
        timeout_s=testing.timeout_s,
    )
    if testing.setup is not None:
        setup = setup_from_file(testing.setup, setup)
    if testing.down and testing.weight_n is None:
        raise FlagsError(
            "--down is the direction in which the weight acts: give the weight with --weight-n too"
        )
    if testing.traces and folder is None:
        raise FlagsError("--traces writes files: give their folder with --out DIR too")
    own = () if testing.wrenches is None else wrenches_from_file(testing.wrenches)
    weight = () if testing.weight_n is None else weights(testing.weight_n, testing.down)
    agenda = Agenda(
        random_wrenches=testing.random_wrenches,
        wrenches=(*own, *weight),
        limits=testing.limits,
        trials=testing.repeats.trials,
        noise=noise_of(testing.repeats),
        keep_traces=testing.traces,
        seed=seed,
    )
    return setup, agenda


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
