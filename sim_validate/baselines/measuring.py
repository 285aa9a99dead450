"""Grasps on the bench -> a baseline: verdicts now, with all that they depend on."""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.records import SavedGrasps
from grasp_core.versions import versions
from sim_validate.baselines.values import Baseline, entry_of
from sim_validate.flags import Fingers
from sim_validate.gate import require_faithful
from sim_validate.grasp_verdict import Verdict
from sim_validate.jobs import Job, validated
from sim_validate.noise import Noise
from sim_validate.rounding import arithmetic
from sim_validate.setup import Agenda, NamedWrench, Setup
from sim_validate.setup_file import setup_from_file, setup_from_tables, tables_of
from sim_validate.validate_command import finger_settings, planned_fingers


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Verdicts on the grasps of a file, and what a baseline keeps of them."""

    baseline: Baseline
    verdicts: Mapping[str, Verdict]
    """By grasp."""


def measured(
    saved: SavedGrasps,
    grasps_file: str,
    setup: Setup,
    agenda: Agenda,
    processors: int,
    report: Callable[[int, int], None],
) -> Measured:
    """Simulate grasps and keep what their verdicts say.

    Args:
        saved: The grasps.
        grasps_file: Where they are, from the baseline's folder.
        setup: How trials are simulated.
        agenda: Which ones.
        processors: How many to use; nothing depends on it.
        report: Told how many grasps are done, and of how many.

    Raises:
        InputError: There is no grasp, or one is refused.
        UnfaithfulError: The simulator fails the gate.
    """
    if not saved.grasps:
        raise InputError(f"{grasps_file}: holds no grasp")
    require_faithful(setup, saved.friction, saved.body.radius)
    jobs = [Job(saved.body, grasp, saved.friction, agenda, setup) for grasp in saved.grasps]
    verdicts = dict[str, Verdict]()
    for grasp, verdict in zip(saved.grasps, validated(jobs, processors), strict=True):
        verdicts[grasp.id] = verdict
        report(len(verdicts), len(jobs))
    entries = [entry_of(grasp, verdicts[grasp.id], saved.body.radius) for grasp in saved.grasps]
    baseline = Baseline(
        grasps_file=grasps_file,
        object=saved.body.name,
        content_sha256=saved.body.content_sha256,
        friction=saved.friction,
        settings=settings_of(setup, agenda),
        versions=versions(),
        arithmetic=arithmetic(),
        entries=tuple(sorted(entries, key=lambda entry: entry.id)),
    )
    return Measured(baseline, verdicts)


def setup_for(saved: SavedGrasps, path: Path | None) -> Setup:
    """How grasps are simulated: with the fingertips they were planned for, as a file has it.

    Raises:
        InputError: The file is missing or refused.
    """
    setup = Setup(fingers=finger_settings(planned_fingers(Fingers(), saved.finger)))
    return setup if path is None else setup_from_file(path, setup)


def seen_from(baseline: Path, grasps: Path) -> str:
    """The path of grasps from a baseline's folder."""
    return Path(os.path.relpath(grasps.resolve(), baseline.resolve().parent)).as_posix()


def settings_of(setup: Setup, agenda: Agenda) -> dict[str, Any]:
    """How trials are simulated and which ones, as a baseline's file has it."""
    settings = {
        "setup": tables_of(setup),
        "surface": setup.surface,
        "random_wrenches": agenda.random_wrenches,
        "wrenches": {each.name: each.wrench.tolist() for each in agenda.wrenches},
        "limits": agenda.limits,
        "trials": agenda.trials,
        "noise": asdict(agenda.noise),
        "seed": agenda.seed,
    }
    return json.loads(json.dumps(settings))


def of_settings(settings: Mapping[str, Any], path: str) -> tuple[Setup, Agenda]:
    """The setup and agenda that a baseline keeps.

    Args:
        settings: As `settings_of` gives them.
        path: Where they come from, for messages.

    Raises:
        InputError: A setting is missing, unknown or refused.
    """
    try:
        setup = setup_from_tables(settings["setup"], Setup(surface=settings["surface"]), path)
        wrenches = tuple(NamedWrench(name, w) for name, w in settings["wrenches"].items())
        agenda = Agenda(
            random_wrenches=settings["random_wrenches"],
            wrenches=wrenches,
            limits=settings["limits"],
            trials=settings["trials"],
            noise=Noise(**settings["noise"]),
            seed=settings["seed"],
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: its settings are not those of a baseline ({error})") from error
    return setup, agenda
