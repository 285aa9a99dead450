"""Turns the flags and files of a command into the settings and trials of the simulator."""

from dataclasses import fields
from pathlib import Path

from grasp_core.planning.reach import Finger
from scenes.mujoco.fingertips import FingerSettings
from scenes.mujoco.physics import PhysicsSettings
from sim_validate.closure.setup_toml import setup_from_file
from sim_validate.engine.setup import Agenda, Noise, Setup, with_planned_radius
from sim_validate.kit import flag_groups
from sim_validate.kit.exit_codes import FlagsError
from sim_validate.planning.wrenches_json import weights, wrenches_from_file


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
