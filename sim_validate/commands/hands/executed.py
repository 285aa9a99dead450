"""Executes the grasps that a hand reaches with that hand, and shows how the trials ended."""

from collections.abc import Mapping, Sequence

from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.cli import hand_flags
from sim_validate.cli.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.execution.verdict import (
    Execution,
    held_controls_in_words,
    loss_in_words,
)
from sim_validate.hands.execute_hand import hand_execution_settings
from sim_validate.hands.jobs import ExecutedHand, HandJob, executed_by_hands

COLUMNS = ("grasp", "survived", "least predicted loss", "payload kg", "controls let go")
ABSENT = "-"


def executed(
    command: hand_flags.Reach, hand: Hand, saved: SavedGrasps, found: Sequence[HandReach],
    reporter: Reporter, results: dict[str, ExecutedHand],
) -> None:  # fmt: skip
    """Execute each grasp that the hand reaches, and enter what is found by the ids of the grasps.

    What is entered stays there if the run is interrupted.
    """
    if command.mass_kg is None:
        return
    settings = hand_execution_settings(command.mass_kg)
    jobs = [
        HandJob(hand, saved.body, each, saved.friction, settings) for each in found if each.reached
    ]
    with reporter.progress("executing") as steps:
        for each in executed_by_hands(jobs, command.jobs):
            results[each.grasp] = each
            kept = sum(one.survived for one in results.values())
            steps.update(len(results), len(jobs), f"({kept} survived)")


def show_executed(results: Mapping[str, ExecutedHand], reporter: Reporter) -> None:
    """Show how the executions ended, those that are farthest from a loss first."""
    if not results:
        return
    ranked = sorted(results.values(), key=lambda each: -each.least_predicted_loss)
    rows = [_row(each.grasp, each.execution) for each in ranked[:TABLE_ROWS]]
    reporter.table("grasps executed with the hand", COLUMNS, rows)
    say_cut(len(ranked), reporter)
    survived = sum(each.survived for each in ranked)
    reporter.say(f"{survived} of {len(ranked)} grasps survived every trial with the hand")
    for each in ranked:
        if each.execution is None:
            reporter.warn(f"{each.grasp}: {each.refused}")
            continue
        for sentence in held_controls_in_words(each.execution):
            reporter.warn(f"{each.grasp}: {sentence}")
        if each.enough is not None:
            reporter.warn(f"{each.grasp}: {loss_in_words(each.execution)}")


def _row(grasp: str, found: Execution | None) -> tuple[str, ...]:
    if found is None:
        return grasp, "not tried", ABSENT, ABSENT, ABSENT
    kept = sum(trial.survived for trial in found.trials)
    let_go = sum(control.let_go for control in found.controls)
    return (
        grasp, f"{kept} of {len(found.trials)}", f"{found.least_predicted_loss:.3g}",
        f"{found.payload_kg:.3g}", f"{let_go} of {len(found.controls)}",
    )  # fmt: skip
