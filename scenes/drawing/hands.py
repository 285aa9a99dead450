"""Shows a hand in the pose in which it stands in a grasp: its shapes, and the view to see it from.

Every part is a convex solid, so that pictures draw it as its outline and the sides that face the
viewer. Long parts are cut into pieces about as long as they are thick: parts are drawn in the order
of the depths of their middles, which is the right order for parts of like size.

The sides of a rounded box, all points within a radius of a box, are those of a coarse ball whose
eight octants are moved apart to the corners of the box. The points of the ball are at equal steps
of latitude and longitude, and those on the border of two octants occur twice, once for the corner
on either side: what lies between the two is a side of the box or a part of a round edge. Where the
box or the radius has no size, sides without area are left out. So the same rule makes boxes,
capsules and balls.
"""

import importlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.allowed_values import instance
from grasp_core.arrays import Array, Indices
from grasp_core.arrays import Shape as ArrayShape
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.frames import POSE_SIZE
from grasp_core.geometry.polygons import FEWEST_CORNERS
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import hand_arrays, places
from grasp_core.hands.reach import HandReach, with_balls
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import first_best
from grasp_core.values import Contact, Grasp
from scenes.drawing.painting import (
    SAME_VIEW_MERIT,
    VIEW_RADII,
    Alone,
    Camera,
    Drawable,
    Role,
    edge_on,
    least_gaps,
    panes_of,
    views_at,
)

QUARTER_SIDES = 3
ONE_CORNER = 1e-9
"""Distance below which corners of a box of size 1 are one: far above rounding."""
Truths: TypeAlias = NDArray[np.bool_]
BoxEnds: TypeAlias = tuple[bool, ...]
LONG, LEAST_RADII = 1.2, 2.5
"""Length of a piece of a part in thicknesses of the part, but at least so many radii of the hand's
largest fingertip."""
MOST_PART_PIECES = 6
PIECE_OVERLAP = 0.02
"""How far a piece reaches into the next one, as a share of its length, so that no gap is seen."""
NUMBER_RADII = 2.9
"""Distance of a finger's number from its contact, through the middle of the fingertip, in the
fingertip's radii."""
HAND_ELEVATIONS = (18, 28, 40, 0, -18, -28, -40)
HIDDEN = 4.0
"""Fault of a view in which the hand hides all contacts."""
FAULT_BEHIND = 1.0
FAULT_ALONG = 0.8
"""Fault of a view along the way from the middle of the hand to the object: fingers look short."""
FAULT_EDGE_ON = 0.5
"""Fault of a view in which all of the object's faces are seen nearly as lines."""
LEAST_RAY_M = 1e-12
"""Least length of a ray along an axis, so that it may be divided by [m]."""
HIDING_SHARE = 0.9
"""Share of a part's size within which it hides what is behind it: a fingertip's rim hides no
contact."""


WHOLE_BOX = np.ones((2, 3), dtype=bool)


def rounded_box(low: Array, high: Array, radius: float, outer: Truths) -> tuple[Array, ...]:
    """Make the flat sides of a rounded box, (k, 3) each [m], counter-clockwise from outside.

    Of a piece that is cut across the axes of the box, `outer` (2, 3) tells which ends are its own.
    """
    first, last, long = (tuple(each.tolist()) for each in (*outer, high > low))
    sides = _sides(long, radius > 0.0, first, last)
    corners = _corners(low, high, radius, first, last)
    return tuple(corners[side] for side in sides)


def _corners(low: Array, high: Array, radius: float, first: BoxEnds, last: BoxEnds) -> Array:
    """Place every point of the ball, (rows * columns, 3) [m]."""
    ways, upper = _grid()
    reach = radius * np.where(upper, last, first)
    return (np.where(upper, high, low) + reach * ways).reshape(-1, 3)


@cache
def _sides(long: BoxEnds, rounded: bool, first: BoxEnds, last: BoxEnds) -> tuple[Indices, ...]:
    """Return the corners of each side that has an area and is not a cut."""
    # which corners coincide does not depend on sizes, so that a box of size 1 tells
    high = np.array(long, dtype=float)
    corners = _corners(-high, high, float(rounded), first, last)
    on_cut = np.abs(np.tile(corners, 2) - np.concatenate([-high, high])) < ONE_CORNER
    on_cut &= ~np.array([*first, *last])
    places = np.arange(len(corners)).reshape(_grid()[0].shape[:2])
    above, below = places[:-1], places[1:]
    around = np.stack(
        [above, below, np.roll(below, -1, axis=1), np.roll(above, -1, axis=1)], axis=-1
    )
    sides = list[Indices]()
    for side in (places[0], places[-1, ::-1], *around.reshape(-1, 4)):
        here = corners[side]
        side = side[
            np.abs(np.roll(here, -1, axis=0) - here).max(axis=1) > ONE_CORNER
        ]  # each corner once
        if len(side) >= FEWEST_CORNERS and not on_cut[side].all(axis=0).any():
            sides.append(side)
    return tuple(sides)


@cache
def _grid() -> tuple[Array, Truths]:
    """Return the points of a ball, (rows, columns, 3), and whether they are above on each axis."""
    quarter = np.linspace(0.0, 0.5 * np.pi, QUARTER_SIDES + 1)
    heights = np.concatenate([quarter[::-1], -quarter])
    above = np.repeat([1.0, -1.0], QUARTER_SIDES + 1)
    turns = (0.5 * np.pi * np.arange(4)[:, None] + quarter).ravel()
    middles = np.repeat(0.5 * np.pi * np.arange(4) + 0.25 * np.pi, QUARTER_SIDES + 1)
    flat, up = np.cos(heights)[:, None], np.sin(heights)[:, None]
    ones = np.ones((len(heights), len(turns)))
    ways = np.stack([flat * np.cos(turns), flat * np.sin(turns), up * ones], axis=-1)
    signs = np.stack(
        [np.sign(np.cos(middles)) * ones, np.sign(np.sin(middles)) * ones, above[:, None] * ones],
        axis=-1,
    )
    return ways, signs > 0.0


@declared
class PosedHand(Declared):
    """A hand in a pose in which its fingertips touch an object, or came near."""

    hand: Hand
    joints: Annotated[Array, ArrayShape(None)]
    """Joint angles in the order of `hand.joints`, (j,) [rad]."""
    palm_pose: Annotated[Array, ArrayShape(POSE_SIZE, POSE_SIZE)]
    """Pose of the palm in the object's frame, (4, 4)."""
    fingers: tuple[int, ...]
    contacts: tuple[Contact, ...]
    stands: bool = True
    """Whether the fingertips touch, at the contacts."""

    def _check_together(self) -> None:
        joints, known, used = len(self.hand.joints), len(self.hand.fingers), set(self.fingers)
        alike = len(used) == len(self.fingers) == len(self.contacts)
        if len(self.joints) != joints or not alike or not used <= set(range(known)):
            raise InputError(
                f"the pose must be one of the hand {self.hand.name}: {joints} angles, and for each "
                f"of {len(self.contacts)} contacts another finger, numbered from 0 to {known - 1}; "
                f"got {len(self.joints)} angles and fingers {list(self.fingers)}"
            )

    @property
    def tips(self) -> Array:
        """Return the middles of the fingertips' balls at the contacts, (contacts, 3) [m]."""
        hand = self.hand
        if self.stands:
            hand = with_balls(hand, self.joints, self.palm_pose, self.fingers, self.contacts)
        return places(hand, self.joints, self.palm_pose).tips[0, list(self.fingers)]

    @property
    def finger_names(self) -> tuple[str, ...]:
        """Return the name of the hand's finger at each contact."""
        return tuple(self.hand.fingers[finger].name for finger in self.fingers)

    @property
    def tip_radii(self) -> Array:
        """Return the radii of these fingertips, (contacts,) [m]."""
        return np.array([self.hand.fingers[finger].tip.radius for finger in self.fingers])

    @property
    def positions(self) -> Array:
        """Return the places of the contacts, (contacts, 3) [m]."""
        return np.array([contact.position for contact in self.contacts]).reshape(-1, 3)


def posed_hand(hand: Hand | None, reach: HandReach | None, grasp: Grasp) -> PosedHand | None:
    """Take a hand in its pose, or the nearest one, from what `reach_with` found.

    None if nothing is given.
    """
    if hand is None and reach is None:
        return None
    if hand is None or reach is None:
        missing = "hand" if hand is None else "reach"
        raise InputError(
            f"hand and reach must be given together, got no {missing}: "
            "reach = gc.reach_with(hand, body, grasp, friction)"
        )
    instance(hand, Hand, "hand", "load_hand makes one")
    instance(reach, HandReach, "reach", "reach_with finds one")
    if (reach.hand, reach.grasp) != (hand.name, grasp.id):
        raise InputError(
            f"reach must be about the hand {hand.name} and the grasp {grasp.id}, got "
            f"{reach.hand} and {reach.grasp}"
        )
    if (near := reach.nearest) is not None:
        touched = tuple(grasp.contacts[int(k)] for k in near.used)
        fingers = tuple(near.fingers.tolist())
        return PosedHand(hand, near.joints, near.palm_pose, fingers, touched, stands=False)
    joints, pose, used, contacts = reach.joints, reach.palm_pose, reach.fingers, reach.contacts
    if joints is None or pose is None or used is None or contacts is None:
        raise InputError(f"reach must hold a pose to draw, got none: {reach.explanation}")
    return PosedHand(hand, joints, pose, tuple(used.tolist()), contacts)


@dataclass(frozen=True, slots=True, eq=False)
class HandParts:
    """The rounded boxes of which a hand is made, in the object's frame."""

    middles: Array
    """Middles of the boxes, (n, 3) [m]."""
    axes: Array
    """Columns are the boxes' axes, (n, 3, 3)."""
    half_sizes: Array
    """Half the boxes' lengths along these axes, (n, 3) [m]."""
    radii: Array
    """Distances from the boxes to the surfaces, (n,) [m]."""
    contacts: tuple[int | None, ...]
    """The contact at which a part touches, for the parts that are fingertips."""
    blocks: tuple[Array | None, ...]
    """Corners of the parts that are blocks, which the boxes cover, (m, 3) [m]."""


def parts_of(held: PosedHand) -> HandParts:
    """Place the parts of a hand; a tip is its block, its ball, or the capsule that ends in it."""
    arrays = hand_arrays(held.hand)
    at = places(held.hand, held.joints, held.palm_pose)
    R = np.concatenate([at.link_rotations[0], held.palm_pose[None, :3, :3]])  # the palm's is -1
    p = np.concatenate([at.link_positions[0], held.palm_pose[None, :3, 3]])
    tips: list[int] = arrays.shape_tips.tolist()
    own = arrays.tip_shapes.tolist()
    kept = [n for n, tip in enumerate(tips) if n not in own or tips.count(tip) == 1]
    links: list[int] = arrays.shape_links[kept].tolist()
    contact_of = {finger: contact for contact, finger in enumerate(held.fingers)}
    blocks = list[Array | None]()
    for n, link in zip(kept, links, strict=True):
        corners = held.hand.fingers[tips[n]].tip.corners if n in own else None
        blocks.append(None if corners is None else p[link] + corners @ R[link].T)
    return HandParts(
        p[links] + np.einsum("nij,nj->ni", R[links], arrays.shape_positions[kept]),
        R[links] @ arrays.shape_rotations[kept],
        arrays.shape_sizes[kept],
        arrays.shape_radii[kept],
        tuple(contact_of.get(tips[n]) for n in kept),
        tuple(blocks),
    )


def hand_shapes(held: PosedHand) -> tuple[Drawable, ...]:
    """Return the shapes of a hand in the object's frame, fingertips in the colours of contacts."""
    parts, shapes = parts_of(held), list[Drawable]()
    least = LEAST_RADII * max(finger.tip.radius for finger in held.hand.fingers)
    for contact, polygons in solids_of(parts, least):
        role: Role = "hand" if contact is None else "fingertip"
        shapes.append(Drawable(role, contact, polygons=polygons))
    return tuple(shapes)


def solids_of(parts: HandParts, least: float) -> Iterator[tuple[int | None, tuple[Array, ...]]]:
    """Yield the sides of each convex solid of a hand, with the contact of its part.

    Pieces of long parts are at least as long as `least` [m].
    """
    for n, contact in enumerate(parts.contacts):
        if (corners := parts.blocks[n]) is not None:
            yield contact, _hull(corners)
            continue
        for sides in _pieces(parts.half_sizes[n], float(parts.radii[n]), least):
            yield contact, tuple(parts.middles[n] + side @ parts.axes[n].T for side in sides)


def _pieces(half: Array, radius: float, least: float) -> Iterator[tuple[Array, ...]]:
    """Yield the sides of a rounded box, cut into pieces about as long as the box is thick."""
    lengths = 2.0 * (half + radius)
    piece = max(LONG * float(lengths.min()), least)
    counts = np.clip(np.rint(lengths / piece), 1, MOST_PART_PIECES).astype(int)
    counts[half == 0.0] = 1
    steps = 2.0 * half / counts
    for place in product(*map(range, counts.tolist())):
        at = np.array(place)
        outer = np.array([at == 0, at == counts - 1])
        spare = PIECE_OVERLAP * steps * ~outer
        yield rounded_box(
            -half + steps * at - spare[0], -half + steps * (at + 1) + spare[1], radius, outer
        )


def _hull(corners: Array) -> tuple[Array, ...]:
    """Return the triangles around points, corners counter-clockwise as seen from outside."""
    spatial: Any = importlib.import_module("scipy.spatial")
    found = spatial.ConvexHull(corners)
    sides: Array = corners[found.simplices]
    across = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    inward = np.einsum("ij,ij->i", across, found.equations[:, :3]) < 0.0
    sides[inward] = sides[inward, ::-1]
    return tuple(sides)


def numbers_behind(held: PosedHand) -> Array:
    """Return where the numbers of the fingers are written, behind the tips, (contacts, 3) [m]."""
    ways = held.tips - held.positions
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), LEAST_RAY_M)
    return held.tips + (NUMBER_RADII - 1.0) * held.tip_radii[:, None] * ways


def extent_with(body: Polyhedron, parts: HandParts) -> Alone:
    """Measure a ball around an object and a hand."""
    reaches = np.linalg.norm(parts.half_sizes, axis=1) + parts.radii
    middles = np.vstack([parts.middles, body.vertices])
    sizes = np.concatenate([reaches, np.zeros(len(body.vertices))])
    low, high = (middles.T - sizes).min(axis=1), (middles.T + sizes).max(axis=1)
    center = 0.5 * (low + high)
    return Alone(center, float((np.linalg.norm(middles - center, axis=1) + sizes).max()))


def view_of_hand(body: Polyhedron, held: PosedHand) -> Camera:
    """Choose a view in which contacts, object and hand are seen."""
    return view_of_parts(body, parts_of(held), held.positions, numbers_behind(held))


def view_of_parts(body: Polyhedron, parts: HandParts, contacts: Array, others: Array) -> Camera:
    """Choose a view of an object in a hand that shows contacts (c, 3) [m], apart from others."""
    extent = extent_with(body, parts)
    angles, axes = views_at(HAND_ELEVATIONS)
    cameras = extent.center_of_mass + VIEW_RADII * extent.radius * axes[:, 2]
    centroids, normals, _ = panes_of(body)
    arms = cameras[:, None] - centroids
    facing = np.einsum("vfi,fi->vf", arms, normals) < 0.0  # normals point into the object
    behind = _hidden(centroids, cameras, parts) & facing
    covered = behind.sum(axis=1) / np.maximum(facing.sum(axis=1), 1)
    hidden = _hidden(contacts, cameras, parts).mean(axis=1)
    apart = least_gaps(axes, np.vstack([contacts, others]), extent)
    merits = apart / body.radius - HIDDEN * hidden - FAULT_BEHIND * covered
    way = body.center_of_mass - parts.middles.mean(axis=0)
    along = np.abs(axes[:, 2] @ way) / max(float(np.linalg.norm(way)), LEAST_RAY_M)
    merits -= FAULT_EDGE_ON * edge_on(body, axes) + FAULT_ALONG * along
    return Camera.of_angles(*angles[first_best(merits, SAME_VIEW_MERIT)], extent)


def _hidden(points: Array, cameras: Array, parts: HandParts) -> Array:
    """Tell which points (p, 3) the parts of a hand hide from cameras (v, 3), (v, p).

    A ray is inside a box where it is between the two planes of each pair: from the last entry to
    the first exit. For a rounded box the box in it is taken, which a contact on it is outside of.
    """
    sizes = HIDING_SHARE * (parts.half_sizes + parts.radii[:, None] / np.sqrt(3.0))
    hides = np.zeros((len(cameras), len(points)), dtype=bool)
    for middle, turned, half in zip(parts.middles, parts.axes, sizes, strict=True):
        starts = (points - middle) @ turned
        ways = (cameras - middle) @ turned
        ways = ways[:, None] - starts
        ways = np.where(np.abs(ways) < LEAST_RAY_M, LEAST_RAY_M, ways)
        one, two = (-half - starts) / ways, (half - starts) / ways
        enters, leaves = np.minimum(one, two).max(axis=2), np.maximum(one, two).min(axis=2)
        hides |= leaves > np.maximum(enters, 0.0)
    return hides
