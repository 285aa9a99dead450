"""Runs the command `reach`, which looks for poses in which a hand stands in grasps.

Where it is asked to, the hand then holds test wrenches and executes the grasps in simulation, and
poses are written as records of DexGraspBench.
"""

import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from operator import call
from pathlib import Path
from typing import TypeAlias

from grasp_core.declared import counted
from grasp_core.errors import InputError, SolverError
from grasp_core.execution.carried_mass import HandPayload
from grasp_core.files.text_files import write_text
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import hand_payload
from grasp_core.hands.reach import HandReach, reach_with, uncoupled
from grasp_core.objects.polyhedron import Polyhedron, is_convex
from grasp_core.planning.result import Plan
from sim_validate.engine.setup import Agenda
from sim_validate.execution.verdict import (
    ExecutedGrasp,
    Execution,
    held_controls_in_words,
    loss_in_words,
)
from sim_validate.hands import flags as hand_flags
from sim_validate.hands.dexgraspbench import dex_record, write_dex_object, write_dex_record
from sim_validate.hands.execute_hand import executed_by_hand, hand_execution_settings
from sim_validate.hands.hand_command import asked_hand
from sim_validate.hands.reaches_json import (
    AskedRecord,
    HandTrials,
    reaches_summary,
    reaches_to_json,
)
from sim_validate.hands.validate_hand import MOST_PUSH_N, HandVerdict, validate_hand
from sim_validate.kit import processes
from sim_validate.kit.compiling import REACHING, compile_loops, must_compile
from sim_validate.kit.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.kit.exit_codes import Exit, FlagsError
from sim_validate.kit.result_folders import REACHES, alone_in, remove_results
from sim_validate.planning.asked_objects import asked_grasps
from sim_validate.planning.grasps_json import GRASPS

ABSENT = "-"
HELD = Agenda(critical_friction=False)
"""What hands hold: the usual wrenches, with controls."""
PAYLOAD = "payload kg"
HELD_COLUMNS = ("grasp", "weakest wrench N", "held", "controls let go")
EXECUTED_COLUMNS = ("grasp", "survived", "least predicted loss", PAYLOAD, "controls let go")


Judge: TypeAlias = Callable[[Plan, Hand, Sequence[HandReach]], tuple[Exit, str]]
"""Judges a hand in its poses by another test; gives the exit code and the text of its results."""


def reach_file(command: hand_flags.Reach, reporter: Reporter, judge: Judge | None = None) -> int:
    """Look for a pose of a hand in each grasp of a file, and write what was found."""
    hand = with_motors(asked_hand(command), command)
    chosen = asked_grasps(
        command.grasps, reporter, grasp=command.grasp, friction=command.friction,
        limit=command.limit,
    )  # fmt: skip
    if chosen is None:
        return Exit.NONE
    with alone_in(command.out):
        found, tried, text = _reach(command, hand, chosen, reporter)
        _show(hand, found, tried.payloads, reporter)
        if command.dexgraspbench is not None:
            write_records(command.dexgraspbench, hand, chosen.body, found, reporter)
        judged = Exit.GOOD
        if judge is not None:
            judged, text = judge(chosen, hand, found)
    reporter.text(text)
    show_simulated(tried.verdicts, reporter)
    show_executed(tried.executions, reporter)
    if any(one.reached for one in found):
        say_where_to_look(command, reporter)
    good = all(one.reached for one in found) and all(one.good for one in tried.verdicts.values())
    good &= all(one.survived and one.controls_let_go for one in tried.executions.values())
    return judged if good else Exit.NEGATIVE


def _reach(
    command: hand_flags.Reach, hand: Hand, saved: Plan, reporter: Reporter
) -> tuple[list[HandReach], HandTrials, str]:
    if command.out is not None:
        remove_results(command.out, "reaches")
    asked: AskedRecord = {
        "regions": not command.contacts_only, "table_down": command.table,
        "clearance_m": command.clearance_m, "starts": command.starts, "seed": command.seed,
    }  # fmt: skip
    look = partial(reach_with, hand, saved.body, friction=saved.friction, **asked)
    if command.mass_kg is not None:
        asked["execution"] = asdict(hand_execution_settings(command.mass_kg).used)
    found, tried = list[HandReach](), HandTrials()
    if saved.grasps and must_compile(REACHING, command.jobs):
        reporter.say("compiling inner loops once, which takes a minute or two")
        compile_loops(REACHING)
    try:
        results, count = processes.each(look, saved.grasps, jobs=command.jobs), len(saved.grasps)
        for one in reporter.counted("reaching", results, count, "reached", lambda one: one.reached):
            found.append(one)
        stood = [one for one in found if one.reached]
        tried.payloads.update(carried(hand, saved, stood))
        _try(command, hand, saved, stood, tried, reporter)
    finally:
        stands = sum(one.reached for one in found)
        held = len(tried.verdicts) == stands or not tries_ours(command)
        lifted = len(tried.executions) == stands or command.mass_kg is None
        complete = len(found) == len(saved.grasps) and held and lifted
        text = reaches_to_json(
            hand, saved.body, saved.friction, asked, found, complete=complete,
            grasps=saved.grasps, tried=tried,
        )  # fmt: skip
        if command.out is not None and found:
            path = write_text(command.out / REACHES, text)
            reporter.say(f"wrote {path}" if complete else f"wrote what is done to {path}")
    return found, tried, text


def _show(
    hand: Hand, found: Sequence[HandReach], payloads: Mapping[str, HandPayload], reporter: Reporter
) -> None:
    shown = found[:TABLE_ROWS]
    columns = ("grasp", "reached", "fingers", "starts", "opens", "straight way in")
    rows = [_row(hand, each) for each in shown]
    if payloads:
        columns = (*columns, PAYLOAD)
        masses = (payloads.get(each.grasp) for each in shown)
        cells = (ABSENT if mass is None else f"{mass.lower:.3g}" for mass in masses)
        rows = [(*row, cell) for row, cell in zip(rows, cells, strict=True)]
    reporter.table(f"grasps with the hand {hand.name}", columns, rows)
    say_cut(len(found), reporter)
    if payloads:
        reporter.say(
            f"{PAYLOAD}: the largest mass that the motors hold whichever way the hand is turned, "
            "their links included, with forces chosen anew for each orientation"
        )
    counts = reaches_summary(found, complete=True)
    said = f"{counts['reached']} of {counts['grasps']} grasps were reached"
    if counts["collision"] + counts["limit"] + counts["not_found"]:
        said += (
            f"; of the others {counts['collision']} met a collision, {counts['limit']} a joint's "
            f"limit, and for {counts['not_found']} no pose was found; more --starts may find some"
        )
    reporter.say(said)
    if unclosed := counts["no_closure"]:
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


def carried(hand: Hand, saved: Plan, found: Sequence[HandReach]) -> dict[str, HandPayload]:
    """Find the largest mass in any orientation, by the ids of the grasps that are reached.

    There is none for a hand whose motors or links are not known well enough, and for grasps in
    which motors cannot carry their links.
    """
    unknown = any(link.mass_kg is None or link.center_of_mass is None for link in hand.links)
    if unknown or any(joint.torque_limit_n_m is None for joint in hand.free_joints):
        return {}
    payloads = dict[str, HandPayload]()
    for reach in found:
        # a figure beside the poses, which are there without it
        with suppress(InputError, SolverError):
            payloads[reach.grasp] = hand_payload(
                hand, saved.body, reach, saved.friction, max_push_n=MOST_PUSH_N
            )
    return payloads


def with_motors(hand: Hand, command: hand_flags.Reach) -> Hand:
    """Return the hand with the torque limits that the command gives."""
    if command.torque_limit_n_m is not None:
        hand = hand.with_torque_limits(command.torque_limit_n_m, "given on the command line")
    if command.protocol and not command.simulate:
        raise FlagsError(
            "--protocol judges a hand in simulation: give --simulate too, or leave --protocol out"
        )
    if command.simulate or command.mass_kg is not None:
        asked = "--simulate" if command.simulate else "--mass-kg"
        uncoupled(hand, asked)
        missing = [joint.name for joint in hand.joints if joint.torque_limit_n_m is None]
        if missing:
            raise InputError(
                f"{asked} needs a torque limit for each joint, but {hand.name} has none for "
                f"{missing[0]}; give one for all joints with --torque-limit-n-m, or each in the "
                "hand's file (actuatorfrcrange of its joint)"
            )
    return hand


def tries_ours(command: hand_flags.Reach) -> bool:
    """Return whether the hand goes through our own trials, not through those of other tools."""
    return command.simulate and not command.protocol


def _try(
    command: hand_flags.Reach, hand: Hand, saved: Plan, found: Sequence[HandReach],
    tried: HandTrials, reporter: Reporter,
) -> None:  # fmt: skip
    """Simulate and execute what the hand reaches; what is entered by then outlasts an interrupt."""
    if tries_ours(command):
        held = [
            partial(validate_hand, hand, saved.body, reach, saved.friction, agenda=HELD)
            for reach in found
        ]
        verdicts, count = processes.each(call, held, jobs=command.jobs), len(held)
        for one in reporter.counted("simulating", verdicts, count, "held", lambda one: one.good):
            tried.verdicts[one.grasp] = one
    if command.mass_kg is not None:
        settings = hand_execution_settings(command.mass_kg)
        executed = [
            partial(executed_by_hand, hand, saved.body, reach, saved.friction, settings)
            for reach in found
        ]
        results, count = processes.each(call, executed, jobs=command.jobs), len(executed)
        for one in reporter.counted(
            "executing", results, count, "survived", lambda one: one.survived
        ):
            tried.executions[one.id] = one


def show_simulated(verdicts: Mapping[str, HandVerdict], reporter: Reporter) -> None:
    """Show what the hand held, the strongest grasp first."""
    if not verdicts:
        return
    ranked = sorted(verdicts.values(), key=lambda verdict: -verdict.weakest_n)
    rows = [
        (
            each.grasp, f"{each.weakest_n:.3g}",
            "yes" if each.held else f"{len(each.failures)} of {len(each.wrenches)} not",
            f"{sum(one.let_go for one in each.controls)} of {len(each.controls)}",
        )
        for each in ranked[:TABLE_ROWS]
    ]  # fmt: skip
    reporter.table("what the hand holds with its motors, the strongest first", HELD_COLUMNS, rows)
    say_cut(len(ranked), reporter)
    held = sum(verdict.held for verdict in ranked)
    controls = [control for verdict in ranked for control in verdict.controls]
    let_go = sum(control.let_go for control in controls)
    reporter.say(
        f"{held} of {len(ranked)} hands held all wrenches, at 80 % of what they resist; "
        f"{let_go} of {len(controls)} negative controls were let go (all should)"
    )
    for verdict in ranked:
        for sentence in verdict.mismatches:
            reporter.warn(f"{verdict.grasp}: {sentence}")


def show_executed(results: Mapping[str, ExecutedGrasp], reporter: Reporter) -> None:
    """Show how the executions ended, those that are farthest from a loss first."""
    if not results:
        return
    ranked = sorted(results.values(), key=lambda each: -each.least_predicted_loss)
    rows = [_executed_row(each.id, each.execution) for each in ranked[:TABLE_ROWS]]
    reporter.table("grasps executed with the hand", EXECUTED_COLUMNS, rows)
    say_cut(len(ranked), reporter)
    survived = sum(each.survived for each in ranked)
    reporter.say(f"{survived} of {len(ranked)} grasps survived every trial with the hand")
    for each in ranked:
        if each.execution is None:
            reporter.warn(f"{each.id}: {each.reason}")
            continue
        for sentence in held_controls_in_words(each.execution):
            reporter.warn(f"{each.id}: {sentence}")
        if each.enough is not None:
            reporter.warn(f"{each.id}: {loss_in_words(each.execution)}")


def _executed_row(grasp: str, found: Execution | None) -> tuple[str, ...]:
    if found is None:
        return grasp, "not tried", ABSENT, ABSENT, ABSENT
    kept = sum(trial.survived for trial in found.trials)
    let_go = sum(control.let_go for control in found.controls)
    return (
        grasp, f"{kept} of {len(found.trials)}", f"{found.least_predicted_loss:.3g}",
        f"{found.payload_kg:.3g}", f"{let_go} of {len(found.controls)}",
    )  # fmt: skip


def write_records(
    folder: Path, hand: Hand, body: Polyhedron, found: Sequence[HandReach], reporter: Reporter
) -> None:
    """Write a record for each grasp that is reached, and the object if it is convex."""
    place = folder / "object"
    if is_convex(body):
        write_dex_object(body, place)
    else:
        reporter.warn(
            f"{body.name} is not convex: let MeshProcess write {place} from its mesh, as "
            "DexGraspBench simulates convex pieces"
        )
    reached = [each for each in found if each.reached]
    for each in reached:
        record = dex_record(hand, each, str(place.resolve()))
        write_dex_record(record, folder / "graspdata" / f"{each.grasp}.npy")
    reporter.say(f"wrote {counted(len(reached), 'record')} of DexGraspBench to {folder}")
