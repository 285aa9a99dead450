"""Writes `reaches.json`: in which grasps a hand can stand, with poses, and why not in others."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contact_arrays import contacts_sha256
from grasp_core.execution.carried_mass import HandPayload
from grasp_core.files.json_text import text_of
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from sim_validate.hands.hand_verdict import HandVerdict
from sim_validate.hands.jobs import ExecutedHand
from sim_validate.records.executions_json import enough_record, tip_radii
from sim_validate.records.hand_model import model_record
from sim_validate.records.reaches_schema import (
    AskedRecord,
    ExecutedHandRecord,
    PoseRecord,
    ReachedContactRecord,
    ReachesFile,
    ReachesSummary,
    ReachRecord,
    Row,
    SimulatedHandRecord,
    Triple,
)
from sim_validate.records.verdicts_json import object_record

SCHEMA = 1


@dataclass(frozen=True, slots=True, eq=False)
class HandTrials:
    """What the hand carries and did in simulation, by the ids of grasps, as far as it was tried."""

    payloads: dict[str, HandPayload] = field(default_factory=dict[str, HandPayload])
    """The largest mass in any orientation."""
    verdicts: dict[str, HandVerdict] = field(default_factory=dict[str, HandVerdict])
    """What it held."""
    executions: dict[str, ExecutedHand] = field(default_factory=dict[str, ExecutedHand])
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
            "weakest_gravity": _triple(carried.weakest),
        }
    if found.grasp in tried.verdicts:
        record["simulated"] = _simulated(tried.verdicts[found.grasp])
    if found.grasp in tried.executions:
        record["executed"] = _executed(tried.executions[found.grasp])
    return record


def _executed(found: ExecutedHand) -> ExecutedHandRecord:
    execution = found.execution
    if execution is None:
        return {
            "refused": found.refused, "enough": enough_record(found.enough), "execution": None,
        }  # fmt: skip
    losses = [trial.predicted_loss for trial in execution.trials]
    return {
        "refused": "",
        "enough": enough_record(found.enough),
        "execution": {
            "mass_kg": execution.mass_kg,
            "survived": execution.survived,
            "trials": len(execution.trials),
            "lost": [trial.name for trial in execution.trials if not trial.survived],
            "skipped": [f"{each.kind}: {each.reason}" for each in execution.skipped],
            "least_predicted_loss": min(losses) if losses else None,
            "payload_kg": execution.payload_kg,
            "squeeze_n": [_triple(force) for force in execution.squeeze],
            "tip_radius_m": tip_radii(execution),
            "controls_held": [each.name for each in execution.controls if not each.let_go],
        },
    }


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
            "position_m": _triple(contact.position),
            "normal": _triple(contact.normal),
            "within_region": bool((found.within_regions or ())[k]),
        }
        for k, contact in enumerate(contacts)
    ]
    first, second, third, last = (_row(row) for row in found.palm_pose)
    return {
        "palm_pose": (first, second, third, last),
        "joints_rad": found.joints.tolist(),
        "used": used,
        "contacts": listed,
        "closure_margin": certificate.margin,
        "pregrasp_joints_rad": None if found.pregrasp is None else found.pregrasp.tolist(),
        "approach": None if found.approach is None else _triple(found.approach),
    }


def _triple(vector: Array) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


def _row(row: Array) -> Row:
    x, y, z, w = row.tolist()
    return x, y, z, w
