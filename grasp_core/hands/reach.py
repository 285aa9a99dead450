"""Answers whether a hand can stand in a grasp: a pose with its proof, or what was in the way.

A pose that is returned is checked: joints are within their ranges, fingertips touch within 10 um,
exact distances of all else are no less than the clearance that was asked for (a link whose tip
touches must only not overlap the object), and the contacts that are reached are proved to be in
force closure. No pose means that none was found from the starts that were tried, never that there
is none. What is proved instead is that a hand with three fingers has no contacts to stand at, where
no three of the grasp's contacts are in force closure.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Indices, frozen, frozen_indices
from grasp_core.by_value import ByValue, summary
from grasp_core.checked import (
    BOUNDS,
    coefficient,
    instance,
    number,
    one_of,
    seed_of,
    switch,
    text,
    whole,
)
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.errors import InputError
from grasp_core.frames import POSE
from grasp_core.hands.hand import Hand
from grasp_core.hands.posing.contact_choices import ContactChoices, contact_choices
from grasp_core.hands.posing.opening import Opening, opened
from grasp_core.hands.posing.pose_search import Asked, FoundPose, NoPose, find_pose
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS, Contact, Grasp

ReachReason: TypeAlias = Literal["", "limit", "collision", "not found", "no closure"]
"""Why no pose was found: fingertips stayed away with a joint at a limit, or touched but something
overlapped, or neither; or, proved, no three contacts close for a hand with three fingers; empty
where a pose was found."""
OVERLAPS = {"self": "the hand itself", "object": "the object", "table": "the table"}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandReach(ByValue):
    """A pose in which a hand stands in a grasp, or why none was found."""

    hand: str
    """Name of the hand."""
    grasp: str
    """Id of the grasp."""
    reason: ReachReason
    """Why no pose was found; empty where one was."""
    explanation: str
    """Reason why no pose was found, as a sentence; empty where one was found."""
    starts: int
    """Number of starts that were tried."""
    clearance_m: float
    """Least distance that was asked for between all that must not touch [m]."""
    fingers: Indices | None = None
    """The hand's finger at each contact that is used, (k,)."""
    joints: Array | None = None
    """Joint angles in the order of `Hand.joints`, (j,) [rad]."""
    palm_pose: Array | None = None
    """Pose of the palm in the object's frame, (4, 4)."""
    contacts: tuple[Contact, ...] | None = None
    """Contacts that are reached, k of them, in the grasp's finger order."""
    certificate: ClosureCertificate | None = None
    """Proof of force closure with these contacts."""
    within_regions: tuple[bool, ...] | None = None
    """Whether each is in the grasp's region for it, or at the planned contact; regions are proved
    for four contacts together, so that they promise nothing to three."""
    pregrasp: Array | None = None
    """Joint angles at which the fingers are open and the hand is free, (j,) [rad]; None if none
    were found."""
    approach: Array | None = None
    """Unit vector along which the palm moves in with open fingers, over 60 mm, in the object's
    frame, (3,); None if no straight way was found."""
    used: Indices | None = None
    """Indices of the grasp's contacts at which fingers stand, (k,), rising: all four, or three for
    a hand with three fingers. All are taken to be used where `fingers` are given and this is
    not."""
    open_choices: tuple[ClosureCertificate, ...] = ()
    """Proofs that choices of three contacts are not in force closure, where the reason is
    `no closure`."""

    def __post_init__(self) -> None:
        for name in ("hand", "grasp", "explanation"):
            text(getattr(self, name), name)
        one_of(self.reason, get_args(ReachReason), "reason")
        whole(self.starts, "starts")
        number(self.clearance_m, "clearance_m", **BOUNDS["hand_clearance_m"])
        if self.fingers is not None:
            used = range(FINGERS) if self.used is None else self.used
            kept = frozen_indices(used, (None,), "used")
            fingers = frozen_indices(self.fingers, (len(kept),), "fingers")
            object.__setattr__(self, "used", kept)
            object.__setattr__(self, "fingers", fingers)
        shapes = {
            "joints": (None,),
            "palm_pose": (POSE, POSE),
            "pregrasp": (None,),
            "approach": (3,),
        }
        for name, shape in shapes.items():
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name), shape, name))

    @property
    def reached(self) -> bool:
        """Return whether a pose was found."""
        return self.joints is not None

    def __repr__(self) -> str:
        told = "reached" if self.reached else self.reason
        return summary("HandReach", self.hand, self.grasp, told, starts=self.starts)


def reach_with(  # noqa: PLR0913 - one keyword for each thing that may be asked
    hand: Hand,
    body: Polyhedron,
    grasp: Grasp,
    friction: float,
    *,
    seed: int = 0,
    regions: bool = True,
    table_down: ArrayLike | None = None,
    clearance_m: float = 5e-4,
    starts: int = 100,
) -> HandReach:
    """Look for a pose in which a hand stands in a grasp.

    Args:
        hand: The hand. One with three fingers stands at three of the grasp's contacts which alone
            are in force closure, and any other at all four.
        body: The object.
        grasp: The grasp.
        friction: Coulomb coefficient at every contact.
        seed: Seed of the postures from which the search starts.
        regions: Whether contacts may be anywhere in the grasp's regions, where it has some, or must
            be the planned ones.
        table_down: Downward direction in the object's frame, (3,): the object lies on a table
            across it, and the hand stays above the table. None for no table.
        clearance_m: Least distance between all that must not touch [m].
        starts: Largest number of starts, for each choice of contacts.

    Returns:
        A pose that is checked, or what was in the way.

    Raises:
        InputError: An argument is refused.
    """
    _check(hand, body, grasp)
    up, height = _table(body, table_down)
    switch(regions, "regions")
    asked = Asked(
        hand, body, grasp, coefficient(friction), up, height,
        number(clearance_m, "clearance_m", **BOUNDS["hand_clearance_m"]), regions,
        seed_of(seed), whole(starts, "starts", **BOUNDS["starts"]),
    )  # fmt: skip
    choices = contact_choices(grasp, asked.friction, len(hand.fingers))
    if not choices.closed:
        return _unclosed(asked, choices)
    found = find_pose(asked, choices.closed)
    if isinstance(found, NoPose):
        reason, said = _why(found)
        return HandReach(hand.name, grasp.id, reason, said, found.starts, clearance_m)
    return _reached(asked, found, opened(asked, found))


def _check(hand: Hand, body: Polyhedron, grasp: Grasp) -> None:
    instance(hand, Hand, "hand", "load_hand makes one")
    check_body(body)
    instance(grasp, Grasp, "grasp", "plan finds some")


def _table(body: Polyhedron, down: ArrayLike | None) -> tuple[Array, float]:
    """Return the unit normal of the table that an object lies on, and its height along it."""
    if down is None:
        return np.array([0.0, 0.0, 1.0]), -np.inf
    way = frozen(down, (3,), "table_down")
    length = float(np.linalg.norm(way))
    if length == 0.0:
        raise InputError("table_down must be a direction, got a vector of length zero")
    up = -way / length
    return up, float((body.vertices @ up).min())


def _reached(asked: Asked, found: FoundPose, opening: Opening) -> HandReach:
    proof = found.certificate
    contacts = tuple(map(Contact, proof.positions, proof.normals))
    return HandReach(
        asked.hand.name, asked.grasp.id, "", "", found.starts, asked.clearance, found.fingers,
        found.joints, found.palm_pose, contacts, proof, found.within, opening.joints,
        opening.approach, found.used,
    )  # fmt: skip


def _unclosed(asked: Asked, choices: ContactChoices) -> HandReach:
    """Say that there are no contacts to stand at, with the proofs."""
    count, name = len(asked.hand.fingers), asked.hand.name
    fewer = f"{name} has {count} fingers, and no {count} of the grasp's {FINGERS} contacts alone"
    at = f"at friction {asked.friction:g}"
    if not choices.undecided:
        reason, said = "no closure", f"{fewer} are in force closure {at}, which is proved"
    else:
        reason = "not found"
        said = f"{fewer} are proved to be in force closure {at}; {choices.undecided} choices of "
        said += "contacts are undecided"
    return HandReach(
        name, asked.grasp.id, reason, said, 0, asked.clearance, open_choices=choices.open
    )  # fmt: skip


def _why(found: NoPose) -> tuple[ReachReason, str]:
    """Say what was in the way most often."""
    tried = f"from {found.starts} starts no pose was found"
    tally: Counter[str] = found.tally
    blocked = {name: tally[name] for name in OVERLAPS if tally[name]}
    if blocked:
        most = max(blocked, key=lambda name: blocked[name])
        return "collision", (
            f"{tried}: where the fingertips touched ({sum(blocked.values())} times), the hand "
            f"overlapped {OVERLAPS[most]} most often; more starts may find one"
        )
    if tally["limit"] > tally["away"]:
        return "limit", (
            f"{tried}: fingertips did not get to their contacts, mostly with a joint at its limit; "
            "more starts may find one"
        )
    if tally["open"]:
        return "not found", f"{tried}: the contacts that were touched are not in force closure"
    return "not found", f"{tried}: fingertips did not get to their contacts; more starts may do"
