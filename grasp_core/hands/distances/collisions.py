"""Measures how far a hand is from itself, from an object and from a table: this decides.

Distances are exact, between boxes with rounded edges and triangles. A shape wholly inside the
object counts as overlapping it.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.frames import POSE
from grasp_core.hands.distances.surface import surface_tree
from grasp_core.hands.hand import PALM, SAME, Hand
from grasp_core.hands.hand_arrays import hand_arrays
from grasp_core.hands.kinematics import places
from grasp_core.hands.loop_values import HandArrays
from grasp_core.objects.polyhedron import Polyhedron

FAR = 0.02
"""Distance up to which clearances are measured [m]."""


@dataclass(frozen=True, slots=True)
class Clearances:
    """Least distances of a hand's parts, negative where they overlap, at most `FAR` [m]."""

    itself: float
    """Between links that must not overlap."""
    object: float
    """From the object, of all shapes but those that stand for touching fingertips."""
    tips: float
    """From the object, of those fingertips: zero where they touch."""
    table: float
    """From the table; `FAR` where there is none."""


def clearances(
    hand: Hand,
    body: Polyhedron,
    joints: Array,
    palm_pose: Array,
    fingers: Indices,
    up: Array | None = None,
    height: float = 0.0,
) -> Clearances:
    """Measure the distances of a hand from itself, an object and a table.

    Takes `joints` (j,) [rad]; `palm_pose` (4, 4); `up` (3,); `height` [m].
    """
    arrays, tree = hand_arrays(hand), surface_tree(body)
    turned, middles = _shapes(hand, arrays, joints, palm_pose)
    kernel, worst = compiled("grasp_core.hands.distances.collisions_kernel"), np.empty(2, np.int64)
    touching = np.isin(arrays.shape_tips, fingers)
    never = np.full(len(touching), -np.inf)
    apart = [
        kernel.of_object(arrays, turned, middles, tree, np.where(left_out, never, FAR), worst[:1])
        for left_out in (touching, ~touching)
    ]
    low = FAR if up is None else kernel.of_table(arrays, turned, middles, up, height, worst[:1])
    own = kernel.of_itself(arrays, turned, middles, FAR, worst)
    return Clearances(
        min(own, FAR), min(apart[0], 0.0) + FAR, min(apart[1], 0.0) + FAR, min(low, FAR)
    )


@dataclass(frozen=True, slots=True)
class TipGaps:
    """Where fingertips are nearest to an object, or deepest in it."""

    gaps: Array
    """Distances of the tips from the surface, negative where they overlap, (k,) [m]."""
    on_tips: Array
    """Points of the tips' hulls there, (k, 3) [m]: middles of tips that are balls."""
    on_object: Array
    """Points of the surface there, (k, 3) [m]."""


def tip_gaps(
    hand: Hand, body: Polyhedron, joints: Array, palm_pose: Array, fingers: Indices
) -> TipGaps:
    """Measure how far fingertips are from an object.

    Takes `joints` (j,) [rad]; `palm_pose` (4, 4); `fingers` (k,).
    """
    arrays, tree = hand_arrays(hand), surface_tree(body)
    turned, middles = _shapes(hand, arrays, joints, palm_pose)
    kernel = compiled("grasp_core.hands.distances.collisions_kernel")
    near, other = np.empty((len(fingers), 3)), np.empty((len(fingers), 3))
    apart = np.empty(len(fingers))
    for k, finger in enumerate(fingers):
        apart[k] = kernel.tip_surface(arrays, turned, middles, tree, finger, near[k], other[k])
        if apart[k] <= SAME:
            s = arrays.tip_shapes[finger]
            corners, _ = kernel.core_in(arrays, turned[s], middles[s], s)
            apart[k] = kernel.deepest(corners, tree, near[k], other[k])
    return TipGaps(apart - arrays.tip_roundings[fingers], near, other)


def tip_distances(
    hand: Hand, joints: Array, palm_pose: Array, fingers: Iterable[int], points: Array
) -> Array:
    """Measure how far points are from fingertips: zero where these touch them, (k,) [m].

    Takes `joints` (j,) [rad]; `palm_pose` (4, 4); `fingers` (k,); `points` (k, 3) [m].
    """
    arrays, kernel = hand_arrays(hand), compiled("grasp_core.hands.distances.collisions_kernel")
    turned, middles = _shapes(hand, arrays, joints, palm_pose)
    return np.array([
        kernel.tip_point(arrays, turned, middles, finger, point)
        for finger, point in zip(fingers, points, strict=True)
    ])  # fmt: skip


def _shapes(hand: Hand, arrays: HandArrays, joints: Array, palm_pose: Array) -> tuple[Array, Array]:
    """Return axes and middles of the shapes of a hand in the object's frame."""
    found = places(hand, joints, palm_pose)
    turned, middles = np.empty_like(arrays.shape_rotations), np.empty_like(arrays.shape_positions)
    compiled("grasp_core.hands.distances.collisions_kernel").place_shapes(
        arrays, palm_pose[:3, :3].copy(), palm_pose[:3, 3].copy(), found.link_rotations[0],
        found.link_positions[0], turned, middles,
    )  # fmt: skip
    return turned, middles


def overlapping_pairs(hand: Hand, joints: Array) -> set[tuple[str, str]]:
    """Return the names of links, in order of the alphabet, that overlap at some joint angles.

    Takes `joints` (j,) [rad].
    """
    arrays, kernel = hand_arrays(hand), compiled("grasp_core.hands.distances.collisions_kernel")
    turned, middles = _shapes(hand, arrays, joints, np.eye(POSE))
    names = [PALM, *(link.name for link in hand.links)]
    found, way, point = set[tuple[str, str]](), np.empty(3), np.empty(3)
    for i, j in arrays.pairs.tolist():
        if kernel.pair_distance(arrays, turned, middles, i, j, 0.0, way, point) <= 0.0:
            pair = sorted(names[1 + int(arrays.shape_links[each])] for each in (i, j))
            found.add((pair[0], pair[1]))
    return found
