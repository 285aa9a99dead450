"""The commands about baselines: to record one, and to check whether stability has changed."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from grasp_core.records import SavedGrasps, grasps_from_json
from sim_validate import baseline_flags, cli
from sim_validate.baselines.baseline_file import baseline_from_json, baseline_to_json
from sim_validate.baselines.comparing import Finding, Status, compare, failing
from sim_validate.baselines.junit import junit_text
from sim_validate.baselines.measuring import measured, of_settings, seen_from, setup_for
from sim_validate.console import TABLE_ROWS, Reporter
from sim_validate.files import read_text, write_text
from sim_validate.plan_command import say_cut
from sim_validate.setup import Agenda
from sim_validate.setup_file import setup_from_file
from sim_validate.validate_command import noise_of
from sim_validate.wrench_file import wrenches_from_file


def record_baseline(command: baseline_flags.Record, reporter: Reporter) -> int:
    """Write a baseline."""
    saved = _read(command.grasps, command.limit)
    setup = setup_for(saved, command.setup)
    agenda = Agenda(
        random_wrenches=command.random_wrenches,
        wrenches=() if command.wrenches is None else wrenches_from_file(command.wrenches),
        limits=command.limits,
        trials=command.repeats.trials,
        noise=noise_of(command.repeats),
        seed=saved.seed if command.seed is None else command.seed,
    )
    where = seen_from(command.out, command.grasps)
    with reporter.progress("simulating") as steps:
        done = measured(saved, where, setup, agenda, command.jobs, steps.update)
    found = done.baseline
    write_text(command.out, baseline_to_json(found))
    held = sum(entry.held for entry in found.entries)
    reporter.say(f"wrote {command.out}: {held} of {len(found.entries)} grasps held")
    reporter.document({"baseline": str(command.out), "grasps": len(found.entries), "held": held})
    return cli.Exit.GOOD


def check_baseline(command: baseline_flags.Check, reporter: Reporter) -> int:
    """Say what became of the grasps of a baseline."""
    before = baseline_from_json(read_text(command.baseline), str(command.baseline))
    path = command.grasps or command.baseline.parent / before.grasps_file
    saved = _read(path)
    setup, agenda = of_settings(before.settings, str(command.baseline))
    if command.setup is not None:
        setup = setup_from_file(command.setup, setup)
    with reporter.progress("simulating") as steps:
        done = measured(saved, before.grasps_file, setup, agenda, command.jobs, steps.update)
    after = done.baseline
    findings = compare(before, after)
    if command.junit is not None:
        text = junit_text(str(command.baseline), findings, strict=command.strict)
        write_text(command.junit, text)
    _show(findings, reporter)
    if command.bless:
        write_text(command.baseline, baseline_to_json(after))
        reporter.say(f"wrote {command.baseline}")
        return cli.Exit.GOOD
    return exit_code(findings, strict=command.strict)


def exit_code(findings: Sequence[Finding], *, strict: bool) -> int:
    """1 if a grasp fails the check, 4 if one cannot be compared, else 0."""
    came = {finding.status for finding in findings}
    if came & {*failing(strict=strict)}:
        return cli.Exit.NEGATIVE
    return cli.Exit.INPUT if Status.NOT_COMPARABLE in came else cli.Exit.GOOD


def _read(path: Path, limit: int | None = None) -> SavedGrasps:
    saved = grasps_from_json(read_text(path))
    return SavedGrasps(saved.body, saved.friction, saved.seed, saved.grasps[:limit], saved.finger)


def _show(findings: Sequence[Finding], reporter: Reporter) -> None:
    told = [finding for finding in findings if finding.status is not Status.SAME]
    rows = [(each.id, each.status.value, "; ".join(each.reasons)) for each in told]
    if rows:
        reporter.table("what became of grasps", ("grasp", "status", "why"), rows[:TABLE_ROWS])
        say_cut(len(rows), reporter)
    counts = Counter(finding.status.value for finding in findings)
    reporter.say(", ".join(f"{count} {name}" for name, count in sorted(counts.items())))
    reporter.document(
        {"counts": dict(counts), "grasps": [_record(finding) for finding in findings]}
    )


def _record(finding: Finding) -> dict[str, object]:
    return {
        "id": finding.id,
        "status": finding.status.value,
        "reasons": list(finding.reasons),
        "before": None if finding.before is None else asdict(finding.before),
        "after": None if finding.after is None else asdict(finding.after),
    }
