"""Explains in words why a grasp is not as stable as it must be, and how to look at it."""

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path

from grasp_core.declared import Declared, counted
from grasp_core.figures import NONE, Shown, cell, compared
from sim_validate.baselines.baseline import Baseline
from sim_validate.baselines.check import Checked
from sim_validate.baselines.compare import WORDS, Finding, Status
from sim_validate.baselines.part import Present
from sim_validate.closure.verdict import Verdict, WrenchVerdict
from sim_validate.engine.setup import AXIS_NAMES, WEAKEST
from sim_validate.execution.verdict import ExecutedGrasp, held_controls_in_words, losses_in_words

PLAIN = Shown("", infinite="infinite")


def explained(done: Checked, files: tuple[Path, Path], now: Present) -> str:
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
    return "\n".join([*lines, *_next_steps(finding.id, at, files, now)])


def passing(done: Checked, now: Present) -> str:
    """Say in one short line what became of a grasp that passes, if anything."""
    (finding,) = done.findings
    if not now.change and finding.status is not Status.IMPROVED:
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


def _next_steps(name: str, at: str | None, files: tuple[Path, Path], now: Present) -> Iterator[str]:
    baseline, grasps = (shlex.quote(str(path)) for path in files)
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
    """Yield a line for each figure of a grasp, in the baseline and now."""
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
    for each in () if kind is None else compared(kind):
        cells = [cell(each.of(record), PLAIN) for record in records]
        if {*cells} != {NONE}:
            yield (f"{start}{each.called}", *cells)


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
