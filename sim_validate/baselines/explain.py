"""Explains in words why a grasp is not as stable as it must be, and how to look at it."""

import shlex
from collections.abc import Iterator
from pathlib import Path

from sim_validate.baselines.compare import Finding
from sim_validate.baselines.entries import Entry
from sim_validate.baselines.executions import not_survived
from sim_validate.execution.jobs import ExecutedGrasp
from sim_validate.validation.grasp_verdict import Verdict
from sim_validate.validation.wrench_verdict import WrenchVerdict


def explained(
    finding: Finding, verdict: Verdict | None, files: tuple[Path, Path], how: str,
    executed: ExecutedGrasp | None = None,
) -> str:  # fmt: skip
    """Explain how a grasp has changed: prediction, simulation, baseline, and commands to run next.

    Args:
        finding: How the grasp has changed.
        verdict: The verdict measured now, or None if the grasp could not be simulated.
        files: Paths of the baseline and the grasps.
        how: How results were compared, in words.
        executed: The execution measured now; None if the grasp was not executed.
    """
    lines = [f"{finding.id}: {finding.status.value}", *(f"  {why}" for why in finding.reasons)]
    lines += [f"  {text}" for text in finding.differences if text not in finding.reasons]
    lines += [f"  compared {how}"] if how else []
    for title, entry in (("baseline", finding.before), ("now", finding.after)):
        lines += [] if entry is None else _numbers(title, entry)
    failed = verdict.failures[0] if verdict is not None and verdict.failures else None
    if failed is not None:
        lines.append(f"  first wrench that was not held: {in_words(failed)}")
    lines += [f"  {not_survived(executed)}"] if executed and not_survived(executed) else []
    baseline, grasps = (shlex.quote(str(path)) for path in files)
    if verdict is not None:
        chosen = "" if failed is None else f" --wrench={shlex.quote(failed.name)}"
        which = f"--grasp {shlex.quote(finding.id)}{chosen} --grasps {grasps}"
        lines.append(f"  to see it: graspproof replay {baseline} {which} --out replay")
    lines.append(f"  all of them: graspproof baseline check {baseline} --grasps {grasps}")
    return "\n".join(lines)


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
