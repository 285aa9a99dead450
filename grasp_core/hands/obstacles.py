"""Says what stops a hand in a grasp, and how near it came, from where all of its starts ended.

*What stops it* is the one thing without which it stands in the grasp. With each obstacle left out,
with the palm, say, free to be inside the object, the hand is moved on from the nearest poses, and
then from new starts. Obstacles that most starts ended near are the first; limits of joints come
last, as wider ranges get around much else. Then the object's size is changed, and at last all
overlaps are left out at once. A size that is proved to be wrong, see `sizes`, comes before all.

*The nearest pose* is the one with the least distance from touching with nothing in the way: the
root of the sum of squares of how far fingertips are from their contacts or regions, and of how far
parts are nearer to the object, the table and each other than they may be. Balls stand for parts
before the last of a finger, as in the search.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias, get_args

import numpy as np
from pydantic import Field

from grasp_core.allowed_values import NotNegative
from grasp_core.arrays import Array, Indices, Shape
from grasp_core.by_value import counted
from grasp_core.compiled import compiled
from grasp_core.declared import Declared, declared
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.hand_arrays import Gaps
from grasp_core.hands.pose_search import (
    POSE_KERNEL,
    SEARCH_ROOM,
    AskedPose,
    FoundPose,
    MissedPose,
    Obstacle,
    obstacles,
    pose_if,
    targets,
)
from grasp_core.hands.sizes import size_fault, size_proof
from grasp_core.messages import MILLI
from grasp_core.solvers.ties import first_best, smallest_first
from grasp_core.values import FINGERS

ReachReason: TypeAlias = Literal[
    "", "too large", "too small", "palm", "collision", "limit", "not found", "no closure"
]
"""What stops a hand, see `REASONS`; empty where a pose was found."""
REASONS: dict[ReachReason, str] = {
    "too large": "the object is too large",
    "too small": "the object is too small",
    "palm": "the palm is in the way",
    "collision": "links or the table are in the way",
    "limit": "limits of joints",
    "not found": "no single cause",
    "no closure": "too few fingers for closure",
}
"""What each reason says in a few words."""
IN_THE_WAY: dict[Obstacle, tuple[ReachReason, str, str]] = {
    "self": ("collision", "links are in the way of each other", "links that may overlap"),
    "table": ("collision", "the table is in the way", "no table"),
    "palm": ("palm", "the palm is in the way", "a palm that may overlap the object"),
    "links": (
        "collision", "links of fingers are in the way", "links that may overlap the object"
    ),
    "limit": ("limit", "limits of joints are in the way", "ranges 45 degrees wider"),
}  # fmt: skip
"""The reason that each obstacle makes, what it does, and what the hand has without it."""
LIMIT: Obstacle = "limit"
OVERLAPS: tuple[Obstacle, ...] = get_args(Obstacle)[:-1]
MOVED_ON = 6  # number of nearest poses from which a hand is moved on without an obstacle
SAME_OFF_M = 1e-6  # difference of distances from touching that does not count [m]


@declared
class NearestPose(Declared):
    """The pose of a hand that came nearest to standing in a grasp, and how far it is from it."""

    used: Annotated[Indices, Shape("k", whole=True, least=0, most=FINGERS - 1)]
    """Indices of the grasp's contacts at which fingers were to touch, (k,)."""
    fingers: Annotated[Indices, Shape("k", whole=True, least=0)]
    """The hand's finger for each of them, (k,)."""
    joints: Annotated[Array, Shape("j"), Field(alias="joints_rad")]
    """Joint angles in the order of `Hand.joints`, (j,) [rad]."""
    palm_pose: Annotated[Array, Shape(POSE_SIZE, POSE_SIZE)]
    """Pose of the palm in the object's frame, (4, 4)."""
    off_m: NotNegative
    """Root of the sum of squares of all gaps, and of what parts lack in distance [m]."""
    gaps_m: Annotated[Array, Shape("k", least=0.0)]
    """Distances of the fingertips from their contacts, or from the regions for them, (k,) [m]."""
    too_near: tuple[Obstacle, ...]
    """What is nearer than the clearance that was asked for, or a limit that a joint is at."""


@dataclass(frozen=True, slots=True)
class Stopped:
    """What stops a hand in a grasp."""

    reason: ReachReason
    explanation: str
    nearest: NearestPose | None


def what_stops(asked: AskedPose, missed: Sequence[MissedPose]) -> Stopped:
    """Say what stops a hand whose starts all ended without a pose."""
    if not missed:
        return Stopped("not found", "no random posture of the hand is one to start from", None)
    off = [_off(asked, each) for each in missed]
    near = [missed[n] for n in smallest_first(off)[:MOVED_ON]]
    nearest = _nearest_pose(asked, missed[first_best(-np.array(off), SAME_OFF_M)], min(off))
    choices = list({tuple(each.used.tolist()): None for each in missed})
    regions = asked.settings.regions
    wanted = [targets(asked, np.array(each), regions=regions) for each in choices]
    proof = size_proof(asked.arrays, asked.settings.clearance_m, wanted)
    reason, said = proof or _in_the_way(asked, choices, missed, near) or _unknown(missed, nearest)
    tried = f"from {counted(len(missed), 'start')} no pose was found"
    return Stopped(reason, f"{tried}: {said}", nearest)


def _off(asked: AskedPose, ended: MissedPose) -> float:
    """Measure how far a pose is from touching with nothing in the way [m]."""
    kernel, clear = compiled(POSE_KERNEL), asked.settings.clearance_m
    sums = kernel.empty_sums(asked.arrays, ended.aims)
    exact = Gaps(clear, clear, clear, 0.0, 0.0, overlaps=True, palm_moves=False)
    kernel.residuals(asked.arrays, asked.tree, ended.aims, exact, ended.pose, sums)
    _, touching, overlaps = sums.parts.tolist()
    return math.sqrt(touching / kernel.EQUAL**2 + overlaps) / MILLI


def _nearest_pose(asked: AskedPose, ended: MissedPose, off: float) -> NearestPose:
    palm_pose, pose = np.eye(POSE_SIZE), ended.pose
    palm_pose[:3, :3], palm_pose[:3, 3] = pose.palm, pose.origin
    return NearestPose(
        ended.used, ended.aims.fingers, pose.q, palm_pose, off,
        _gaps(ended, asked.arrays.tip_roundings),
        tuple(near_to(asked, ended, asked.settings.clearance_m)),
    )  # fmt: skip


def _gaps(ended: MissedPose, roundings: Array) -> Array:
    """Measure how far fingertips are from their contacts or regions, (k,) [m]."""
    aims, pose = ended.aims, ended.pose
    ahead = np.einsum("ki,ki->k", pose.fronts - aims.origins, aims.normals)
    beside = np.einsum("kai,ki->ka", aims.tangents, pose.tips - aims.origins)
    aside = np.where(aims.pinned > 0.0, np.linalg.norm(beside, axis=1), 0.0)
    out = aims.edge_points - pose.tips[aims.edge_contacts]
    np.maximum.at(aside, aims.edge_contacts, np.einsum("ei,ei->e", out, aims.edge_inward))
    return np.hypot(ahead + roundings[aims.fingers], aside)


def near_to(asked: AskedPose, ended: MissedPose, clearance: float) -> list[Obstacle]:
    """List what a pose is nearer to than a clearance, and whether a joint is at its limit."""
    found = list(obstacles(asked, ended.pose, clearance, ended.aims.fingers, -np.inf))
    (low, high), q = asked.arrays.ranges.T, ended.pose.q
    at_limit = ((q <= low) | (q >= high)) & (low < high)
    return [*found, "limit"] if at_limit.any() else found


def _in_the_way(
    asked: AskedPose, choices: Sequence[tuple[int, ...]], missed: Sequence[MissedPose],
    near: Sequence[MissedPose],
) -> tuple[ReachReason, str] | None:  # fmt: skip
    """Say which obstacle, or size, stops a hand: it stands in the grasp without; None if none."""
    room = asked.settings.clearance_m + SEARCH_ROOM
    counts = Counter(each for ended in missed for each in near_to(asked, ended, room))
    met: list[Obstacle] = [each for each in OVERLAPS if counts[each]]
    met.sort(key=lambda each: -counts[each])
    limits: list[Obstacle] = [LIMIT] if counts[LIMIT] else []
    for name in met + limits:
        if found := pose_if(asked, choices, near, left_out=frozenset([name])):
            reason, does, without = IN_THE_WAY[name]
            said = f"{does}, met in {counts[name]} of them; with {without} the hand stands in the "
            return reason, f"{said}grasp{_beyond(asked, found) if name == LIMIT else ''}"
    if fault := size_fault(asked, choices):
        return fault
    if len(met) > 1 and pose_if(asked, choices, near, left_out=frozenset(met)):
        does = ", ".join(f"{IN_THE_WAY[each][1]} in {counts[each]} of them" for each in met)
        return "collision", f"{does}; with all of that allowed the hand stands in the grasp"
    return None


def _unknown(missed: Sequence[MissedPose], nearest: NearestPose) -> tuple[ReachReason, str]:
    if is_open := sum(ended.is_open for ended in missed):
        said = f"the contacts that were touched in {is_open} of them are not in force closure"
        return "not found", said
    return "not found", (
        f"at the nearest, a fingertip was {MILLI * nearest.gaps_m.max():.3g} mm off its contact, "
        "and neither without single obstacles nor on a copy of another size does the hand stand in "
        "the grasp; more starts may find a pose"
    )


def _beyond(asked: AskedPose, found: FoundPose) -> str:
    """Say which joint is farthest beyond its range, and by how much."""
    (low, high), q = asked.arrays.ranges.T, found.pose.q
    beyond = np.maximum(low - q, q - high)
    n = first_best(beyond)
    joint = asked.hand.joints[n].name
    return f", {joint} {math.degrees(beyond[n]):.3g} degrees beyond its range"
