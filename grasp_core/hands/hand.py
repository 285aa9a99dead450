"""Defines a hand: a palm, and fingers that are chains of revolute joints with a ball at the end.

Frames: the palm's frame is the hand's. Each link has a frame whose origin lies on its joint's axis.
With the angle q of a joint, the link's frame in the frame of the link before it is

    T(q) = (position, rotation) . turn(axis, q).                                          (1)

Shapes for collisions are boxes with rounded edges: all points within `radius` of a box. A radius of
zero makes it a box, two half-sizes of zero a capsule, three a ball.

Couplings: joints whose angle follows that of another, which alone moves freely. With the number d
of the joint that joint k follows (k itself where it moves freely), every joint is

    q_k = c_k + r_k q_d,                                                                  (2)

with r_k = 1 and c_k = 0 for a free joint. The angles of a free joint are those at which all joints
that follow it are in their ranges too. By virtual work the motor of a free joint carries

    tau_d = sum over its followers and itself of r_k tau_k.                               (3)

*Built-in hands* are records of `Hand`: `NAME.json` beside this module holds each, and `record_of`
writes one. Frames, joints and boxes are those of the sources that they name, to the last digit;
sources state turns as quaternions, and boxes in millimetres.

Allegro, the right hand of Wonik Robotics, version 3. Numbers of the URDF that SimLab publishes
(BSD-2-Clause, copyright 2016 SimLab), in the frames of MuJoCo Menagerie's model `wonik_allegro`
(BSD-2-Clause), whose capsules stand for the fingertips. The fingertip is the ball of radius 12 mm
at the end of that capsule. Capsules end 2.3 mm (thumb: .7 mm) beyond the balls of the URDF and its
meshes: `allegro-urdf` ends with those. The URDF states no efforts and Menagerie no torque limits.
Menagerie states the mass of the palm and a density of links, but no masses of links.

LEAP, the right hand of Carnegie Mellon University. Numbers of MuJoCo Menagerie's model `leap_hand`
(MIT, copyright 2023 Ananye Agarwal), which comes from dexsuite's URDF. Boxes, masses and centres of
mass are those of the model. Fingertips are rubber blocks 21 mm wide, 24 mm broad and rounded at the
end: the hulls of the corners of the model's meshes, given to .1 mm. All points within .1 mm of such
a hull hold the mesh, and reach at most .18 mm beyond it. A block is covered by the box around its
corners, whose edges are rounded by 5 mm and by as much as the corners need. The ball of 10.4 mm,
half a block's width, stands for a block where a tip has to be a ball.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from typing import Annotated

import numpy as np
from annotated_types import Interval, Len
from numpy.typing import ArrayLike
from pydantic import AfterValidator, Field

from grasp_core.allowed_values import TorqueLimit, value_of
from grasp_core.arrays import Array, Indices, Shape, UnitVector, frozen_each
from grasp_core.by_value import counted, summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.files.json_text import object_of
from grasp_core.files.records import from_record
from grasp_core.files.text_files import read_text
from grasp_core.messages import UnfitError, shown
from grasp_core.names import HANDS

LARGEST_SIZE = 2.0  # largest length of a hand [m]: a larger one is in other units
LARGEST_ANGLE = 2.0 * np.pi  # largest angle of a joint, in either direction [rad]
FEWEST_FINGERS, MOST_FINGERS = 3, 5
MOST_HAND_LINKS, MOST_SHAPES, MOST_TIP_CORNERS = 40, 400, 200
"""Largest numbers of links and shapes of a hand, and of corners of a fingertip."""
LEAST_ROUNDING = 5e-5
"""Least rounding of a fingertip [m]: the way from its hull to a surface must be a direction when it
touches to 10 um."""
FILE_DIGITS = 1e-9
"""Difference below which two lengths [m], or angles [rad], count as equal: the rounding of a file.
"""
RIGID_SLACK = 1e-9
"""How far the rows of a rotation may be from orthonormal: the rounding of ten digits."""
MOST_RATIO, LEAST_RATIO, MOST_OFFSET = 100.0, 0.01, 100.0
"""Sizes of ratios and offsets of couplings, which keep (2) exact to rounding."""
PALM_NAME = "palm"  # name of the palm among the links


def _turn(turned: Array) -> Array:
    """Refuse a matrix whose rows are not orthonormal and right-handed."""
    off = float(np.abs(turned @ turned.T - np.eye(3)).max())
    if off > RIGID_SLACK or not np.linalg.det(turned) > 0.0:
        raise UnfitError("must be a rotation matrix, right-handed with orthonormal rows")
    return turned


Rotation = Annotated[Array, Shape(3, 3), AfterValidator(_turn)]
HandPoint = Annotated[Array, Shape(3, least=-LARGEST_SIZE, most=LARGEST_SIZE)]
"""A point of a hand, (3,) [m]."""
TipCorners = Annotated[
    Array, Shape(None, 3, least=-LARGEST_SIZE, most=LARGEST_SIZE), Len(2, MOST_TIP_CORNERS)
]  # fmt: skip
"""Two or more points of a hand, (m, 3) [m]: one corner would make a ball."""
HandLength = Annotated[float, Interval(ge=0.0, le=LARGEST_SIZE)]
Angle = Annotated[float, Interval(ge=-LARGEST_ANGLE, le=LARGEST_ANGLE)]


@declared
class LinkShape(Declared):
    """All points within `radius` of a box: a box, a capsule or a ball of a link."""

    position: Annotated[HandPoint, Field(alias="position_m")]
    """Middle in the link's frame, (3,) [m]."""
    rotation: Rotation
    """Columns are the box's axes in the link's frame, (3, 3)."""
    half_sizes: Annotated[
        Array, Shape(3, least=0.0, most=LARGEST_SIZE), Field(alias="half_sizes_m")
    ]  # fmt: skip
    """Half the box's lengths along its axes, (3,) [m], each zero or more."""
    radius: Annotated[HandLength, Field(alias="radius_m")]
    """Distance from the box to the surface [m]."""

    def _check_together(self) -> None:
        if self.half_sizes.max() == 0.0 and self.radius == 0.0:
            raise InputError("half_sizes or radius must be above zero, got 0 for all")

    def holds(self, points: Array, radius: float) -> bool:
        """Return whether balls about points (n, 3) of the link's frame are within the shape."""
        out = np.abs((points - self.position) @ self.rotation) - self.half_sizes
        away = np.linalg.norm(np.maximum(out, 0.0), axis=1) + np.minimum(out.max(axis=1), 0.0)
        return bool((away + radius <= self.radius + FILE_DIGITS).all())


@declared
class Joint(Declared):
    """A revolute joint: where it is on the link before it, its axis, range and torque limit."""

    name: str
    position: Annotated[HandPoint, Field(alias="position_m")]
    """Origin of the moved link's frame, in the frame of the link before it, (3,) [m]."""
    rotation: Rotation
    """Axes of that frame at the angle zero, (3, 3)."""
    axis: UnitVector
    """Unit vector of the axis through the origin, in the moved link's frame, (3,)."""
    lowest: Annotated[Angle, Field(alias="lowest_rad")]
    """Smallest angle [rad]."""
    highest: Annotated[Angle, Field(alias="highest_rad")]
    """Largest angle [rad]."""
    torque_limit_n_m: TorqueLimit | None = None
    """Largest torque of the motor in either direction [N m]; None where no source states one."""

    def _check_together(self) -> None:
        if self.highest < self.lowest:
            raise InputError(
                f"highest must be no less than lowest, {self.lowest:g}, got {self.highest:g}"
            )


@declared
class Link(Declared):
    """A part of a finger behind one joint."""

    name: str
    joint: Joint
    shapes: tuple[LinkShape, ...]
    mass_kg: Annotated[float, Interval(ge=0.0, le=1e3)] | None = None
    """Mass [kg]; None where no source states one."""
    center_of_mass: Annotated[HandPoint | None, Field(alias="center_of_mass_m")] = None
    """Centre of mass in the link's frame, (3,) [m]; None where no source states one."""


@declared
class Fingertip(Declared):
    """The end of a finger that touches the object: a ball, or a block.

    A block is all points within `rounding` of the hull of its `corners`. A ball stands for it where
    a tip has to be one: in planning, and in simulations, where it lies at the block's contact.
    """

    center: Annotated[HandPoint, Field(alias="center_m")]
    """Middle of the ball in the last link's frame, (3,) [m]."""
    radius: Annotated[float, Interval(gt=0.0, le=LARGEST_SIZE), Field(alias="radius_m")]
    """Radius of the ball [m]."""
    corners: Annotated[TipCorners | None, Field(alias="corners_m")] = None
    """Corners of the block in the last link's frame, (m, 3) [m]; None for a ball."""
    rounding: Annotated[HandLength, Field(alias="rounding_m")] = 0.0
    """Distance from their hull to the surface of the block [m]; zero for a ball."""

    def _check_together(self) -> None:
        if self.corners is None and self.rounding > 0.0:
            raise InputError(f"rounding must be 0 for a ball, got {self.rounding:g}")
        if self.corners is not None and self.rounding < LEAST_ROUNDING:
            raise InputError(
                f"rounding must be from {LEAST_ROUNDING:g} to {LARGEST_SIZE:g} m for a block, got "
                f"{self.rounding:g}"
            )

    @property
    def core(self) -> tuple[Array, float]:
        """Return the corners whose hull is the tip but for a rounding, (m, 3), and that [m]."""
        if self.corners is None:
            return self.center[None], self.radius
        return self.corners, self.rounding


@declared
class HandFinger(Declared):
    """A chain of links from the palm, with a fingertip on the last of them.

    The last shape of the last link covers a fingertip that is a block: it stands for the tip
    wherever the tip is not to touch.
    """

    name: str
    links: tuple[Link, ...]
    tip: Fingertip

    def _check_together(self) -> None:
        links = self.links
        if not links:
            raise InputError(f"links of finger {self.name} must be at least one, got none")
        if self.tip.corners is not None and not (
            links[-1].shapes and links[-1].shapes[-1].holds(*self.tip.core)
        ):
            raise InputError(
                f"the last shape of the last link of finger {self.name} must cover its fingertip, "
                "whose corners are outside"
            )


@declared
class Coupling(Declared):
    """A joint that follows another: its angle is `offset + ratio * angle of the driver`."""

    joint: str
    """Name of the joint that follows."""
    driver: str
    """Name of the joint that it follows, which follows none itself."""
    ratio: Annotated[float, Interval(ge=-MOST_RATIO, le=MOST_RATIO)]
    """Change of the angle per change of the driver's angle."""
    offset: Annotated[
        float, Interval(ge=-MOST_OFFSET, le=MOST_OFFSET), Field(alias="offset_rad")
    ] = 0.0
    """Angle where the driver's is zero [rad]."""

    def _check_together(self) -> None:
        if abs(self.ratio) < LEAST_RATIO:
            raise InputError(
                f"ratio must be at least {LEAST_RATIO:g} or at most -{LEAST_RATIO:g}, got "
                f"{self.ratio:g} for {self.joint}"
            )

    @property
    def equation(self) -> str:
        """Return how the joint follows, as an equation with an offset in degrees."""
        said, offset = f"{self.joint} = {self.ratio:g} {self.driver}", np.degrees(self.offset)
        return f"{said} {'-' if offset < 0.0 else '+'} {abs(offset):.4g} deg" if offset else said


@dataclass(frozen=True, slots=True, eq=False)
class Drives:
    """All joints of a hand by (2), and the angles that they can have."""

    drivers: Indices  # the joint that each follows, itself where it is free, (j,)
    ratios: Array  # (j,)
    offsets: Array  # (j,) [rad]
    ranges: Array  # lowest and highest angles, as followers allow, (j, 2) [rad]

    @property
    def free(self) -> Indices:
        """Return the numbers of the joints that move freely, (m,)."""
        return np.flatnonzero(self.drivers == np.arange(len(self.drivers)))

    @property
    def turning(self) -> Array:
        """Return how far each joint turns per turn of the free ones, (j, m)."""
        return self.ratios[:, None] * (self.drivers[:, None] == self.free)

    def obeyed(self, angles: Array) -> Array:
        """Return angles (n, j) with those of followers put in by (2)."""
        found = self.offsets + self.ratios * angles[:, self.drivers]
        return np.clip(found, self.ranges[:, 0], self.ranges[:, 1])

    def carried(self, torques: Array) -> Array:
        """Return what free joints carry of the torques of all joints (j, ...) by (3), (m, ...)."""
        found = np.zeros_like(torques)
        np.add.at(found, self.drivers, (self.ratios * torques.T).T)
        return found[self.free]


def drives(names: Sequence[str], ranges: Array, couplings: Sequence[Coupling]) -> Drives:
    """Lay couplings out by the numbers of joints."""
    j = len(names)
    drivers, ratios, offsets = np.arange(j), np.ones(j), np.zeros(j)
    for each in couplings:
        for name in (each.joint, each.driver):
            if list(names).count(name) != 1:
                raise InputError(f"couplings must name single joints of the hand, got {name}")
        k = names.index(each.joint)
        if drivers[k] != k or each.driver in {other.joint for other in couplings}:
            raise InputError(
                f"couplings must let each joint follow one free joint, got {each.joint} after "
                f"{each.driver}, where one of them follows another joint too"
            )
        drivers[k], ratios[k], offsets[k] = names.index(each.driver), each.ratio, each.offset
    ends = np.sort((ranges - offsets[:, None]) / ratios[:, None], axis=1)
    found = ranges.copy()
    for k in np.unique(drivers[drivers != np.arange(j)]).tolist():
        own = np.flatnonzero(drivers == k).tolist()
        low, high = float(ends[own, 0].max()), float(ends[own, 1].min())
        if low > high + FILE_DIGITS:
            raise InputError(
                f"ranges must leave an angle to joints that are coupled, got none for "
                f"{', '.join(names[i] for i in own)}"
            )
        kept = np.array([low, max(low, high)])
        for i in own:
            moved = np.sort(offsets[i] + ratios[i] * kept)
            found[i] = np.clip(moved, *ranges[i]) if i != k else kept
    return Drives(drivers, ratios, offsets, found)


def name_of_copy(name: str, finger: str) -> str:
    """Name a finger's copy of a link or joint that it has in common with a finger before it."""
    return f"{name} of {finger}"


@declared
class Hand(Declared):
    """A palm with three to five fingers, and where its numbers come from."""

    name: str
    palm: tuple[LinkShape, ...]
    fingers: tuple[HandFinger, ...]
    sources: tuple[str, ...] = ()
    """Where the numbers come from, with licences."""
    torque_source: str = "no source states torque limits"
    """Where the torque limits come from."""
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    """Names of links that may overlap, besides neighbours in a chain; `palm` is the palm."""
    couplings: tuple[Coupling, ...] = ()
    """Joints that follow others."""
    notes: tuple[str, ...] = ()
    """How the hand differs from the file that it was read from, a sentence each."""
    palm_link: str = PALM_NAME
    """Name of the palm's link in the file that the hand was read from."""
    shared_motors: tuple[str, ...] = ()
    """Motors that turn several joints or pull cables, a phrase each: what such a hand holds is not
    known here, though it is posed as if each joint had a motor of its own."""

    def _check_together(self) -> None:
        if not FEWEST_FINGERS <= len(self.fingers) <= MOST_FINGERS:
            raise InputError(
                f"fingers must be {FEWEST_FINGERS} to {MOST_FINGERS}, got {len(self.fingers)}"
            )
        shapes = len(self.palm) + sum(len(link.shapes) for link in self.links)
        if len(self.links) > MOST_HAND_LINKS or shapes > MOST_SHAPES:
            raise InputError(
                f"a hand must have at most {MOST_HAND_LINKS} links and {MOST_SHAPES} shapes, got "
                f"{len(self.links)} and {shapes}"
            )
        names = [PALM_NAME, *(link.name for link in self.links)]
        if len(set(names)) < len(names):
            raise InputError("names of links must differ from each other and from 'palm'")
        for pair in self.ignored_pairs:
            if not set(pair) <= set(names):
                raise InputError(f"ignored_pairs must be pairs of names of links, got {pair}")
        _ = self.drives  # refuses couplings that cannot be

    @property
    def links(self) -> tuple[Link, ...]:
        """Return the links of all fingers, finger by finger, from the palm outwards."""
        return tuple(link for finger in self.fingers for link in finger.links)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Return the joints in the order of `links`."""
        return tuple(link.joint for link in self.links)

    @property
    def file_joints(self) -> tuple[str, ...]:
        """Return the name in the hand's file of each joint: a copy has that of its original."""
        names = [joint.name for joint in self.joints]
        copies = {name_of_copy(name, f.name): name for f in self.fingers for name in names}
        return tuple(copies.get(name, name) for name in names)

    @property
    def chains(self) -> tuple[range, ...]:
        """Return the numbers of each finger's links and joints, from the palm outwards."""
        ends = list(accumulate(len(finger.links) for finger in self.fingers))
        return tuple(map(range, [0, *ends[:-1]], ends))

    @property
    def drives(self) -> Drives:
        """Return which joints follow which, and the angles that all of them can have."""
        joints = self.joints
        ranges = np.array([[joint.lowest, joint.highest] for joint in joints])
        return drives([joint.name for joint in joints], ranges, self.couplings)

    @property
    def free_joints(self) -> tuple[Joint, ...]:
        """Return the joints that follow no other, in the order of `joints`."""
        return tuple(self.joints[int(place)] for place in self.drives.free)

    @property
    def ranges(self) -> Array:
        """Return the lowest and highest angle of each joint, (joints, 2) [rad].

        They are those of the joint itself, as far as all joints that are coupled with it allow.
        """
        return self.drives.ranges

    def with_torque_limits(self, limits_n_m: ArrayLike, source: str) -> "Hand":
        """Return the hand with other torque limits.

        Args:
            limits_n_m: One limit for all joints or one each, in the order of `joints` [N m].
            source: Where they come from.

        Raises:
            InputError: A limit is not a number above zero.
        """
        limits = iter(frozen_each(limits_n_m, len(self.joints), "limits_n_m").tolist())
        fingers = tuple(
            replace(finger, links=tuple(
                replace(link, joint=replace(link.joint, torque_limit_n_m=next(limits)))
                for link in finger.links
            ))
            for finger in self.fingers
        )  # fmt: skip
        return replace(self, fingers=fingers, torque_source=value_of(str, source, "source"))

    def __repr__(self) -> str:
        parts = counted(len(self.fingers), "finger"), counted(len(self.joints), "joint")
        return summary("Hand", self.name, *parts)


def load_hand(name: str) -> Hand:
    """Return a hand whose numbers are built in.

    Args:
        name: "allegro", "allegro-urdf" (the same with fingertips as in the maker's URDF) or "leap";
            `scenes.hand_from_file` reads others.

    Raises:
        InputError: There is no such hand.
    """
    if value_of(str, name, "name") not in HANDS:
        raise InputError(
            f"name must be that of a built-in hand, {' or '.join(HANDS)}, got {shown(name)}; "
            "scenes.hand_from_file(path, fingertips) reads others"
        )
    found = read_text(Path(__file__).with_name(f"{name}.json"))
    return from_record(Hand, object_of(found, "hand"))
