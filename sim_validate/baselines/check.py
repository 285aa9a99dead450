"""Simulates grasps, makes a baseline of the verdicts, and compares it with the recorded one.

Why a grasp is not as stable as it must be, and how to look at it, is said in words.
"""

import os
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from grasp_core.by_value import counted
from grasp_core.declared import Declared
from grasp_core.errors import InputError
from grasp_core.figures import NONE, Shown, cell, compared
from grasp_core.planning.result import Plan
from grasp_core.provenance import arithmetic, versions
from scenes.settings import FingerSettings
from sim_validate.baselines.baseline import Baseline, How, KeptGrasp, write_baseline
from sim_validate.baselines.compare import WORDS, Carried, Finding, Status, bands_between, compare
from sim_validate.baselines.part import Present
from sim_validate.closure.validate import checked_for, validated_grasp
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.engine.setup import (
    AXIS_NAMES,
    WEAKEST,
    Setup,
    setup_from_file,
    with_planned_radius,
)
from sim_validate.execution.execute import ExecutionJob, executed_grasp
from sim_validate.execution.verdict import ExecutedGrasp, held_controls_in_words, losses_in_words
from sim_validate.files.result_files import AboutObject
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.processes.workers import each, processes

ReportSteps = Callable[[int, int], None]


def _silent(_: int, __: int) -> None:
    pass


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredGrasps:
    """Verdicts on the grasps of a file, and the baseline made of them."""

    now: Present
    files: tuple[Path, Path]
    """Paths of the baseline and of the grasps."""
    baseline: Baseline
    verdicts: Mapping[str, Verdict]
    refused: Mapping[str, str]
    executions: Mapping[str, ExecutedGrasp] = field(default_factory=dict[str, ExecutedGrasp])

    def bless(self) -> Baseline:
        """Write the baseline, with the part that it is about; every grasp must be in it."""
        now = self.now.testable(self.baseline.limit)
        if self.refused:
            raise InputError("; ".join(self.refused.values()))
        unit, scale = now.file_lengths
        found = replace(self.baseline, part=now.recorded, unit=unit, scale=scale)
        write_baseline(self.files[0], found)
        return found


def measured(
    now: Present, files: tuple[Path, Path], limit: int | None, how: How, processors: int = 1,
    report: ReportSteps = _silent,
) -> MeasuredGrasps:  # fmt: skip
    """Simulate the first grasps of a file and make a baseline of their verdicts."""
    now = now.testable(limit)
    saved, chosen = now.saved, now.saved.grasps
    baseline, grasps = (path.resolve() for path in files)
    where = _as_seen_from(baseline, grasps)
    if not chosen:
        raise InputError(f"{where}: expected at least one grasp to simulate, found none")
    settings = None if how.execution is None else how.execution.for_body(saved.body)
    executing = [
        ExecutionJob(saved.body, grasp, saved.friction, settings, enough=False)
        for grasp in chosen
        if settings is not None
    ]
    count, total = processes(len(chosen), processors), len(chosen) + len(executing)
    setup = replace(how.setup.for_body(saved.body), threads=processors // count)
    gate = checked_for(saved.body, saved.friction, how.agenda, setup)
    validating = partial(
        validated_grasp, saved.body, friction=saved.friction, gate=gate, agenda=how.agenda,
        setup=setup, refused=(),
    )  # fmt: skip
    answers = chain(
        each(partial(_or_refusal, validating, ""), chosen, jobs=count),
        each(partial(_or_refusal, executed_grasp, "the execution is refused: "), executing,
             jobs=processors),
    )  # fmt: skip
    verdicts, executions = dict[str, Verdict](), dict[str, ExecutedGrasp]()
    refused = dict[str, str]()
    for done, (grasp, answer) in enumerate(zip([*chosen, *chosen], answers, strict=False), start=1):
        if isinstance(answer, str):
            refused.setdefault(grasp.id, answer)
        else:
            (verdicts if isinstance(answer, Verdict) else executions)[grasp.id] = answer
        report(done, total)
    entries = [
        KeptGrasp.of(verdicts[grasp.id], executions.get(grasp.id))
        for grasp in chosen
        if grasp.id not in refused
    ]
    kept = Baseline(
        grasps_file=where,
        limit=limit,
        object=AboutObject.of(saved.body),
        friction=saved.friction,
        planned_radius_m=_planned_radius(saved),
        settings=how,
        versions=versions(),
        arithmetic=arithmetic(),
        entries=tuple(sorted(entries, key=lambda entry: entry.id)),
    )
    return MeasuredGrasps(now, files, kept, verdicts, refused, executions)


def _as_seen_from(baseline: Path, grasps: Path) -> str:
    try:
        return Path(os.path.relpath(grasps, baseline.parent)).as_posix()
    except ValueError as error:
        raise InputError(
            f"{grasps}: expected grasps on the drive of {baseline}, which names them by a relative "
            "path; copy one of the two to the other's drive"
        ) from error


def _or_refusal(work: Callable[[Any], Any], beginning: str, job: Any) -> Any:
    try:
        return work(job)
    except OWN_FAULTS as error:
        return f"{beginning}{error}"


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


def _planned_radius(saved: Plan) -> float | None:
    return None if saved.finger is None else saved.finger.radius_m


@dataclass(frozen=True, slots=True, eq=False)
class CheckedBaseline:
    """The result of a check: how the grasps of a baseline have changed."""

    findings: tuple[Finding, ...]
    measured: MeasuredGrasps
    how: str
    """How strictly results were compared, in words."""


def check(
    before: Baseline, now: Present, files: tuple[Path, Path], how: How, processors: int = 1,
    report: ReportSteps = _silent, name: str | None = None,
) -> CheckedBaseline:  # fmt: skip
    """Simulate grasps again, or the one with an id, and compare them with a baseline."""
    now = now.first(before.limit)
    if name is not None:
        now, own = now.only(name), tuple(each for each in before.entries if each.id == name)
        before = replace(before, entries=own, limit=None)
    how = with_planned_fingers(how, before, now.saved)
    if not now.saved.grasps and (now.gone or name is not None):
        body = AboutObject.of(now.saved.body)
        found = MeasuredGrasps(now, files, replace(before, entries=(), object=body), {}, {})
    else:
        found = measured(now, files, before.limit, how, processors, report)
    carried = _carried(now)
    return CheckedBaseline(
        compare(before, found.baseline, found.refused, carried),
        found,
        bands_between(before, found.baseline, carried)[1],
    )


def _carried(now: Present) -> Carried | None:
    known = now.carried is not None or now.since is not None or bool(now.change)
    return Carried(now.change, now.gone) if known else None


def demanded(done: CheckedBaseline) -> CheckedBaseline:
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


PLAIN_TEXT = Shown("", infinite="infinite")


def explained(done: CheckedBaseline) -> str:
    """Explain a change: prediction, simulation, baseline, and commands to run next."""
    (finding,) = done.findings
    verdict, how = done.measured.verdicts.get(finding.id), done.how
    executed = done.measured.executions.get(finding.id)
    lines = [f"{finding.id}: {finding.status.value}", *(f"  {why}" for why in finding.reasons)]
    lines += [f"  {text}" for text in finding.further]
    lines += [f"  compared {how}"] if how and finding.after is not None else []
    lines += _figures(finding)
    failed = verdict.failures[0] if verdict is not None and verdict.failures else None
    if failed is not None:
        lines.append(f"  first wrench that was not held: {in_words(failed)}")
    lines += [f"  {not_survived(executed)}"] if executed and not_survived(executed) else []
    # `validate` knows no wrenches beside these: the others stand in the baseline's own settings
    at = "" if verdict is not None else None
    if verdict is not None and failed is not None:
        names = (each.name for each in verdict.failures)
        at = next((name for name in names if name in (*AXIS_NAMES, WEAKEST)), None)
    return "\n".join([*lines, *_next_steps(finding.id, at, done.measured)])


def passing(done: CheckedBaseline) -> str:
    """Say in one short line what became of a grasp that passes, if anything."""
    (finding,) = done.findings
    if not done.measured.now.change and finding.status is not Status.IMPROVED:
        return ""
    said = finding.id
    if finding.status is Status.GONE or finding.after is None:
        return f"{said} {finding.reasons[0]}" if finding.reasons else said
    said += f" {WORDS.get(finding.status, finding.status.value)}"
    if finding.status is Status.IMPROVED:
        said += f" than in the baseline: {'; '.join(finding.beyond)}"
    return said


def written(path: Path, baseline: Baseline, now: Present) -> str:
    """Say which baseline was written, where, and with how many grasps."""
    held = sum(entry.held for entry in baseline.entries)
    said = f"wrote {path}: {held} of {counted(len(baseline.entries), 'grasp')} held"
    gone = len(now.gone)
    left = f"; {gone} more {'is' if gone == 1 else 'are'} gone from the changed part and left out"
    return f"{said}{left if gone else ''}"


def _next_steps(name: str, at: str | None, found: MeasuredGrasps) -> Iterator[str]:
    now, (baseline, grasps) = found.now, (shlex.quote(str(path)) for path in found.files)
    chosen = f" --wrench={shlex.quote(at)}" if at else ""
    check = f"  all of them: graspproof baseline check {baseline} --grasps {grasps}"
    if now.carried is None:
        if at is not None:
            yield _to_see(name, chosen, grasps)
        yield check
        return
    part = shlex.quote(str(now.source.file))
    lengths = f"--unit {now.unit}" + (f" --scale {now.scale!r}" if now.scale != 1.0 else "")
    yield f"  its contacts: graspproof transfer {grasps} {part} {lengths} --out carried"
    if at is not None:
        yield _to_see(now.id_on_part(name) or name, chosen, "carried/grasps.json")
    yield f"{check} --object {part}"


def _to_see(name: str, chosen: str, grasps: str) -> str:
    which = f"--grasp {shlex.quote(name)}{chosen} --grasps {grasps}"
    return (
        f"  to see it: graspproof validate {grasps} --out seen; "
        f"graspproof replay seen {which} --out replay"
    )


def unstable(verdict: Verdict) -> str:
    """Describe loads that the grasp did not hold or a negative control held; empty if none."""
    lines = [f"{verdict.id} at friction {verdict.friction}: {verdict.outcome.value}"]
    lines += [f"  {in_words(failed)}" for failed in verdict.failures[:1]]
    lines += [f"  control {each.control.name} was not let go"
              for each in verdict.controls if not each.let_go]  # fmt: skip
    lines += [f"  {text}" for text in verdict.mismatches]
    return "" if verdict.good else "\n".join(lines)


def in_words(trial: WrenchVerdict) -> str:
    """Describe how the trial of a wrench ended, when, and what was predicted."""
    hold = trial.hold
    when = "" if hold.failed_after_s is None else f" after {hold.failed_after_s:.3g} s"
    return (
        f"{trial.name} {trial.wrench.tolist()}: {hold.outcome.value}{when} ({hold.reason}), "
        f"predicted limit {trial.predicted_limit:.4g} times it"
    )


def _figures(finding: Finding) -> Iterator[str]:
    entries = (finding.before, finding.after)
    if entries == (None, None):
        return
    rows = [*_rows([entry and entry.verdict for entry in entries], "")]
    rows += _rows([entry and entry.execution for entry in entries], "execution: ")
    width = max(len(name) for name, *_ in rows)
    for name, *cells in [("", "baseline", "now"), *rows]:
        yield f"    {name:<{width}}" + "".join(f"{cell:>14}" for cell in cells)


def _rows(records: Sequence[Declared | None], start: str) -> Iterator[tuple[str, ...]]:
    """Yield what differences call each figure that a record has, and its cells in SI units."""
    kind = next((type(record) for record in records if record is not None), None)
    for figure in () if kind is None else compared(kind):
        cells = [cell(figure.of(record), PLAIN_TEXT) for record in records]
        if {*cells} != {NONE}:
            yield (f"{start}{figure.called}", *cells)


def not_survived(grasp: ExecutedGrasp) -> str:
    """Say why a grasp does not survive its execution: trials, numbers, predictions."""
    found = grasp.execution
    if found is None:
        return f"{grasp.id} was not executed: {grasp.reason}"
    lines = [*losses_in_words(found), *held_controls_in_words(found)]
    if not lines:
        return ""
    lost = sum(not trial.survived for trial in found.trials)
    head = (
        f"{grasp.id} with {found.mass_kg:g} kg: {lost} of {len(found.trials)} trials lost; its "
        f"squeeze is certified for {found.load_multiple:.4g} times the weight in any direction"
    )
    return "\n  ".join([head, *lines])
