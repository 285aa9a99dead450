"""Defines recorded grasps, in whatever format they came, and records that are wrong.

Frames: the object's frame is that of its mesh, after its lengths were multiplied by the scale. The
root of a hand is the world of the hand's file. Lengths are in metres and angles in radians.
"""

from typing import Annotated, TypeAlias

import numpy as np
from annotated_types import Interval, Len
from pydantic import AfterValidator

from grasp_core.arrays import Array, Shape
from grasp_core.by_value import summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.hand import LARGEST_ANGLE, RIGID_SLACK, Rotation
from grasp_core.messages import UnfitError
from grasp_core.planning.grasps_json import FEWEST_CONTACTS, MOST_CONTACTS
from grasp_core.values import Contact

LARGEST_ROOT_M = 10.0
"""Largest coordinate of a hand's root in the object's frame [m]: a larger one is in other units."""
LARGEST_POSTURE_RAD = 2.0 * LARGEST_ANGLE
"""Largest angle of a posture: squeezes aim beyond the ranges of joints, and degrees are larger."""
MOST_JOINTS = 100
LONGEST_TEXT = 1000


def _pose(pose: Array) -> Array:
    """Refuse a matrix that is no pose of a hand near an object."""
    turn = pose[:3, :3]
    off = float(np.abs(turn @ turn.T - np.eye(3)).max())
    if off > RIGID_SLACK or not np.linalg.det(turn) > 0.0 or pose[3].tolist() != [0, 0, 0, 1]:
        raise UnfitError("must be a pose: a right-handed rotation, a position, and 0, 0, 0, 1")
    if (farthest := float(np.abs(pose[:3, 3]).max())) > LARGEST_ROOT_M:
        raise UnfitError(
            f"must be within {LARGEST_ROOT_M:g} m of the object, got a coordinate of {farthest:.6g}"
        )
    return pose


def _printable(text: str) -> str:
    if not text.isprintable():
        raise UnfitError(f"must be text that can be printed, got {text[:40]!r}")
    return text


def _radians(angles: Array) -> Array:
    """Refuse angles that no joint has."""
    most = float(np.abs(angles).max(initial=0.0))
    if most > LARGEST_POSTURE_RAD:
        raise UnfitError(
            f"must be radians from -{LARGEST_POSTURE_RAD:.4g} to {LARGEST_POSTURE_RAD:.4g}, got "
            f"{most:.4g}; degrees are larger, so convert them"
        )
    return angles


RecordText = Annotated[str, Len(1, LONGEST_TEXT), AfterValidator(_printable)]
MeshScale = Annotated[float, Interval(ge=1e-6, le=1e3)]


@declared
class Posture(Declared):
    """Where a hand is, and how it is bent."""

    root: Annotated[Array, Shape(POSE_SIZE, POSE_SIZE), AfterValidator(_pose)]
    """Pose of the hand's root in the object's frame, (4, 4) [m]."""
    joints: Annotated[
        Array,
        Shape("j"),
        Len(1, MOST_JOINTS),
        AfterValidator(_radians),
    ]
    """Joint angles, (j,) [rad]."""


@declared
class HandRecord(Declared):
    """A recorded grasp of a hand."""

    id: RecordText
    """The file, relative to the folder that was given, and the record's place in it from 0, as in
    `mug.npy#12`; the file alone where it holds one record."""
    object: RecordText
    """The object, as the record names it."""
    scale: MeshScale
    """Factor on the lengths of the object's mesh."""
    joint_names: Annotated[tuple[RecordText, ...], Len(0, MOST_JOINTS)]
    """Names of the j joints; none where they are in the order of the hand's file."""
    grasp: Posture
    """The hand where it touches."""
    pregrasp: Posture | None
    """The open hand from which it closes; None where none is recorded."""
    squeeze: Posture | None
    """What servos are told to squeeze with; None where nothing is recorded."""
    axes: Rotation
    """Columns are the axes of the record's world in the object's frame, (3, 3)."""

    def _check_together(self) -> None:
        known = len(self.grasp.joints)
        counts = {len(self.joint_names), len(set(self.joint_names))}
        if self.joint_names and counts != {known}:
            raise InputError(
                f"joint_names must be {known} different names, one for each angle, got "
                f"{max(counts)}, {min(counts)} of them different"
            )
        for name, each in (("pregrasp", self.pregrasp), ("squeeze", self.squeeze)):
            if each is not None and len(each.joints) != known:
                raise InputError(
                    f"{name} must have the {known} joints of the grasp, got {len(each.joints)}"
                )

    def __repr__(self) -> str:
        return summary("HandRecord", self.id, self.object, joints=len(self.grasp.joints))


@declared
class ContactRecord(Declared):
    """The contacts of a recorded grasp of which no hand is known."""

    id: RecordText
    """The file and the record's place in it, as in `HandRecord`."""
    object: RecordText
    """The object, as the record names it."""
    scale: MeshScale
    """Factor on the lengths of the object's mesh."""
    contacts: Annotated[tuple[Contact, ...], Len(FEWEST_CONTACTS, MOST_CONTACTS)]
    """Points on the surface with normals into the object."""


@declared
class BadRecord(Declared):
    """A record or a file that cannot be read."""

    id: str
    """The file and the record's place in it, as in `HandRecord`."""
    reason: str
    """What was expected, what came, and what to do."""


GraspRecord: TypeAlias = HandRecord | ContactRecord | BadRecord
