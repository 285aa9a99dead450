"""Answers whether a hand can stand in a grasp: a pose with its proof, or what was in the way.

A pose that is returned is checked: joints are within their ranges, fingertips touch within 10 um,
exact distances of all else are no less than the clearance that was asked for (a link whose tip
touches must only not overlap the object), and the contacts that are reached are proved to be in
force closure. No pose means that none was found from the starts that were tried, never that there
is none. What is proved instead is that a hand with three fingers has no contacts to stand at, where
no three of the grasp's contacts are in force closure.

The stance of a pose is what mechanics and scenes need of it, with balls for all fingertips.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, computed_field

from grasp_core.allowed_values import Friction, HandClearance, Number, instance, value_of
from grasp_core.arrays import Array, Indices, Shape, UnitVector, frozen_indices
from grasp_core.by_value import summary
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.hand import Fingertip, Hand
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.obstacles import NearestPose, ReachReason, what_stops
from grasp_core.hands.pose_search import AskedPose, contact_choices, find_pose, opened
from grasp_core.hands.settings import ReachSettings
from grasp_core.messages import shown
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS, Contact, Grasp

OBEYED = 1e-6
"""By how much a joint may be off the angle that follows from another: rounding of a file [rad]."""


@declared
class HandReach(Declared):
    """A pose in which a hand stands in a grasp, or why none was found."""

    hand: str
    """Name of the hand."""
    grasp: Annotated[str, Field(alias="id"), Shown("grasp")]
    """Id of the grasp."""
    reason: ReachReason
    """What stops the hand; empty where a pose was found."""
    explanation: str
    """Reason why no pose was found, as a sentence; empty where one was found."""
    starts: Annotated[Number, Shown("starts")]
    """Number of starts that were tried."""
    clearance_m: HandClearance
    """Least distance that was asked for between all that must not touch [m]."""
    fingers: Annotated[Indices, Shape("k", whole=True)] | None = None
    """The hand's finger at each contact that is used, (k,)."""
    joints: Annotated[Annotated[Array, Shape("j")] | None, Field(alias="joints_rad")] = None
    """Joint angles in the order of `Hand.joints`, (j,) [rad]."""
    palm_pose: Annotated[Array, Shape(POSE_SIZE, POSE_SIZE)] | None = None
    """Pose of the palm in the object's frame, (4, 4)."""
    certificate: ClosureCertificate | None = None
    """Proof that the k contacts that are reached are in force closure."""
    within_regions: tuple[bool, ...] | None = None
    """Whether each is in the grasp's region for it, or at the planned contact; regions are proved
    for four contacts together, so that they promise nothing to three."""
    pregrasp: Annotated[Annotated[Array, Shape("j")] | None, Field(alias="pregrasp_joints_rad")] = (
        None
    )
    """Joint angles at which the fingers are open and the hand is free, (j,) [rad]; None if none
    were found."""
    approach: UnitVector | None = None
    """Unit vector along which the palm moves in with open fingers, over 60 mm, in the object's
    frame, (3,); None if no straight way was found."""
    used: Annotated[Indices, Shape("k", whole=True)] | None = None
    """Indices of the grasp's contacts at which fingers stand, (k,), rising: all four, or three for
    a hand with three fingers. All are taken to be used where `fingers` are given and this is
    not."""
    open_choices: tuple[ClosureCertificate, ...] = ()
    """Proofs that choices of three contacts are not in force closure, where the reason is
    `no closure`."""
    nearest: NearestPose | None = None
    """The pose that came nearest to standing in the grasp, where none was found and some start was
    tried."""

    def __post_init__(self) -> None:
        if self.fingers is not None and self.used is None:
            object.__setattr__(self, "used", frozen_indices(range(FINGERS), (FINGERS,), "used"))
        Declared.__post_init__(self)

    def _check_together(self) -> None:
        found = (self.fingers, self.joints, self.palm_pose, self.certificate)
        if [each is None for each in found] != [self.reason != ""] * len(found):
            raise InputError(
                f"fingers, joints, palm_pose and certificate must be there exactly where the "
                f"reason is empty, which is {shown(self.reason)} for grasp {self.grasp}"
            )
        if self.nearest is not None and self.reached:
            raise InputError(f"nearest must be None (null) where a pose was found, {self.grasp}")
        counts = {len(each) for each in (self.used, self.contacts, self.within_regions)
                  if each is not None}  # fmt: skip
        if len(counts) > 1:
            raise InputError(
                f"used, contacts and within_regions must be equally many for grasp {self.grasp}"
            )

    @computed_field
    @property
    def reached(self) -> Annotated[bool, Shown("reached")]:
        """Whether a pose was found."""
        return self.joints is not None

    @computed_field
    @property
    def contacts(self) -> tuple[Contact, ...] | None:
        """Contacts that are reached, k of them, in the grasp's finger order."""
        proof = self.certificate
        return None if proof is None else tuple(map(Contact, proof.positions, proof.normals))

    @computed_field
    @property
    def closure_margin(self) -> Annotated[float | None, Shown("margin")]:
        """Margin of force closure with the contacts that are reached, proved."""
        return None if self.certificate is None else self.certificate.margin

    @computed_field
    @property
    def contacts_within_regions(self) -> Annotated[int | None, Shown("within regions")]:
        """How many of the contacts are in the grasp's regions for them, or as planned."""
        return None if self.within_regions is None else sum(self.within_regions)

    @computed_field
    @property
    def opens(self) -> Annotated[bool | None, Shown("opens")]:
        """Whether the fingers can open by 3 to 15 mm, with the palm where it is."""
        return self.pregrasp is not None if self.reached else None

    @computed_field
    @property
    def comes_straight(self) -> Annotated[bool | None, Shown("straight way in")]:
        """Whether the open hand comes in straight over 60 mm, with nothing in the way."""
        return self.approach is not None if self.reached else None

    def __repr__(self) -> str:
        told = "reached" if self.reached else self.reason
        return summary("HandReach", self.hand, self.grasp, told, starts=self.starts)


def reach_with(
    hand: Hand,
    body: Polyhedron,
    grasp: Grasp,
    friction: float,
    settings: ReachSettings | None = None,
    **given: Any,
) -> HandReach:
    """Look for a pose in which a hand stands in a grasp.

    Args:
        hand: The hand. One with three fingers stands at three of the grasp's contacts which alone
            are in force closure, and any other at all four.
        body: The object.
        grasp: The grasp.
        friction: Coulomb coefficient at every contact.
        settings: What is asked of the pose; the usual settings if None.
        given: Settings by their names, in place of those of `settings`.

    Returns:
        A pose that is checked, or what was in the way.

    Raises:
        InputError: An argument is refused.
    """
    instance(hand, Hand, "hand", "load_hand makes one")
    check_body(body)
    instance(grasp, Grasp, "grasp", "plan finds some")
    value_of(Friction, friction, "friction")
    usual = ReachSettings() if settings is None else instance(settings, ReachSettings, "settings")
    asked = AskedPose(hand, body, grasp, friction, replace(usual, **given))
    clearance_m = asked.settings.clearance_m
    closed, refuted, undecided = contact_choices(grasp, friction, len(hand.fingers))
    if not closed:
        return _unclosed(asked, refuted, undecided)
    found = find_pose(asked, closed)
    if isinstance(found, tuple):
        stopped = what_stops(asked, found)
        return HandReach(
            hand.name, grasp.id, stopped.reason, stopped.explanation, len(found), clearance_m,
            nearest=stopped.nearest,
        )  # fmt: skip
    joints, way = opened(asked, found)
    palm_pose = np.eye(POSE_SIZE)
    palm_pose[:3, :3], palm_pose[:3, 3] = found.pose.palm, found.pose.origin
    return HandReach(
        hand.name, grasp.id, "", "", found.starts, clearance_m, found.aims.fingers, found.pose.q,
        palm_pose, found.certificate, found.within, joints, way, found.used,
    )  # fmt: skip


def _unclosed(
    asked: AskedPose, refuted: tuple[ClosureCertificate, ...], undecided: int
) -> HandReach:
    count, name = len(asked.hand.fingers), asked.hand.name
    fewer = f"{name} has {count} fingers, and no {count} of the grasp's {FINGERS} contacts alone"
    at = f"at friction {asked.friction:g}"
    if not undecided:
        reason, said = "no closure", f"{fewer} are in force closure {at}, which is proved"
    else:
        reason = "not found"
        said = f"{fewer} are proved to be in force closure {at}; {undecided} choices of "
        said += "contacts are undecided"
    return HandReach(
        name, asked.grasp.id, reason, said, 0, asked.settings.clearance_m, open_choices=refuted
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """A hand in a pose at its contacts."""

    hand: Hand  # with a ball at its contact in place of each block
    joints: Array  # joint angles, (j,) [rad]
    palm_pose: Array  # pose of the palm in the object's frame, (4, 4)
    contacts: tuple[Contact, ...]
    fingers: tuple[int, ...]  # the hand's finger at each contact
    forces: Array  # balanced, strictly inside the cones, of any size, (k, 3)

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


def with_balls(
    hand: Hand, joints: Array, palm_pose: Array, fingers: Iterable[int],
    contacts: Iterable[Contact],
) -> Hand:  # fmt: skip
    """Put a ball at its contact in place of each block: scenes and drawings know tips as balls."""
    touching = {f: each for f, each in zip(fingers, contacts, strict=True)
                if hand.fingers[f].tip.corners is not None}  # fmt: skip
    if not touching:
        return hand
    found, made = places(hand, joints, palm_pose), list(hand.fingers)
    for f, contact in touching.items():
        radius, end = made[f].tip.radius, hand.chains[f][-1]
        middle = contact.position - radius * contact.normal
        center = found.link_rotations[0, end].T @ (middle - found.link_positions[0, end])
        made[f] = replace(made[f], tip=Fingertip(center, radius))
    return replace(hand, fingers=tuple(made))
