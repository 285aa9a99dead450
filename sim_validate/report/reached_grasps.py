"""Says where a hand stands in grasps, or why not, on cards and on the pages about grasps."""

import shlex
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from grasp_core.declared import counted
from grasp_core.files.records import from_record
from grasp_core.hands.named_hands import HANDS
from grasp_core.values import Grasp
from scenes.drawing.hands import PosedHand, posed_hand
from scenes.drawing.pages import number
from sim_validate.execution.verdict import Enough
from sim_validate.report.agreement import BAD, GOOD, QUIET, Record

if TYPE_CHECKING:
    from grasp_core.hands.reach import HandReach
    from sim_validate.hands.reaches_json import ExecutedHandRecord, SavedReaches

MILLI = 1e3
STARTS, SEED, CLEARANCE_M = 100, 0, 5e-4
"""Values that `graspproof reach` takes where nothing else is asked for."""
REASONS = {
    "collision": "a collision",
    "limit": "a joint's limit",
    "not found": "no pose found",
    "no closure": "no three contacts close",
}
"""Words for what was in the way."""
CLEARANCE = "least distance asked for between all that must not touch: links, palm, object, table"
FINGERS = "that touch at the grasp's contacts, by finger of the grasp"
WITHIN = "where the fingertips touch; force closure is proved again with these contacts"
OPENING = "joint angles at which the fingers are 3 to 15 mm open, with the palm where it is"
MOTORS = "in simulation, each at 80 % of what contacts and motors resist by the analysis"
WEAKEST = "that contacts and motors resist; torques over the object's radius"
LOSS = "multiple of a trial's load at which the object is lost, by the analysis"
PAYLOAD = "that it is certified to carry slowly, in any direction, within the motors' torques"
CARRIED = "that motors and contacts hold whichever way the hand is turned, forces chosen anew"
WAY = "over 60 mm, with open fingers and nothing in the way"


def held_in(reaches: "SavedReaches | None", grasp: Grasp) -> PosedHand | None:
    """Return the hand in the pose in which it stands in a grasp."""
    reach = reach_of(reaches, grasp)
    if reaches is None or reaches.hand is None or reach is None or not reach.reached:
        return None
    return posed_hand(reaches.hand, reach, grasp)


def reach_of(reaches: "SavedReaches | None", grasp: Grasp) -> "HandReach | None":
    """Return what was found for a grasp; None where no hand was asked for."""
    return None if reaches is None else reaches.found.get(grasp.id)


def why_not_held(reaches: "SavedReaches", grasp: Grasp) -> str:
    """Say why there is no hand to draw in a grasp."""
    found = reach_of(reaches, grasp)
    if found is None:
        return f"reaches.json holds nothing about {grasp.id}; `graspproof reach` looks for a pose"
    return reaches.missing if found.reached else f"{grasp.id}: {found.explanation}"


def said_of_reach(reaches: "SavedReaches | None", grasp: Grasp) -> tuple[str, str]:
    """Say in words whether the hand reaches a grasp, with the tone; nothing without a hand."""
    if reaches is None:
        return "", QUIET
    found, name = reach_of(reaches, grasp), reaches.hand_name
    if found is None:
        return f"{name}: not asked", QUIET
    if not found.reached:
        return f"{name}: not reached, {REASONS[found.reason]}", QUIET
    within = found.within_regions or ()
    inside = f"{sum(within)} of {len(within)} contacts "
    said = [f"{name}: reached, {'' if all(within) else inside}within regions"]
    tone = GOOD
    if (held := reaches.simulated.get(grasp.id)) is not None:
        strength = f"held: {number(held['weakest_n'])} N with its motors"
        said.append(strength if held["held"] else "not held in simulation")
        tone = tone if held["held"] else BAD
    if (tried := reaches.executed.get(grasp.id)) is not None:
        if (trials := tried["execution"]) is None:
            said.append("not executed")
        else:
            lost = len(trials["lost"])
            said.append(f"survived {trials['trials'] - lost} of {trials['trials']} trials")
            tone = BAD if lost else tone
    return ", ".join(said), tone


def held_by_hand(reaches: "SavedReaches | None", grasp: Grasp) -> float | None:
    """Return the weakest wrench that a hand resists in a grasp [N]; None if it was not simulated.

    Torques count over the object's radius.
    """
    held = None if reaches is None else reaches.simulated.get(grasp.id)
    return None if held is None else float(held["weakest_n"])


def described_reaches(reaches: "SavedReaches | None") -> str:
    """Say in one sentence how many grasps a hand reaches, and whether it can be drawn."""
    if reaches is None:
        return ""
    asked = counted(len(reaches.found), "grasp")
    said = f"The hand {reaches.hand_name} reaches {reaches.reached} of {asked}"
    said += "." if reaches.complete else "; the search was interrupted."
    return f"{said} {reaches.missing}".strip()


def reach_settings(reaches: "SavedReaches") -> Iterable[tuple[str, str]]:
    """Yield names and values of everything that was asked for."""
    yield "hand.name", reaches.hand_name
    yield "hand.friction", f"{reaches.friction:g}"
    yield from ((f"hand.{name}", str(value)) for name, value in reaches.asked.items())
    limits = [] if reaches.hand is None else [j.torque_limit_n_m for j in reaches.hand.joints]
    stated = sorted({limit for limit in limits if limit is not None})
    if stated:
        yield "hand.torque_limits_n_m", ", ".join(f"{limit:g}" for limit in stated)


def reach_section(reaches: "SavedReaches | None", grasp: Grasp) -> Record | None:
    """Build the section about the hand in a grasp; None where no hand was asked for."""
    found = reach_of(reaches, grasp)
    if reaches is None or found is None:
        return None
    said, tone = said_of_reach(reaches, grasp)
    return {
        "hand": reaches.hand_name,
        "said": said.partition(": ")[2],
        "tone": tone,
        "facts": list(_facts(reaches, found)),
        "explanation": found.explanation,
        "missing": reaches.missing if found.reached else "",
    }


def _facts(reaches: "SavedReaches", found: "HandReach") -> Iterable[tuple[str, str, str]]:
    if found.reached:
        names = ", ".join(f"{k}: {name}" for k, name in enumerate(reaches.finger_names(found)))
        yield "Fingers used", names, FINGERS
        within = found.within_regions or ()
        yield "Contacts within regions", f"{sum(within)} of {len(within)}", WITHIN
        margin = number(reaches.margins[found.grasp])
        yield "Margin of closure there", margin, f"at friction {number(reaches.friction)}"
    yield "Least clearance", f"{number(MILLI * found.clearance_m)} mm", CLEARANCE
    if found.reached:
        for name, way, meaning in (
            ("Fingers open", found.pregrasp, OPENING), ("Straight way in", found.approach, WAY)
        ):  # fmt: skip
            yield name, "none found" if way is None else "found", meaning
    if (carried := reaches.payloads.get(found.grasp)) is not None:
        yield "Payload in any orientation", f"{number(carried['lower_kg'])} kg", CARRIED
    if (held := reaches.simulated.get(found.grasp)) is not None:
        count, lost = held["wrenches"], len(held["not_held"])
        yield "Held with its motors", f"{count - lost} of {count} wrenches", MOTORS
        yield "Weakest wrench of the hand", f"{number(held['weakest_n'])} N", WEAKEST
        let_go = sum(control["let_go"] for control in held["controls"])
        controls = ", ".join(control["name"].replace("_", " ") for control in held["controls"])
        yield "Controls let go", f"{let_go} of {len(held['controls'])}", controls
    if (tried := reaches.executed.get(found.grasp)) is not None:
        yield from _executed(tried)
    yield "Starts tried", str(found.starts), "postures from which a pose was sought"


def _executed(tried: "ExecutedHandRecord") -> Iterable[tuple[str, str, str]]:
    found = tried["execution"]
    if found is None:
        yield "Executed with the hand", "not tried", tried["refused"]
        return
    kept, lost = found["trials"] - len(found["lost"]), ", ".join(found["lost"])
    said = f"{kept} of {found['trials']} trials survived"
    yield "Executed with the hand", said, f"lost: {lost}" if lost else "; ".join(found["skipped"])
    loss = found["least_predicted_loss"]
    yield "Least predicted loss", "none" if loss is None else number(loss), LOSS
    yield "Payload of the squeeze", f"{number(found['payload_kg'])} kg", PAYLOAD
    if tried["enough"] is not None:
        enough = from_record(Enough, tried["enough"], "executed.enough")
        yield "What would be enough", str(enough), ""


def reach_commands(reaches: "SavedReaches | None", grasp: Grasp, path: str) -> Sequence[str]:
    """Write the shell command that seeks the pose again; none for a hand from a file."""
    if reaches is None or reaches.hand_name not in HANDS or grasp.id not in reaches.found:
        return []
    asked = reaches.asked
    words = ["graspproof", "reach", path, "--hand", reaches.hand_name, "--grasp", grasp.id]
    words += ["--friction", repr(reaches.friction)]
    for flag, value, usual in (
        ("--starts", asked["starts"], STARTS), ("--seed", asked["seed"], SEED),
        ("--clearance-m", asked["clearance_m"], CLEARANCE_M),
    ):  # fmt: skip
        words += [] if value == usual else [flag, repr(value)]
    down = asked["table_down"]
    words += [] if down is None else ["--table", *map(repr, down)]
    words += [] if asked["regions"] else ["--contacts-only"]
    return [shlex.join(words)]
