"""Loads `transfer.json` for people who look in Python at what became of grasps."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from grasp_core.by_value import ByValue, counted, summary
from grasp_core.checked import path_of
from grasp_core.errors import InputError
from grasp_core.files.json_text import place, record_of
from grasp_core.files.text_files import read_text
from grasp_core.grasp_tables import ById
from grasp_core.transferring.change_words import in_words
from grasp_core.transferring.contacts import CarriedContact
from grasp_core.transferring.face_changes import FaceChange
from grasp_core.transferring.judging import CHANGES, Change, GraspFigures
from grasp_core.values import Contact
from sim_validate.records.transfers.transfer_json import MM, MM2, SCHEMA, TRANSFER
from sim_validate.records.transfers.transfer_schema import (
    CarriedContactRecord,
    CarriedGraspRecord,
    FaceChangeRecord,
    FiguresRecord,
    TransferFile,
    TransferSummary,
)

Where = tuple[str | int, ...]
"""Keys that lead to a record in its file."""


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
    """What became of each contact, in finger order, without reasons of its own."""
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
        """Say in one line where faces are that moved, and by how much."""
        return in_words(self.faces, self.added)

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
        normal=record.get("normal"),
        center=record.get("center_m"),
        likely=record.get("likely"),
        likely_turn=math.radians(record.get("likely_turned_deg", 0.0)),
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
        contacts=_contacts(record["contacts"], where),
        before=_figures(record["before"]),
        after=None if record["after"] is None else _figures(record["after"]),
    )


def _contacts(records: Sequence[CarriedContactRecord], where: Where) -> tuple[CarriedContact, ...]:
    return tuple(
        _contact(finger, record, (*where, "contacts", finger))
        for finger, record in enumerate(records)
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
