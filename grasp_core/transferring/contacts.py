"""Carries the contacts of a grasp over to a changed part, one by one."""

import math
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import cross
from grasp_core.by_value import ByValue, summary
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import Nearest
from grasp_core.transferring.face_places import face_in_words
from grasp_core.transferring.like_faces import (
    WIDEST_DEG,
    Likeness,
    nearest_at_any_distance,
    place_of,
)
from grasp_core.values import Contact, Grasp

MM = 1e3


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CarriedContact(ByValue):
    """What became of one contact of a grasp on the changed part."""

    finger: int
    old_face: int
    """Number of the face of the old part on which the contact was."""
    new_face: int | None
    """Number of the face of the changed part that it is on now; None if it has no place there."""
    contact: Contact | None
    """The contact on the changed part, with the normal of its face; None if it has no place."""
    distance: float
    """How far it moved [m]; without a place, the distance of the nearest like face, which is
    infinite if there is none."""
    turn: float
    """Angle between its old normal and that of the nearest like face [rad]; 0.0 if there is none.
    """
    reason: str = ""
    """Why it has no place: finger, face and distance; empty if it has one."""

    def __repr__(self) -> str:
        return summary(
            "CarriedContact", finger=self.finger, old_face=self.old_face, new_face=self.new_face,
            distance=self.distance,
        )  # fmt: skip


def carried_contacts(
    old: Polyhedron, new: Polyhedron, grasp: Grasp, rule: Likeness
) -> tuple[CarriedContact, ...]:
    """Carry the four contacts of a grasp over to a changed part, in finger order."""
    return tuple(
        _carried((old, new), finger, face, contact, rule)
        for finger, (face, contact) in enumerate(zip(grasp.faces, grasp.contacts, strict=True))
    )


def _carried(
    parts: tuple[Polyhedron, Polyhedron], finger: int, face: int, contact: Contact, rule: Likeness
) -> CarriedContact:
    old, new = parts
    lost = f"finger {finger} has lost face {face} ({face_in_words(old.faces[face])})"
    place = place_of(new, contact.position, contact.normal, rule)
    near = place or nearest_at_any_distance(new, contact.position, contact.normal, rule)
    if near is None:
        reason = f"{lost}: {_turned(new, contact, rule)}"
        return CarriedContact(finger, face, None, None, math.inf, 0.0, reason)
    turn = _angle(contact, near)
    if place is not None:
        return CarriedContact(finger, face, place.part.face, place.contact, place.distance, turn)
    reason = (
        f"{lost}: the nearest face like it, {_on(new, near)}, is {MM * near.distance:.2f} mm away, "
        f"more than {MM * rule.distance:.2f} mm{_nearer(new, contact, near.distance, rule)}"
    )
    return CarriedContact(finger, face, None, None, near.distance, turn, reason)


def _nearer(new: Polyhedron, contact: Contact, distance: float, rule: Likeness) -> str:
    """Name the face that a contact was on, if it turned too far; empty if no such face is near."""
    near = nearest_at_any_distance(new, contact.position, contact.normal, _wide(rule))
    if near is None or near.distance >= distance - rule.same:
        return ""
    return (
        f"; nearer, {MM * near.distance:.2f} mm away, is {_on(new, near)}, but turned by "
        f"{_degrees(contact, near)}, more than {math.degrees(rule.angle):.4g} deg"
    )


def _wide(rule: Likeness) -> Likeness:
    return replace(rule, angle=math.radians(WIDEST_DEG))


def _degrees(contact: Contact, near: Nearest) -> str:
    return f"{math.degrees(_angle(contact, near)):.2f} deg"


def _turned(new: Polyhedron, contact: Contact, rule: Likeness) -> str:
    """Say that no face is like that of a contact, and which one it may have become."""
    said = f"no face of the changed part is within {math.degrees(rule.angle):.4g} deg of it"
    near = nearest_at_any_distance(new, contact.position, contact.normal, _wide(rule))
    if near is None:
        return said
    return (
        f"{said}; the nearest one within {WIDEST_DEG:g} deg, {_on(new, near)}, is turned by "
        f"{_degrees(contact, near)} and {MM * near.distance:.2f} mm away"
    )


def _on(new: Polyhedron, near: Nearest) -> str:
    """Name a face of the changed part, whose numbers are its own."""
    number = near.part.face
    return (
        f"face {number} in the numbering of the changed part ({face_in_words(new.faces[number])})"
    )


def _angle(contact: Contact, near: Nearest) -> float:
    """Return the angle between the normal of a contact and that of a face near it [rad]."""
    sine = float(np.linalg.norm(cross(contact.normal, near.contact.normal)))
    return math.atan2(sine, float(contact.normal @ near.contact.normal))
