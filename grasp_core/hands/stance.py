"""Says where a hand stands in a grasp that it reaches: what of a `HandReach` is then known."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import instance
from grasp_core.errors import InputError
from grasp_core.hands.hand import Fingertip, Hand
from grasp_core.hands.kinematics import places
from grasp_core.hands.reach import HandReach
from grasp_core.values import Contact

OBEYED = 1e-6
"""By how much a joint may be off the angle that follows from another: rounding of a file [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """A hand in a pose at its contacts."""

    hand: Hand
    """The hand, with a ball at its contact in place of each fingertip that is a block."""
    joints: Array
    """Joint angles, (j,) [rad]."""
    palm_pose: Array
    """Pose of the palm in the object's frame, (4, 4)."""
    contacts: tuple[Contact, ...]
    fingers: tuple[int, ...]
    """The hand's finger at each contact."""
    forces: Array
    """Balanced contact forces strictly inside the friction cones, of any size, (k, 3)."""

    @property
    def tip_radii(self) -> Array:
        """Return the radii of the fingertips at the contacts, (k,) [m]."""
        return np.array([self.hand.fingers[finger].tip.radius for finger in self.fingers])


def stance_of(hand: Hand, reach: HandReach) -> Stance:
    """Return where a hand stands."""
    instance(hand, Hand, "hand", "load_hand makes one")
    instance(reach, HandReach, "reach", "reach_with makes one")
    if reach.hand != hand.name:
        raise InputError(
            f"hand must be the one of the pose, {reach.hand}, got {hand.name}: its joints differ"
        )
    if (
        reach.joints is None
        or reach.palm_pose is None
        or reach.contacts is None
        or reach.fingers is None
        or reach.certificate is None
        or reach.certificate.forces is None
    ):
        raise InputError(
            f"reach must have a pose, got none for grasp {reach.grasp}: {reach.explanation}"
        )
    off = float(np.abs(hand.drives.obeyed(reach.joints[None])[0] - reach.joints).max())
    if hand.couplings and off > OBEYED:
        raise InputError(
            f"reach must have the joints that follow others where they follow them, got one off by "
            f"{off:.3g} rad for grasp {reach.grasp}"
        )
    fingers = tuple(reach.fingers.tolist())
    return Stance(
        with_balls(hand, reach.joints, reach.palm_pose, fingers, reach.contacts), reach.joints,
        reach.palm_pose, reach.contacts, fingers, reach.certificate.forces,
    )  # fmt: skip


def uncoupled(hand: Hand, doing: str) -> Hand:
    """Return a hand in which no joint follows another."""
    instance(hand, Hand, "hand", "load_hand makes one")
    if hand.couplings:
        listed = ", ".join(f"{each.joint} follows {each.driver}" for each in hand.couplings)
        raise InputError(
            f"{doing} needs a hand with a motor at each joint, got {hand.name}, where {listed}; "
            "reach_with, hand_motors and hand_payload take such hands"
        )
    return hand


def with_balls(
    hand: Hand, joints: Array, palm_pose: Array, fingers: Iterable[int],
    contacts: Iterable[Contact],
) -> Hand:  # fmt: skip
    """Put a ball that touches at its contact in place of each fingertip that is a block.

    Scenes and drawings know fingertips as balls on the last links. Which part of a block touches is
    the pose's.

    Takes `joints` (j,) [rad]; `palm_pose` (4, 4).
    """
    touching = {f: each for f, each in zip(fingers, contacts, strict=True)
                if hand.fingers[f].tip.corners is not None}  # fmt: skip
    if not touching:
        return hand
    found, made = places(hand, joints, palm_pose), list(hand.fingers)
    ends = np.cumsum([len(finger.links) for finger in hand.fingers]) - 1
    for f, contact in touching.items():
        radius, R = made[f].tip.radius, found.link_rotations[0, ends[f]]
        middle = contact.position - radius * contact.normal
        center = R.T @ (middle - found.link_positions[0, ends[f]])
        made[f] = replace(made[f], tip=Fingertip(center, radius))
    return replace(hand, fingers=tuple(made))
