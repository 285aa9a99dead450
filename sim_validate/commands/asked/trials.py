"""Turns the flags and files of a command into the settings and trials of the simulator."""

from pathlib import Path

from grasp_core.planning.reach import Finger
from scenes.fingertips import FingerSettings
from scenes.physics import PhysicsSettings
from sim_validate.cli import flag_groups
from sim_validate.cli.flag_bounds import FlagsError
from sim_validate.records.setup_toml import setup_from_file
from sim_validate.records.wrenches import weights, wrenches_from_file
from sim_validate.simulation.setup import Agenda, Noise, Setup, with_planned_radius


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
    plain = flag_groups.Repeats()
    if not given.trials and given != plain:
        raise FlagsError(
            "the flags --noise-... set the noise of repeated trials: give their number with "
            "--trials too"
        )
    return Noise(
        shift=given.noise_shift,
        turn_deg=given.noise_turn_deg,
        normal_deg=given.noise_normal_deg,
        friction=given.noise_friction,
        mass=given.noise_mass,
    )


def prepared(
    testing: flag_groups.Testing, planned: Finger | None, seed: int, folder: Path | None
) -> tuple[Setup, Agenda]:
    """Build the settings and the choice of trials from flags and files, before anything runs."""
    return _setup(testing, planned), _agenda(testing, seed, folder)


def _setup(testing: flag_groups.Testing, planned: Finger | None) -> Setup:
    """Build simulation settings from the flags; a setup file overrides them."""
    setup = Setup(
        fingers=with_planned_radius(finger_settings(testing.fingers), planned),
        physics=PhysicsSettings(torsion_m=testing.fingers.torsion_m),
        surface=testing.surface,
        timeout_s=testing.timeout_s,
    )
    return setup if testing.setup is None else setup_from_file(testing.setup, setup)


def _agenda(testing: flag_groups.Testing, seed: int, folder: Path | None) -> Agenda:
    """Choose the trials that the flags ask for."""
    if testing.down and testing.weight_n is None:
        raise FlagsError(
            "--down is the direction in which the weight acts: give the weight with --weight-n too"
        )
    if testing.traces and folder is None:
        raise FlagsError("--traces writes files: give their folder with --out DIR too")
    own = () if testing.wrenches is None else wrenches_from_file(testing.wrenches)
    weight = () if testing.weight_n is None else weights(testing.weight_n, testing.down)
    return Agenda(
        random_wrenches=testing.random_wrenches,
        wrenches=(*own, *weight),
        limits=testing.limits,
        trials=testing.repeats.trials,
        noise=noise_of(testing.repeats),
        keep_traces=testing.traces,
        seed=seed,
    )
