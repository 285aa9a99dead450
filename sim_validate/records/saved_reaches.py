"""Reads from `reaches.json` where a hand stands in grasps, so that it can be drawn.

The file holds the hand's parts. Files of earlier versions have only its name: then the built-in
hand of that name is taken, if there is one. Either way the hand is taken only if its fingertips
touch at the contacts of the file, and otherwise a sentence says why it cannot be drawn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.files.json_text import record_of
from grasp_core.files.text_files import read_text
from grasp_core.frames import POSE
from grasp_core.hands.distances.collisions import tip_distances
from grasp_core.hands.hand import Hand
from grasp_core.hands.named_hands import HANDS, load_hand
from grasp_core.hands.reach import HandReach
from grasp_core.values import Contact
from sim_validate.records.hand_model import ModelRecord, hand_of_model
from sim_validate.records.reaches_json import SCHEMA
from sim_validate.records.reaches_schema import (
    AskedRecord,
    ExecutedHandRecord,
    HandPayloadRecord,
    HandRecord,
    PoseRecord,
    ReachesFile,
    ReachRecord,
    SimulatedHandRecord,
)

TOUCHING_M = 1e-4
"""How far a fingertip of the file may be from its contact [m]: ten times what `reach` allows."""


@dataclass(frozen=True, slots=True, eq=False)
class SavedReaches:
    """A hand in the grasps of an object, as a file holds it."""

    hand: Hand | None
    """The hand; None if it cannot be drawn."""
    hand_name: str
    missing: str
    """Reason why the hand cannot be drawn, as a sentence; empty if it can."""
    friction: float
    asked: AskedRecord
    complete: bool
    """Whether every grasp that was asked for was looked at."""
    found: Mapping[str, HandReach]
    """What was found, by the ids of the grasps."""
    margins: Mapping[str, float]
    """Margin of closure with the contacts that are reached, by the ids of these grasps."""
    fingers: tuple[str, ...]
    """Names of the hand's fingers."""
    payloads: Mapping[str, HandPayloadRecord]
    """What the hand carries in any orientation, by the ids of the grasps."""
    simulated: Mapping[str, SimulatedHandRecord]
    """What the hand held in simulation, by the ids of the grasps in which it was simulated."""
    executed: Mapping[str, ExecutedHandRecord]
    """What came of executing grasps with the hand, by their ids."""

    @property
    def reached(self) -> int:
        """Return the number of grasps that the hand reaches."""
        return sum(each.reached for each in self.found.values())

    def finger_names(self, reach: HandReach) -> tuple[str, ...]:
        """Return the name of the finger at each contact; none for a grasp that is not reached."""
        used = () if reach.fingers is None else reach.fingers
        return tuple(self.fingers[int(finger)] for finger in used)


def read_reaches(path: Path) -> tuple[SavedReaches, ReachesFile]:
    """Read the poses of a hand, and the record that holds them."""
    try:
        return reaches_from_json(read_text(path))
    except InputError as error:
        raise InputError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from error


def reaches_from_json(text: str) -> tuple[SavedReaches, ReachesFile]:
    """Read the poses of a hand from the text of `reaches.json`, and the record that holds them."""
    record = record_of(ReachesFile, text, "reaches.json", schema=SCHEMA)
    return _saved(record), record


def _saved(record: ReachesFile) -> SavedReaches:
    own, asked = record["hand"], record["asked"]
    found = {each["id"]: _reach(own, each, asked["clearance_m"]) for each in record["reaches"]}
    hand, missing = _hand(own, [each for each in found.values() if each.reached])
    return SavedReaches(
        hand=hand,
        hand_name=own["name"],
        missing=missing,
        friction=record["friction"],
        asked=asked,
        complete=record["summary"]["complete"],
        found=found,
        margins={
            each["id"]: each["pose"]["closure_margin"]
            for each in record["reaches"] if each["pose"] is not None
        },
        fingers=tuple(own["fingers"]),
        payloads={each["id"]: each["payload"] for each in record["reaches"] if "payload" in each},
        simulated={
            each["id"]: each["simulated"] for each in record["reaches"] if "simulated" in each
        },
        executed={
            each["id"]: each["executed"] for each in record["reaches"] if "executed" in each
        },
    )  # fmt: skip


def _reach(hand: HandRecord, record: ReachRecord, clearance_m: float) -> HandReach:
    """Make the value of what was found for one grasp."""
    pose, name = record["pose"], record["id"]
    if not record["reached"] == (pose is not None) == (record["reason"] == ""):
        raise InputError(
            f"reaches: {name}: expected a pose, and no reason, exactly where `reached` is true; "
            "write the file again, or remove it"
        )
    if pose is None:
        return HandReach(
            hand["name"], name, record["reason"], record["explanation"], record["starts"],
            clearance_m,
        )  # fmt: skip
    contacts = pose["contacts"]
    unknown = {each["finger"] for each in contacts} - set(hand["fingers"])
    if unknown or len(pose["joints_rad"]) != len(hand["joints"]):
        raise InputError(
            f"reaches: {name}: the pose must name fingers of the hand and have an angle for each "
            f"of its {len(hand['joints'])} joints, got {len(pose['joints_rad'])} angles and "
            f"{'unknown' if unknown else 'known'} fingers"
        )
    return HandReach(
        hand["name"], name, "", "", record["starts"], clearance_m,
        fingers=np.array([hand["fingers"].index(each["finger"]) for each in contacts]),
        joints=np.array(pose["joints_rad"]),
        palm_pose=np.array(pose["palm_pose"]),
        contacts=_contacts(pose),
        within_regions=tuple(each["within_region"] for each in contacts),
        pregrasp=_array(pose["pregrasp_joints_rad"]),
        approach=_array(pose["approach"]),
        used=np.array(pose["used"]) if "used" in pose else None,
    )  # fmt: skip


def _contacts(pose: PoseRecord) -> tuple[Contact, ...]:
    return tuple(
        Contact(np.array(each["position_m"]), np.array(each["normal"]))
        for each in pose["contacts"]
    )  # fmt: skip


def _array(values: Sequence[float] | None) -> Array | None:
    return None if values is None else np.array(values)


def _hand(record: HandRecord, reached: Sequence[HandReach]) -> tuple[Hand | None, str]:
    """Return the hand of a file, or None and the reason why it cannot be drawn."""
    name = record["name"]
    if "model" in record:
        hand = _modelled(name, record, record["model"])
    elif name in HANDS:
        hand = load_hand(name)
    else:
        return None, (
            f"The hand {name} cannot be drawn: reaches.json is of a version that kept no more of a "
            "hand than its name. Run `graspproof reach` again."
        )
    same = [joint.name for joint in hand.joints] == record["joints"] and (
        [finger.name for finger in hand.fingers] == record["fingers"]
    )
    if same and _touches(hand, reached):
        return hand, ""
    return None, (
        f"The hand {name} cannot be drawn: with the joint angles in reaches.json its fingertips do "
        "not touch at the contacts there, so it is another hand of that name. Run `graspproof "
        "reach` again."
    )


def _modelled(name: str, record: HandRecord, model: ModelRecord) -> Hand:
    try:
        return hand_of_model(name, model, record["sources"], record["torque_source"])
    except InputError as error:
        raise InputError(f"hand.model of {name} is none that a hand can have: {error}") from error


def _touches(hand: Hand, reached: Sequence[HandReach]) -> bool:
    """Tell whether the fingertips of a hand touch at the contacts in every pose."""
    for each in reached:
        if each.fingers is None or each.contacts is None or each.joints is None:
            continue
        used = [int(finger) for finger in each.fingers]
        touched = np.array([contact.position for contact in each.contacts])
        pose = np.eye(POSE) if each.palm_pose is None else each.palm_pose
        off = tip_distances(hand, each.joints, pose, used, touched)
        if (np.abs(off) > TOUCHING_M).any():
            return False
    return True
