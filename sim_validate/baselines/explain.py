"""Explains in words why a grasp is not as stable as it must be, and how to look at it."""

import shlex
from collections.abc import Iterator
from pathlib import Path

from sim_validate.baselines.parts.changed_part import Present
from sim_validate.baselines.check import Checked
from sim_validate.baselines.entries import Entry
from sim_validate.baselines.executions import not_survived
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.wrench_verdict import WrenchVerdict


def explained(done: Checked, files: tuple[Path, Path], now: Present) -> str:
    """Explain how a grasp has changed: prediction, simulation, baseline, and commands to run next.

    Args:
        done: The check of this grasp alone.
        files: Paths of the baseline and the grasps.
        now: The grasps on their part as it is now.
    """
    (finding,) = done.findings
    verdict, how = done.verdicts.get(finding.id), done.how
    executed = done.measured.executions.get(finding.id)
    lines = [f"{finding.id}: {finding.status.value}", *(f"  {why}" for why in finding.reasons)]
    lines += [f"  {text}" for text in finding.differences if text not in finding.reasons]
    lines += [f"  compared {how}"] if how else []
    for title, entry in (("baseline", finding.before), ("now", finding.after)):
        lines += [] if entry is None else _numbers(title, entry)
    failed = verdict.failures[0] if verdict is not None and verdict.failures else None
    if failed is not None:
        lines.append(f"  first wrench that was not held: {in_words(failed)}")
    lines += [f"  {not_survived(executed)}"] if executed and not_survived(executed) else []
    at = None if verdict is None else "" if failed is None else failed.name
    return "\n".join([*lines, *_next_steps(finding.id, at, files, now)])


def _next_steps(name: str, at: str | None, files: tuple[Path, Path], now: Present) -> Iterator[str]:
    """Yield the commands that show a grasp, and that check all of them.

    Args:
        name: Id of the grasp.
        at: The first wrench that was not held; empty if all were, None if nothing was simulated.
        files: Paths of the baseline and the grasps.
        now: The grasps on their part as it is now.
    """
    baseline, grasps = (shlex.quote(str(path)) for path in files)
    chosen = f" --wrench={shlex.quote(at)}" if at else ""
    check = f"  all of them: graspproof baseline check {baseline} --grasps {grasps}"
    if now.carried is None:
        which = f"--grasp {shlex.quote(name)}{chosen} --grasps {grasps}"
        if at is not None:
            yield f"  to see it: graspproof replay {baseline} {which} --out replay"
        yield check
        return
    part = shlex.quote(str(now.source.file))
    yield f"  its contacts: graspproof transfer {grasps} {part} --unit {now.unit} --out carried"
    if at is not None:
        which = f"--grasp {shlex.quote(now.id_on_part(name) or name)}{chosen}"
        yield f"  to see it: graspproof replay carried/grasps.json {which} --out replay"
    yield f"{check} --object {part}"


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


def _numbers(title: str, entry: Entry) -> Iterator[str]:
    failed = f" at {entry.not_held[0]}" if entry.not_held else ""
    simulated = number(entry.simulated_critical_friction)
    yield f"  {title}: {entry.outcome}{failed}, moved {number(entry.displacement_m)} m"
    yield f"    critical friction {entry.critical_friction:.6g} predicted, {simulated} simulated"
    limit = number(entry.simulated_limit_n)
    yield f"    weakest wrench {entry.limit_n:.6g} N predicted, {limit} simulated"
    if entry.noisy_trials:
        yield f"    with noise {entry.noisy_held} of {entry.noisy_trials} held"
    if (found := entry.execution) is not None:
        lost = f"lost {', '.join(found.lost)}" if found.lost else found.reason
        yield f"    executed: {'survived' if found.survived else lost or 'no trial is possible'}"
        slips = [number(found.predicted_first_slip), number(found.simulated_first_slip)]
        yield f"    first slip {slips[0]} predicted, {slips[1]} simulated"


def number(value: float | None) -> str:
    """Write a measured number to six digits."""
    return "not measured" if value is None else f"{value:.6g}"
