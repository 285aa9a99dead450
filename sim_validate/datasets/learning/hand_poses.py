"""Finds poses in which a hand stands in grasps, as cells of their rows."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from grasp_core.hands.hand import Hand
from grasp_core.hands.named_hands import load_hand
from grasp_core.hands.reach import HandReach, reach_with
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp


@cache
def hand_named(name: str) -> Hand:
    """Return a built-in hand, one value for all grasps of a process, as searches are kept by it."""
    return load_hand(name)


def hand_cells(
    hand: Hand, body: Polyhedron, grasp: Grasp, friction: float, seed: int
) -> Mapping[str, Any]:
    """Look for a pose of a hand in a grasp, and return the cells that tell of it."""
    found = reach_with(hand, body, grasp, friction, seed=seed)
    cells: dict[str, Any] = {"hand_reached": found.reached, "hand_reason": found.reason}
    return {**cells, **_pose_cells(found)} if found.reached else cells


def _pose_cells(found: HandReach) -> dict[str, Any]:
    """Return the cells of a pose that was found."""
    lists = {
        "hand_fingers": found.fingers, "hand_joints_rad": found.joints,
        "T_object_palm_m": found.palm_pose, "hand_open_joints_rad": found.pregrasp,
        "hand_approach": found.approach,
    }  # fmt: skip
    contacts = found.contacts or ()
    return {
        **{name: None if value is None else value.tolist() for name, value in lists.items()},
        "hand_points_m": [contact.position.tolist() for contact in contacts],
        "hand_normals": [contact.normal.tolist() for contact in contacts],
    }
