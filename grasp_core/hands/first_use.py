"""Compiles the loops that reaching needs, half of them by each of two calls.

Each call uses its loops once, on a hand that stands nowhere, so that two processes can compile at
the same time.
"""

import numpy as np

from grasp_core.compiled import compiled
from grasp_core.frames import plane_tangents
from grasp_core.hands.collisions import surface_tree
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import Pose, Targets, Wanted, hand_arrays
from grasp_core.hands.pose_search import SOFT
from grasp_core.hands.starts import postures
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS

AXIS = (0.0, 0.0, 1.0)


def compile_posing(hand: Hand, body: Polyhedron) -> None:
    """Compile what moves a hand until its fingertips touch."""
    arrays, tree = hand_arrays(hand), surface_tree(body)
    kernel = compiled("grasp_core.hands.pose_kernel")
    count = min(len(hand.fingers), FINGERS)
    normals = np.tile(AXIS, (count, 1))
    aims = Targets(
        np.arange(count, dtype=np.int64), np.zeros((count, 3)), normals,
        np.array([plane_tangents(*normal) for normal in normals.tolist()]), np.ones(count),
        np.full((count, 3), np.nan), SOFT, np.empty(0, np.int64), np.empty((0, 3)),
        np.empty((0, 3)), np.array(AXIS), -np.inf,
    )  # fmt: skip
    wanted = Wanted(0.0, 0.0, 0.0, 0.0, 0.0, overlaps=True, palm_moves=True)
    pose: Pose = kernel.empty_pose(arrays, count)
    pose.palm[:], pose.origin[:], pose.q[:] = np.eye(3), 1.0, hand.ranges.mean(axis=1)
    kernel.settle(arrays, tree, aims, wanted, pose, kernel.empty_sums(arrays, aims), 0, 1.0)
    kernel.lay(arrays, tree, aims, pose, np.empty((count, 3)))
    compiled("grasp_core.hands.pose_rows_kernel").place(arrays, aims, pose)


def compile_checks(hand: Hand, body: Polyhedron, seed: int) -> None:
    """Compile what chooses postures and checks distances; the postures are kept."""
    postures(hand, seed)
    arrays, worst = hand_arrays(hand), np.empty(2, np.int64)
    kernel = compiled("grasp_core.hands.collisions_kernel")
    turned, middles = np.array(arrays.shape_rotations), np.array(arrays.shape_positions)
    needs = np.zeros(len(middles))
    kernel.of_itself(arrays, turned, middles, 0.0, worst)
    kernel.of_object(arrays, turned, middles, surface_tree(body), needs, worst[:1])
