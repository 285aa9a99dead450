"""`reaches.json`: in which grasps a hand can stand, with poses, and why not in others.

The file holds the hand's parts, so that it can be drawn. They are taken only if the fingertips
touch at the contacts of the file; otherwise a sentence says why the hand cannot be drawn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, NotRequired

import numpy as np
from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError, about
from grasp_core.execution.carried_mass import HandPayload
from grasp_core.files.json_text import record_of, text_of
from grasp_core.files.records import record_of as plain_record
from grasp_core.files.text_files import read_text
from grasp_core.frames import POSE
from grasp_core.hands.collisions import tip_distances
from grasp_core.hands.hand import FEWEST_FINGERS, Hand
from grasp_core.hands.reach import HandReach, ReachReason
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from grasp_core.values import FINGERS, Contact, Grasp
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.hands.hand_model import hand_of_model, model_record
from sim_validate.hands.validate_hand import HandVerdict
from sim_validate.kit.fields import Count, Finite, ObjectRecord, Positive, Triple, object_record

NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0, lt=FINGERS)]
Row = tuple[Finite, Finite, Finite, Finite]
SCHEMA = 1
TOUCHING_M = 1e-4
"""How far a fingertip of the file may be from its contact [m]: ten times what `reach` allows."""


class HandRecord(TypedDict):
    """Fields about the hand."""

    name: str
    joints: list[str]
    fingers: list[str]
    sources: list[str]
    torque_source: str
    model: dict[str, Any]


class ReachedContactRecord(TypedDict):
    """Fields about one contact that is reached."""

    finger: str
    position_m: Triple
    normal: Triple
    within_region: bool


class PoseRecord(TypedDict):
    """Fields about a pose in which the hand stands in a grasp."""

    palm_pose: tuple[Row, Row, Row, Row]
    joints_rad: list[Finite]
    used: Annotated[list[Index], Field(min_length=FEWEST_FINGERS)]
    """Indices of the grasp's contacts at which fingers stand."""
    contacts: Annotated[
        list[ReachedContactRecord], Field(min_length=FEWEST_FINGERS, max_length=FINGERS)
    ]  # fmt: skip
    closure_margin: Finite
    pregrasp_joints_rad: list[Finite] | None
    approach: Triple | None


class HandControlRecord(TypedDict):
    """Fields about one negative control of a hand."""

    name: str
    explanation: str
    let_go: bool


class SimulatedHandRecord(TypedDict):
    """Fields about the trials of a hand in its pose, with its motors."""

    held: bool
    wrenches: Count
    """Number of wrenches that were to be held."""
    not_held: list[str]
    """Names of the wrenches that were not held."""
    weakest_n: NotNegative
    """Size of the weakest wrench at its predicted limit, torques over the object's radius."""
    controls: list[HandControlRecord]
    contradictions: list[str]
    """Where the simulation contradicts the analysis, a sentence each."""


class HandExecutionRecord(TypedDict):
    """Fields about the trials of one grasp, executed with a hand."""

    mass_kg: Positive
    survived: bool
    trials: Count
    lost: list[str]
    """Names of the trials that the object did not survive."""
    skipped: list[str]
    """Kinds of trials that were left out, with the reasons."""
    least_predicted_loss: Annotated[float, Field(ge=0.0)] | None
    """Least multiple of a trial's load at which the object is predicted to be lost; null without a
    trial."""
    payload_kg: NotNegative
    """Largest mass that the squeeze is certified to carry slowly, in any direction."""
    squeeze_n: list[Triple]
    """Contact forces at rest, on the object."""
    tip_radius_m: list[Positive] | None
    """Radii of the fingertips, one for each force."""
    controls_held: list[str]
    """Names of negative controls that did not slip, though they must; empty if all did."""


class ExecutedHandRecord(TypedDict):
    """Fields about executing one grasp with a hand."""

    refused: str
    """Why the grasp cannot be executed; empty if it was."""
    enough: dict[str, Any] | None
    """The push within the motors' torques that would be enough; null where all was survived."""
    execution: HandExecutionRecord | None


class HandPayloadRecord(TypedDict):
    """Fields about the largest mass that a hand holds in any orientation, its links included."""

    lower_kg: NotNegative
    """Mass that is held in every orientation, with forces chosen anew for each."""
    upper_kg: NotNegative
    """Mass above which some orientation is not held."""
    weakest_gravity: Triple
    """Direction of gravity in which the hand lets go first, of unit length, object axes."""


class ReachRecord(TypedDict):
    """Fields about one grasp."""

    id: str
    contacts_sha256: str
    """Hash of the planned contacts."""
    reached: bool
    reason: ReachReason
    explanation: str
    starts: Count
    pose: PoseRecord | None
    payload: NotRequired[HandPayloadRecord]
    """What the hand carries; absent where motors or links are unknown, or too weak."""
    simulated: NotRequired[SimulatedHandRecord]
    """What the hand held in simulation; absent where no simulation was asked for."""
    executed: NotRequired[ExecutedHandRecord]
    """What came of executing the grasp with the hand; absent where it was not asked for."""


class ReachesSummary(TypedDict):
    """Numbers of grasps by how the search ended."""

    grasps: Count
    reached: Count
    limit: Count
    collision: Count
    not_found: Count
    no_closure: Count
    """Grasps no three of whose contacts close, for a hand with three fingers."""
    complete: bool


class AskedRecord(TypedDict):
    """Fields about what was asked for."""

    regions: bool
    table_down: Triple | None
    clearance_m: NotNegative
    starts: Count
    seed: Count
    execution: NotRequired[dict[str, Any]]
    """Settings of the executions, as in `executions.json`; absent where none were asked for."""


@with_config(ConfigDict(strict=True, extra="forbid"))
class ReachesFile(TypedDict):
    """The content of `reaches.json`; type checking holds its writer to it."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    hand: HandRecord
    asked: AskedRecord
    summary: ReachesSummary
    reaches: list[ReachRecord]
    versions: dict[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class HandTrials:
    """What the hand carries and did in simulation, by the ids of grasps, as far as it was tried."""

    payloads: dict[str, HandPayload] = field(default_factory=dict[str, HandPayload])
    """The largest mass in any orientation."""
    verdicts: dict[str, HandVerdict] = field(default_factory=dict[str, HandVerdict])
    """What it held."""
    executions: dict[str, ExecutedGrasp] = field(default_factory=dict[str, ExecutedGrasp])
    """What came of executing the grasps with it."""


def reaches_to_json(
    hand: Hand, body: Polyhedron, friction: float, asked: AskedRecord, found: Sequence[HandReach],
    *, complete: bool, grasps: Sequence[Grasp], tried: HandTrials | None = None,
) -> str:  # fmt: skip
    """Write the text of `reaches.json`; equal results give equal texts."""
    planned = {grasp.id: contacts_sha256(grasp.contacts) for grasp in grasps}
    document: ReachesFile = {
        "schema": SCHEMA,
        "object": object_record(body),
        "friction": friction,
        "hand": {
            "name": hand.name,
            "joints": [joint.name for joint in hand.joints],
            "fingers": [finger.name for finger in hand.fingers],
            "sources": list(hand.sources),
            "torque_source": hand.torque_source,
            "model": model_record(hand),
        },
        "asked": asked,
        "summary": reaches_summary(found, complete=complete),
        "reaches": [
            _record(hand, each, planned[each.grasp], tried or HandTrials()) for each in found
        ],
        "versions": versions(),
    }
    return text_of({**document})


def reaches_summary(found: Sequence[HandReach], *, complete: bool) -> ReachesSummary:
    """Count grasps by how the search ended."""
    reasons = [each.reason for each in found]
    return {
        "grasps": len(found),
        "reached": reasons.count(""),
        "limit": reasons.count("limit"),
        "collision": reasons.count("collision"),
        "not_found": reasons.count("not found"),
        "no_closure": reasons.count("no closure"),
        "complete": complete,
    }


def _record(hand: Hand, found: HandReach, planned: str, tried: HandTrials) -> ReachRecord:
    record: ReachRecord = {
        "id": found.grasp,
        "contacts_sha256": planned,
        "reached": found.reached,
        "reason": found.reason,
        "explanation": found.explanation,
        "starts": found.starts,
        "pose": _pose(hand, found),
    }
    if (carried := tried.payloads.get(found.grasp)) is not None:
        record["payload"] = {
            "lower_kg": carried.lower,
            "upper_kg": carried.upper,
            "weakest_gravity": carried.weakest.tolist(),
        }
    if found.grasp in tried.verdicts:
        record["simulated"] = _simulated(tried.verdicts[found.grasp])
    if found.grasp in tried.executions:
        record["executed"] = _executed(tried.executions[found.grasp])
    return record


def _executed(found: ExecutedGrasp) -> ExecutedHandRecord:
    execution = found.execution
    radii = None if execution is None else execution.tip_radius_m
    losses = [] if execution is None else [trial.predicted_loss for trial in execution.trials]
    return {
        "refused": found.reason or "",
        "enough": None if found.enough is None else plain_record(found.enough),
        "execution": None if execution is None else {
            "mass_kg": execution.mass_kg,
            "survived": execution.survived,
            "trials": len(execution.trials),
            "lost": [trial.name for trial in execution.trials if not trial.survived],
            "skipped": [f"{each.kind}: {each.reason}" for each in execution.skipped],
            "least_predicted_loss": min(losses) if losses else None,
            "payload_kg": execution.payload_kg,
            "squeeze_n": [force.tolist() for force in execution.squeeze],
            "tip_radius_m": None if radii is None else radii.tolist(),
            "controls_held": [each.name for each in execution.controls if not each.let_go],
        },
    }  # fmt: skip


def _simulated(verdict: HandVerdict) -> SimulatedHandRecord:
    return {
        "held": verdict.held,
        "wrenches": len(verdict.wrenches),
        "not_held": [trial.name for trial in verdict.failures],
        "weakest_n": verdict.weakest_n,
        "controls": [
            {
                "name": each.control.name,
                "explanation": each.control.explanation,
                "let_go": each.let_go,
            }
            for each in verdict.controls
        ],
        "contradictions": list(verdict.mismatches),
    }


def _pose(hand: Hand, found: HandReach) -> PoseRecord | None:
    contacts, certificate = found.contacts, found.certificate
    if contacts is None or certificate is None or found.palm_pose is None or found.joints is None:
        return None
    fingers: list[int] = np.asarray(found.fingers).tolist()
    used: list[int] = np.asarray(found.used).tolist()
    listed: list[ReachedContactRecord] = [
        {
            "finger": hand.fingers[fingers[k]].name,
            "position_m": contact.position.tolist(),
            "normal": contact.normal.tolist(),
            "within_region": bool((found.within_regions or ())[k]),
        }
        for k, contact in enumerate(contacts)
    ]
    return {
        "palm_pose": found.palm_pose.tolist(),
        "joints_rad": found.joints.tolist(),
        "used": used,
        "contacts": listed,
        "closure_margin": certificate.margin,
        "pregrasp_joints_rad": None if found.pregrasp is None else found.pregrasp.tolist(),
        "approach": None if found.approach is None else found.approach.tolist(),
    }


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
    text = read_text(path)
    with about(path):
        return reaches_from_json(text)


def reaches_from_json(text: str) -> tuple[SavedReaches, ReachesFile]:
    """Read the poses of a hand from the text of `reaches.json`, and the record that holds them."""
    record = record_of(ReachesFile, text, "reaches.json", schema=SCHEMA)
    return _saved(record), record


def _saved(record: ReachesFile) -> SavedReaches:
    own, asked = record["hand"], record["asked"]
    found = {each["id"]: _reach(own, each, asked["clearance_m"]) for each in record["reaches"]}
    hand, missing = _hand(own, [each for each in found.values() if each.reached])

    def told(name: Literal["payload", "simulated", "executed"]) -> dict[str, Any]:
        return {each["id"]: each.get(name) for each in record["reaches"] if name in each}

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
        payloads=told("payload"),
        simulated=told("simulated"),
        executed=told("executed"),
    )  # fmt: skip


def _reach(hand: HandRecord, record: ReachRecord, clearance_m: float) -> HandReach:
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
    contacts, way_in, approach = pose["contacts"], pose["pregrasp_joints_rad"], pose["approach"]
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
        contacts=tuple(
            Contact(np.array(each["position_m"]), np.array(each["normal"])) for each in contacts
        ),
        within_regions=tuple(each["within_region"] for each in contacts),
        pregrasp=None if way_in is None else np.array(way_in),
        approach=None if approach is None else np.array(approach),
        used=np.array(pose["used"]),
    )  # fmt: skip


def _hand(record: HandRecord, reached: Sequence[HandReach]) -> tuple[Hand | None, str]:
    """Return the hand of a file, or None and the reason why it cannot be drawn."""
    name = record["name"]
    with about(f"hand.model of {name} is none that a hand can have"):
        hand = hand_of_model(name, record["model"], record["sources"], record["torque_source"])
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


def _touches(hand: Hand, reached: Sequence[HandReach]) -> bool:
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
