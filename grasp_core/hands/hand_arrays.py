"""Lays a hand out as arrays, in the order in which compiled loops read them."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.hands.by_identity import kept_by_identity
from grasp_core.hands.hand import PALM, SAME, Hand, HandFinger, LinkShape
from grasp_core.hands.loop_values import HandArrays

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


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """A shape with the number of its link."""

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
    tips = [_tip_shape(finger) for finger in hand.fingers]
    parts += [
        _Part(int(end), tip)
        for end, tip, finger in zip(ends, tips, hand.fingers, strict=True)
        if finger.tip.corners is None
    ]
    corners = [finger.tip.core[0] for finger in hand.fingers]
    free = _free_links(hand, starts)
    where = np.array([part.link for part in parts], np.int64)
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
        pairs=_pairs(where, free),
        ball_links=at,
        ball_centers=np.array([center for _, center, _ in balls]).reshape(-1, 3),
        ball_radii=np.array([radius for _, _, radius in balls]),
    )


def _reach(shape: LinkShape) -> float:
    """Return the largest distance of a shape's points from its middle."""
    return float(np.linalg.norm(shape.half_sizes)) + shape.radius


def _link_ball(parts: list[_Part], link: int) -> tuple[int, float]:
    """Find the smallest ball about the middle of a link's shape that holds all shapes of the link.

    Gives the shape's number and the ball's radius; -1 and zero for a link without shapes.
    """
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


def _pairs(links: Indices, free: Array) -> Indices:
    """Return pairs of things on links that must not overlap, (n, 2)."""
    one, other = np.triu_indices(len(links), 1)
    kept = free[links[one] + 1, links[other] + 1] > 0.0
    return np.column_stack([one[kept], other[kept]]).astype(np.int64)


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


def _tip_shape(finger: HandFinger) -> LinkShape:
    """Return the shape that stands for a fingertip: its ball, or what covers its corners."""
    tip = finger.tip
    if tip.corners is not None:
        return finger.links[-1].shapes[-1]
    return LinkShape(tip.center, np.eye(3), np.zeros(3), tip.radius)


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
