"""Turns the flags and files of a command into the settings and trials of the simulator."""

from dataclasses import replace
from pathlib import Path

from grasp_core.planning.reach import Finger
from grasp_core.settings import extended
from sim_validate.closure.setup_toml import setup_from_file
from sim_validate.engine.setup import Agenda, Setup, with_planned_radius
from sim_validate.kit.exit_codes import FlagsError
from sim_validate.kit.flag_groups import Testing
from sim_validate.planning.wrenches_json import weights, wrenches_from_file
from sim_validate.settings.trials import ChosenTrials, Noise


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
