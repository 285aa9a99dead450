"""Opens the fingers of a hand that holds an object, and looks for a straight way to get there.

The pregrasp keeps the palm where it is and moves fingertips away from the surface, along the
normals as far as the joints allow. The way in is a straight line of the palm with the fingers open.
Both are checked by exact distances; the line at steps of `TICK`.
"""

from itertools import product

import numpy as np

from grasp_core.arrays import Array
from grasp_core.compiled import compiled
from grasp_core.hands.hand_arrays import Pose, Targets, Wanted
from grasp_core.hands.pose_search import Asked, FoundPose, blocking, targets

GAPS_M = (0.015, 0.01, 0.006, 0.003)
"""Distances of fingertips from the surface that are tried, the largest first [m]."""
LEAST_GAP = 0.5
"""Part of such a distance that every fingertip must have."""
STEPS = 30
TICK, LINE = 0.004, 0.06
"""Distance of the poses that are checked on the way in, and its length [m]."""
TILT = 0.4
"""Slope at which some ways in lean from the line from the palm to the contacts' middle."""
LEAST_ALONG = 0.2
"""Least cosine of the angle between a way in and the line from the palm to the contacts' middle."""
DIGITS = 9
"""Digits to which these cosines are compared."""


def opened(asked: Asked, found: FoundPose) -> tuple[Array | None, Array | None]:
    """Open the fingers and look for a straight way in.

    Gives joint angles with the fingers open, and the unit vector along which the palm moves in, in
    the object's frame; None for what was not found.
    """
    joints = _open_joints(asked, found)
    if joints is None:
        return None, None
    ways = (way for way in _ways(asked, found) if _is_free(asked, found, joints, way))
    return joints, next(ways, None)


def _open_joints(asked: Asked, found: FoundPose) -> Array | None:
    """Return joint angles at which fingertips are off the surface and nothing overlaps."""
    arrays, kernel = asked.arrays, compiled("grasp_core.hands.pose_kernel")
    contacts, clear = found.certificate, asked.clearance
    wanted = Wanted(clear, clear, clear, 0.0, 0.0, overlaps=True, palm_moves=False)
    for gap in GAPS_M:
        aims = _aims(asked, found)._replace(
            origins=contacts.positions - gap * contacts.normals, normals=np.array(contacts.normals),
            touching=found.touching,
        )  # fmt: skip
        pose: Pose = kernel.empty_pose(arrays, len(found.used))
        pose.palm[:], pose.origin[:] = found.palm_pose[:3, :3], found.palm_pose[:3, 3]
        pose.q[:] = found.joints
        sums = kernel.empty_sums(arrays, aims)
        kernel.settle(arrays, asked.tree, aims, wanted, pose, sums, STEPS, 1e3 * 0.1 * gap)
        kernel.place(arrays, aims, pose)
        away = np.einsum("ki,ki->k", contacts.positions - pose.fronts, contacts.normals)
        open_by = away - arrays.tip_roundings[found.fingers]
        if open_by.min() >= LEAST_GAP * gap and not blocking(asked, pose):
            return pose.q
    return None


def _aims(asked: Asked, found: FoundPose) -> Targets:
    """Return targets at the planned contacts."""
    return targets(asked, found.used, regions=False)._replace(fingers=found.fingers)


def _ways(asked: Asked, found: FoundPose) -> Array:
    """Return unit vectors along which the palm may move in, the likeliest first, (n, 3)."""
    middle = found.certificate.positions.mean(axis=0)
    palm = np.array([shape.position for shape in asked.hand.palm] or [np.zeros(3)]).mean(axis=0)
    R, origin = found.palm_pose[:3, :3], found.palm_pose[:3, 3]
    ahead = middle - origin - R @ palm
    ahead /= np.linalg.norm(ahead)
    steps = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    steps = steps[np.abs(steps).max(axis=1) > 0.0]
    others = (steps / np.linalg.norm(steps, axis=1, keepdims=True)) @ R.T
    along = others @ ahead
    order = np.argsort(-along.round(DIGITS), kind="stable")
    leaning = ahead + TILT * np.vstack([R.T, -R.T])
    leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
    return np.vstack([ahead, leaning, others[order[along[order] > LEAST_ALONG]]])


def _is_free(asked: Asked, found: FoundPose, joints: Array, way: Array) -> bool:
    """Return whether the open hand is free at all steps of a straight way in."""
    kernel, aims = compiled("grasp_core.hands.pose_kernel"), _aims(asked, found)
    pose: Pose = kernel.empty_pose(asked.arrays, len(found.used))
    pose.palm[:], pose.q[:] = found.palm_pose[:3, :3], joints
    for back in np.arange(TICK, LINE + 0.5 * TICK, TICK):
        pose.origin[:] = found.palm_pose[:3, 3] - back * way
        kernel.place(asked.arrays, aims, pose)
        if blocking(asked, pose):
            return False
    return True
