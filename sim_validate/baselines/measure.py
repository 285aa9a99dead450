"""Simulates grasps and makes a baseline of the verdicts, with all that they depend on."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.provenance import arithmetic, versions
from grasp_core.records.grasps_json import SavedGrasps
from grasp_core.values import Grasp
from sim_validate.baselines.entries import Baseline, Entry, entry_of
from sim_validate.baselines.executions import tried_execution
from sim_validate.baselines.parts.changed_part import Present
from sim_validate.baselines.settings import How, settings_of
from sim_validate.execution.jobs import ExecutionJob
from sim_validate.execution.settings import AskedExecution
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.parallel.processes import each, processes
from sim_validate.simulation.gate import require_faithful
from sim_validate.validation.validation import Job, prepared, verdict_of
from sim_validate.validation.verdict import Verdict

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
    executions: Mapping[str, ExecutedGrasp] = field(default_factory=dict[str, ExecutedGrasp])
    """Executions by the ids of their grasps; empty if none are asked for."""


def measured(
    saved: SavedGrasps, about: tuple[str, int | None], how: How, processors: int, report: Report
) -> Measured:  # fmt: skip
    """Simulate grasps and make a baseline of their verdicts.

    Takes `report` (done, total).
    """
    chosen = saved.grasps[: about[1]]
    if not chosen:
        raise InputError(f"{about[0]}: expected at least one grasp to simulate, found none")
    require_faithful(how.setup, saved.friction, saved.body.radius)
    jobs = [Job(saved.body, grasp, saved.friction, how.agenda, how.setup) for grasp in chosen]
    executing = _executing(saved, chosen, how.execution)
    total = len(jobs) + len(executing)
    verdicts, refused = dict[str, Verdict](), dict[str, str]()
    count = processes(len(jobs), processors)
    for grasp, answer in zip(
        chosen, each(_try, prepared(jobs, processors), jobs=count), strict=True
    ):
        if isinstance(answer, Verdict):
            verdicts[grasp.id] = answer
        else:
            refused[grasp.id] = answer
        report(len(verdicts) + len(refused), total)
    executions = dict[str, ExecutedGrasp]()
    for done, (job, found) in enumerate(
        zip(executing, each(tried_execution, executing, jobs=processors), strict=True), start=1
    ):
        if isinstance(found, str):
            refused.setdefault(job.grasp.id, found)
        else:
            executions[job.grasp.id] = found
        report(len(jobs) + done, total)
    entries = [
        entry_of(grasp, verdicts[grasp.id], saved.body.radius, executions.get(grasp.id))
        for grasp in chosen
        if grasp.id in verdicts and grasp.id not in refused
    ]
    kept = _kept(saved, about, settings_of(how), entries)
    return Measured(kept, verdicts, refused, executions)


def _executing(
    saved: SavedGrasps, chosen: Sequence[Grasp], asked: AskedExecution | None
) -> list[ExecutionJob]:
    if asked is None:
        return []
    settings = asked.settings_for(saved.body)
    return [
        ExecutionJob(saved.body, grasp, saved.friction, settings, enough=False) for grasp in chosen
    ]


def _kept(
    saved: SavedGrasps, about: tuple[str, int | None], settings: Mapping[str, Any],
    entries: Sequence[Entry],
) -> Baseline:  # fmt: skip
    return Baseline(
        grasps_file=about[0],
        limit=about[1],
        object=saved.body.name,
        content_sha256=saved.body.content_sha256,
        friction=saved.friction,
        planned_radius_m=_planned_radius(saved),
        settings=settings,
        versions=versions(),
        arithmetic=arithmetic(),
        entries=tuple(sorted(entries, key=lambda entry: entry.id)),
    )


def _try(job: Job) -> Verdict | str:
    try:
        return verdict_of(job)
    except InputError as error:
        return str(error)


def complete(found: Measured, now: Present) -> Baseline:
    """Return the baseline of a measurement in which every grasp could be simulated."""
    if found.refused:
        raise InputError("; ".join(found.refused.values()))
    unit, scale = now.file_lengths
    return replace(found.baseline, part=now.recorded, unit=unit, scale=scale)


def with_planned_fingers(how: How, before: Baseline, saved: SavedGrasps) -> How:
    """Replace the fingertips of the setup by those that the grasps are planned for now.

    A radius that was not the planned one when the baseline was recorded stays.
    """
    fingers = how.setup.fingers
    if fingers.radius_m != before.planned_radius_m:
        return how
    fingers = replace(fingers, radius_m=_planned_radius(saved))
    return replace(how, setup=replace(how.setup, fingers=fingers))


def seen_from(baseline: Path, grasps: Path) -> str:
    """Return the path of a file of grasps, relative to a baseline's folder."""
    return Path(os.path.relpath(grasps.resolve(), baseline.resolve().parent)).as_posix()


def _planned_radius(saved: SavedGrasps) -> float | None:
    return None if saved.finger is None else saved.finger.radius_m
