"""Simulates grasps and makes a baseline of the verdicts, with all that they depend on."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.provenance import arithmetic, versions
from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.baselines.entries import Baseline, entry_of
from sim_validate.baselines.settings import settings_of
from sim_validate.parallel.processes import each
from sim_validate.simulation.gate.gate import require_faithful
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.jobs import Job, verdict_of, with_threads

Report = Callable[[int, int], None]
"""Function that is called with (done, total) after each grasp."""


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Verdicts on the grasps of a file, and the baseline made of them."""

    baseline: Baseline
    """Baseline without the grasps that could not be simulated."""
    verdicts: Mapping[str, Verdict]
    """Verdicts by the ids of their grasps."""
    refused: Mapping[str, str]
    """Reasons why grasps could not be simulated, by id."""


def measured(
    saved: SavedGrasps, about: tuple[str, int | None], setup: Setup, agenda: Agenda,
    processors: int, report: Report,
) -> Measured:  # fmt: skip
    """Simulate grasps and make a baseline of their verdicts.

    Args:
        saved: The grasps.
        about: Path of the grasps, relative to the baseline's folder, and how many to simulate.
        setup: How trials are simulated.
        agenda: Which trials to run.
        processors: Number of processors to use; no result depends on it.
        report: Called with (done, total) after each grasp.

    Raises:
        InputError: The file of grasps is empty.
        UnfaithfulError: The simulator fails its checks on cases with known answers.
    """
    chosen = saved.grasps[: about[1]]
    if not chosen:
        raise InputError(f"{about[0]}: expected at least one grasp to simulate, found none")
    require_faithful(setup, saved.friction, saved.body.radius)
    jobs = [Job(saved.body, grasp, saved.friction, agenda, setup) for grasp in chosen]
    verdicts, refused = dict[str, Verdict](), dict[str, str]()
    for grasp, answer in zip(
        chosen, each(_try, with_threads(jobs, processors), jobs=processors), strict=True
    ):
        if isinstance(answer, Verdict):
            verdicts[grasp.id] = answer
        else:
            refused[grasp.id] = answer
        report(len(verdicts) + len(refused), len(jobs))
    return Measured(_kept(saved, about, setup, agenda, verdicts), verdicts, refused)


def _kept(
    saved: SavedGrasps, about: tuple[str, int | None], setup: Setup, agenda: Agenda,
    verdicts: Mapping[str, Verdict],
) -> Baseline:  # fmt: skip
    entries = [
        entry_of(grasp, verdicts[grasp.id], saved.body.radius)
        for grasp in saved.grasps
        if grasp.id in verdicts
    ]
    return Baseline(
        grasps_file=about[0],
        limit=about[1],
        object=saved.body.name,
        content_sha256=saved.body.content_sha256,
        friction=saved.friction,
        planned_radius_m=_planned_radius(saved),
        settings=settings_of(setup, agenda),
        versions=versions(),
        arithmetic=arithmetic(),
        entries=tuple(sorted(entries, key=lambda entry: entry.id)),
    )


def _try(job: Job) -> Verdict | str:
    try:
        return verdict_of(job)
    except InputError as error:
        return str(error)


def complete(found: Measured) -> Baseline:
    """Return the baseline of a measurement in which every grasp could be simulated.

    Raises:
        InputError: A grasp could not be simulated.
    """
    if found.refused:
        raise InputError("; ".join(found.refused.values()))
    return found.baseline


def with_planned_fingers(setup: Setup, before: Baseline, saved: SavedGrasps) -> Setup:
    """Replace a setup's fingertips by those that the grasps are planned for now.

    A radius that was not the planned one when the baseline was recorded stays.
    """
    if setup.fingers.radius_m != before.planned_radius_m:
        return setup
    return replace(setup, fingers=replace(setup.fingers, radius_m=_planned_radius(saved)))


def seen_from(baseline: Path, grasps: Path) -> str:
    """Return the path of a file of grasps, relative to a baseline's folder."""
    return Path(os.path.relpath(grasps.resolve(), baseline.resolve().parent)).as_posix()


def _planned_radius(saved: SavedGrasps) -> float | None:
    return None if saved.finger is None else saved.finger.radius_m
