"""Arrays of a hand, a surface, aims and poses, which compiled loops read and change.

With origin p_k and axis w_k of joint k, both in the frame of the palm pose, a point x that a finger
carries moves by

    dx / dq_k = w_k x (x - p_k)                                                           (1)

where k is one of the finger's joints, and by nothing else.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.allowed_values import Direction, value_of
from grasp_core.arrays import Array, Indices, cross, frozen_copy, real_array
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.hand import FILE_DIGITS, PALM_NAME, Hand, HandFinger, LinkShape

_Part: TypeAlias = tuple[int, LinkShape]  # a shape with the number of its link
LEAST_BALL = 0.008
"""Least radius of the balls that stand for a shape while a pose is sought [m]: thinner parts of a
link lie beside thicker ones."""
EDGE_ROUNDED = 1.12
"""Radius of a ball over the smallest half-size of its box: between a ball inside the box and one
through its edges."""
BALLS_APART = 1.7
"""Largest distance between neighbouring balls of a shape, in the smallest half-size."""
STICKING_OUT = 0.006
"""How far a ball must stick out of every larger ball of its link to be kept [m]."""


class HandArrays(NamedTuple):
    """A hand in arrays: j joints, one link each, f fingers, s shapes, b balls, c corners of tips.

    A ball stands for a part of a link before the last of its finger while a pose is sought; shapes
    decide. Links are numbered from 0; -1 is the palm, which comes first where there is a row for
    each of them. Places and sizes are in the frames of the links.
    """

    positions: Array  # origins of links' frames in those of the links before, (j, 3)
    rotations: Array  # axes of these frames at the angle zero, (j, 3, 3)
    axes: Array  # axes of the joints, (j, 3)
    ranges: Array  # lowest and highest angles, (j, 2) [rad]
    drivers: Indices  # joint that each follows, or itself, as in `hand`, (j,)
    ratios: Array  # (j,)
    offsets: Array  # (j,) [rad]
    starts: Indices  # first link of each finger, and the number of links, (f + 1,)
    link_firsts: Indices  # first link of the finger of each link, (j,)
    tip_centers: Array  # middles of the fingertips' balls, (f, 3)
    tip_radii: Array  # radii of these balls, (f,)
    tip_corners: Array  # of all fingertips, for a ball its middle, (c, 3)
    cover_corners: Array  # of blocks in the frames of their covers, else zeros, (c, 3)
    tip_firsts: Indices  # first corner of each finger, and their number, (f + 1,)
    tip_roundings: Array  # distances from corners' hulls to tips' surfaces, (f,)
    tip_shapes: Indices  # shape that is each finger's ball, or covers its block, (f,)
    shape_links: Indices  # the link of each shape, (s,)
    shape_positions: Array  # middles of the shapes, (s, 3)
    shape_rotations: Array  # their axes, (s, 3, 3)
    shape_sizes: Array  # half-sizes of the shapes' boxes, (s, 3)
    shape_radii: Array  # distances from the boxes to the surfaces, (s,)
    shape_reaches: Array  # largest distances of points from the middles, (s,)
    shape_tips: Indices  # the finger whose ball or corners a shape covers, or -1, (s,)
    link_shapes: Indices  # shape about whose middle a ball holds a link, or -1, (j + 1,)
    link_reaches: Array  # radii of these balls, (j + 1,)
    pairs: Indices  # pairs of shapes that must not overlap, (p, 2)
    ball_links: Indices  # the link of each ball, (b,)
    ball_centers: Array  # middles of the balls, (b, 3)
    ball_radii: Array  # (b,)


class SurfaceTree(NamedTuple):
    """Triangles of a surface in a binary tree of n balls; the first is the root."""

    corners: Array  # of the triangles, in the order of the leaves, (t, 3, 3)
    normals: Array  # outward unit normals, (t, 3); zero for a triangle without area
    middles: Array  # of the balls, (n, 3)
    radii: Array  # of the balls, (n,)
    links: Indices
    """For each ball its two children, or minus the number of triangles and the first, (n, 2)."""


class Targets(NamedTuple):
    """Where fingertips are to touch: k contacts, e edges of regions in all."""

    fingers: Indices  # the finger for each contact, (k,)
    origins: Array  # a point of each plane, (k, 3)
    normals: Array  # unit normals into the object, (k, 3)
    tangents: Array  # two unit vectors in each plane, (k, 2, 3)
    pinned: Array  # 1.0 where the contact must be at the origin, else 0.0, (k,)
    touching: Array
    """Points of the tips' hulls that touch, in the last links' frames, (k, 3); NaN where it is the
    corner that reaches farthest along the normal."""
    soft: float
    """Depth of a corner of a block below the one that reaches farthest, at which it counts less by
    the factor e as the point that touches."""
    edge_contacts: Indices  # the contact of each edge, (e,)
    edge_points: Array  # a point of each edge, (e, 3)
    edge_inward: Array  # unit vectors in the plane into the region, (e, 3)
    up: Array  # unit normal of the table, (3,)
    height: float  # of the table along it; minus infinity for none


class Gaps(NamedTuple):
    """Distances that are asked for, and what else counts."""

    clear: float  # of balls from the object and the table
    behind: float  # of last links from the planes that their tips touch
    apart: float  # of links from each other
    margin: float  # of contacts from the edges of their regions
    pull: float  # weight of staying near the planned contact inside a region
    overlaps: bool  # whether the first three count at all
    palm_moves: bool


class HandPose(NamedTuple):
    """A pose of a hand and where its parts are; the loops change the arrays in place."""

    palm: Array  # axes of the palm's frame, (3, 3)
    origin: Array  # its origin, (3,)
    q: Array  # joint angles, (j,) [rad]
    R: Array  # axes of the links' frames, (j, 3, 3)
    p: Array  # their origins, (j, 3)
    W: Array  # axes of the joints, (j, 3)
    turned: Array  # axes of the shapes, (s, 3, 3)
    middles: Array  # of the shapes, (s, 3)
    tips: Array  # points of tips' hulls that touch, middles of balls, (k, 3)
    fronts: Array  # corners of tips that are farthest along the normals, (k, 3)
    rolls: Array  # how these points move on their tips as the tips turn, (k, 3, 3)


class Sums(NamedTuple):
    """What is summed over all residuals r with derivatives J, for n unknowns."""

    H: Array  # J'J, its lower half, (n, n)
    g: Array  # J'r, (n,)
    row: Array  # the derivatives of one residual, zero between two, (n,)
    pivot: Array  # point about which the palm turns, (3,)
    parts: Array
    """The largest distance from touching [mm], the squares of touching and of being in regions, and
    those of overlaps [mm^2], (3,)."""


@lru_cache(maxsize=16)
def hand_arrays(hand: Hand) -> HandArrays:
    """Lay a hand out as arrays; equal hands share them."""
    links, drives, fingers = hand.links, hand.drives, hand.fingers
    starts = np.array([0, *(chain.stop for chain in hand.chains)])
    ends = [chain[-1] for chain in hand.chains]
    parts: list[_Part] = [(-1, shape) for shape in hand.palm]
    parts += [(i, shape) for i, link in enumerate(links) for shape in link.shapes]
    parts += [
        (end, LinkShape(finger.tip.center, np.eye(3), np.zeros(3), finger.tip.radius))
        for end, finger in zip(ends, fingers, strict=True) if finger.tip.corners is None
    ]  # fmt: skip
    where = np.array([link for link, _ in parts])
    tip_shapes = np.array([np.flatnonzero(where == end)[-1] for end in ends])  # balls or covers
    tips = [parts[int(number)][1] for number in tip_shapes]
    corners = [finger.tip.core[0] for finger in fingers]
    one, other = np.triu_indices(len(where), 1)
    kept = _free_links(hand, starts)[where[one] + 1, where[other] + 1]  # must not overlap
    balls = _balls([part for part in parts if part[0] not in ends])
    shapes = [shape for _, shape in parts]
    held = [_link_ball(parts, link) for link in range(-1, len(links))]
    return HandArrays(
        positions=np.array([link.joint.position for link in links]),
        rotations=np.array([link.joint.rotation for link in links]),
        axes=np.array([link.joint.axis for link in links]),
        ranges=drives.ranges, drivers=drives.drivers, ratios=drives.ratios, offsets=drives.offsets,
        starts=starts, link_firsts=np.repeat(starts[:-1], np.diff(starts)),
        tip_centers=np.array([finger.tip.center for finger in fingers]),
        tip_radii=np.array([finger.tip.radius for finger in fingers]),
        tip_corners=np.concatenate(corners),
        cover_corners=np.concatenate(
            [(own - tip.position) @ tip.rotation for own, tip in zip(corners, tips, strict=True)]
        ),
        tip_firsts=np.cumsum([0, *map(len, corners)]),
        tip_roundings=np.array([finger.tip.core[1] for finger in fingers]),
        tip_shapes=tip_shapes,
        shape_links=where,
        shape_positions=np.array([shape.position for shape in shapes]),
        shape_rotations=np.array([shape.rotation for shape in shapes]),
        shape_sizes=np.array([shape.half_sizes for shape in shapes]),
        shape_radii=np.array([shape.radius for shape in shapes]),
        shape_reaches=np.array([_reach(shape) for shape in shapes]),
        shape_tips=np.array([
            next((f for f, (finger, tip) in enumerate(zip(fingers, tips, strict=True))
                  if ends[f] == link and _stands_for(shape, finger, tip)), -1)
            for link, shape in parts
        ]),
        link_shapes=np.array([shape for _, shape in held]),
        link_reaches=np.array([reach for reach, _ in held]),
        pairs=np.column_stack([one[kept], other[kept]]),
        ball_links=np.array([link for link, _, _ in balls], np.int64),
        ball_centers=np.array([center for _, center, _ in balls]).reshape(-1, 3),
        ball_radii=np.array([radius for _, _, radius in balls]),
    )  # fmt: skip


def _stands_for(shape: LinkShape, finger: HandFinger, tip: LinkShape) -> bool:
    """Return whether a shape of a last link covers the fingertip, is its ball, or ends in it."""
    if finger.tip.corners is not None:
        return shape is tip
    local = (tip.position - shape.position) @ shape.rotation
    out = np.linalg.norm(np.maximum(np.abs(local) - shape.half_sizes, 0.0))
    return bool(abs(shape.radius - tip.radius) <= FILE_DIGITS and out <= FILE_DIGITS)


def _reach(shape: LinkShape) -> float:
    return math.hypot(*shape.half_sizes) + shape.radius


def _link_ball(parts: list[_Part], link: int) -> tuple[float, int]:
    """Return the radius of the smallest ball that holds a link, and the shape it is about."""
    own = [(number, shape) for number, (of, shape) in enumerate(parts) if of == link]
    balls = (
        (max(math.hypot(*(each.position - shape.position)) + _reach(each) for _, each in own), n)
        for n, shape in own
    )
    return min(((FILE_DIGITS + reach, number) for reach, number in balls), default=(0.0, -1))


def _free_links(hand: Hand, starts: Indices) -> NDArray[np.bool_]:
    """Return which links, the palm first, must not overlap, (links + 1, links + 1)."""
    names = [PALM_NAME, *(link.name for link in hand.links)]
    pairs = [(names.index(one), names.index(other)) for one, other in hand.ignored_pairs]
    for first, end in pairwise(starts.tolist()):
        pairs += pairwise([0, *range(first + 1, end + 1)])
    free = ~np.eye(len(names), dtype=bool)
    for i, j in pairs:
        free[i, j] = free[j, i] = False
    return free


def _balls(parts: list[_Part]) -> list[tuple[int, Array, float]]:
    """Cover shapes roughly with balls: their links, middles and radii, the largest first."""
    found: list[tuple[int, Array, float]] = []
    for link, shape in parts:
        outer = shape.half_sizes + shape.radius
        inner = max(float(outer.min()), LEAST_BALL)
        radius = inner if shape.radius > 0.0 else EDGE_ROUNDED * inner
        spans = np.maximum(outer - inner, 0.0)
        counts = np.ceil(2.0 * spans / (BALLS_APART * inner)).astype(int) + 1
        ticks: list[Array] = [
            np.linspace(-s, s, n) if n > 1 else np.zeros(1)
            for s, n in zip(spans.tolist(), counts.tolist(), strict=True)
        ]
        for local in np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3):
            found.append((link, shape.position + shape.rotation @ local, radius))
    kept: list[tuple[int, Array, float]] = []
    for link, center, radius in sorted(found, key=lambda ball: -ball[2]):
        inside = any(
            link == other and float(np.linalg.norm(center - middle)) + radius <= size + STICKING_OUT
            for other, middle, size in kept
        )
        if not inside:
            kept.append((link, center, radius))
    return kept


@dataclass(frozen=True, slots=True, eq=False)
class HandPlaces:
    """Where the parts of a hand are, for n sets of joint angles; read-only arrays."""

    link_rotations: Array  # axes of the links' frames, (n, joints, 3, 3)
    link_positions: Array  # origins of these frames, (n, joints, 3) [m]
    joint_axes: Array  # unit vectors of the joints' axes, (n, joints, 3)
    tips: Array  # middles of the fingertips' balls, (n, fingers, 3) [m]


def places(hand: Hand, joints: ArrayLike, palm_pose: ArrayLike | None = None) -> HandPlaces:
    """Compute where links and fingertips are at angles (j,) or (n, j), and one palm pose or n."""
    angles = np.atleast_2d(real_array(joints, "joints"))
    arrays = hand_arrays(hand)
    count, length = len(angles), len(arrays.axes)
    if angles.shape != (count, length):
        raise InputError(
            f"joints must have shape ({length},) or (n, {length}), got {np.shape(joints)}"
        )
    pose = np.eye(POSE_SIZE) if palm_pose is None else real_array(palm_pose, "palm_pose")
    if pose.shape not in {(POSE_SIZE, POSE_SIZE), (count, POSE_SIZE, POSE_SIZE)}:
        raise InputError(f"palm_pose must have shape (4, 4) or ({count}, 4, 4), got {pose.shape}")
    poses = np.broadcast_to(pose, (count, POSE_SIZE, POSE_SIZE))
    R, p = np.empty((count, length, 3, 3)), np.empty((count, length, 3))
    W = np.empty_like(p)
    kernel = compiled("grasp_core.hands.collisions_kernel")
    for own, row, *found in zip(poses, angles, R, p, W, strict=True):
        kernel.place_links(arrays, own[:3, :3].copy(), own[:3, 3].copy(), row, *found)
    last = arrays.starts[1:] - 1
    tips = p[:, last] + np.einsum("nfij,fj->nfi", R[:, last], arrays.tip_centers)
    return HandPlaces(*(frozen_copy(each) for each in (R, p, W, tips)))


def jacobian(hand: Hand, found: HandPlaces, link: int, points: Array) -> Array:
    """Compute the derivatives (1) of points (n, 3) that a link carries, (n, 3, joints) [m/rad]."""
    own = slice(hand_arrays(hand).link_firsts[link], link + 1)
    arms = points[:, None] - found.link_positions[:, own]
    J = np.zeros((len(points), 3, len(hand.joints)))
    J[:, :, own] = np.swapaxes(cross(found.joint_axes[:, own], arms), -1, -2)
    return J


def tip_jacobians(hand: Hand, joints: ArrayLike, palm_pose: ArrayLike | None = None) -> Array:
    """Compute the derivatives (1) of fingertips' middles, (n, fingers, 3, joints) [m/rad]."""
    found, ends = places(hand, joints, palm_pose), hand_arrays(hand).starts[1:] - 1
    each = [jacobian(hand, found, end, found.tips[:, f]) for f, end in enumerate(ends.tolist())]
    return np.stack(each, axis=1)


def direction(down: ArrayLike, name: str) -> Array:
    """Scale a direction to unit length, (3,)."""
    way = np.array(value_of(Direction, down, name))
    return way / float(np.linalg.norm(way))


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the rotation by an angle about a unit axis by Rodrigues' formula, (3, 3)."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
