"""Checks poses of a hand: joints, distances and contacts are computed again from the joint angles.

Nothing is searched for again. A pose that was found counts if its joints are within their ranges,
its fingertips touch the object at the stated contacts, the hand overlaps neither the object nor
itself, and the contacts are proved to be in force closure at the row's friction.
"""

from collections.abc import Iterator

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError
from grasp_core.frames import POSE
from grasp_core.geometry.nearest_points import Surface
from grasp_core.hands.collisions import clearances, tip_distances
from grasp_core.hands.hand import Hand
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS
from sim_validate.datasets.verifying.rows_by_object import Row

TOUCHES_M = 2e-5
"""Largest distance of a fingertip from its contact [m]: twice what the search allows."""
APART_M = 4e-4
"""Least distance of the hand's links from each other [m]; the search keeps 0.5 mm."""
ROUNDED = 1e-9
"""How far rounding may move an angle beyond its range [rad], a link into the object [m], a pose
from a rigid motion, or a direction from unit length."""


def hand_pose_faults(row: Row, hand: Hand, body: Polyhedron) -> Iterator[str]:
    """Yield sentences on what is wrong with the pose of a hand in a row of grasps."""
    reached = row["hand_reached"]
    if bool(row["force_closed"]) != (reached is not None):
        yield f"hand_reached is {reached}, but force_closed is {row['force_closed']}"
    elif reached is not None and reached == bool(row["hand_reason"]):
        yield f"hand_reason is {row['hand_reason']!r}, but hand_reached is {reached}"
    elif reached:
        fingers = row["hand_fingers"]
        if len(set(fingers)) < FINGERS or not set(fingers) <= set(range(len(hand.fingers))):
            yield f"hand_fingers are {fingers}, not {FINGERS} of the hand's {len(hand.fingers)}"
            return
        yield from _motion_faults(row, hand)
        yield from _place_faults(row, hand, body)


def _motion_faults(row: Row, hand: Hand) -> Iterator[str]:
    """Check joint angles, the palm's pose, and the way in, each by itself."""
    low, high = hand.ranges.T
    for name in ("hand_joints_rad", "hand_open_joints_rad"):
        if row[name] is not None:
            angles = np.array(row[name])
            if (angles < low - ROUNDED).any() or (angles > high + ROUNDED).any():
                yield f"{name} are not within the ranges of the joints"
    pose = np.array(row["T_object_palm_m"])
    turn = pose[:3, :3]
    off = float(np.abs(turn @ turn.T - np.eye(3)).max())
    if off > ROUNDED or np.linalg.det(turn) < 0.0 or pose[3].tolist() != np.eye(POSE)[3].tolist():
        yield "T_object_palm_m is not a rigid motion"
    way = row["hand_approach"]
    if way is not None and abs(np.linalg.norm(way) - 1.0) > ROUNDED:
        yield "hand_approach is not of unit length"


def _place_faults(row: Row, hand: Hand, body: Polyhedron) -> Iterator[str]:
    """Check where the hand is that has the stated joint angles and pose of the palm."""
    joints, pose = np.array(row["hand_joints_rad"]), np.array(row["T_object_palm_m"])
    fingers: list[int] = row["hand_fingers"]
    points, normals = np.array(row["hand_points_m"]), np.array(row["hand_normals"])
    surface = Surface(body.vertices, body.triangles)
    pairs = zip(points, normals, strict=True)
    if not all(surface.holds(point, normal, TOUCHES_M) for point, normal in pairs):
        yield "hand_points_m are not on the object, or hand_normals not its normals there"
    roundings = np.array([hand.fingers[finger].tip.core[1] for finger in fingers])
    behind = points - roundings[:, None] * normals  # within the tips, as deep as they are rounded
    if (tip_distances(hand, joints, pose, fingers, behind) + roundings).max() > TOUCHES_M:
        yield "the fingertips of hand_joints_rad do not touch the object at hand_points_m"
    found = clearances(hand, body, joints, pose, np.array(fingers))
    # a link whose tip touches the object may come as near to it as it likes
    if found.itself < APART_M or found.object < -ROUNDED or found.tips < -TOUCHES_M:
        yield "the hand of hand_joints_rad overlaps the object or itself"
    if not _closed(points, normals, row["friction"]):
        yield "hand_points_m are not proved to be in force closure"


def _closed(points: Array, normals: Array, friction: float) -> bool:
    try:
        certificate = force_closure(points, normals, friction)
    except GraspError:
        return False
    return certificate.closed and certificate.verify()
