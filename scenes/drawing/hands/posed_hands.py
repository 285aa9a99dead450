"""Places a hand in the pose in which it stands in a grasp, and makes the shapes that show it.

Every part is a convex solid, so that pictures draw it as its outline and the sides that face the
viewer. Long parts are cut into pieces about as long as they are thick: parts are drawn in the order
of the depths of their middles, which is the right order for parts of like size.
"""

import importlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from grasp_core.arrays import Array, frozen, frozen_indices
from grasp_core.checked import instance
from grasp_core.errors import InputError
from grasp_core.frames import POSE
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import hand_arrays
from grasp_core.hands.kinematics import places
from grasp_core.hands.reach import with_balls
from grasp_core.values import Contact, Grasp
from scenes.drawing.hands.rounded_boxes import rounded_box
from scenes.drawing.shapes import Role, Shape

if TYPE_CHECKING:
    from grasp_core.hands.reach import HandReach

LONG, LEAST = 1.2, 2.5
"""Length of a piece of a part in thicknesses of the part, but at least so many radii of the hand's
largest fingertip."""
MOST_PIECES = 6
"""Largest number of pieces along one axis of a part."""
OVERLAP = 0.02
"""How far a piece reaches into the next one, as a share of its length, so that no gap is seen."""
NUMBER_BEYOND = 2.9
"""Distance of a finger's number from its contact, through the middle of the fingertip, in the
fingertip's radii."""


@dataclass(frozen=True, slots=True, eq=False)
class PosedHand:
    """A hand in a pose in which its fingertips touch an object."""

    hand: Hand
    joints: Array
    """Joint angles in the order of `hand.joints`, (j,) [rad]."""
    palm_pose: Array
    """Pose of the palm in the object's frame, (4, 4)."""
    fingers: tuple[int, ...]
    """The hand's finger at each contact."""
    contacts: tuple[Contact, ...]
    """Where these fingers touch."""

    def __post_init__(self) -> None:
        instance(self.hand, Hand, "hand", "load_hand makes one")
        used = frozen_indices(self.fingers, (len(self.contacts),), "fingers")
        object.__setattr__(self, "fingers", tuple(used.tolist()))
        joints, known = len(self.hand.joints), range(len(self.hand.fingers))
        object.__setattr__(self, "joints", frozen(self.joints, (joints,), "joints"))
        object.__setattr__(self, "palm_pose", frozen(self.palm_pose, (POSE, POSE), "palm_pose"))
        if len(set(self.fingers)) < len(self.fingers) or not set(self.fingers) <= set(known):
            raise InputError(
                f"fingers must be different fingers of the hand, numbered from 0 to {known[-1]}, "
                f"got {list(self.fingers)}"
            )

    @property
    def tips(self) -> Array:
        """Return the middles of the fingertips' balls at the contacts, (contacts, 3) [m]."""
        hand = with_balls(self.hand, self.joints, self.palm_pose, self.fingers, self.contacts)
        return places(hand, self.joints, self.palm_pose).tips[0, list(self.fingers)]

    @property
    def finger_names(self) -> tuple[str, ...]:
        """Return the name of the hand's finger at each contact."""
        return tuple(self.hand.fingers[finger].name for finger in self.fingers)

    @property
    def tip_radii(self) -> Array:
        """Return the radii of these fingertips, (contacts,) [m]."""
        return np.array([self.hand.fingers[finger].tip.radius for finger in self.fingers])

    @property
    def positions(self) -> Array:
        """Return the places of the contacts, (contacts, 3) [m]."""
        return np.array([contact.position for contact in self.contacts]).reshape(-1, 3)


def posed_hand(hand: Hand, reach: "HandReach", grasp: Grasp) -> PosedHand:
    """Take the pose from what `reach_with` found."""
    from grasp_core.hands.reach import HandReach  # drawings without a hand need no search for one

    instance(hand, Hand, "hand", "load_hand makes one")
    instance(reach, HandReach, "reach", "reach_with finds one")
    if (reach.hand, reach.grasp) != (hand.name, grasp.id):
        raise InputError(
            f"reach must be about the hand {hand.name} and the grasp {grasp.id}, got "
            f"{reach.hand} and {reach.grasp}"
        )
    joints, pose, used, contacts = reach.joints, reach.palm_pose, reach.fingers, reach.contacts
    if joints is None or pose is None or used is None or contacts is None:
        raise InputError(f"reach must hold a pose to draw, got none: {reach.explanation}")
    return PosedHand(hand, joints, pose, tuple(used.tolist()), contacts)


@dataclass(frozen=True, slots=True, eq=False)
class HandParts:
    """The rounded boxes of which a hand is made, in the object's frame."""

    middles: Array
    """Middles of the boxes, (n, 3) [m]."""
    axes: Array
    """Columns are the boxes' axes, (n, 3, 3)."""
    half_sizes: Array
    """Half the boxes' lengths along these axes, (n, 3) [m]."""
    radii: Array
    """Distances from the boxes to the surfaces, (n,) [m]."""
    contacts: tuple[int | None, ...]
    """The contact at which a part touches, for the parts that are fingertips."""
    blocks: tuple[Array | None, ...]
    """Corners of the parts that are blocks, which the boxes cover, (m, 3) [m]."""


def parts_of(held: PosedHand) -> HandParts:
    """Place the parts of a hand; a tip is its block, its ball, or the capsule that ends in it."""
    arrays = hand_arrays(held.hand)
    at = places(held.hand, held.joints, held.palm_pose)
    R = np.concatenate([at.link_rotations[0], held.palm_pose[None, :3, :3]])  # the palm's is -1
    p = np.concatenate([at.link_positions[0], held.palm_pose[None, :3, 3]])
    tips = arrays.shape_tips.tolist()
    own = arrays.tip_shapes.tolist()
    kept = np.array([n for n, tip in enumerate(tips) if n not in own or tips.count(tip) == 1])
    links = arrays.shape_links[kept]
    contact_of = {finger: contact for contact, finger in enumerate(held.fingers)}
    return HandParts(
        p[links] + np.einsum("nij,nj->ni", R[links], arrays.shape_positions[kept]),
        R[links] @ arrays.shape_rotations[kept],
        arrays.shape_sizes[kept],
        arrays.shape_radii[kept],
        tuple(contact_of.get(tips[n]) for n in kept.tolist()),
        tuple(
            _block(held.hand, tips[n], R[links[i]], p[links[i]]) if n in own else None
            for i, n in enumerate(kept.tolist())
        ),
    )


def _block(hand: Hand, finger: int, R: Array, p: Array) -> Array | None:
    """Place the corners of a fingertip that is a block on a link with axes R and origin p."""
    corners = hand.fingers[finger].tip.corners
    return None if corners is None else p + corners @ R.T


def hand_shapes(held: PosedHand) -> tuple[Shape, ...]:
    """Return the shapes of a hand in the object's frame, fingertips in the colours of contacts."""
    parts, shapes = parts_of(held), list[Shape]()
    least = LEAST * max(finger.tip.radius for finger in held.hand.fingers)
    for n, contact in enumerate(parts.contacts):
        role: Role = "hand" if contact is None else "fingertip"
        if (corners := parts.blocks[n]) is not None:
            shapes.append(Shape(role, contact, polygons=_hull(corners)))
            continue
        for sides in _pieces(parts.half_sizes[n], float(parts.radii[n]), least):
            placed = tuple(parts.middles[n] + side @ parts.axes[n].T for side in sides)
            shapes.append(Shape(role, contact, polygons=placed))
    return tuple(shapes)


def _pieces(half: Array, radius: float, least: float) -> Iterator[tuple[Array, ...]]:
    """Yield the sides of a rounded box, cut into pieces about as long as the box is thick.

    Takes `half` (3,) [m]; `radius`, `least` [m].
    """
    lengths = 2.0 * (half + radius)
    piece = max(LONG * float(lengths.min()), least)
    counts = np.clip(np.rint(lengths / piece), 1, MOST_PIECES).astype(int)
    counts[half == 0.0] = 1
    steps = 2.0 * half / counts
    for place in product(*map(range, counts.tolist())):
        at = np.array(place)
        outer = np.array([at == 0, at == counts - 1])
        spare = OVERLAP * steps * ~outer
        yield rounded_box(
            -half + steps * at - spare[0], -half + steps * (at + 1) + spare[1], radius, outer
        )


def _hull(corners: Array) -> tuple[Array, ...]:
    """Return the triangles around points, corners counter-clockwise as seen from outside."""
    spatial: Any = importlib.import_module("scipy.spatial")
    found = spatial.ConvexHull(corners)
    sides: Array = corners[found.simplices]
    across = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    inward = np.einsum("ij,ij->i", across, found.equations[:, :3]) < 0.0
    sides[inward] = sides[inward, ::-1]
    return tuple(sides)


def numbers_behind(held: PosedHand) -> Array:
    """Return where the numbers of the fingers are written, behind the tips, (contacts, 3) [m]."""
    places = held.positions
    ways = (held.tips - places) / held.tip_radii[:, None]
    return places + NUMBER_BEYOND * held.tip_radii[:, None] * ways
