"""Carries grasps over to a changed part and judges them anew.

A grasp keeps its fingers: finger i goes where `face_changes` says that its contact is now. A grasp
is `gone` if a contact has no place, if its contacts are no longer in force closure at the friction,
or if its fingers cannot reach it; otherwise its figures are compared with those on the old part,
and it is `same`, `better` or `worse`. The figures are those that contacts of another tool get:
force closure by a certificate, critical friction, and the Ferrari-Canny quality about the centre of
mass, at the radius of the part that they are on. The old figures are computed anew at the same
friction, so both sides are judged alike. A carried grasp claims no regions, and its witness is of
the general type, a regulus.

Bands: at friction mu, a critical friction counts as changed if it differs by more than
`FRICTION_BAND` mu, and a quality if its proved lower bound differs by more than `QUALITY_BAND` of
the old one. The band of critical frictions does not shrink with them: of a grasp whose forces meet
in a point, the critical friction is nearly zero, and any motion of a face multiplies it.

An id that a plan has made of face numbers, such as `c-0-1-2-7`, gets the new face numbers; any
other id stays. Where a new id is taken, the later grasp gets `-2`, `-3` and so on behind it.

The mesh file of a changed part is read the way the old one was. A `grasps.json` does not say in
which unit that was. Where neither the file nor the user says so, it is taken to be the unit in
which the changed part is most nearly as large as the old one, by the diagonals of their bounding
boxes. A part that has then become larger or smaller by more than `SURE_GROWTH` could be in another
unit, so it is refused.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, count
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, get_args

import numpy as np
from pydantic import Field, computed_field

from grasp_core.allowed_values import Friction, Null, OrInfinity, instance, several, value_of
from grasp_core.arrays import Array
from grasp_core.by_value import counted, summary
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, UndecidedError
from grasp_core.families.free import of_general_type
from grasp_core.families.placements import Placement
from grasp_core.files.records import UNRECORDED
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import read_triangles
from grasp_core.messages import MILLI
from grasp_core.objects.build import DEFAULT_LIMITS
from grasp_core.objects.face_pieces import piece_of
from grasp_core.objects.on_faces import check_on_faces, check_planar
from grasp_core.objects.polyhedron import UNITS_M, Polyhedron
from grasp_core.objects.shells import SMALL_SHARE
from grasp_core.planning.given_contacts import Seated, facets_of, grasp_of, nearest_like
from grasp_core.planning.reach import Finger, reach
from grasp_core.transferring.part_comparison import (
    ANGLE_DEG,
    CHANGE_ROUNDING,
    FaceChange,
    Likeness,
    added_faces,
    changes_in_words,
    face_changes,
    likeness,
    turn_of,
)
from grasp_core.values import FINGERS, Contact, Grasp, Witness, four

BY_FACES = re.compile(r"([a-z](?:-[a-z])*)((?:-\d+[ab]?){4})")
"""Ids that plans make: letters of methods, then the faces by finger, perhaps halves of faces."""
Change: TypeAlias = Literal["same", "better", "worse", "gone"]
"""How a grasp of the changed part compares with that of the old part."""
CHANGES: tuple[Change, ...] = get_args(Change)
FRICTION_BAND = 0.05
"""Difference of critical frictions that does not count, as a share of the friction."""
QUALITY_BAND = 0.05
"""Difference of qualities that does not count, as a share of the old quality."""
WITNESS_DRAWS = 8  # how often internal forces are drawn that may make the lines of a witness skew


@declared
class GraspFigures(Declared):
    """What contacts reach at a friction."""

    closure_margin: Annotated[float, Null(-math.inf)]
    """Proved margin of force closure; zero or negative where the contacts are not closed."""
    critical_friction: OrInfinity
    """Smallest Coulomb coefficient above which the contacts are in force closure; at most the
    friction where they are closed, and infinite (null in files) where none suffices."""
    ferrari_canny: tuple[float, float]
    """Proved lower and upper bound of the quality [N]; zeros where the contacts are not closed."""


@declared
class CarriedContact(Declared):
    """What became of one contact of a grasp on the changed part."""

    finger: int
    """Index of the finger."""
    old_face: int
    """Number of the face of the old part on which the contact was."""
    new_face: int | None
    """Number of the face of the changed part that it is on now; None if it has no place there."""
    contact: Contact | None
    """The contact on the changed part, with the normal of its face; None if it has no place."""
    distance: Annotated[OrInfinity, Field(alias="moved_m")]
    """How far it moved [m]; without a place, the distance of the nearest like face, which is
    infinite (null in files) if there is none."""
    turn: Annotated[float, Field(alias="turned_rad")]
    """Angle between its old normal and that of the nearest like face [rad]; 0.0 if there is none.
    """


@declared
class CarriedGrasp(Declared):
    """What became of one grasp on the changed part."""

    old: Annotated[Grasp, UNRECORDED]
    """The grasp of the old part."""
    status: Change
    """`same`, `better` or `worse` by the bands of this module; `gone` if there is no grasp."""
    reason: str
    """Why it is better, worse or gone; empty if it is the same."""
    contacts: tuple[CarriedContact, ...]
    """What became of each contact, in finger order."""
    before: GraspFigures
    """What the grasp reached on the old part, at the friction that is judged with."""
    after: GraspFigures | None
    """What its contacts reach on the changed part; None if a contact has no place there, or if
    closure cannot be decided."""
    grasp: Annotated[Grasp | None, UNRECORDED]
    """The grasp of the changed part, without regions; None exactly where the status is `gone`."""

    @computed_field
    @property
    def id(self) -> str:
        """The id of the grasp of the old part."""
        return self.old.id

    @computed_field
    @property
    def new_id(self) -> str | None:
        """The id of the grasp of the changed part; None if it is gone."""
        return None if self.grasp is None else self.grasp.id

    def __repr__(self) -> str:
        now = "none" if self.grasp is None else self.grasp.id
        return summary("CarriedGrasp", f"{self.old.id} -> {now}", self.status, reason=self.reason)


@declared
class Transfer(Declared):
    """Grasps carried over to a changed part, with what became of its faces."""

    old: Annotated[Polyhedron, UNRECORDED]
    new: Annotated[Polyhedron, UNRECORDED]
    friction: Friction
    distance: Annotated[float, Field(alias="distance_m")]
    """Largest distance by which a contact was allowed to move [m]."""
    angle: Annotated[float, Field(alias="angle_rad")]
    """Largest angle between the normals of like faces [rad]."""
    faces: tuple[FaceChange, ...]
    """What became of each face of the old part, in order."""
    added: Annotated[tuple[int, ...], Field(alias="added_faces")]
    """Faces of the changed part that succeed no old one, ascending."""
    grasps: tuple[CarriedGrasp, ...]
    """What became of each grasp, in the order in which they were given."""

    @property
    def carried(self) -> tuple[Grasp, ...]:
        """Return the grasps of the changed part."""
        return tuple(each.grasp for each in self.grasps if each.grasp is not None)

    def count(self, status: Change) -> int:
        """Return the number of grasps with a status."""
        return sum(each.status == status for each in self.grasps)

    @computed_field
    @property
    def bands(self) -> Mapping[str, float]:
        """Differences that do not count: of critical frictions, and of qualities as a share."""
        return {
            "critical_friction": FRICTION_BAND * self.friction,
            "ferrari_canny_share": QUALITY_BAND,
        }

    @computed_field
    @property
    def summary(self) -> Mapping[str, int]:
        """Numbers of grasps of each status, and of contacts that moved or were lost."""
        contacts = [each for grasp in self.grasps for each in grasp.contacts]
        rounding = (
            self.old.radius * CHANGE_ROUNDING
        )  # a contact on a face that stayed is put on its plane
        placed = [each for each in contacts if each.contact is not None]
        return {
            "grasps": len(self.grasps),
            **{status: self.count(status) for status in CHANGES},
            "contacts_moved": sum(each.distance > rounding for each in placed),
            "contacts_lost": len(contacts) - len(placed),
        }

    @property
    def faces_in_words(self) -> str:
        """Say in one line which faces moved, and by how much."""
        return changes_in_words(self.faces, self.added)

    def __repr__(self) -> str:
        counts = [f"{self.count(status)} {status}" for status in CHANGES]
        said = f"of {counted(len(self.grasps), 'grasp')} {', '.join(counts)}"
        return summary("Transfer", said, self.faces_in_words, friction=self.friction)


def transfer(
    old: Polyhedron,
    new: Polyhedron,
    grasps: Iterable[Grasp],
    friction: float = 0.5,
    *,
    distance: float | None = None,
    angle_deg: float = ANGLE_DEG,
    finger: Finger | None = None,
) -> Transfer:
    """Carry grasps over to a part that has changed since they were planned, and judge them anew.

    Each contact goes to the nearest point of the changed part on a face whose normal is like its
    own; the rules are in `grasp_core.transferring.part_comparison`, the bands by which grasps are
    compared in `grasp_core.transferring.transfer`.

    Args:
        old: The part that the grasps were planned on, with planar faces.
        new: The changed part, with planar faces, in the same frame and unit.
        grasps: Grasps of the old part, or a plan's `grasps`.
        friction: Coulomb coefficient at every contact.
        distance: Largest distance by which a contact may move [m]; None for a twentieth of the old
            part's radius.
        angle_deg: Largest angle between the normals of like faces, up to 45 [deg].
        finger: Size of the fingers that must reach their contacts on free straight lines; None if
            that is not asked for.

    Raises:
        InputError: A part is curved, a grasp is not one of the old part, or a number is out of
            range.
        SolverError: A program's answer failed its check.
    """
    for body, name in ((old, "old"), (new, "new")):
        instance(body, Polyhedron, name, "gc.load_polyhedron reads one from a mesh file")
        check_planar(body, name)
    value_of(Friction, friction, "friction")
    if finger is not None:
        instance(finger, Finger, "finger")
    rule = likeness(old, distance, angle_deg)
    listed = several(grasps, partial(instance, kind=Grasp, name="grasps"), "grasps", "Grasp values")
    for grasp in listed:
        check_on_faces(old, grasp)
    changes = face_changes(old, new, rule)
    judge = _Judge(old, new, friction, rule, finger)
    return Transfer(
        old, new, friction, rule.distance, rule.angle, changes, added_faces(changes, new),
        tuple(judge.carried(grasp) for grasp in listed),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    old: Polyhedron
    new: Polyhedron
    friction: float
    rule: Likeness
    finger: Finger | None
    taken: set[str] = field(default_factory=set[str])  # ids of the grasps that were carried over

    def carried(self, grasp: Grasp) -> CarriedGrasp:
        """Carry a grasp over and judge it on both parts."""
        contacts = tuple(
            self._contact(finger, face, contact)
            for finger, (face, contact) in enumerate(zip(grasp.faces, grasp.contacts, strict=True))
        )
        before, _ = judged(Seated(self.old, grasp.faces, grasp.contacts), self.friction, grasp.id)
        # undecided: at its critical friction, so neither better nor closed for sure
        before = before or GraspFigures(0.0, self.friction, (0.0, 0.0))
        lost = "; ".join(self._lost(each) for each in contacts if each.contact is None)
        if lost:
            return CarriedGrasp(grasp, "gone", lost, contacts, before, None, None)
        seated = Seated(
            self.new, four(each.new_face for each in contacts if each.new_face is not None),
            four(each.contact for each in contacts if each.contact is not None),
        )  # fmt: skip
        name = self._free_id(_id_on(grasp, contacts))
        after, now = judged(seated, self.friction, name)
        if isinstance(now, Grasp) and self.finger is not None:
            ways = reach(self.new, now.faces, now.positions, now.normals, self.finger)
            reached = not isinstance(ways, str)
            now = replace(now, approach_directions=-ways) if reached else f"out of reach: {ways}"
        if after is None or isinstance(now, str):
            return CarriedGrasp(grasp, "gone", str(now), contacts, before, after, None)
        self.taken.add(name)
        status, reason = compared(before, after, self.friction)
        return CarriedGrasp(grasp, status, reason, contacts, before, after, now)

    def _free_id(self, wanted: str) -> str:
        later = (f"{wanted}-{number}" for number in count(2))
        return next(name for name in chain([wanted], later) if name not in self.taken)

    def _contact(self, finger: int, face: int, contact: Contact) -> CarriedContact:
        rule, normal = self.rule, contact.normal
        near = nearest_like(
            facets_of(self.new), contact.position, normal, lean=rule.angle + CHANGE_ROUNDING,
            reach=math.inf, margin=rule.same,
        )  # fmt: skip
        if near is None:
            return CarriedContact(finger, face, None, None, math.inf, 0.0)
        turn, placed = turn_of(normal, near.contact.normal), near.distance <= rule.reach
        new_face, place = (near.face, near.contact) if placed else (None, None)
        return CarriedContact(finger, face, new_face, place, near.distance, turn)

    def _lost(self, lost: CarriedContact) -> str:
        near = f"no face is within {math.degrees(self.rule.angle):.4g} deg of it"
        if math.isfinite(lost.distance):
            reach = f"distance_m allows {MILLI * self.rule.reach:.2f} mm"
            near = f"the nearest face like it is {MILLI * lost.distance:.2f} mm away, {reach}"
        return f"finger {lost.finger} has lost face {lost.old_face}: {near}"


def judged(seated: Seated, friction: float, name: str) -> tuple[GraspFigures | None, Grasp | str]:
    """Judge contacts on the faces of a part; make a grasp of them, or say why they make none."""
    try:
        found = grasp_of(seated, friction, name)
        if isinstance(found, ClosureCertificate):
            needed = critical_friction(found.positions, found.normals)
            said = f"above {needed:.4f} they are" if math.isfinite(needed) else "none suffices"
            said = f"its contacts are not in force closure at friction {friction:g}: {said}"
            return GraspFigures(found.margin, needed, (0.0, 0.0)), said
    except UndecidedError as error:
        said = f"whether its contacts are still in force closure is too close to call: {error}"
        return None, said
    figures = GraspFigures(found.closure_margin, found.critical_friction, found.ferrari_canny)
    body = seated.body
    center, size = body.center_of_mass, body.radius
    faces = [(index, body.faces[index]) for index in found.faces]
    pieces = [
        piece_of(index, face.normal, (face.pieces[0] - center) / size) for index, face in faces
    ]
    positions, none = (found.positions - center) / size, np.empty((0, 3))
    plain = Placement(positions, found.witness.forces, none, np.zeros(FINGERS), 0.0)
    # the forces of a certificate may all meet, as at the face centres of a regular solid
    for draw in range(WITNESS_DRAWS):
        skew = of_general_type(pieces, plain, friction, np.random.default_rng(draw))
        if skew is not None:
            return figures, replace(found, witness=Witness(found.positions, skew.forces))
    return figures, "its friction cones leave too little room for a witness of force closure"


def compared(old: GraspFigures, new: GraspFigures, friction: float) -> tuple[Change, str]:
    """Say how the figures of a grasp that is still closed have changed, and which ones."""
    if old.closure_margin <= 0.0:
        return "better", f"not in force closure before, at friction {friction:g}"
    rise = new.critical_friction - old.critical_friction
    gain = new.ferrari_canny[0] - old.ferrari_canny[0]
    of_friction = f"critical friction {old.critical_friction:.4f} -> {new.critical_friction:.4f}"
    of_quality = f"quality {old.ferrari_canny[0]:.4f} -> {new.ferrari_canny[0]:.4f} N"
    allowed, band = FRICTION_BAND * friction, QUALITY_BAND * old.ferrari_canny[0]
    worse = [text for text, by in ((of_friction, rise - allowed), (of_quality, -gain - band))
             if by > 0.0]  # fmt: skip
    if worse:
        return "worse", "; ".join(worse)
    better = [text for text, by in ((of_friction, -rise - allowed), (of_quality, gain - band))
              if by > 0.0]  # fmt: skip
    return ("better", "; ".join(better)) if better else ("same", "")


def _id_on(grasp: Grasp, contacts: Iterable[CarriedContact]) -> str:
    """Return the id of a grasp with the new numbers of its faces, if the id is made of them."""
    parts = BY_FACES.fullmatch(grasp.id)
    if parts is None:
        return grasp.id
    named = parts[2].split("-")[1:]
    if tuple(int(each.rstrip("ab")) for each in named) != grasp.faces:
        return grasp.id
    now = (f"{each.new_face}{half[len(half.rstrip('ab')):]}"
           for each, half in zip(contacts, named, strict=True))  # fmt: skip
    return "-".join([parts[1], *now])


GUESSED = ("m", "cm", "mm", "in")
"""Units in which a mesh file may be that does not state its own."""
SURE_GROWTH = 1.5
"""Largest ratio of the two sizes at which the unit is sure: an inch and a centimetre, the two units
nearest to each other, differ by 2.54, which is more than the square of it."""
LENGTH_ROUNDING = 1e-6
"""Largest relative difference of two lengths that differ by rounding and joined vertices only."""


def as_read(old: Polyhedron) -> dict[str, Any]:
    """Return the keywords of `load_polyhedron` that read a changed part as the old one was read."""
    return {
        "faces": "planar",
        "largest_part": old.surface.dropped > SMALL_SHARE,
        "center_of_mass": old.center_of_mass if old.surface.center_given else None,
    }


def growth(old: Polyhedron, new: Polyhedron) -> float:
    """Return the size of a changed part relative to the old one."""
    return _diagonal(new.vertices) / _diagonal(old.vertices)


def fitting_unit(
    path: Path, old: Polyhedron, limits: MeshLimits = DEFAULT_LIMITS, *, scale: float = 1.0
) -> str:
    """Find the unit in which a mesh file holds a part about as large as the old one."""
    stated, times = _times(path, old, limits)
    if stated is not None:
        return stated
    size = scale * times
    off = {
        unit: abs(math.log(size * UNITS_M[unit])) if size > 0.0 else math.inf for unit in GUESSED
    }
    best = min(off, key=off.__getitem__)
    if off[best] > math.log(SURE_GROWTH):
        raise InputError(
            f"{path}: the unit of the changed part is not clear: in {best}, which fits best, its "
            f"size is {size * UNITS_M[best]:.3g} times that of the old part; say the unit, and the "
            "scale if it has one"
        )
    return best


def fitting_lengths(
    path: Path, body: Polyhedron, limits: MeshLimits = DEFAULT_LIMITS
) -> tuple[str, float]:
    """Find a unit and a scale at which a mesh file is as large as the body read from it."""
    stated, times = _times(path, body, limits)
    for unit in GUESSED if stated is None else (stated,):
        if math.isclose(times * UNITS_M[unit], 1.0, rel_tol=LENGTH_ROUNDING):
            return unit, 1.0
    unit = stated or "m"
    return unit, float(f"{1.0 / (times * UNITS_M[unit]):.9g}")


def _times(path: Path, body: Polyhedron, limits: MeshLimits) -> tuple[str | None, float]:
    """Return the unit that a mesh file states, and its size in its unit relative to a body's."""
    mesh = read_triangles(path, limits)
    return mesh.unit, _diagonal(mesh.vertices[np.unique(mesh.triangles)]) / _diagonal(body.vertices)


def _diagonal(vertices: Array) -> float:
    return float(np.linalg.norm(np.ptp(vertices, axis=0))) if len(vertices) else 0.0
