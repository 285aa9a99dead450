"""Runs the command `reach`, which looks for poses in which a hand stands in grasps."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

from grasp_core.execution.carrying_hand import HandPayload
from grasp_core.files.text_files import write_text
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.cli import hand_flags
from sim_validate.cli.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.cli.exit_codes import Exit
from sim_validate.commands.asked.grasps import chosen_grasps, saved_grasps
from sim_validate.commands.hands.carried import COLUMN, carried, say_what_it_means
from sim_validate.commands.hands.executed import executed, show_executed
from sim_validate.commands.hands.hand import asked_hand
from sim_validate.commands.hands.records import write_records
from sim_validate.commands.hands.simulated import (
    show_simulated,
    simulated,
    tries_ours,
    with_motors,
)
from sim_validate.commands.judging.by_protocols import judge_hands
from sim_validate.files.folder_lock import alone_in
from sim_validate.files.stale_results import REACHES, remove_reaches
from sim_validate.hands.execute_hand import hand_execution_settings
from sim_validate.parallel.compiling import REACHING, compile_loops, must_compile
from sim_validate.parallel.reaching import ReachJob, reached
from sim_validate.records.grasps import grasp_with_id
from sim_validate.records.reaches_json import HandTrials, reaches_summary, reaches_to_json
from sim_validate.records.reaches_schema import AskedRecord
from sim_validate.reports.run_folder import GRASPS

ABSENT = "-"


def reach_file(command: hand_flags.Reach, reporter: Reporter) -> int:
    """Look for a pose of a hand in each grasp of a file, and write what was found."""
    hand = with_motors(asked_hand(command), command)
    saved = saved_grasps(command.grasps, reporter)
    if saved is None:
        return Exit.NONE
    if command.grasp is not None:
        saved = replace(saved, grasps=(grasp_with_id(command.grasps, saved, command.grasp),))
    chosen = chosen_grasps(saved, friction=command.friction, seed=None, limit=command.limit)
    with alone_in(command.out):
        found, tried, text = _reach(command, hand, chosen, reporter)
        _show(hand, found, tried.payloads, reporter)
        if command.dexgraspbench is not None:
            write_records(command.dexgraspbench, hand, chosen.body, found, reporter)
        judged = Exit.GOOD
        if command.protocol:
            judged, text = judge_hands(
                chosen, hand, found, command.protocol, seed=command.seed, jobs=command.jobs,
                folder=command.out, reporter=reporter,
            )  # fmt: skip
    reporter.text(text)
    show_simulated(tried.verdicts, reporter)
    show_executed(tried.executions, reporter)
    if any(each.reached for each in found):
        say_where_to_look(command, reporter)
    results = (*tried.verdicts.values(), *tried.executions.values())
    good = all(each.reached for each in found) and all(each.good for each in results)
    return judged if good else Exit.NEGATIVE


def _reach(
    command: hand_flags.Reach, hand: Hand, saved: SavedGrasps, reporter: Reporter
) -> tuple[list[HandReach], HandTrials, str]:
    """Look for poses, try them, and write what is done even if the run is interrupted."""
    if command.out is not None:
        remove_reaches(command.out)
    jobs = [
        ReachJob(
            hand, saved.body, grasp, saved.friction, command.seed, not command.contacts_only,
            command.table, command.clearance_m, command.starts,
        )
        for grasp in saved.grasps
    ]  # fmt: skip
    asked: AskedRecord = {
        "regions": not command.contacts_only,
        "table_down": command.table,
        "clearance_m": command.clearance_m,
        "starts": command.starts,
        "seed": command.seed,
    }
    if command.mass_kg is not None:
        asked["execution"] = asdict(hand_execution_settings(command.mass_kg).used)
    found: list[HandReach] = []
    tried = HandTrials()
    if jobs and must_compile(REACHING, command.jobs):
        reporter.say("compiling inner loops once, which takes a minute or two")
        compile_loops(REACHING)
    try:
        with reporter.progress("reaching") as steps:
            for each in reached(jobs, command.jobs):
                found.append(each)
                good = sum(one.reached for one in found)
                steps.update(len(found), len(jobs), f"({good} reached)")
        tried.payloads.update(carried(hand, saved, found))
        simulated(command, hand, saved, found, reporter, tried.verdicts)
        executed(command, hand, saved, found, reporter, tried.executions)
    finally:
        complete = len(found) == len(jobs) and _all_tried(command, found, tried)
        text = reaches_to_json(
            hand, saved.body, saved.friction, asked, found, complete=complete,
            grasps=saved.grasps, tried=tried,
        )  # fmt: skip
        if command.out is not None and found:
            path = write_text(command.out / REACHES, text)
            reporter.say(f"wrote {path}" if complete else f"wrote what is done to {path}")
    return found, tried, text


def _all_tried(command: hand_flags.Reach, found: Sequence[HandReach], tried: HandTrials) -> bool:
    """Return whether all that was asked for was done in each grasp that is reached."""
    reached = sum(each.reached for each in found)
    held = len(tried.verdicts) == reached or not tries_ours(command)
    return held and (len(tried.executions) == reached or command.mass_kg is None)


def _show(
    hand: Hand, found: Sequence[HandReach], payloads: Mapping[str, HandPayload], reporter: Reporter
) -> None:
    shown = found[:TABLE_ROWS]
    columns = ("grasp", "reached", "fingers", "starts", "opens", "straight way in")
    rows = [_row(hand, each) for each in shown]
    if payloads:
        columns = (*columns, COLUMN)
        masses = (payloads.get(each.grasp) for each in shown)
        cells = (ABSENT if mass is None else f"{mass.lower:.3g}" for mass in masses)
        rows = [(*row, cell) for row, cell in zip(rows, cells, strict=True)]
    reporter.table(f"grasps with the hand {hand.name}", columns, rows)
    say_cut(len(found), reporter)
    say_what_it_means(payloads, reporter)
    counts = reaches_summary(found, complete=True)
    said = f"{counts['reached']} of {counts['grasps']} grasps were reached"
    if counts["collision"] + counts["limit"] + counts["not_found"]:
        said += (
            f"; of the others {counts['collision']} met a collision, {counts['limit']} a joint's "
            f"limit, and for {counts['not_found']} no pose was found; more --starts may find some"
        )
    reporter.say(said)
    if unclosed := counts.get("no_closure"):
        reporter.say(
            f"{unclosed} have no {len(hand.fingers)} contacts that are in force closure alone, "
            "which is proved; more friction may help, and other grasps"
        )
    for each in shown:
        if not each.reached:
            reporter.warn(f"{each.grasp}: {each.reason}: {each.explanation}")


def say_where_to_look(command: hand_flags.Reach, reporter: Reporter) -> None:
    """Say which command draws the hand in the grasps, where their file is beside the poses."""
    out = command.out
    if out is None or not (out / GRASPS).is_file() or not command.grasps.samefile(out / GRASPS):
        reporter.say(
            f"give the folder of {GRASPS} as --out to have the hand drawn by `graspproof report`"
        )
        return
    reporter.say(f"see the hand in the grasps: graspproof report {shlex.quote(str(out))}")


def _row(hand: Hand, each: HandReach) -> tuple[str, ...]:
    if each.fingers is None:
        return (each.grasp, "no", ABSENT, str(each.starts), ABSENT, ABSENT)
    names = " ".join(hand.fingers[int(finger)].name for finger in each.fingers)
    yes = ("yes" if value is not None else "no" for value in (each.pregrasp, each.approach))
    return (each.grasp, "yes", names, str(each.starts), *yes)
