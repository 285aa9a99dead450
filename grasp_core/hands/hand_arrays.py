"""Arrays of a hand, a surface, aims and poses, which compiled loops read and change.

Hands and objects keep their arrays by identity: equal ones that are other objects share them too.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, wraps
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.hands.hand import PALM, SAME, Hand, LinkShape

Value = TypeVar("Value")
Result = TypeVar("Result")
LEAST_BALL = 0.008
"""Least radius of the balls that stand for a shape while a pose is sought [m]: thinner parts of a
link lie beside thicker ones."""
ROUNDED = 1.12
"""Radius of a ball over the smallest half-size of its box: between a ball inside the box and one
through its edges."""
BALLS_APART = 1.7
"""Largest distance between neighbouring balls of a shape, in the smallest half-size."""
OUTSIDE = 0.006
"""How far a ball must stick out of every larger ball of its link to be kept [m]."""


def kept_by_identity(most: int) -> Callable[[Callable[[Value], Result]], Callable[[Value], Result]]:
    """Return a decorator that keeps results for at most so many arguments, and these alive."""

    def decorated(function: Callable[[Value], Result]) -> Callable[[Value], Result]:
        kept: dict[int, tuple[Value, Result]] = {}

        @wraps(function)
        def looked_up(value: Value) -> Result:
            known = kept.get(id(value))
            if known is None:  # a kept argument is alive, so that no other has its address
                known = value, function(value)
                if len(kept) >= most:
                    kept.clear()
                kept[id(value)] = known
            return known[1]

        return looked_up

    return decorated


class HandArrays(NamedTuple):
    """A hand in arrays: j joints, one link each, f fingers, s shapes, b balls.

    A ball stands for a part of a link before the last of its finger while a pose is sought; shapes
    decide.
    """

    positions: Array
    """Origins of the links' frames in those of the links before them, (j, 3) [m]."""
    rotations: Array  # axes of these frames at the angle zero, (j, 3, 3)
    axes: Array  # axes of the joints, (j, 3)
    ranges: Array  # lowest and highest angles, (j, 2) [rad]
    drivers: Indices
    """Joint that each joint follows, or its own number: see `couplings`, as for the next, (j,)."""
    ratios: Array  # (j,)
    offsets: Array  # (j,) [rad]
    starts: Indices
    """First link of each finger, and the number of links at the end, (f + 1,)."""
    tip_centers: Array
    """Middles of the fingertips' balls in the frames of the last links, (f, 3) [m]."""
    tip_radii: Array  # radii of these balls, (f,) [m]
    tip_corners: Array
    """Corners of all fingertips, finger by finger: for a ball its middle, (c, 3) [m]."""
    cover_corners: Array
    """Corners of blocks in the frames of the shapes that cover them, zeros for balls, (c, 3)."""
    tip_firsts: Indices
    """First corner of each finger, and the number of corners at the end, (f + 1,)."""
    tip_roundings: Array
    """Distances from the hulls of these corners to the tips' surfaces, (f,) [m]."""
    tip_shapes: Indices
    """The shape that is each finger's ball, or covers its block, (f,)."""
    shape_links: Indices  # the link of each shape, -1 for the palm, (s,)
    shape_positions: Array  # middles of the shapes in the links' frames, (s, 3) [m]
    shape_rotations: Array  # axes of the shapes in the links' frames, (s, 3, 3)
    shape_sizes: Array  # half-sizes of the shapes' boxes, (s, 3) [m]
    shape_radii: Array  # distances from the boxes to the surfaces, (s,) [m]
    shape_reaches: Array
    """Largest distances of the shapes' points from their middles, (s,) [m]."""
    shape_tips: Indices
    """The finger whose tip a shape stands for: it shares the tip's ball or covers its corners; -1
    for none, (s,)."""
    link_shapes: Indices
    """For the palm and each link, the shape about whose middle a ball holds all of its shapes, or
    -1 if it has none, (j + 1,)."""
    link_reaches: Array  # radii of these balls, (j + 1,) [m]
    pairs: Indices  # pairs of shapes of one hand that must not overlap, (p, 2)
    ball_links: Indices  # the link of each ball, -1 for the palm, (b,)
    ball_centers: Array  # middles of the balls in the links' frames, (b, 3) [m]
    ball_radii: Array  # radii of the balls, (b,) [m]


class SurfaceTree(NamedTuple):
    """Triangles of a surface in a binary tree of n balls; the first is the root."""

    corners: Array
    """Corners of the triangles, in the order of the leaves, (t, 3, 3) [m]."""
    normals: Array  # outward unit normals, (t, 3); zero for a triangle without area
    numbers: Indices  # number of each of these triangles in the body, (t,)
    middles: Array  # middles of the balls, (n, 3) [m]
    radii: Array  # radii of the balls, (n,) [m]
    links: Indices
    """For each ball its two children, or a negative number and the first of its triangles: minus
    their number, (n, 2)."""


class Targets(NamedTuple):
    """Where fingertips are to touch: k contacts, e edges of regions in all."""

    fingers: Indices  # the finger for each contact, (k,)
    origins: Array  # a point of each plane, (k, 3) [m]
    normals: Array  # unit normals into the object, (k, 3)
    tangents: Array  # two unit vectors in each plane, (k, 2, 3)
    pinned: Array
    """1.0 where the contact must be at the origin, 0.0 where in its region, (k,)."""
    touching: Array
    """Points of the tips' hulls that touch, in the last links' frames, (k, 3) [m]; NaN where it is
    the corner that reaches farthest along the normal."""
    soft: float
    """Depth of a corner of a block below the one that reaches farthest, at which it counts less by
    the factor e as the point that touches [m]."""
    edge_contacts: Indices  # the contact of each edge, (e,)
    edge_points: Array  # a point of each edge, (e, 3) [m]
    edge_inward: Array
    """Unit vectors in the plane from the edge into the region, (e, 3)."""
    up: Array  # unit normal of the table, (3,)
    height: float  # height of the table along it [m]; minus infinity for none


class Wanted(NamedTuple):
    """Distances that are asked for, and what else counts."""

    clear: float  # distance of balls from the object and the table [m]
    behind: float
    """Distance of last links from the planes that their tips touch [m]."""
    apart: float  # distance of links from each other [m]
    margin: float  # distance of contacts from the edges of their regions [m]
    pull: float  # weight of staying near the planned contact inside a region
    overlaps: bool  # whether the first three count at all
    palm_moves: bool  # whether the palm may move


class Pose(NamedTuple):
    """A pose of a hand and where its parts are; the loops change the arrays in place."""

    palm: Array  # axes of the palm's frame, (3, 3)
    origin: Array  # its origin, (3,) [m]
    q: Array  # joint angles, (j,) [rad]
    R: Array  # axes of the links' frames, (j, 3, 3)
    p: Array  # their origins, (j, 3) [m]
    W: Array  # axes of the joints, (j, 3)
    turned: Array  # axes of the shapes, (s, 3, 3)
    middles: Array  # middles of the shapes, (s, 3) [m]
    tips: Array
    """Points of the tips' hulls that touch, by contact, (k, 3) [m]: middles of tips that are
    balls."""
    fronts: Array
    """Corners of the tips that are farthest along the normals, (k, 3) [m]."""
    rolls: Array
    """How points that touch move on their tips as the tips turn, (k, 3, 3) [m]."""


class Sums(NamedTuple):
    """What is summed over all residuals r with derivatives J, for n unknowns."""

    H: Array  # J'J, its lower half, (n, n)
    g: Array  # J'r, (n,)
    row: Array  # the derivatives of one residual, zero between two, (n,)
    pivot: Array  # point about which the palm turns, (3,) [m]
    parts: Array
    """The largest distance from touching [mm], the squares of touching and of being in regions, and
    those of overlaps [mm^2], (3,)."""


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    link: int
    shape: LinkShape


@kept_by_identity(16)
@lru_cache(maxsize=16)
def hand_arrays(hand: Hand) -> HandArrays:
    """Lay a hand out as arrays; equal hands share them."""
    links, drives = hand.links, hand.drives
    parts = [_Part(-1, shape) for shape in hand.palm]
    parts += [_Part(i, shape) for i, link in enumerate(links) for shape in link.shapes]
    lengths = [len(finger.links) for finger in hand.fingers]
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    ends = starts[1:] - 1
    # what stands for a fingertip: its ball, or what covers its corners
    tips = [
        LinkShape(each.tip.center, np.eye(3), np.zeros(3), each.tip.radius)
        if each.tip.corners is None else each.links[-1].shapes[-1]
        for each in hand.fingers
    ]  # fmt: skip
    parts += [
        _Part(int(end), tip)
        for end, tip, finger in zip(ends, tips, hand.fingers, strict=True)
        if finger.tip.corners is None
    ]
    corners = [finger.tip.core[0] for finger in hand.fingers]
    free = _free_links(hand, starts)
    where = np.array([part.link for part in parts], np.int64)
    one, other = np.triu_indices(len(where), 1)
    kept = free[where[one] + 1, where[other] + 1] > 0.0  # pairs that must not overlap
    balls = _balls([part for part in parts if part.link not in ends])
    at = np.array([link for link, _, _ in balls], np.int64)
    shapes = [part.shape for part in parts]
    held = [_link_ball(parts, link) for link in range(-1, len(links))]
    return HandArrays(
        positions=np.array([link.joint.position for link in links]),
        rotations=np.array([link.joint.rotation for link in links]),
        axes=np.array([link.joint.axis for link in links]),
        ranges=drives.ranges,
        drivers=drives.drivers,
        ratios=drives.ratios,
        offsets=drives.offsets,
        starts=starts,
        tip_centers=np.array([finger.tip.center for finger in hand.fingers]),
        tip_radii=np.array([finger.tip.radius for finger in hand.fingers]),
        tip_corners=np.concatenate(corners),
        cover_corners=np.concatenate(
            [(own - tip.position) @ tip.rotation for own, tip in zip(corners, tips, strict=True)]
        ),
        tip_firsts=np.concatenate([[0], np.cumsum([len(own) for own in corners])]).astype(np.int64),
        tip_roundings=np.array([finger.tip.core[1] for finger in hand.fingers]),
        tip_shapes=np.array(
            [
                max(n for n, part in enumerate(parts) if part.shape is tip and part.link == end)
                for end, tip in zip(ends, tips, strict=True)
            ],
            np.int64,
        ),
        shape_links=where,
        shape_positions=np.array([shape.position for shape in shapes]),
        shape_rotations=np.array([shape.rotation for shape in shapes]),
        shape_sizes=np.array([shape.half_sizes for shape in shapes]),
        shape_radii=np.array([shape.radius for shape in shapes]),
        shape_reaches=np.array([_reach(shape) for shape in shapes]),
        shape_tips=_shape_tips(hand, parts, ends.tolist(), tips),
        link_shapes=np.array([shape for shape, _ in held], np.int64),
        link_reaches=np.array([reach for _, reach in held]),
        pairs=np.column_stack([one[kept], other[kept]]).astype(np.int64),
        ball_links=at,
        ball_centers=np.array([center for _, center, _ in balls]).reshape(-1, 3),
        ball_radii=np.array([radius for _, _, radius in balls]),
    )


def _reach(shape: LinkShape) -> float:
    return float(np.linalg.norm(shape.half_sizes)) + shape.radius


def _link_ball(parts: list[_Part], link: int) -> tuple[int, float]:
    """Find the shape about whose middle the smallest ball holds a link, and its radius."""
    best = (-1, 0.0)
    own = [(number, part.shape) for number, part in enumerate(parts) if part.link == link]
    for number, middle in own:
        reach = SAME + max(
            float(np.linalg.norm(shape.position - middle.position)) + _reach(shape)
            for _, shape in own
        )
        if best[0] < 0 or reach < best[1]:
            best = (number, reach)
    return best


def _free_links(hand: Hand, starts: Indices) -> Array:
    """Return which links, the palm first, must not overlap, (links + 1, links + 1) of 0 and 1."""
    names = [PALM, *(link.name for link in hand.links)]
    free = np.ones((len(names),) * 2) - np.eye(len(names))
    for first, end in pairwise(starts.tolist()):
        chain = [0, *range(first + 1, end + 1)]
        for one, other in pairwise(chain):
            free[one, other] = free[other, one] = 0.0
    for one, other in hand.ignored_pairs:
        i, j = names.index(one), names.index(other)
        free[i, j] = free[j, i] = 0.0
    return free


def _balls(parts: list[_Part]) -> list[tuple[int, Array, float]]:
    """Cover shapes roughly with balls: their links, middles and radii, the largest first."""
    found: list[tuple[int, Array, float]] = []
    for part in parts:
        shape = part.shape
        outer = shape.half_sizes + shape.radius
        inner = max(float(outer.min()), LEAST_BALL)
        radius = inner if shape.radius > 0.0 else ROUNDED * inner
        spans = np.maximum(outer - inner, 0.0)
        counts = np.ceil(2.0 * spans / (BALLS_APART * inner)).astype(int) + 1
        ticks: list[Array] = [
            np.linspace(-s, s, n) if n > 1 else np.zeros(1)
            for s, n in zip(spans.tolist(), counts.tolist(), strict=True)
        ]
        for local in np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3):
            found.append((part.link, shape.position + shape.rotation @ local, radius))
    kept: list[tuple[int, Array, float]] = []
    for link, center, radius in sorted(found, key=lambda ball: -ball[2]):
        inside = any(
            link == other and float(np.linalg.norm(center - middle)) + radius <= size + OUTSIDE
            for other, middle, size in kept
        )
        if not inside:
            kept.append((link, center, radius))
    return kept


def _shape_tips(
    hand: Hand, parts: list[_Part], ends: list[int], tips: list[LinkShape]
) -> Indices:  # fmt: skip
    """Find the shapes that stand for fingertips: covers, balls, and capsules that end in these."""
    found = np.full(len(parts), -1, np.int64)
    for number, part in enumerate(parts):
        if part.link in ends:
            finger, shape = ends.index(part.link), part.shape
            if hand.fingers[finger].tip.corners is not None:
                found[number] = finger if shape is tips[finger] else -1
                continue
            local = (tips[finger].position - shape.position) @ shape.rotation
            out = np.linalg.norm(np.maximum(np.abs(local) - shape.half_sizes, 0.0))
            alike = abs(shape.radius - tips[finger].radius) <= SAME
            found[number] = finger if alike and out <= SAME else -1
    return found
