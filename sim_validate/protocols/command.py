"""Runs `validate`: by our trials, or by published tests, which `reach` also judges hands by."""

from collections.abc import Callable, Sequence
from functools import partial
from operator import call
from pathlib import Path

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.planning.result import Plan
from sim_validate.closure.command import prepared, simulate_grasps
from sim_validate.commands import simulation_flags
from sim_validate.commands.console import TABLE_ROWS, Reporter
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.files.output_folders import alone_in
from sim_validate.files.result_files import AboutObject
from sim_validate.files.results_folder import remove_results
from sim_validate.hands import flags as hand_flags
from sim_validate.hands.command import reach_file
from sim_validate.planning.asked_objects import asked_grasps
from sim_validate.processes import workers
from sim_validate.protocols.judging import attempted, judge_hand_by
from sim_validate.protocols.published import protocol
from sim_validate.protocols.verdict import Judgement, Judgements


def validate_file(command: simulation_flags.ValidateFlags, reporter: Reporter) -> int:
    """Simulate the grasps of a file, or judge them by published tests, and report which hold."""
    chosen = asked_grasps(
        command.grasps, reporter, friction=command.friction, seed=command.seed, limit=command.limit
    )
    if chosen is None:
        return Exit.NONE
    if command.testing.traces and command.out is None:
        raise FlagsError("--traces writes files: give their folder with --out DIR too")
    setup, agenda = prepared(command.testing, chosen.finger, chosen.seed)
    jobs, folder = command.testing.jobs, command.out
    with alone_in(folder):
        if command.protocol:
            cases = [
                partial(attempted, name, chosen.body, grasp, chosen.friction, setup)
                for name in command.protocol
                for grasp in chosen.grasps
            ]
            code, found = judge_cases(cases, chosen, command.protocol, jobs, folder, reporter)
        else:
            code, found = simulate_grasps(
                chosen, setup, agenda, jobs=jobs, folder=folder, reporter=reporter
            )
    reporter.document(found.document())
    return code


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
