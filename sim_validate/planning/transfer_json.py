"""Writes `transfer.json`: what became of each face and each grasp of a part that has changed."""

import math

from grasp_core.files.json_text import text_of
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.provenance import versions
from grasp_core.records.grasps_json import plan_to_json
from grasp_core.transferring.face_changes import FaceChange
from grasp_core.transferring.transfer import (
    FRICTION_BAND,
    QUALITY_BAND,
    CarriedContact,
    CarriedGrasp,
    GraspFigures,
    Transfer,
)
from sim_validate.kit.fields import object_record

TRANSFER = "transfer.json"
"""Name of the file in a folder of results."""
SCHEMA = 1
MM, MM2 = 1e3, 1e6
DIGITS = 9
"""Digits after the point of millimetres, square millimetres and degrees."""


def transfer_to_json(found: Transfer) -> str:
    """Write the text of `transfer.json`; equal transfers give equal texts."""
    document = {
        "schema": SCHEMA,
        "old": object_record(found.old),
        "new": object_record(found.new),
        "friction": found.friction,
        "distance_m": found.distance,
        "angle_deg": _rounded(math.degrees(found.angle)),
        "bands": {
            "critical_friction": FRICTION_BAND * found.friction,
            "ferrari_canny_share": QUALITY_BAND,
        },
        "summary": _summary(found),
        "faces": [_face_record(change) for change in found.faces],
        "added_faces": list(found.added),
        "grasps": [_grasp_record(grasp) for grasp in found.grasps],
        "versions": versions(),
    }
    return text_of(document)


def _summary(found: Transfer) -> dict[str, int]:
    contacts = [each for grasp in found.grasps for each in grasp.contacts]
    rounding = found.old.radius * 1e-9  # a contact on a face that stayed is put on its plane again
    placed = [each for each in contacts if each.contact is not None]
    return {
        "grasps": len(found.grasps),
        **{status: found.count(status) for status in ("same", "better", "worse", "gone")},
        "contacts_moved": sum(each.distance > rounding for each in placed),
        "contacts_lost": len(contacts) - len(placed),
    }


def _face_record(change: FaceChange) -> dict[str, object]:
    return {
        "old": change.old,
        "new": change.new,
        "moved_mm": _rounded(MM * change.distance),
        "turned_deg": _rounded(math.degrees(change.turn)),
        "old_area_mm2": _rounded(MM2 * change.old_area),
        "new_area_mm2": _rounded(MM2 * change.new_area),
        "moved": change.moved,
        "likely": change.likely,
        "likely_turned_deg": _rounded(math.degrees(change.likely_turn)),
        "normal": change.normal,
        "center_m": change.center,
    }


def _grasp_record(found: CarriedGrasp) -> dict[str, object]:
    return {
        "id": found.old.id,
        "new_id": None if found.grasp is None else found.grasp.id,
        "status": found.status,
        "reason": found.reason,
        "contacts": [_contact_record(each) for each in found.contacts],
        "before": _figures_record(found.before),
        "after": None if found.after is None else _figures_record(found.after),
    }


def _contact_record(found: CarriedContact) -> dict[str, object]:
    at = found.contact
    return {
        "old_face": found.old_face,
        "new_face": found.new_face,
        "moved_mm": _rounded(MM * found.distance) if math.isfinite(found.distance) else None,
        "turned_deg": _rounded(math.degrees(found.turn)),
        "position_m": None if at is None else at.position.tolist(),
        "normal": None if at is None else at.normal.tolist(),
    }


def _rounded(value: float) -> float:
    """Leave out the digits of millimetres and degrees that are only rounding."""
    return round(value, DIGITS) + 0.0


def _figures_record(found: GraspFigures) -> dict[str, object]:
    critical = found.critical_friction
    return {
        "closure_margin": found.closure_margin,
        "critical_friction": critical if math.isfinite(critical) else None,
        "ferrari_canny": found.ferrari_canny,
    }


def carried_to_json(found: Transfer, saved: Plan) -> str:
    """Write the carried grasps as the text of a `grasps.json` of the changed part."""
    absence = None
    if not found.carried:
        absence = (
            f"none of the {len(found.grasps)} grasps could be carried over to the changed part"
        )
    nothing_tried = PlanCounts(faces=len(found.new.faces), quadruples=0, spanning=None)
    plan = Plan(
        body=found.new,
        grasps=found.carried,
        friction=found.friction,
        theta=math.atan(found.friction),
        seed=saved.seed,
        counts=nothing_tried,
        outcomes=Outcomes(0, 0, 0),
        absence=absence,
        finger=saved.finger,
    )
    return plan_to_json(found.new, plan)
