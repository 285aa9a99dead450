"""Checks poses of a hand: joints, distances and contacts are computed again from the joint angles.

Nothing is searched for again. A pose that was found counts if its joints are within their ranges,
its fingertips touch the object at the stated contacts, nothing else overlaps, and the contacts are
proved to be in force closure at the row's friction.
"""

from collections.abc import Iterator

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError
from grasp_core.hands.distances.collisions import clearances
from grasp_core.hands.hand import Hand
from grasp_core.hands.kinematics import places
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.datasets.verifying.rows_by_object import Row

TOUCHES_M = 2e-5
"""Largest distance of a fingertip from its contact [m]: twice what the search allows."""
CLEAR_M = 4e-4
"""Least distance of the hand's links from each other [m]; the search keeps 0.5 mm. From the object
links need none where their tips touch it."""
TURNED = 1e-9
"""How far an angle may be beyond its range [rad]: the rounding of ten digits."""


def hand_pose_faults(row: Row, hand: Hand, body: Polyhedron) -> Iterator[str]:
    """Yield sentences on what is wrong with the pose of a hand in a row of grasps."""
    if not row["hand_reached"]:
        return
    joints, pose = np.array(row["hand_joints_rad"]), np.array(row["T_object_palm_m"])
    ranges = hand.ranges
    if (joints < ranges[:, 0] - TURNED).any() or (joints > ranges[:, 1] + TURNED).any():
        yield "hand_joints_rad are not within the ranges of the joints"
    fingers: list[int] = row["hand_fingers"]
    points, normals = np.array(row["hand_points_m"]), np.array(row["hand_normals"])
    radii = np.array([hand.fingers[finger].tip.radius for finger in fingers])
    tips = places(hand, joints, pose).tips[0, fingers]
    if np.linalg.norm(tips + radii[:, None] * normals - points, axis=1).max() > TOUCHES_M:
        yield "the fingertips of hand_joints_rad do not touch the object at hand_points_m"
    found = clearances(hand, body, joints, pose, np.array(fingers))
    if found.itself < CLEAR_M or min(found.object, found.tips) < -TOUCHES_M:
        yield "the hand of hand_joints_rad overlaps the object or itself"
    if not _closed(points, normals, row["friction"]):
        yield "hand_points_m are not proved to be in force closure"


def _closed(points: Array, normals: Array, friction: float) -> bool:
    try:
        certificate = force_closure(points, normals, friction)
    except GraspError:
        return False
    return certificate.closed and certificate.verify()
