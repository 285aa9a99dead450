"""Defines a hand: a palm, and fingers that are chains of revolute joints with a ball at the end.

Frames: the palm's frame is the hand's. Each link has a frame whose origin lies on its joint's axis.
With the angle q of a joint, the link's frame in the frame of the link before it is

    T(q) = (position, rotation) . turn(axis, q).                                          (1)

Shapes for collisions are boxes with rounded edges: all points within `radius` of a box. A radius of
zero makes it a box, two half-sizes of zero a capsule, three a ball.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Shape, UnitVector, frozen_each
from grasp_core.declared import Declared, counted, summary
from grasp_core.errors import InputError
from grasp_core.files.records import Key
from grasp_core.hands.couplings import Coupling, Drives, drives
from grasp_core.kinds import Many, Range, TorqueLimit, value_of

LARGEST_SIZE = 2.0
"""Largest length of a hand [m]: a larger one is in other units."""
MOST_TURN = 2.0 * np.pi
"""Largest angle of a joint, in either direction [rad]."""
FEWEST_FINGERS, MOST_FINGERS = 3, 5
MOST_LINKS, MOST_SHAPES, MOST_CORNERS = 40, 400, 200
"""Largest numbers of links and shapes of a hand, and of corners of a fingertip."""
LEAST_ROUNDING = 5e-5
"""Least rounding of a fingertip [m]: the way from its hull to a surface must be a direction when it
touches to 10 um."""
SAME = 1e-9
"""Length below which two lengths count as equal [m]: the rounding of a file."""
RIGID_SLACK = 1e-9
"""How far the rows of a rotation may be from orthonormal: the rounding of ten digits."""
PALM = "palm"
"""Name of the palm among the links."""


class _Turn:
    """The rule that a matrix is a rotation."""

    def holds(self, turned: Array) -> bool:
        """Return whether rows are orthonormal and right-handed."""
        off = float(np.abs(turned @ turned.T - np.eye(3)).max())
        return off <= RIGID_SLACK and bool(np.linalg.det(turned) > 0.0)

    def __str__(self) -> str:
        """Return what is asked for in words."""
        return "that is a rotation matrix, right-handed with orthonormal rows"


Rotation = Annotated[Array, Shape(3, 3), _Turn()]
Place = Annotated[Array, Shape(3, least=-LARGEST_SIZE, most=LARGEST_SIZE)]
"""A point of a hand, (3,) [m]."""
Corners = Annotated[
    Array, Shape(None, 3, least=-LARGEST_SIZE, most=LARGEST_SIZE), Many(2, MOST_CORNERS)
]  # fmt: skip
"""Two or more points of a hand, (m, 3) [m]: one corner would make a ball."""
Length = Annotated[float, Range(least=0.0, most=LARGEST_SIZE)]
Angle = Annotated[float, Range(least=-MOST_TURN, most=MOST_TURN)]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LinkShape(Declared):
    """All points within `radius` of a box: a box, a capsule or a ball of a link."""

    position: Annotated[Place, Key("position_m")]
    """Middle in the link's frame, (3,) [m]."""
    rotation: Rotation
    """Columns are the box's axes in the link's frame, (3, 3)."""
    half_sizes: Annotated[
        Array, Shape(3, least=0.0, most=LARGEST_SIZE), Key("half_sizes_m")
    ]  # fmt: skip
    """Half the box's lengths along its axes, (3,) [m], each zero or more."""
    radius: Annotated[Length, Key("radius_m")]
    """Distance from the box to the surface [m]."""

    def _check_together(self) -> None:
        if self.half_sizes.max() == 0.0 and self.radius == 0.0:
            raise InputError("half_sizes or radius must be above zero, got 0 for all")

    def holds(self, points: Array, radius: float) -> bool:
        """Return whether balls about points (n, 3) of the link's frame are within the shape."""
        out = np.abs((points - self.position) @ self.rotation) - self.half_sizes
        away = np.linalg.norm(np.maximum(out, 0.0), axis=1) + np.minimum(out.max(axis=1), 0.0)
        return bool((away + radius <= self.radius + SAME).all())


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Joint(Declared):
    """A revolute joint: where it is on the link before it, its axis, range and torque limit."""

    name: str
    position: Annotated[Place, Key("position_m")]
    """Origin of the moved link's frame, in the frame of the link before it, (3,) [m]."""
    rotation: Rotation
    """Axes of that frame at the angle zero, (3, 3)."""
    axis: UnitVector
    """Unit vector of the axis through the origin, in the moved link's frame, (3,)."""
    lowest: Annotated[Angle, Key("lowest_rad")]
    """Smallest angle [rad]."""
    highest: Annotated[Angle, Key("highest_rad")]
    """Largest angle [rad]."""
    torque_limit_n_m: TorqueLimit | None = None
    """Largest torque of the motor in either direction [N m]; None where no source states one."""

    def _check_together(self) -> None:
        if self.highest < self.lowest:
            raise InputError(
                f"highest must be no less than lowest, {self.lowest:g}, got {self.highest:g}"
            )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Link(Declared):
    """A part of a finger behind one joint."""

    name: str
    joint: Joint
    shapes: tuple[LinkShape, ...]
    mass_kg: Annotated[float, Range(least=0.0, most=1e3)] | None = None
    """Mass [kg]; None where no source states one."""
    center_of_mass: Annotated[Place, Key("center_of_mass_m")] | None = None
    """Centre of mass in the link's frame, (3,) [m]; None where no source states one."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Fingertip(Declared):
    """The end of a finger that touches the object: a ball, or a block.

    A block is all points within `rounding` of the hull of its `corners`. A ball stands for it where
    a tip has to be one: in planning, and in simulations, where it lies at the block's contact.
    """

    center: Annotated[Place, Key("center_m")]
    """Middle of the ball in the last link's frame, (3,) [m]."""
    radius: Annotated[float, Range(above=0.0, most=LARGEST_SIZE), Key("radius_m")]
    """Radius of the ball [m]."""
    corners: Annotated[Corners, Key("corners_m")] | None = None
    """Corners of the block in the last link's frame, (m, 3) [m]; None for a ball."""
    rounding: Annotated[Length, Key("rounding_m")] = 0.0
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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

    def _check_together(self) -> None:
        if not FEWEST_FINGERS <= len(self.fingers) <= MOST_FINGERS:
            raise InputError(
                f"fingers must be {FEWEST_FINGERS} to {MOST_FINGERS}, got {len(self.fingers)}"
            )
        shapes = len(self.palm) + sum(len(link.shapes) for link in self.links)
        if len(self.links) > MOST_LINKS or shapes > MOST_SHAPES:
            raise InputError(
                f"a hand must have at most {MOST_LINKS} links and {MOST_SHAPES} shapes, got "
                f"{len(self.links)} and {shapes}"
            )
        names = [PALM, *(link.name for link in self.links)]
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
