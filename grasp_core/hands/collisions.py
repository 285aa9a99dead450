"""Measures how far a hand is from itself, from an object and from a table: this decides.

Distances are exact, between boxes with rounded edges and triangles. A shape wholly inside the
object counts as overlapping it. The triangles of a surface are sorted into a tree of balls, in
which compiled loops find near ones.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.hand import FILE_DIGITS, PALM_NAME, Hand
from grasp_core.hands.hand_arrays import HandArrays, SurfaceTree, hand_arrays, places
from grasp_core.objects.polyhedron import Polyhedron

COLLISIONS = "grasp_core.hands.collisions_kernel"
LEAF_TRIANGLES = 4  # largest number of triangles of a node without children
FAR_M = 0.02  # distance up to which clearances are measured


@lru_cache(maxsize=8)
def surface_tree(body: Polyhedron) -> SurfaceTree:
    """Sort the triangles of an object; equal objects share the tree."""
    triangles = body.vertices[body.triangles]
    middles, order = triangles.mean(axis=1), np.arange(len(triangles))
    balls: list[tuple[Array, float]] = []
    links: list[tuple[int, int]] = []

    def add(first: int, end: int) -> int:
        part = order[first:end]
        corners = triangles[part].reshape(-1, 3)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        balls.append((middle, float(np.linalg.norm(corners - middle, axis=1).max())))
        links.append((-(end - first), first))
        return len(balls) - 1

    ahead = [(add(0, len(order)), 0, len(order))]
    while ahead:
        node, first, end = ahead.pop()
        if end - first <= LEAF_TRIANGLES:
            continue
        at = middles[order[first:end]]
        axis = int(np.argmax(np.ptp(at, axis=0)))
        order[first:end] = order[first:end][np.argsort(at[:, axis], kind="stable")]
        half = (first + end) // 2
        children = add(first, half), add(half, end)
        links[node] = children
        ahead += [(children[0], first, half), (children[1], half, end)]
    corners = triangles[order]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(across, axis=1, keepdims=True)
    return SurfaceTree(
        np.ascontiguousarray(corners),
        np.divide(across, sizes, out=np.zeros_like(across), where=sizes > 0.0),
        np.array([middle for middle, _ in balls]),
        np.array([radius for _, radius in balls]), np.array(links, np.int64),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Clearances:
    """Least distances of a hand's parts, negative where they overlap, at most `FAR_M` [m]."""

    itself: float  # between links that must not overlap
    object: float  # from the object, of all shapes but those that stand for touching fingertips
    tips: float  # from the object, of those fingertips: zero where they touch
    table: float  # from the table; `FAR_M` where there is none


def clearances(
    hand: Hand, body: Polyhedron, joints: Array, palm_pose: Array, fingers: Indices,
    up: Array | None = None, height: float = 0.0,
) -> Clearances:  # fmt: skip
    """Measure the distances of a hand from itself, an object and a table."""
    kernel, tree = compiled(COLLISIONS), surface_tree(body)
    shapes = _shapes(hand, joints, palm_pose)
    touching = np.isin(shapes[0].shape_tips, fingers)
    never = np.full(len(touching), -np.inf)
    apart = [
        kernel.of_object(*shapes, tree, np.where(left_out, never, FAR_M))
        for left_out in (touching, ~touching)
    ]
    low = FAR_M if up is None else kernel.of_table(*shapes, up, height)
    own = kernel.of_itself(*shapes, FAR_M)
    return Clearances(
        min(own, FAR_M), min(apart[0], 0.0) + FAR_M, min(apart[1], 0.0) + FAR_M, min(low, FAR_M)
    )


def tip_gaps(
    hand: Hand, body: Polyhedron, joints: Array, palm_pose: Array, fingers: Indices
) -> tuple[Array, Array, Array]:
    """Measure how far fingertips are from an object, negative in it, (k,) [m].

    Also gives where they are nearest, or deepest: points of tips' hulls, which are the middles of
    balls, and of the surface, (k, 3) each [m].
    """
    kernel, tree = compiled(COLLISIONS), surface_tree(body)
    arrays, turned, middles = _shapes(hand, joints, palm_pose)
    near, other, apart = *np.empty((2, len(fingers), 3)), np.empty(len(fingers))
    for k, finger in enumerate(fingers):
        apart[k] = kernel.tip_surface(arrays, turned, middles, tree, finger, near[k], other[k])
        if apart[k] <= FILE_DIGITS:
            s = arrays.tip_shapes[finger]
            corners, _ = kernel.core_in(arrays, turned[s], middles[s], s)
            apart[k] = kernel.deepest(corners, tree, near[k], other[k])
    return apart - arrays.tip_roundings[fingers], near, other


def tip_distances(
    hand: Hand, joints: Array, palm_pose: Array, fingers: Iterable[int], points: Array
) -> Array:
    """Measure how far points are from fingertips: zero where these touch them, (k,) [m]."""
    kernel, (arrays, turned, middles) = compiled(COLLISIONS), _shapes(hand, joints, palm_pose)
    apart: list[float] = []
    for finger, point in zip(fingers, points, strict=True):
        s = arrays.tip_shapes[finger]
        corners, rounding = kernel.core_in(arrays, turned[s], middles[s], s)
        apart.append(beyond_hull(corners, point[None])[0] - rounding)
    return np.array(apart)


def _shapes(hand: Hand, joints: Array, palm_pose: Array) -> tuple[HandArrays, Array, Array]:
    """Return the arrays of a hand, and the axes and middles of its shapes where it stands."""
    found, arrays = places(hand, joints, palm_pose), hand_arrays(hand)
    turned, middles = np.empty_like(arrays.shape_rotations), np.empty_like(arrays.shape_positions)
    compiled(COLLISIONS).place_shapes(
        arrays, palm_pose[:3, :3].copy(), palm_pose[:3, 3].copy(), found.link_rotations[0],
        found.link_positions[0], turned, middles,
    )  # fmt: skip
    return arrays, turned, middles


def overlapping_pairs(hand: Hand, joints: Array) -> set[tuple[str, str]]:
    """Return the names of links, in order of the alphabet, that overlap at some joint angles."""
    kernel = compiled(COLLISIONS)
    arrays, turned, middles = _shapes(hand, joints, np.eye(POSE_SIZE))
    names = [PALM_NAME, *(link.name for link in hand.links)]
    found, way, point = set[tuple[str, str]](), np.empty(3), np.empty(3)
    for i, j in arrays.pairs.tolist():
        if kernel.pair_distance(arrays, turned, middles, i, j, 0.0, way, point) <= 0.0:
            pair = sorted(names[1 + int(arrays.shape_links[each])] for each in (i, j))
            found.add((pair[0], pair[1]))
    return found


def beyond_hull(corners: Array, points: Array) -> list[float]:
    """Measure how far points (n, 3) are outside the hull of corners (m, 3), zero inside."""
    kernel, near, other = compiled("grasp_core.hands.distances_kernel"), *np.empty((2, 3))
    return [kernel.hull_hull(corners, point[None], np.inf, near, other) for point in points]
