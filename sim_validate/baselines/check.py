"""Simulates grasps, makes a baseline of the verdicts, and compares it with the recorded one."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.planning.result import Plan
from grasp_core.provenance import arithmetic, versions
from scenes.settings import FingerSettings
from sim_validate.baselines.baseline import Baseline, Entry, How
from sim_validate.baselines.compare import Carried, Finding, Status, bands_between, compare
from sim_validate.baselines.part import Present
from sim_validate.closure.setup_toml import setup_from_file
from sim_validate.closure.validate import Job, prepared, verdict_of
from sim_validate.closure.verdict import Verdict
from sim_validate.engine.gate import require_faithful
from sim_validate.engine.setup import Setup, with_planned_radius
from sim_validate.execution.jobs import ExecutionJob, executed_grasp
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.kit.about_object import AboutObject
from sim_validate.kit.processes import each, processes

Report = Callable[[int, int], None]


def _silent(_: int, __: int) -> None:
    pass


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Verdicts on the grasps of a file, and the baseline made of them."""

    baseline: Baseline
    verdicts: Mapping[str, Verdict]
    refused: Mapping[str, str]
    executions: Mapping[str, ExecutedGrasp] = field(default_factory=dict[str, ExecutedGrasp])


def measured(
    saved: Plan, about: tuple[str, int | None], how: How, processors: int = 1,
    report: Report = _silent,
) -> Measured:  # fmt: skip
    """Simulate grasps and make a baseline of their verdicts."""
    chosen = saved.grasps[: about[1]]
    if not chosen:
        raise InputError(f"{about[0]}: expected at least one grasp to simulate, found none")
    require_faithful(how.setup, saved.friction, saved.body.radius)
    jobs = [Job(saved.body, grasp, saved.friction, how.agenda, how.setup) for grasp in chosen]
    executing = list[ExecutionJob]()
    if how.execution is not None:
        settings = how.execution.for_body(saved.body)
        executing = [
            ExecutionJob(saved.body, grasp, saved.friction, settings, enough=False)
            for grasp in chosen
        ]
    total = len(jobs) + len(executing)
    verdicts, refused = dict[str, Verdict](), dict[str, str]()
    count = processes(len(jobs), processors)
    judged = each(partial(_or_refusal, verdict_of), prepared(jobs, processors), jobs=count)
    for grasp, answer in zip(chosen, judged, strict=True):
        if isinstance(answer, Verdict):
            verdicts[grasp.id] = answer
        else:
            refused[grasp.id] = answer
        report(len(verdicts) + len(refused), total)
    executions = dict[str, ExecutedGrasp]()
    answers = each(partial(_or_refusal, executed_grasp), executing, jobs=processors)
    for done, (job, found) in enumerate(zip(executing, answers, strict=True), start=1):
        if isinstance(found, str):
            refused.setdefault(job.grasp.id, f"the execution is refused: {found}")
        else:
            executions[job.grasp.id] = found
        report(len(jobs) + done, total)
    entries = [
        Entry.of(verdicts[grasp.id], executions.get(grasp.id))
        for grasp in chosen
        if grasp.id in verdicts and grasp.id not in refused
    ]
    kept = Baseline(
        grasps_file=about[0],
        limit=about[1],
        object=AboutObject.of(saved.body),
        friction=saved.friction,
        planned_radius_m=_planned_radius(saved),
        settings=how,
        versions=versions(),
        arithmetic=arithmetic(),
        entries=tuple(sorted(entries, key=lambda entry: entry.id)),
    )
    return Measured(kept, verdicts, refused, executions)


def _or_refusal(work: Callable[[Any], Any], job: Any) -> Any:
    """Return what a job gives, or why it is refused."""
    try:
        return work(job)
    except InputError as error:
        return str(error)


def complete(found: Measured, now: Present) -> Baseline:
    """Return the baseline of a measurement in which every grasp could be simulated."""
    if found.refused:
        raise InputError("; ".join(found.refused.values()))
    unit, scale = now.file_lengths
    return replace(found.baseline, part=now.recorded, unit=unit, scale=scale)


def setup_for(saved: Plan, path: Path | None) -> Setup:
    """Build the setup of grasps: with their planned fingertips, then with a settings file."""
    setup = Setup(fingers=with_planned_radius(FingerSettings(), saved.finger))
    return setup if path is None else setup_from_file(path, setup)


def with_planned_fingers(how: How, before: Baseline, saved: Plan) -> How:
    """Replace the fingertips of the setup by those that the grasps are planned for now."""
    fingers = how.setup.fingers
    if fingers.fingertip_radius_m != before.planned_radius_m:
        return how
    fingers = replace(fingers, fingertip_radius_m=_planned_radius(saved))
    return replace(how, setup=replace(how.setup, fingers=fingers))


def seen_from(baseline: Path, grasps: Path) -> str:
    """Return the path of a file of grasps, relative to a baseline's folder."""
    return Path(os.path.relpath(grasps.resolve(), baseline.resolve().parent)).as_posix()


def _planned_radius(saved: Plan) -> float | None:
    return None if saved.finger is None else saved.finger.radius_m


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """The result of a check: how the grasps of a baseline have changed."""

    findings: tuple[Finding, ...]
    measured: Measured
    how: str
    """How strictly results were compared, in words."""


def check(
    before: Baseline, now: Present, where: str, how: How, processors: int = 1,
    report: Report = _silent,
) -> Checked:  # fmt: skip
    """Simulate grasps again and compare them with a baseline."""
    now = now.first(before.limit)
    how = with_planned_fingers(how, before, now.saved)
    if now.gone and not now.saved.grasps:
        found = _nothing_measured(before, now)
    else:
        found = measured(now.saved, (where, before.limit), how, processors, report)
    carried = _carried(now)
    return Checked(
        compare(before, found.baseline, found.refused, carried),
        found,
        bands_between(before, found.baseline, carried)[1],
    )


def check_one(before: Baseline, now: Present, where: str, how: How, name: str) -> Checked:
    """Simulate one grasp again, by its id, and compare it with a baseline."""
    one = now.first(before.limit).only(name)
    kept = replace(before, entries=tuple(e for e in before.entries if e.id == name), limit=None)
    if one.saved.grasps or one.gone:
        return check(kept, one, where, how)
    gone = _nothing_measured(kept, one)
    return Checked(compare(kept, gone.baseline, carried=_carried(one)), gone, "")


def _carried(now: Present) -> Carried | None:
    """Say what a comparison must know of a part that is not the planned or the recorded one."""
    known = now.carried is not None or now.since is not None or bool(now.change)
    return Carried(now.change, now.gone) if known else None


def _nothing_measured(before: Baseline, now: Present) -> Measured:
    """Return a measurement of no grasp, on the part as it is now."""
    return Measured(replace(before, entries=(), object=AboutObject.of(now.saved.body)), {}, {})


def demanded(done: Checked) -> Checked:
    """Count grasps that do not survive their execution as regressed, whatever the baseline says.

    A grasp that has no entry now, or whose settings differ from the baseline's, stays as it is.
    """
    findings = list[Finding]()
    for finding in done.findings:
        now = None if finding.after is None else finding.after.execution
        lost = now is not None and not now.survived
        if lost and finding.status is not Status.NOT_COMPARABLE:
            why = ("the grasp must survive its execution, but does not", *finding.reasons)
            finding = replace(finding, status=Status.REGRESSED, reasons=why)
        findings.append(finding)
    return replace(done, findings=tuple(findings))
