"""Finds straight lines on which four fingers reach their contacts without touching anything.

Solved: for each finger, a direction in which a ball of radius r and the rod behind it reach the
place p - r n, where the ball touches at p, from a given distance without touching anything else.
A rod is all points within r of a segment, so it is free of the object iff no triangle is nearer to
the segment than r, and free of another rod iff the segments are 2 r apart.

A segment and a triangle are nearest where they cross, at an end of the segment, or at an edge of
the triangle. The triangles of the curved patch that is touched do not
count: they are not exactly in the plane that the finger is thought to touch.

The directions tried are the normal and two rings around it. If none of them is free, another
direction may still be.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, islice, product

import numpy as np

from grasp_core.allowed_values import Quantity
from grasp_core.arrays import Array
from grasp_core.declared import declared
from grasp_core.geometry.polygons import plane_frame
from grasp_core.objects.on_faces import nearest_on_triangles, on_face_slack
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.settings import Settings
from grasp_core.values import FaceQuadruple

RINGS_DEG = (30.0, 60.0)
"""Angles to the normal at which fingers may approach, besides straight along it [deg]."""
RING_DIRECTIONS = 6


@declared
class Finger(Settings):
    """A finger's radius and the length of its straight way to a contact.

    Raises:
        InputError: A length is not positive.
    """

    radius_m: Quantity
    """Radius of the spherical tip and of the rod behind it [m]."""
    approach_m: Quantity
    """Length of the free line on which the finger comes [m]."""


def reach(
    body: Polyhedron, faces: FaceQuadruple, positions: Array, normals: Array, finger: Finger
) -> Array | str:
    """Find straight lines on which all fingers reach their contacts without a collision.

    Gives unit vectors from each tip along its rod, (k, 3), or the reason why there are none.
    """
    slack = on_face_slack(body)
    tips = positions - finger.radius_m * normals
    for i, j in combinations(range(len(tips)), 2):
        if np.linalg.norm(tips[i] - tips[j]) < 2.0 * finger.radius_m - slack:
            return f"fingertips {i} and {j} overlap"
    surroundings = [_Surroundings.of(body, face) for face in faces]
    for place, (others, tip) in enumerate(zip(surroundings, tips, strict=True)):
        if others.distance(tip, tip, finger.radius_m) < finger.radius_m - slack:
            return f"fingertip {place} meets the object beside its contact"
    free: list[list[Array]] = []
    for most in (1, None):  # most fingers come along their normals
        free = [
            [
                way
                for way in islice(_directions(-normal), most)
                if others.distance(tip, tip + finger.approach_m * way, finger.radius_m)
                >= finger.radius_m - slack
            ]
            for others, tip, normal in zip(surroundings, tips, normals, strict=True)
        ]
        if all(free) and (chosen := _apart(tips, free, finger, slack)) is not None:
            return chosen
    blocked = [place for place, ways in enumerate(free) if not ways]
    if blocked:
        return f"finger {blocked[0]} has no free line to its contact"
    return "the fingers' lines cross"


@dataclass(frozen=True, slots=True, eq=False)
class _Surroundings:
    """Triangles that a finger may collide with, each with a ball around it."""

    corners: Array  # (t, 3, 3) [m]
    middles: Array  # centres of the balls, (t, 3) [m]
    extents: Array  # radii of the balls, (t,) [m]

    @classmethod
    def of(cls, body: Polyhedron, face: int) -> "_Surroundings":
        """Collect all triangles of an object except those of the curved patch that is touched."""
        keep = np.ones(len(body.triangles), dtype=np.bool_)
        keep[body.faces[face].facets] = False
        corners = body.vertices[body.triangles[keep]]
        middles = corners.mean(axis=1)
        extents = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
        return cls(corners, middles, extents)

    def distance(self, start: Array, end: Array, within: float) -> float:
        """Return a segment's distance to the nearest triangle [m], exact only below `within`."""
        along = end - start
        squared = float(along @ along)
        # only triangles whose balls come near enough need the exact distance
        shares = np.clip((self.middles - start) @ along / squared, 0.0, 1.0) if squared else 0.0
        away = self.middles - start - np.multiply.outer(shares, along)
        near = np.einsum("ti,ti->t", away, away) <= (within + self.extents) ** 2
        if not near.any():
            return math.inf
        return float(segment_distances(start, end, self.corners[near]).min())


def _directions(outward: Array) -> Iterator[Array]:
    """Yield the direction along a normal, then the directions of the rings around it."""
    yield outward
    frame = plane_frame(outward)
    for lean in np.radians(RINGS_DEG):
        for turn in 2.0 * math.pi * np.arange(RING_DIRECTIONS) / RING_DIRECTIONS:
            across = frame @ np.array([math.cos(turn), math.sin(turn)])
            yield math.cos(lean) * outward + math.sin(lean) * across


def _apart(tips: Array, ways: list[list[Array]], finger: Finger, slack: float) -> Array | None:
    """Choose one free direction per finger so that no rods overlap, straight ones first."""
    ends = [
        [tip + finger.approach_m * way for way in each]
        for tip, each in zip(tips, ways, strict=True)
    ]
    clear = {
        (i, j): np.array(
            [
                [_between(tips[i], one, tips[j][None], other[None])[0] for other in ends[j]]
                for one in ends[i]
            ]
        )
        >= 2.0 * finger.radius_m - slack
        for i, j in combinations(range(len(tips)), 2)
    }
    choices = sorted(product(*(range(len(each)) for each in ways)), key=lambda c: (sum(c), c))
    for choice in choices:
        if all(free[choice[i], choice[j]] for (i, j), free in clear.items()):
            return np.array([ways[finger][way] for finger, way in enumerate(choice)])
    return None


def segment_distances(start: Array, end: Array, triangles: Array) -> Array:
    """Compute the distance of a segment from each triangle (t, 3, 3), (t,) [m]."""
    after, ends = np.roll(triangles, -1, axis=1), np.array([start, end])
    edges = [_between(start, end, triangles[:, k], after[:, k]) for k in range(3)]
    feet = np.linalg.norm(nearest_on_triangles(triangles, ends) - ends[:, None], axis=2)
    found = np.minimum(np.min(edges, axis=0), feet.min(axis=0))
    normals = np.cross(after[:, 0] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    heights = np.einsum("ti,eti->et", normals, ends[:, None] - triangles[:, 0])
    # the line of the segment passes all edges on the same side
    sides = np.cross(triangles - start, after - start) @ (end - start)
    through = (sides >= 0.0).all(axis=1) | (sides <= 0.0).all(axis=1)
    return np.where(through & (heights[0] * heights[1] < 0.0), 0.0, found)


def _between(start: Array, end: Array, tails: Array, heads: Array) -> Array:
    """Compute the least distance of one segment from each of others, (t,) [m]."""
    one, others, apart = end - start, heads - tails, start - tails
    a, e = float(one @ one), np.einsum("ti,ti->t", others, others)
    b, c, f = others @ one, apart @ one, np.einsum("ti,ti->t", others, apart)
    safe_a, safe_e = max(a, 1e-300), np.where(e > 0.0, e, 1.0)
    det = a * e - b * b
    skew = det > 1e-14 * a * e  # else parallel: any share of one is as good
    share = np.where(skew, np.clip((b * f - c * e) / np.where(skew, det, 1.0), 0.0, 1.0), 0.0)
    other = np.clip(np.where(e > 0.0, (b * share + f) / safe_e, 0.0), 0.0, 1.0)
    share = np.clip((b * other - c) / safe_a, 0.0, 1.0) if a > 0.0 else np.zeros_like(other)
    return np.linalg.norm(apart + share[:, None] * one - other[:, None] * others, axis=1)
