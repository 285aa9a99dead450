"""`transfer.json`: what became of each face and each grasp of a part that has changed."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.by_value import ByValue, counted, summary
from grasp_core.checked import path_of
from grasp_core.errors import InputError
from grasp_core.files.json_text import place, record_of, text_of
from grasp_core.files.text_files import read_text
from grasp_core.grasp_tables import ById
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.provenance import versions
from grasp_core.records.grasps_json import SavedGrasps, plan_to_json
from grasp_core.transferring.face_changes import FaceChange, changes_in_words
from grasp_core.transferring.transfer import (
    CHANGES,
    FRICTION_BAND,
    QUALITY_BAND,
    CarriedContact,
    CarriedGrasp,
    Change,
    GraspFigures,
    Transfer,
)
from grasp_core.values import FINGERS, Contact
from sim_validate.records.fields import Count, Finite, ObjectRecord, Positive, object_record

TRANSFER = "transfer.json"
"""Name of the file in a folder of results."""
SCHEMA = 1
MM, MM2 = 1e3, 1e6
DIGITS = 9
"""Digits after the point of millimetres, square millimetres and degrees."""
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Triple = tuple[Finite, Finite, Finite]
Where = tuple[str | int, ...]
"""Keys that lead to a record in its file."""


class FaceChangeRecord(TypedDict):
    """Fields about what became of one face of the old part."""

    old: Count
    new: Count | None
    moved_mm: Finite
    turned_deg: NotNegative
    old_area_mm2: NotNegative
    new_area_mm2: NotNegative
    moved: bool
    normal: Triple
    center_m: Triple
    likely: Count | None
    likely_turned_deg: NotNegative


class CarriedContactRecord(TypedDict):
    """Fields about one contact; without a place, `moved_mm` is how far the nearest like face is."""

    old_face: Count
    new_face: Count | None
    moved_mm: NotNegative | None
    turned_deg: NotNegative
    position_m: Triple | None
    normal: Triple | None


class FiguresRecord(TypedDict):
    """Fields about what contacts reach; a critical friction that does not exist is null."""

    closure_margin: Finite
    critical_friction: NotNegative | None
    ferrari_canny: tuple[Finite, Finite]


class CarriedGraspRecord(TypedDict):
    """Fields about what became of one grasp."""

    id: str
    new_id: str | None
    status: Change
    reason: str
    contacts: Annotated[
        list[CarriedContactRecord], Field(min_length=FINGERS, max_length=FINGERS)
    ]  # fmt: skip
    before: FiguresRecord
    after: FiguresRecord | None


class BandsRecord(TypedDict):
    """Fields about the differences that do not count."""

    critical_friction: NotNegative
    ferrari_canny_share: NotNegative


class TransferSummary(TypedDict):
    """Numbers of grasps by what became of them, and of contacts that moved or have no place."""

    grasps: Count
    same: Count
    better: Count
    worse: Count
    gone: Count
    contacts_moved: Count
    contacts_lost: Count


@with_config(ConfigDict(strict=True, extra="forbid"))
class TransferFile(TypedDict):
    """The content of `transfer.json`; type checking holds its writer to it."""

    schema: Literal[1]
    old: ObjectRecord
    new: ObjectRecord
    friction: Positive
    distance_m: NotNegative
    angle_deg: NotNegative
    bands: BandsRecord
    summary: TransferSummary
    faces: list[FaceChangeRecord]
    added_faces: list[Count]
    grasps: list[CarriedGraspRecord]
    versions: dict[str, str]


def transfer_to_json(found: Transfer) -> str:
    """Write the text of `transfer.json`; equal transfers give equal texts."""
    document: TransferFile = {
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
    return text_of({**document})


def _summary(found: Transfer) -> TransferSummary:
    """Count grasps by what became of them, and contacts that moved or have no place."""
    contacts = [each for grasp in found.grasps for each in grasp.contacts]
    rounding = found.old.radius * 1e-9  # a contact on a face that stayed is put on its plane again
    placed = [each for each in contacts if each.contact is not None]
    return {
        "grasps": len(found.grasps),
        "same": found.count("same"),
        "better": found.count("better"),
        "worse": found.count("worse"),
        "gone": found.count("gone"),
        "contacts_moved": sum(each.distance > rounding for each in placed),
        "contacts_lost": len(contacts) - len(placed),
    }


def _face_record(change: FaceChange) -> FaceChangeRecord:
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


def _grasp_record(found: CarriedGrasp) -> CarriedGraspRecord:
    return {
        "id": found.old.id,
        "new_id": None if found.grasp is None else found.grasp.id,
        "status": found.status,
        "reason": found.reason,
        "contacts": [_contact_record(each) for each in found.contacts],
        "before": _figures_record(found.before),
        "after": None if found.after is None else _figures_record(found.after),
    }


def _contact_record(found: CarriedContact) -> CarriedContactRecord:
    at = found.contact
    return {
        "old_face": found.old_face,
        "new_face": found.new_face,
        "moved_mm": _rounded(MM * found.distance) if math.isfinite(found.distance) else None,
        "turned_deg": _rounded(math.degrees(found.turn)),
        "position_m": None if at is None else _triple(at.position.tolist()),
        "normal": None if at is None else _triple(at.normal.tolist()),
    }


def _rounded(value: float) -> float:
    """Leave out the digits of millimetres and degrees that are only rounding."""
    return round(value, DIGITS) + 0.0


def _triple(numbers: list[float]) -> Triple:
    x, y, z = numbers
    return x, y, z


def _figures_record(found: GraspFigures) -> FiguresRecord:
    critical = found.critical_friction
    return {
        "closure_margin": found.closure_margin,
        "critical_friction": critical if math.isfinite(critical) else None,
        "ferrari_canny": found.ferrari_canny,
    }


def carried_to_json(found: Transfer, saved: SavedGrasps) -> str:
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SavedCarriedGrasp(ByValue):
    """What became of one grasp on a changed part, as a file holds it."""

    id: str
    """Id of the grasp on the old part."""
    new_id: str | None
    """Id of the grasp of the changed part, in the `grasps.json` beside the file; None exactly where
    the status is `gone`."""
    status: Change
    reason: str
    """Why it is better, worse or gone; empty if it is the same."""
    contacts: tuple[CarriedContact, ...]
    """What became of each contact, in finger order."""
    before: GraspFigures
    after: GraspFigures | None
    """What its contacts reach on the changed part; None if a contact has no place there, or if
    closure cannot be decided."""

    def __repr__(self) -> str:
        now = "none" if self.new_id is None else self.new_id
        said = f"{self.id} -> {now}"
        return summary("SavedCarriedGrasp", said, self.status, reason=self.reason)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SavedTransfer(ByValue, ById[SavedCarriedGrasp]):
    """What became of grasps and faces on a changed part, as a file holds it.

    It is a sequence of its grasps, as a plan is: `len`, iteration, `[0]`, `["c-0-1-2-7"]` by the
    old id, and slices. Distances and angles have the digits of the file, billionths of a millimetre
    and of a degree.
    """

    old_sha256: str
    """Hash of the old part's canonical mesh, as in `Polyhedron.content_sha256`."""
    new_sha256: str
    """Hash of the changed part's canonical mesh."""
    friction: float
    distance: float
    """Largest distance by which a contact was allowed to move [m]."""
    angle: float
    """Largest angle between the normals of like faces [rad]."""
    faces: tuple[FaceChange, ...]
    """What became of each face of the old part, in order."""
    added: tuple[int, ...]
    """Faces of the changed part that succeed no old one, ascending."""
    grasps: tuple[SavedCarriedGrasp, ...]
    """What became of each grasp, in the order of the old file."""

    def count(self, status: Change) -> int:
        """Return the number of grasps with a status."""
        return sum(each.status == status for each in self.grasps)

    @property
    def faces_in_words(self) -> str:
        """Say in one line which faces moved, and by how much."""
        return changes_in_words(self.faces, self.added)

    def __repr__(self) -> str:
        counts = [f"{self.count(status)} {status}" for status in CHANGES]
        said = f"of {counted(len(self.grasps), 'grasp')} {', '.join(counts)}"
        return summary("SavedTransfer", said, self.faces_in_words, friction=self.friction)


def load_transfer(path: str | Path) -> SavedTransfer:
    """Read what became of grasps on a changed part, as `graspproof transfer` writes it.

    Args:
        path: A `transfer.json`. The grasps of the changed part are in the `grasps.json` beside it.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    try:
        return transfer_from_json(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def transfer_from_json(text: str) -> SavedTransfer:
    """Read the text of a `transfer.json`."""
    record = record_of(TransferFile, text, TRANSFER, schema=SCHEMA)
    found = SavedTransfer(
        old_sha256=record["old"]["content_sha256"],
        new_sha256=record["new"]["content_sha256"],
        friction=record["friction"],
        distance=record["distance_m"],
        angle=math.radians(record["angle_deg"]),
        faces=tuple(map(_face, record["faces"])),
        added=tuple(record["added_faces"]),
        grasps=tuple(
            _grasp(each, ("grasps", number)) for number, each in enumerate(record["grasps"])
        ),
    )
    _check_summary(record["summary"], found)
    return found


def _check_summary(told: TransferSummary, found: SavedTransfer) -> None:
    """Refuse counts that contradict the grasps."""
    lost = sum(each.contact is None for grasp in found for each in grasp.contacts)
    counts = [("grasps", len(found)), *((status, found.count(status)) for status in CHANGES)]
    for name, count in [*counts, ("contacts_lost", lost)]:
        if told[name] != count:
            raise InputError(
                f"summary.{name}: expected {count}, as the grasps say, got {told[name]}; write the "
                "file again"
            )


def _face(record: FaceChangeRecord) -> FaceChange:
    return FaceChange(
        old=record["old"],
        new=record["new"],
        distance=record["moved_mm"] / MM,
        turn=math.radians(record["turned_deg"]),
        old_area=record["old_area_mm2"] / MM2,
        new_area=record["new_area_mm2"] / MM2,
        moved=record["moved"],
        normal=record["normal"],
        center=record["center_m"],
        likely=record["likely"],
        likely_turn=math.radians(record["likely_turned_deg"]),
    )


def _grasp(record: CarriedGraspRecord, where: Where) -> SavedCarriedGrasp:
    if (record["new_id"] is None) != (record["status"] == "gone"):
        raise InputError(
            f"{place([*where, 'new_id'])}: expected null for a grasp that is gone, and an id for "
            "any other"
        )
    return SavedCarriedGrasp(
        id=record["id"],
        new_id=record["new_id"],
        status=record["status"],
        reason=record["reason"],
        contacts=tuple(
            _contact(finger, each, (*where, "contacts", finger))
            for finger, each in enumerate(record["contacts"])
        ),
        before=_figures(record["before"]),
        after=None if record["after"] is None else _figures(record["after"]),
    )


def _contact(finger: int, record: CarriedContactRecord, where: Where) -> CarriedContact:
    moved = math.inf if record["moved_mm"] is None else record["moved_mm"] / MM
    found: Contact | None = None
    at, normal = record["position_m"], record["normal"]
    _check_place([record["new_face"], at, normal], where)
    if at is not None and normal is not None:
        if record["moved_mm"] is None:
            raise InputError(f"{place([*where, 'moved_mm'])}: null is not allowed beside a place")
        try:
            found = Contact(np.array(at), np.array(normal))
        except InputError as error:
            raise InputError(f"{place(where)}: {error}") from error
    turn = math.radians(record["turned_deg"])
    return CarriedContact(finger, record["old_face"], record["new_face"], found, moved, turn)


def _check_place(parts: Iterable[object], where: Where) -> None:
    """Refuse a place on the changed part of which only some parts are told."""
    if len({part is None for part in parts}) > 1:
        raise InputError(
            f"{place(where)}: new_face, position_m and normal: expected all three, or null for all"
        )


def _figures(record: FiguresRecord) -> GraspFigures:
    critical = record["critical_friction"]
    return GraspFigures(
        closure_margin=record["closure_margin"],
        critical_friction=math.inf if critical is None else critical,
        ferrari_canny=record["ferrari_canny"],
    )
