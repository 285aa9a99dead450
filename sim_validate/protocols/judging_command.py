"""Judges the grasps of a file, and the poses of hands that `reach` finds, by published tests."""

from collections.abc import Callable, Sequence
from functools import partial
from operator import call
from pathlib import Path

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.planning.result import Plan
from sim_validate.commands.console import TABLE_ROWS, Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.commands.simulation_flags import ValidateFlags
from sim_validate.engine.setup import Setup
from sim_validate.files.result_files import AboutObject
from sim_validate.files.results_folder import remove_results
from sim_validate.hands import flags as hand_flags
from sim_validate.hands.command import reach_file
from sim_validate.processes import workers
from sim_validate.protocols.judging import attempted, judge_hand_by
from sim_validate.protocols.published import protocol
from sim_validate.protocols.verdict import Judgement, Judgements


def judge_grasps(
    command: ValidateFlags, chosen: Plan, setup: Setup, reporter: Reporter
) -> tuple[Exit, Judgements]:
    """Judge grasps by the published tests that are named."""
    cases = [
        partial(attempted, name, chosen.body, grasp, chosen.friction, setup)
        for name in command.protocol
        for grasp in chosen.grasps
    ]
    return judge_cases(cases, chosen, command.protocol, command.testing.jobs, command.out, reporter)


def judge_reach(command: hand_flags.Reach, reporter: Reporter) -> int:
    """Look for poses of a hand in grasps, and judge them by the published tests that are named."""

    def judge(saved: Plan, hand: Hand, found: Sequence[HandReach]) -> tuple[Exit, Judgements]:
        cases = [
            partial(judge_hand_by, name, hand, saved.body, reach, saved.friction)
            for name in command.protocol
            for reach in found
        ]
        return judge_cases(cases, saved, command.protocol, command.jobs, command.out, reporter)

    return reach_file(command, reporter, judge if command.protocol else None)


def judge_cases(
    cases: Sequence[Callable[[], Judgement]], saved: Plan, names: Sequence[str], jobs: int,
    folder: Path | None, reporter: Reporter,
) -> tuple[Exit, Judgements]:  # fmt: skip
    """Run published tests; return the exit code and the judgements."""
    if folder:
        remove_results(folder, Judgements.FILE)
    found = workers.each(call, cases, jobs=jobs)
    tests = {name: protocol(name) for name in names}
    collect = partial(Judgements, AboutObject.of(saved.body), saved.friction, tests)
    done = reporter.collected(
        "judging", found, len(cases), ("passed", lambda one: one.theirs), collect, folder
    )
    _show(done, reporter)
    good = all(one.good for one in done.judgements)
    return (Exit.GOOD if good else Exit.NEGATIVE), done


def _show(found: Judgements, reporter: Reporter) -> None:
    reporter.records("judged by published tests", found.judgements)
    reporter.records("in all", [*found.summary.values()])
    for each in found.judgements[:TABLE_ROWS]:
        about = f"{each.grasp}: {each.protocol}"
        for run in [run for run in each.runs if not run.passed][:1]:
            reporter.warn(f"{about}: run {run.number}: {run.reason}")
        if not each.ours.held:
            reporter.warn(f"{about}: ours: {each.ours.reason}")
