"""Says where a hand stands in grasps, or why not, on cards and on the pages about grasps."""

import shlex
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from grasp_core.declared import counted
from grasp_core.figures import figures
from grasp_core.files.records import record_of
from grasp_core.hands.named_hands import HANDS
from grasp_core.values import Grasp
from scenes.drawing.hands import PosedHand, posed_hand
from scenes.drawing.pages import number
from sim_validate.report.agreement import BAD, GOOD, QUIET, Record

if TYPE_CHECKING:
    from sim_validate.hands.reaches import ReachedGrasp, Reaches

Fact = tuple[str, str, str]
"""Name, value and meaning of a figure."""
REASONS = {
    "collision": "a collision",
    "limit": "a joint's limit",
    "not found": "no pose found",
    "no closure": "no three contacts close",
}
"""Words for what was in the way."""
FINGERS = "that touch at the grasp's contacts, by finger of the grasp"
SAID_ABOVE = ("grasp", "id")
"""Figures that the page has in its title."""
FLAGS = {"starts": "--starts", "seed": "--seed", "clearance_m": "--clearance-m"}
"""Flags of `graspproof reach` for what may be asked of a pose."""


def held_in(reaches: "Reaches | None", grasp: Grasp) -> PosedHand | None:
    """Return the hand in the pose in which it stands in a grasp."""
    found = reach_of(reaches, grasp)
    if reaches is None or found is None or not found.reach.reached:
        return None
    return posed_hand(reaches.hand, found.reach, grasp)


def reach_of(reaches: "Reaches | None", grasp: Grasp) -> "ReachedGrasp | None":
    """Return what was found for a grasp; None where no hand was asked for."""
    return None if reaches is None or grasp.id not in reaches else reaches[grasp.id]


def why_not_held(reaches: "Reaches", grasp: Grasp) -> str:
    """Say why there is no hand to draw in a grasp."""
    found = reach_of(reaches, grasp)
    if found is None:
        return f"reaches.json holds nothing about {grasp.id}; `graspproof reach` looks for a pose"
    return f"{grasp.id}: {found.reach.explanation}"


def said_of_reach(reaches: "Reaches | None", grasp: Grasp) -> tuple[str, str]:
    """Say in words whether the hand reaches a grasp, with the tone; nothing without a hand."""
    if reaches is None:
        return "", QUIET
    found, name = reach_of(reaches, grasp), reaches.hand.name
    if found is None:
        return f"{name}: not asked", QUIET
    reach, held, executed = found.reach, found.simulated, found.executed
    if not reach.reached:
        return f"{name}: not reached, {REASONS[reach.reason]}", QUIET
    within = reach.within_regions or ()
    inside = f"{sum(within)} of {len(within)} contacts "
    said = [f"{name}: reached, {'' if all(within) else inside}within regions"]
    if held is not None:
        strength = f"held: {number(held.weakest_n)} N with its motors"
        said.append(strength if held.held else "not held in simulation")
    if executed is not None and executed.execution is None:
        said.append("not executed")
    elif executed is not None:
        kept = sum(trial.survived for trial in executed.trials)
        said.append(f"survived {kept} of {len(executed.trials)} trials")
    lost = executed is not None and not all(trial.survived for trial in executed.trials)
    return ", ".join(said), BAD if lost or (held is not None and not held.held) else GOOD


def held_by_hand(reaches: "Reaches | None", grasp: Grasp) -> float | None:
    """Return the weakest wrench that a hand resists in a grasp [N]; None if it was not simulated.

    Torques count over the object's radius.
    """
    found = reach_of(reaches, grasp)
    return None if found is None or found.simulated is None else found.simulated.weakest_n


def described_reaches(reaches: "Reaches | None") -> str:
    """Say in one sentence how many grasps a hand reaches."""
    if reaches is None:
        return ""
    asked = counted(len(reaches), "grasp")
    said = f"The hand {reaches.hand.name} reaches {reaches.summary['reached']} of {asked}"
    return said + ("." if reaches.complete else "; the search was interrupted.")


def reach_settings(reaches: "Reaches") -> Iterable[tuple[str, str]]:
    """Yield names and values of everything that was asked for."""
    yield "hand.name", reaches.hand.name
    yield "hand.friction", f"{reaches.friction:g}"
    for name, value in record_of(reaches.asked).items():
        yield f"hand.{name}", str(value)
    limits = {joint.torque_limit_n_m for joint in reaches.hand.joints}
    if stated := sorted(limit for limit in limits if limit is not None):
        yield "hand.torque_limits_n_m", ", ".join(f"{limit:g}" for limit in stated)


def reach_section(reaches: "Reaches | None", grasp: Grasp) -> Record | None:
    """Build the section about the hand in a grasp; None where no hand was asked for."""
    found = reach_of(reaches, grasp)
    if reaches is None or found is None:
        return None
    said, tone = said_of_reach(reaches, grasp)
    return {
        "hand": reaches.hand.name,
        "said": said.partition(": ")[2],
        "tone": tone,
        "facts": list(_facts(reaches, found)),
        "explanation": found.reach.explanation,
    }


def _facts(reaches: "Reaches", found: "ReachedGrasp") -> Iterable[Fact]:
    if found.reach.reached:
        names = reaches.finger_names(found.reach)
        yield "Fingers used", ", ".join(f"{k}: {name}" for k, name in enumerate(names)), FINGERS
    yield from _figures(found, "")
    if found.simulated is not None:
        yield from _figures(found.simulated, "With its motors: ")
    if (executed := found.executed) is not None:
        yield from _figures(executed, "Executed with the hand: ")
        if executed.reason is not None:
            yield "Not executed", executed.reason, ""
        if executed.enough is not None:
            yield "What would be enough", str(executed.enough), ""


def _figures(record: object, part: str) -> Iterable[Fact]:
    """Yield the figures that a record has, but for the grasp that the page is about."""
    for each in figures(type(record)):
        if each.name not in SAID_ABOVE and each.of(record) is not None:
            heading = f"{part}{each.shown.heading}"
            yield heading[:1].upper() + heading[1:], each.cell(record), each.meaning


def reach_commands(reaches: "Reaches | None", grasp: Grasp, path: str) -> Sequence[str]:
    """Write the shell command that seeks the pose again; none for a hand from a file."""
    if reaches is None or reaches.hand.name not in HANDS or grasp.id not in reaches:
        return []
    asked, usual = reaches.asked, type(reaches.asked)()
    words = ["graspproof", "reach", path, "--hand", reaches.hand.name, "--grasp", grasp.id]
    words += ["--friction", repr(reaches.friction)]
    for name, flag in FLAGS.items():
        value = getattr(asked, name)
        words += [] if value == getattr(usual, name) else [flag, repr(value)]
    words += [] if asked.table_down is None else ["--table", *map(repr, asked.table_down)]
    words += [] if asked.regions else ["--contacts-only"]
    return [shlex.join(words)]
