"""Holds test wrenches with the hand that `reach` found poses for, and shows what it held."""

from collections.abc import Mapping, Sequence

from grasp_core.errors import InputError
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach, uncoupled
from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.cli import hand_flags
from sim_validate.cli.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.cli.flag_bounds import FlagsError
from sim_validate.hands.hand_verdict import HandVerdict
from sim_validate.hands.jobs import HandJob, held_by_hands

GIVEN = "given on the command line"
COLUMNS = ("grasp", "weakest wrench N", "held", "controls let go")


def with_motors(hand: Hand, command: hand_flags.Reach) -> Hand:
    """Return the hand with the torque limits that the command gives."""
    if command.torque_limit_n_m is not None:
        hand = hand.with_torque_limits(command.torque_limit_n_m, GIVEN)
    if command.protocol and not command.simulate:
        raise FlagsError(
            "--protocol judges a hand in simulation: give --simulate too, or leave --protocol out"
        )
    missing = [joint.name for joint in hand.joints if joint.torque_limit_n_m is None]
    asked = "--simulate" if command.simulate else "--mass-kg"
    if command.simulate or command.mass_kg is not None:
        uncoupled(hand, asked)
    if (command.simulate or command.mass_kg is not None) and missing:
        raise InputError(
            f"{asked} needs a torque limit for each joint, but {hand.name} has none for "
            f"{missing[0]}; give one for all joints with --torque-limit-n-m, or each in the hand's "
            "file (actuatorfrcrange of its joint)"
        )
    return hand


def tries_ours(command: hand_flags.Reach) -> bool:
    """Return whether the hand goes through our own trials, not through those of other tools."""
    return command.simulate and not command.protocol


def simulated(
    command: hand_flags.Reach, hand: Hand, saved: SavedGrasps, found: Sequence[HandReach],
    reporter: Reporter, verdicts: dict[str, HandVerdict],
) -> None:  # fmt: skip
    """Test the hand in each grasp that it reaches, and enter verdicts by the ids of the grasps.

    What is entered stays there if the run is interrupted.
    """
    if not tries_ours(command):
        return
    jobs = [HandJob(hand, saved.body, each, saved.friction) for each in found if each.reached]
    with reporter.progress("simulating") as steps:
        for verdict in held_by_hands(jobs, command.jobs):
            verdicts[verdict.grasp] = verdict
            good = sum(each.good for each in verdicts.values())
            steps.update(len(verdicts), len(jobs), f"({good} held)")


def show_simulated(verdicts: Mapping[str, HandVerdict], reporter: Reporter) -> None:
    """Show what the hand held, the strongest grasp first."""
    if not verdicts:
        return
    ranked = sorted(verdicts.values(), key=lambda verdict: -verdict.weakest_n)
    rows = [_row(verdict) for verdict in ranked[:TABLE_ROWS]]
    reporter.table("what the hand holds with its motors, the strongest first", COLUMNS, rows)
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


def _row(verdict: HandVerdict) -> tuple[str, ...]:
    held = "yes" if verdict.held else f"{len(verdict.failures)} of {len(verdict.wrenches)} not"
    let_go = sum(control.let_go for control in verdict.controls)
    controls = f"{let_go} of {len(verdict.controls)}"
    return verdict.grasp, f"{verdict.weakest_n:.3g}", held, controls
