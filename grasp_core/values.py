"""Defines the values of a grasp: contacts, force cones, regions, witnesses and grasps.

All of them are frozen. Every vector is in the object's frame and in SI units. Normals are unit
vectors that point into the object. Arrays are copied, checked and made read-only on construction.
"""

import math
from collections.abc import Iterable
from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, TypeVar

import numpy as np
from annotated_types import Interval
from pydantic import Field, computed_field

from grasp_core.allowed_values import NotNegative, Null, Number, Signed, value_of
from grasp_core.arrays import Array, Shape, UnitVector, UnitVectors
from grasp_core.by_value import counted, summary, vector
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.files.records import UNRECORDED
from grasp_core.frames import poses_along
from grasp_core.messages import FieldError, shown
from grasp_core.names import Family

RegionKind: TypeAlias = Literal["cone", "disc", "point", "certified"]
FaceQuadruple: TypeAlias = tuple[Number, Number, Number, Number]
"""Indices of four faces, in finger order."""

Item = TypeVar("Item")

FINGERS = 4
RIGHT_ANGLE = math.pi / 2
HalfAngle = Annotated[float, Interval(ge=0.0, lt=RIGHT_ANGLE)]
"""The half-angle of a cone, from 0 to below pi / 2 [rad]."""
Bounds = tuple[Signed, Signed]
"""A proved lower and a proved upper bound of one number."""


@declared
class ForceCone(Declared):
    """A circular cone of force directions inside a friction cone.

    In the paper its axis is the contact normal and its half-angle the friction angle.
    """

    axis: UnitVector
    """Unit vector along the middle of the cone, (3,)."""
    half_angle: Annotated[HalfAngle, Field(alias="half_angle_rad")]
    """Angle between the axis and the cone's surface, from 0 to below pi / 2 [rad]."""


@declared
class Contact(Declared):
    """A point where one fingertip touches the object, with the direction in which it can push."""

    position: Annotated[Array, Shape(3), Field(alias="position_m")]
    """Point on the surface, (3,) [m]."""
    normal: UnitVector
    """Unit vector into the object, (3,)."""


@declared
class ContactRegion(Declared):
    """A region where one finger may stand while the others stay anywhere in their own regions."""

    kind: RegionKind
    """Which proof certifies the region: `cone` is the inverted force cone of a focus point cut with
    the face, `disc` a disc around the contact of a pencil, `certified` a region with a proof of its
    own (see `certify_regions`); `point` claims nothing but the contact."""
    polygon: Annotated[Array, Shape(None, 3), Field(alias="polygon_m")]
    """Convex polygon on the face, (k, 3) [m]; for a disc, points of its border."""
    inscribed_radius: Annotated[NotNegative, Field(alias="inscribed_radius_m")]
    """Radius of the largest disc inside the region [m]."""

    def __repr__(self) -> str:
        corners = counted(len(self.polygon), "corner")
        return summary("ContactRegion", self.kind, corners, inscribed_radius=self.inscribed_radius)


@declared
class Witness(Declared):
    """Balanced contact forces, whose four lines show to which family a grasp belongs."""

    points: Annotated[Array, Shape(FINGERS, 3), Field(alias="points_m")]
    """One point on each line, namely the contact, (4, 3) [m]."""
    forces: Annotated[Array, Shape(FINGERS, 3)]
    """Forces along the lines, into the object, whose normal parts sum to one, (4, 3)."""

    @computed_field
    @property
    def directions(self) -> UnitVectors:
        """Return unit vectors along the lines, (4, 3)."""
        return self.forces / np.linalg.norm(self.forces, axis=1, keepdims=True)

    def __repr__(self) -> str:
        return summary("Witness", *(vector(force) for force in self.forces))


PUT_OFF = ("critical_friction", "ferrari_canny")
"""Fields of a grasp that may be computed when they are asked for."""


@declared
class Grasp(Declared):
    """Four contacts in finger order, with a witness that shows why they hold the object.

    A planned grasp computes its `critical_friction` and its `ferrari_canny` when they are first
    asked for, and keeps them: a plan of thousands of grasps would take several times as long with
    both. Copies, pickles and files hold the computed figures.
    """

    id: Annotated[str, Shown("grasp")]
    family: Annotated[Family, Shown("family")]
    faces: FaceQuadruple
    contacts: tuple[Contact, Contact, Contact, Contact]
    focus_points: Annotated[Array, Shape(None, 3), Field(alias="focus_points_m")]
    """Points where witness lines meet, (k, 3) [m]: one for a concurrent grasp, one for each pair of
    a pencil. For a regulus, the points midway between the two lines of each pair; empty for other
    grasps."""
    force_cones: tuple[ForceCone, ForceCone, ForceCone, ForceCone]
    """Force cones that the construction used; each lies inside its contact's friction cone."""
    regions: tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
    radius: Annotated[NotNegative, Field(alias="radius_m"), Shown("radius mm", ".3g", 1e3)]
    """Radius of the smallest of four discs in which fingers may stand independently [m]; 0.0 where
    no discs are claimed."""
    span_angle: Annotated[
        HalfAngle, Field(alias="span_angle_rad"), Shown("theta* deg", ".2f", math.degrees(1.0))
    ]
    """theta*, the largest half-angle [rad] below which cones around the four normals positively
    span."""
    critical_friction: Annotated[
        float, Interval(ge=0.0, le=math.inf), Null(math.inf), Shown("mu*", ".4f")
    ]
    """Smallest Coulomb coefficient above which the contacts are in force closure; computed at
    first use if the grasp was planned."""
    closure_margin: Annotated[Signed, Shown("margin", ".4f")]
    """Proved margin of force closure at the planned friction (see `ClosureCertificate.margin`)."""
    ferrari_canny: Annotated[Bounds, Shown("quality N", ".4f")]
    """Proved lower and upper bound [N] of the `l1` quality at the planned friction, with torques
    about the centre of mass and divided by the object's radius; computed at first use if the grasp
    was planned."""
    witness: Witness
    """Balanced forces whose four lines belong to the grasp's family."""
    approach_directions: Annotated[Array, Shape(FINGERS, 3, units=True)] | None = None
    """Unit vector along which each finger moves in to its contact on a free line, (4, 3); None if
    no free lines were asked for (`plan(finger=...)`)."""
    _figures: Annotated[Any, UNRECORDED] = field(default=None, init=False, compare=False)
    """Has a method for each figure that is `PUT_OFF`, by its name; None where they were given."""

    def _check_together(self) -> None:
        lower, upper = self.ferrari_canny
        if lower > upper:
            said = f"must be a lower bound, then an upper bound, got {shown((lower, upper))}"
            raise FieldError("ferrari_canny", said)

    if not TYPE_CHECKING:  # or any misspelt field would pass the type checker

        def __getattr__(self, name: str) -> Any:
            """Compute a figure that was put off, and keep it."""
            if name not in PUT_OFF or self._figures is None:
                raise AttributeError(f"a Grasp has no attribute {shown(name)}", name=name, obj=self)
            object.__setattr__(self, name, getattr(self._figures, name)())
            return getattr(self, name)

    @property
    def positions(self) -> Array:
        """Return the contact points in finger order, (4, 3) [m]."""
        return np.array([contact.position for contact in self.contacts])

    @property
    def normals(self) -> Array:
        """Return the inward normals in finger order, (4, 3)."""
        return np.array([contact.normal for contact in self.contacts])

    def contact_frames(self) -> Array:
        """Return a pose at each contact in finger order, (4, 4, 4) [m].

        The origin is the contact, z is the inward normal, and x and y lie in the face (see
        `grasp_core.frames.plane_tangents`). Each pose maps its own coordinates to the object's.
        """
        return poses_along(self.positions, self.normals)

    def approach_poses(self, standoff_m: float = 0.0) -> Array:
        """Return a pose from which each finger moves in along its z axis, (4, 4, 4) [m].

        The z axis is the approach direction, or the inward normal where none was planned. x and y
        are as in `contact_frames`.

        Args:
            standoff_m: Distance of the origins before the contacts [m].

        Raises:
            InputError: The distance is not a number from 0 up.
        """
        value_of(NotNegative, standoff_m, "standoff_m")
        ways = self.normals if self.approach_directions is None else self.approach_directions
        return poses_along(self.positions - standoff_m * ways, ways)

    def __repr__(self) -> str:
        return summary(
            "Grasp", shown(self.id), self.family, faces=self.faces, radius=self.radius,
            critical_friction=self.critical_friction, closure_margin=self.closure_margin,
            ferrari_canny=np.array(self.ferrari_canny),
        )  # fmt: skip


def four(items: Iterable[Item]) -> tuple[Item, Item, Item, Item]:
    """Return exactly four items, one per finger."""
    listed = tuple(items)
    if len(listed) != FINGERS:
        raise InputError(f"a grasp needs {FINGERS} items, one per finger, got {len(listed)}")
    return listed
