"""Says where a contact or a face of an old part is on a changed one, and how it moved.

Both parts are in the same frame and unit. For a point p of the old surface with the inward normal
n, the point q of the new surface that takes its place is found by these rules, in this order:

1. A face is *like* n if its own inward normal makes an angle of at most `angle` with n.
2. On each like face, the candidate is the point nearest to p, its holes and notches left out: the
   foot of the perpendicular, or a point of the border if the foot is outside.
3. The nearest candidate is q if |q - p| <= `distance`. Of candidates that are equally near, to
   within `CHANGE_ROUNDING` of the old part's size, the one on the face with the lowest number is q.
4. Otherwise p has no place on the new surface.

Therefore a point on a face that has moved along its normal by h goes straight along that normal, by
h; one on a face that has not changed stays where it is; and one where a hole was drilled goes to
the rim of the hole. Nothing is found through the part: the face on the other side of a plate has
the opposite normal, which is never like.

Each old face is represented by the centres of the convex pieces that tile it, weighted by area. Its
*distance* from a new face is the mean distance of these centres from that face. Of the new faces
that are like it, the nearest becomes its successor if its distance is at most the one that contacts
may move. An old face without such a successor gets the nearest like face that
succeeds no other one, however far it is. Of equally near faces, the one with the lowest number is
taken. One new face may succeed several old ones that have merged; of a face that was cut in two,
one part succeeds it, and the other counts as added.

An old face that no face is like may have turned too far for that. The nearest of the new faces that
succeed no other one, turned by at most `WIDEST_DEG`, is then named as what it probably became, but
no contact follows it there.

How far a face moved is measured on the line through its old centroid c along its old normal n. With
q any point of the new plane and n' its normal, the line meets that plane at c - h n, where

    h = n'.(c - q) / n'.n,                                                              (1)

positive outwards, because normals point into the part.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from grasp_core.allowed_values import FaceTurn, Vector, number, value_of
from grasp_core.arrays import Array, cross
from grasp_core.by_value import counted
from grasp_core.declared import Declared, declared
from grasp_core.messages import MILLI
from grasp_core.objects.on_faces import nearest_on_triangles, on_face_slack
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.planning.given_contacts import fan
from grasp_core.transferring.settings import Carrying

SHARE_OF_SIZE = 0.05
"""Default for how far a contact may move, relative to the old part's radius."""
ANGLE_DEG = Carrying().angle_deg
WIDEST_DEG = 45.0
"""Largest angle between the normals of like faces that is accepted [deg]."""
CHANGE_ROUNDING = 1e-9
"""Difference of distances, relative to the old part's radius, and of angles [rad] that is rounding:
a face that has moved by exactly the allowed distance is still near enough."""
TURNED = 1e-4
"""Least angle that counts as turned [rad]: six digits turn a face by no more unless it is narrower
than a hundredth of the part."""
RESHAPED = 1e-5  # least change of a face's area that counts, relative to its area
FACES_IN_A_LINE = 12  # largest number of faces that one line names


@dataclass(frozen=True, slots=True)
class Likeness:
    """How near, and how little turned, a face must be to take the place of another one."""

    distance: float  # largest distance by which a contact may move [m]
    angle: float  # largest angle between the two normals [rad]
    same: float  # difference of distances that is rounding [m]

    @property
    def reach(self) -> float:
        """Return the largest distance, with rounding [m]."""
        return self.distance + self.same


def likeness(old: Polyhedron, distance: float | None, angle_deg: float) -> Likeness:
    """Build the rule for an old part."""
    where = f", the part's radius in m, or None for {SHARE_OF_SIZE:g} of it"
    usual = SHARE_OF_SIZE * old.radius
    most = usual if distance is None else distance
    return Likeness(
        number(most, "distance", ge=0.0, le=old.radius, where=where),
        math.radians(value_of(FaceTurn, angle_deg, "angle_deg")),
        CHANGE_ROUNDING * old.radius,
    )


@declared
class FaceChange(Declared):
    """What became of one face of the old part."""

    old: int
    """Number of the face on the old part."""
    new: int | None
    """Number of its successor on the changed part; None if there is none."""
    distance: Annotated[float, Field(alias="moved_m")]
    """How far the face moved, positive outwards, at its old centroid [m]; 0.0 without successor."""
    turn: Annotated[float, Field(alias="turned_rad")]
    """Angle between the old and the new normal [rad]; 0.0 without successor."""
    old_area: Annotated[float, Field(alias="old_area_m2")]
    """Area on the old part [m^2]."""
    new_area: Annotated[float, Field(alias="new_area_m2")]
    """Area of the successor [m^2]; 0.0 without one."""
    moved: bool
    """Whether the face is gone, or its plane is another one by more than rounding."""
    normal: Vector
    """Inward unit normal on the old part."""
    center: Annotated[Vector, Field(alias="center_m")]
    """Centroid on the old part [m]."""
    likely: int | None = None
    """Number of the face that it probably became although it turned too far to succeed it; None if
    it has a successor, or no face is plausible."""
    likely_turn: Annotated[float, Field(alias="likely_turned_rad")] = 0.0
    """Angle between the normals of these two [rad]; 0.0 without such a face."""

    @property
    def reshaped(self) -> bool:
        """Return whether the area of the face is another one, as after a hole was drilled."""
        return abs(self.new_area - self.old_area) > RESHAPED * self.old_area

    def __str__(self) -> str:
        """Say what became of the face: `face 3 moved 1.00 mm outward`."""
        return self.in_words(f"face {self.old}")

    def in_words(self, name: str) -> str:
        """Say what became of the face, under the name that another numbering gives it."""
        if self.likely is not None:
            turn = math.degrees(self.likely_turn)
            return f"{name} turned {turn:.2f} deg, too far to be the same face"
        if self.new is None:
            return f"{name} is gone"
        if not self.moved:
            return f"{name} is as it was"
        way = "outward" if self.distance > 0.0 else "inward"
        turned = f" and turned {math.degrees(self.turn):.2f} deg" if self.turn > TURNED else ""
        return f"{name} moved {abs(MILLI * self.distance):.2f} mm {way}{turned}"


def changes_in_words(
    changes: Sequence[FaceChange],
    added: Sequence[int] = (),
    numbers: Mapping[int, int] | None = None,
) -> str:
    """Say which faces moved, by numbers on another part if given, and count the other changes."""
    moved = sorted(
        (change for change in changes if change.moved),
        key=lambda change: (change.new is not None, -abs(change.distance), change.old),
    )
    said: list[str] = []
    for change in moved[:FACES_IN_A_LINE]:
        number = change.old if numbers is None else numbers.get(change.old)
        said.append(change.in_words("a newer face" if number is None else f"face {number}"))
    if len(moved) > FACES_IN_A_LINE:
        said.append(f"{len(moved) - FACES_IN_A_LINE} more faces moved")
    if kept := sum(change.reshaped and not change.moved for change in changes):
        said.append(f"{counted(kept, 'face')} of another area")
    likely = {change.likely for change in changes}
    if new := sum(index not in likely for index in added):
        said.append(counted(new, "new face"))
    return "; ".join(said) or "no face moved"


def face_changes(old: Polyhedron, new: Polyhedron, rule: Likeness) -> tuple[FaceChange, ...]:
    """Find the successor of each face of an old part, in the order of the old faces."""
    every = range(len(new.faces))
    near = [_successor(face, new, every, rule, rule.reach) for face in old.faces]
    free = sorted({*every} - {*near})
    changes: list[FaceChange] = []
    slack = max(on_face_slack(old), on_face_slack(new))  # less than this is no motion
    for index, (face, successor) in enumerate(zip(old.faces, near, strict=True)):
        found = successor
        if found is None and (found := _successor(face, new, free, rule, math.inf)) is not None:
            free.remove(found)
        changes.append(_change(index, face, found, new, slack))
    wide = replace(rule, angle=math.radians(WIDEST_DEG))
    for index, change in enumerate(changes):
        face = old.faces[index]
        if (
            change.new is None
            and (found := _successor(face, new, free, wide, math.inf)) is not None
        ):
            free.remove(found)
            turn = turn_of(face.normal, new.faces[found].normal)
            changes[index] = replace(change, likely=found, likely_turn=turn)
    return tuple(changes)


def added_faces(changes: Iterable[FaceChange], new: Polyhedron) -> tuple[int, ...]:
    """List the faces of the changed part that succeed no face of the old one, ascending."""
    known = {change.new for change in changes}
    return tuple(index for index in range(len(new.faces)) if index not in known)


def _successor(
    face: Face, new: Polyhedron, candidates: Sequence[int], rule: Likeness, reach: float
) -> int | None:
    """Find the nearest like face among some of the changed part; None if none is within reach."""
    like = new.normals @ face.normal >= math.cos(rule.angle + CHANGE_ROUNDING)
    centers = np.array([piece.mean(axis=0) for piece in face.pieces])
    weights = np.array([  # twice the areas of the pieces
        float(np.linalg.norm(cross(piece[1:-1] - piece[0], piece[2:] - piece[0]).sum(axis=0)))
        for piece in face.pieces
    ])  # fmt: skip
    best, least = None, math.inf
    for index in (each for each in candidates if like[each]):
        # planes are nowhere nearer than this, so most faces are left out at once
        plane = new.faces[index]
        heights = np.abs((centers - plane.centroid) @ plane.normal)
        if float(np.average(heights, weights=weights)) > min(reach, least):
            continue
        feet = nearest_on_triangles(fan(plane), centers)
        gaps = np.linalg.norm(feet - centers[:, None], axis=2).min(axis=1)
        mean = float(np.average(gaps, weights=weights))
        if mean <= reach and mean < least - rule.same:
            best, least = index, mean
    return best


def _change(
    index: int, face: Face, successor: int | None, new: Polyhedron, slack: float
) -> FaceChange:
    (x, y, z), (a, b, c) = face.normal.tolist(), face.centroid.tolist()
    normal, center = (x, y, z), (a, b, c)
    if successor is None:
        return FaceChange(index, None, 0.0, 0.0, face.area, 0.0, True, normal, center)
    now = new.faces[successor]
    along = float(now.normal @ face.normal)
    # (1), positive outwards
    distance = float(now.normal @ (face.centroid - now.centroid)) / along
    turn = turn_of(face.normal, now.normal)
    moved = abs(distance) > slack or turn > TURNED
    return FaceChange(index, successor, distance, turn, face.area, now.area, moved, normal, center)


def turn_of(normal: Array, now: Array) -> float:
    """Return the angle between two normals [rad]."""
    sine = float(np.linalg.norm(cross(normal, now)))
    return math.atan2(sine, float(now @ normal))
