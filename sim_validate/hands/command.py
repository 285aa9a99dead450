"""Runs `reach`, which looks for poses of a hand in grasps, and `hand`, which shows a hand.

Where it is asked to, the hand then holds test wrenches and executes the grasps in simulation, and
poses are written as records of DexGraspBench.
"""

import math
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

from grasp_core.by_value import counted
from grasp_core.figures import NONE, meanings, table
from grasp_core.files.file_kinds import GRASPS, REACHES
from grasp_core.files.records import RecordFile, record_of
from grasp_core.hands.hand import Hand, load_hand
from grasp_core.hands.obstacles import REASONS, SAME_OFF_M
from grasp_core.hands.reach import HandReach
from grasp_core.messages import MILLI
from grasp_core.names import HANDS
from grasp_core.objects.polyhedron import Polyhedron, is_convex
from grasp_core.planning.result import Plan
from grasp_core.solvers.ties import first_best
from scenes.drawing.hands import posed_hand
from scenes.drawing.pictures import Drawing
from scenes.hand_files.building import hand_from_file
from sim_validate.commands.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.execution.verdict import ExecutedGrasp, held_controls_in_words, loss_in_words
from sim_validate.files.output_folders import alone_in
from sim_validate.files.result_files import AboutObject
from sim_validate.files.results_folder import NEAREST_PICTURE, remove_results
from sim_validate.hands import flags as hand_flags
from sim_validate.hands.dexgraspbench import dex_record, write_dex_object, write_dex_record
from sim_validate.hands.reached_grasps import (
    HandTask,
    execution_with,
    reached_grasp,
    with_motors,
)
from sim_validate.hands.reaches import ReachedGrasp, Reaches
from sim_validate.hands.verdict import HandVerdict
from sim_validate.planning.asked_objects import asked_grasps
from sim_validate.processes import workers
from sim_validate.processes.compiling import REACHING, compile_loops, must_compile

Judge: TypeAlias = Callable[[Plan, Hand, Sequence[HandReach]], tuple[Exit, RecordFile]]
"""Judges a hand in its poses by another test; gives the exit code and its results."""


def reach_file(command: hand_flags.Reach, reporter: Reporter, judge: Judge | None = None) -> int:
    """Look for a pose of a hand in each grasp of a file, and write what was found."""
    if command.protocol and not command.trials.simulate:
        raise FlagsError(
            "--protocol judges a hand in simulation: give --simulate too, or leave --protocol out"
        )
    hand = with_motors(asked_hand(command), command.trials, "given on the command line", flags=True)
    chosen = asked_grasps(
        command.grasps, reporter, grasp=command.grasp, friction=command.friction,
        limit=command.limit,
    )  # fmt: skip
    if chosen is None:
        return Exit.NONE
    with alone_in(command.out):
        found = _reach(command, hand, chosen, reporter)
        _show(found, reporter)
        if command.out is not None:
            _draw_nearest(found, chosen, command.out / NEAREST_PICTURE, reporter)
        poses = [each.reach for each in found if each.reach.reached]
        if command.dexgraspbench is not None:
            write_records(command.dexgraspbench, hand, chosen.body, poses, reporter)
        judged, told = (Exit.GOOD, found) if judge is None else judge(chosen, hand, poses)
    reporter.document(told.document())
    show_simulated([each.simulated for each in found if each.simulated is not None], reporter)
    show_executed([each.executed for each in found if each.executed is not None], reporter)
    beside = None if command.out is None else command.out / GRASPS
    if poses and beside is not None and beside.is_file() and command.grasps.samefile(beside):
        folder = shlex.quote(str(command.out))
        reporter.say(f"see the hand in the grasps: graspproof report {folder}")
    elif poses:
        reporter.say(
            f"give the folder of {GRASPS} as --out to have the hand drawn by `graspproof report`"
        )
    return judged if all(each.good for each in found) else Exit.NEGATIVE


def _reach(command: hand_flags.Reach, hand: Hand, saved: Plan, reporter: Reporter) -> Reaches:
    if command.out is not None:
        remove_results(command.out, REACHES)
    simulate = command.trials.simulate and not command.protocol  # which simulate themselves
    execution = execution_with(command.trials, saved.body)
    task = HandTask(command.pose, simulate, execution)
    work = partial(reached_grasp, hand, saved.body, friction=saved.friction, task=task)
    if saved.grasps and must_compile(REACHING, command.jobs):
        reporter.say("compiling inner loops once, which takes a minute or two")
        compile_loops(REACHING)
    settings = None if execution is None else execution.used
    results, count = workers.each(work, saved.grasps, jobs=command.jobs), len(saved.grasps)
    return reporter.collected(
        "reaching", results, count, ("reached", lambda each: each.reach.reached),
        partial(
            Reaches, AboutObject.of(saved.body), saved.friction, hand, command.pose, settings
        ), command.out,
    )  # fmt: skip


def _show(found: Reaches, reporter: Reporter) -> None:
    shown = found.reaches[:TABLE_ROWS]
    columns, rows = table(shown, ReachedGrasp)
    names = [" ".join(found.finger_names(each.reach)) or NONE for each in shown]
    reporter.table(
        f"grasps with the hand {found.hand.name}", (*columns, "fingers"),
        [(*row, name) for row, name in zip(rows, names, strict=True)],
    )  # fmt: skip
    say_cut(len(found), reporter)
    if any(each.payload for each in found):
        reporter.say(f"payload kg: {meanings(ReachedGrasp)['payload_kg']}")
    counts = found.summary
    said = f"{counts['reached']} of {counts['grasps']} grasps were reached"
    stopped = Counter(each.reach.reason for each in found if not each.reach.reached)
    if stopped:
        causes = (f"{REASONS[each]} ({stopped[each]})" for each in REASONS if stopped[each])
        said += f"; what stops the hand in the others: {', '.join(causes)}"
    reporter.say(said)
    if counts["torque"]:
        reporter.say(f"in {counts['torque']} of those reached, the motors are too weak")
    if stopped.keys() - {"no closure"}:
        reporter.say("a pose that was not found may exist: more --starts may find some")
    if unclosed := stopped["no closure"]:
        reporter.say(
            f"{unclosed} have no {len(found.hand.fingers)} contacts that are in force closure "
            "alone, which is proved; more friction may help, and other grasps"
        )
    for each in (one.reach for one in shown if not one.reach.reached):
        reporter.warn(f"{each.grasp}: {each.reason}: {each.explanation}")
    for each in (one for one in shown if one.too_weak):
        reporter.warn(f"{each.id}: torque: {each.too_weak}")


def _draw_nearest(found: Reaches, saved: Plan, path: Path, reporter: Reporter) -> None:
    """Draw the pose that came nearest to a grasp, of all grasps that are not reached."""
    missed = [(each.reach, each.reach.nearest.off_m) for each in found if each.reach.nearest]
    if missed:
        reach, _ = missed[first_best([-off for _, off in missed], SAME_OFF_M)]
        held = posed_hand(found.hand, reach, grasp := saved[reach.grasp])
        Drawing(saved.body, grasp, found.friction, held).sheet(legend=True).write(path)
        reporter.say(f"drew the pose that came nearest, for {grasp.id}: {path}")


def show_simulated(verdicts: Sequence[HandVerdict], reporter: Reporter) -> None:
    """Show what the hand held, the strongest grasp first."""
    if not verdicts:
        return
    ranked = sorted(verdicts, key=lambda verdict: -verdict.weakest_n)
    reporter.records("what the hand holds with its motors, the strongest first", ranked)
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


def show_executed(results: Sequence[ExecutedGrasp], reporter: Reporter) -> None:
    """Show how the executions ended, those that are farthest from a loss first."""
    if not results:
        return
    ranked = sorted(results, key=lambda each: -each.least_predicted_loss)
    reporter.records("grasps executed with the hand", ranked)
    survived = sum(each.survived for each in ranked)
    reporter.say(f"{survived} of {len(ranked)} grasps survived every trial with the hand")
    for each in ranked:
        if each.execution is None:
            reporter.warn(f"{each.id}: not tried: {each.reason}")
            continue
        for sentence in held_controls_in_words(each.execution):
            reporter.warn(f"{each.id}: {sentence}")
        if each.enough is not None:
            reporter.warn(f"{each.id}: {loss_in_words(each.execution)}")


def write_records(
    folder: Path, hand: Hand, body: Polyhedron, poses: Sequence[HandReach], reporter: Reporter
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
    for each in poses:
        record = dex_record(hand, each, str(place.resolve()))
        write_dex_record(record, folder / "graspdata" / f"{each.grasp}.npy")
    reporter.say(f"wrote {counted(len(poses), 'record')} of DexGraspBench to {folder}")


SMALL_RANGE = math.radians(10.0)
"""Fingers whose joints all turn by less hardly open [rad]."""
SHAPES_WEIGH = "MuJoCo gives links without inertia in the file that of their shapes at 1,000 kg/m^3"


def asked_hand(command: hand_flags.ShownHand | hand_flags.Reach) -> Hand:
    """Load the hand that a command names."""
    names = [name.strip() for name in command.fingertips.split(",") if name.strip()]
    if command.hand not in HANDS:
        return hand_from_file(command.hand, names)
    if names:
        raise FlagsError(f"the built-in hand {command.hand} has its own --fingertips")
    return load_hand(command.hand)


def show_hand(command: hand_flags.ShownHand, reporter: Reporter) -> int:
    """Show fingers, joints and fingertips of a hand."""
    hand = asked_hand(command)
    reporter.document(record_of(hand))
    fingers = [
        (
            f.name, str(len(f.links)), f"{MILLI * f.tip.radius:.1f}",
            "ball" if f.tip.corners is None else f"block of {len(f.tip.corners)} corners",
            str(sum(len(link.shapes) for link in f.links)),
        )
        for f in hand.fingers
    ]  # fmt: skip
    reporter.table(
        f"fingers of {hand.name}", ("fingertip", "joints", "radius mm", "kind", "shapes"), fingers
    )
    columns = ("joint", "fingertip", "range deg", "torque limit N m")
    links = [(finger, link.joint) for finger in hand.fingers for link in finger.links]
    joints = [
        (
            joint.name, finger.name, f"{math.degrees(low):.1f} to {math.degrees(high):.1f}",
            "none stated" if joint.torque_limit_n_m is None else f"{joint.torque_limit_n_m:g}",
        )
        for (finger, joint), (low, high) in zip(links, hand.ranges.tolist(), strict=True)
    ]  # fmt: skip
    reporter.table("joints, from the palm outwards", columns, joints)
    reporter.say(f"The palm has {counted(len(hand.palm), 'shape')} that must touch nothing.")
    if hand.ignored_pairs:
        listed = ", ".join(" and ".join(pair) for pair in hand.ignored_pairs)
        reporter.say(f"Links that may overlap, besides neighbours: {listed}.")
    if hand.couplings:
        reporter.say(
            f"Joints that follow others: {', '.join(each.equation for each in hand.couplings)}."
        )
    reporter.say(f"Torque limits: {hand.torque_source}.")
    reporter.say(_weight(hand))
    if all(joint.highest - joint.lowest < SMALL_RANGE for joint in hand.joints):
        reporter.say(
            f"Every joint turns by less than {math.degrees(SMALL_RANGE):g} degrees: MJCF counts "
            'angles in degrees unless it has <compiler angle="radian"/>.'
        )
    for note in hand.notes:
        reporter.say(f"Note: {note}.")
    for source in hand.sources:
        reporter.say(f"Source: {source}.")
    return Exit.GOOD


def _weight(hand: Hand) -> str:
    masses = [link.mass_kg for link in hand.links]
    stated = [mass for mass in masses if mass is not None]
    if len(stated) < len(masses):
        return "Masses of links: unknown; without them gravity does not load the motors."
    said = f"The links of the fingers weigh {1e3 * sum(stated):.3g} g together"
    return said + ("." if hand.name in HANDS else f"; {SHAPES_WEIGH}.")
