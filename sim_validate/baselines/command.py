"""Runs `baseline record` and `baseline check`, which tell when the stability of grasps changes."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from grasp_core.files.records import record_of
from grasp_core.records.grasps_json import load_grasps
from grasp_core.settings import extended
from sim_validate.baselines import flags as baseline_flags
from sim_validate.baselines.baseline import How, check_writable, read_baseline
from sim_validate.baselines.check import Checked, check, measured, setup_for
from sim_validate.baselines.compare import Finding, Status, failing
from sim_validate.baselines.part import Present, present
from sim_validate.closure.command import check_noise
from sim_validate.commands.console import TABLE_ROWS, Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.engine.setup import Agenda, setup_from_file, wrenches_from_file


def record_baseline(command: baseline_flags.Record, reporter: Reporter) -> int:
    """Simulate grasps and write the results as a baseline, to compare later results with."""
    check_writable(command.out)
    saved = load_grasps(command.grasps)
    where = [command.out.parent]
    now = present(saved, command.grasps, where, command.changed_part, command.object)
    check_noise(command.more)
    wrenches = () if command.wrenches is None else wrenches_from_file(command.wrenches)
    seed = saved.seed if command.seed is None else command.seed
    agenda = extended(Agenda, command.more, wrenches=wrenches, seed=seed)
    how, files = How(setup_for(saved, command.setup), agenda), (command.out, command.grasps)
    with reporter.progress("simulating") as steps:
        done = measured(now, files, command.limit, how, command.jobs, steps.update)
    found = done.bless()
    held = sum(entry.held for entry in found.entries)
    reporter.say(f"wrote {command.out}: {held} of {len(found.entries)} grasps held")
    _say_mesh(now, reporter)
    reporter.document({"baseline": str(command.out), "grasps": len(found.entries), "held": held})
    return Exit.GOOD


def check_baseline(command: baseline_flags.Check, reporter: Reporter) -> int:
    """Simulate the grasps of a baseline again and report how each result differs."""
    before = read_baseline(command.baseline)
    path = command.grasps or command.baseline.parent / before.grasps_file
    saved = load_grasps(path)
    asked = command.changed_part.with_scale(before.scale)
    now = present(saved, path, [command.baseline.parent], asked, command.object).against(before)
    how = before.settings
    if command.setup is not None:
        how = replace(how, setup=setup_from_file(command.setup, how.setup))
    with reporter.progress("simulating") as steps:
        done = check(before, now, (command.baseline, path), how, command.jobs, steps.update)
    _show(done, reporter)
    _say_mesh(now, reporter)
    if command.bless:
        done.measured.bless()
        reporter.say(f"wrote {command.baseline}")
        return Exit.GOOD
    return exit_code(done.findings, strict=command.strict)


def _say_mesh(now: Present, reporter: Reporter) -> None:
    """Say what must be known about the mesh that was tested, and which grasps it lost."""
    if now.note:
        reporter.say(now.note)
    for name, why in list(now.gone.items())[:TABLE_ROWS]:
        reporter.say(f"{name} is gone: {why}")


def exit_code(findings: Sequence[Finding], *, strict: bool) -> int:
    """Return 1 if a grasp fails the check, 4 if a grasp cannot be compared, else 0."""
    came = {finding.status for finding in findings}
    if came & {*failing(strict=strict)}:
        return Exit.NEGATIVE
    return Exit.INPUT if Status.NOT_COMPARABLE in came else Exit.GOOD


def _show(done: Checked, reporter: Reporter) -> None:
    differing = [finding for finding in done.findings if finding.status is not Status.SAME]
    reporter.records("grasps that differ from the baseline", differing)
    counts = Counter(finding.status.value for finding in done.findings)
    reporter.say(", ".join(f"{count} {name}" for name, count in sorted(counts.items())))
    reporter.say(f"compared {done.how}")
    listed = [record_of(finding) for finding in done.findings]
    reporter.document({"counts": dict(counts), "compared": done.how, "grasps": listed})
