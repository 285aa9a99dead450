"""Looks for a pose in which a hand's fingertips touch an object in a grasp, and nothing overlaps.

A hand with four fingers or more stands at all contacts. One with three stands at three of them, and
only at three that are proved to be in force closure without the fourth. That proof is about the
planned contacts; where fingertips come to rest in their regions, closure is proved again.

From each start, a hand is moved until its fingertips touch, anywhere in their regions or at the
contacts themselves, and balls that stand for its parts are clear of the object. Then fingertips are
laid on the surface itself, and exact distances decide.

Starts are postures of the hand, laid over the contacts. Postures are random joint angles at which
the hand is free of itself. For each posture and each order of fingers, the fingertips are compared
with where they would have to be: first by the distances between them and the angles between their
ways inwards, which do not depend on the palm's pose, then by the rest that is left when one set of
points is laid over the other by the best rigid motion (Kabsch). The motion keeps handedness, so an
order of fingers around the palm that runs the wrong way leaves a large rest.

The pregrasp keeps the palm where it is and moves fingertips away from the surface, along the
normals as far as the joints allow. The way in is a straight line of the palm with the fingers open.
Both are checked by exact distances; the line at steps of `WAY_TICK`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import combinations, permutations, product
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, cross, to_digits
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.force_closure import force_closure
from grasp_core.compiled import compiled
from grasp_core.errors import SolverError, UndecidedError
from grasp_core.frames import plane_tangents
from grasp_core.hands.collisions import surface_tree
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_arrays import (
    Gaps,
    HandArrays,
    HandPose,
    SurfaceTree,
    Targets,
    direction,
    hand_arrays,
)
from grasp_core.hands.settings import ReachSettings
from grasp_core.objects.on_faces import SolidSurface
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import largest_first
from grasp_core.values import FINGERS, Grasp

POSE_KERNEL = "grasp_core.hands.pose_kernel"
NARROWEST = 1e-4
"""Least inscribed radius of a region that is aimed at; in smaller ones the contact is [m]."""
SOUGHT_SOFTNESS = 2e-3
"""How far corners of a block below the farthest count while a pose is sought [m]."""
SHORT_EDGE = 1e-9  # length below which an edge of a region is left out [m]
TIP_TOUCHING = 1e-5
"""Largest gap or overlap of a fingertip that counts as touching [m]: a tenth of the overlap that
simulators and makers of hands allow."""
MOST_SEARCH_STEPS = 60
GOOD_MM, ROUGH_MM, FINE_MM = 0.05, 1.0, 1e-6
"""Distances from touching at which the search for a pose ends, from which fingertips are laid on
the surface, and at which they lie on a flat one [mm]."""
MOST_TOUCHES, TOUCH_STEPS = 12, 8
"""Largest number of planes that a fingertip tries on a curved surface, and of steps to each."""
SETTLED_M, RESTING_MM = 1e-9, 1e-9
"""Change of a distance below which a fingertip rests on a surface [m], and distance from touching
at which it does [mm]."""
LAID_SOFTNESS = 1e-4
"""How far corners of a block below the farthest still count when fingertips are laid down [m]."""
SEARCH_ROOM = 0.0015
"""Distance beyond the one asked for that the search keeps from the object [m]."""
PULL = 0.03
EDGE_MARGIN, LEAST_EDGE_MARGIN = 5e-4, 1e-4
"""Distances from the edges of regions that are sought, and kept when fingertips are laid down [m].
"""
POSTURES = 400  # number of postures to choose from
RANDOM_POSTURES = 60_000  # number of random joint angles among which they are looked for
INNER = (0.1, 0.85)
"""Part of the joints' ranges in which they are looked for: rather open than closed."""
POSTURE_CLEARANCE = 0.002  # least distance between links in a posture [m]
WIDEST_TIPS = 0.075  # largest distance of a fingertip from the middle of all [m]
KEPT_POSTURES = 300  # number of postures with an order of fingers that are laid over the contacts
EQUAL_LENGTH = 0.02  # difference of two distances between fingertips that counts as one [m]
TURN = 0.3  # weight of the angles between ways inwards
ARM = 0.03  # length of the ways inwards where they are laid over each other [m]
TIE_DIGITS = 9
"""Digits after the point to which rests, and cosines, are compared: ties are decided by the order.
"""
NEVER_BEHIND = -10.0
"""Distance that no part of a hand is short of, where parts need not stay behind a plane [m]."""
FEW_STARTS = 16  # number of starts with which it is seen what stops a hand
WIDER = math.radians(45.0)
"""How far joints may turn beyond their ranges where limits are left out [rad]."""
Obstacle: TypeAlias = Literal["self", "table", "palm", "links", "limit"]
"""What may stop a hand: links that overlap each other, the table, the palm or other links that
overlap the object, or the limits of joints."""


@dataclass(frozen=True, eq=False)
class AskedPose:
    """What a pose is sought for."""

    hand: Hand
    body: Polyhedron
    grasp: Grasp
    friction: float
    settings: ReachSettings
    left_out: frozenset[Obstacle] = frozenset()
    """Obstacles that are taken to be none, to see what stops the hand."""
    size: float = 1.0
    """Size of the copy of the object and its grasp that is taken, as a multiple of their own."""

    @cached_property
    def table(self) -> tuple[Array, float]:
        """Return the table's unit normal, (3,), and its height along it [m]: -inf for none."""
        down = self.settings.table_down
        if down is None or "table" in self.left_out:
            return np.array([0.0, 0.0, 1.0]), -np.inf
        up = -direction(down, "table_down")
        return up, self.size * float((self.body.vertices @ up).min())

    @cached_property
    def arrays(self) -> HandArrays:
        """Return the hand in arrays, without what is left out."""
        arrays, out = hand_arrays(self.hand), self.left_out
        if "self" in out:
            arrays = arrays._replace(pairs=arrays.pairs[:0])
        if "limit" in out:
            free = arrays.drivers == np.arange(len(arrays.axes))
            wider = np.where(free, WIDER, np.inf)[:, None] * [-1.0, 1.0]
            arrays = arrays._replace(ranges=arrays.ranges + wider)
        if not out & {"palm", "links"}:
            return arrays
        kept = np.where(arrays.ball_links < 0, "palm" not in out, "links" not in out)
        return arrays._replace(
            ball_links=arrays.ball_links[kept], ball_centers=arrays.ball_centers[kept],
            ball_radii=arrays.ball_radii[kept],
        )  # fmt: skip

    @cached_property
    def tree(self) -> SurfaceTree:
        """Return the object's surface."""
        tree = surface_tree(self.body)
        return tree if self.size == 1.0 else tree._replace(
            corners=self.size * tree.corners, middles=self.size * tree.middles,
            radii=self.size * tree.radii,
        )  # fmt: skip

    @cached_property
    def solid(self) -> SolidSurface:
        """Return the object's surface with its normals; blocks may also touch an edge or corner."""
        return SolidSurface(self.size * self.body.vertices, self.body.triangles)

    def pose(self, contacts: int, palm: Array, origin: Array, joints: Array) -> HandPose:
        """Return a pose whose parts are still to be placed."""
        pose: HandPose = compiled(POSE_KERNEL).empty_pose(self.arrays, contacts)
        pose.palm[:], pose.origin[:], pose.q[:] = palm, origin, joints
        return pose


def contact_choices(
    grasp: Grasp, friction: float, fingers: int
) -> tuple[list[tuple[int, ...]], tuple[ClosureCertificate, ...], int]:
    """Choose all contacts, or as many as fingers that alone are closed, the largest margin first.

    Also gives a refutation for each choice that is open, and how many choices are undecided. Equal
    margins, by `solvers.ties`, stay in the order of their indices.
    """
    if fingers >= FINGERS:
        return [tuple(range(FINGERS))], (), 0
    closed = list[tuple[int, ...]]()
    margins, refuted, undecided = list[float](), list[ClosureCertificate](), 0
    for chosen in combinations(range(FINGERS), fingers):
        kept = list(chosen)
        proof = proved_closure(grasp.positions[kept], grasp.normals[kept], friction)
        if proof is None:
            undecided += 1
        elif proof.closed:
            closed.append(chosen)
            margins.append(proof.margin)
        else:
            refuted.append(proof)
    order = largest_first(margins) if margins else []
    return [closed[n] for n in order], tuple(refuted), undecided


def proved_closure(points: Array, normals: Array, friction: float) -> ClosureCertificate | None:
    """Prove that contacts are in force closure, or that they are not; None if neither succeeds."""
    try:
        return force_closure(points, normals, friction)
    except (UndecidedError, SolverError):
        return None


def targets(asked: AskedPose, used: Indices, *, regions: bool) -> Targets:
    """Say where fingertips are to touch, finger k at the k-th of the contacts that are used."""
    normals, own = asked.grasp.normals[used], [asked.grasp.regions[int(k)] for k in used]
    aimed = [regions and each.kind != "point" and each.inscribed_radius > NARROWEST for each in own]
    edges = [
        _edges(asked.size * region.polygon, normal) if aim else np.empty((2, 0, 3))
        for aim, region, normal in zip(aimed, own, normals, strict=True)
    ]
    numbers, (points, inward) = np.arange(len(used)), np.concatenate(edges, axis=1)
    return Targets(
        numbers, to_digits(asked.size * asked.grasp.positions[used]), normals,
        np.array([plane_tangents(*normal) for normal in normals.tolist()]),
        np.where(aimed, 0.0, 1.0), np.full((len(used), 3), np.nan), SOUGHT_SOFTNESS,
        np.repeat(numbers, [each.shape[1] for each in edges]), points, inward,
        *asked.table,
    )  # fmt: skip


def _edges(polygon: Array, normal: Array) -> Array:
    """Return points of the edges and unit vectors from them into the convex polygon, (2, e, 3)."""
    polygon = to_digits(polygon)
    along = np.roll(polygon, -1, axis=0) - polygon
    kept = np.linalg.norm(along, axis=1) > SHORT_EDGE
    starts, inward = polygon[kept], cross(normal, along[kept])
    sides = np.einsum("ej,ej->e", inward, polygon.mean(axis=0) - starts)
    inward *= np.copysign(1.0 / np.linalg.norm(inward, axis=1), sides)[:, None]
    return np.array([starts, inward])


@lru_cache(maxsize=16)
def postures(hand: Hand, seed: int) -> tuple[Array, Array]:
    """Choose at most `POSTURES` at random: joint angles, (n, j), and tips' middles, (n, f, 3)."""
    arrays, rng = hand_arrays(hand), np.random.default_rng(seed)
    low, high = arrays.ranges.T
    share = rng.uniform(*INNER, (RANDOM_POSTURES, len(low)))
    angles = hand.drives.obeyed(low + (high - low) * share)
    kept, tips = np.empty(POSTURES, np.int64), np.empty((POSTURES + 1, len(arrays.tip_radii), 3))
    kernel = compiled("grasp_core.hands.collisions_kernel")
    count = kernel.free_postures(arrays, angles, POSTURE_CLEARANCE, WIDEST_TIPS, kept, tips)
    return angles[kept[:count]], tips[:count]


def starts(asked: AskedPose, points: Array, normals: Array) -> Iterator[tuple[Indices, HandPose]]:
    """Choose where to start from, best first: the finger for each contact, (k,), and a pose."""
    (joints, ends), arrays = postures(asked.hand, asked.settings.seed), asked.arrays
    if not len(joints):
        return
    orders = np.array(list(permutations(range(len(arrays.tip_radii)), len(normals))))
    inward = ends.mean(axis=1, keepdims=True) - ends
    inward /= np.maximum(np.linalg.norm(inward, axis=2, keepdims=True), 1e-9)
    i, j = np.triu_indices(len(normals), 1)
    # all tips of a hand are taken to be as thick as the first
    middles = points - arrays.tip_radii[0] * normals
    apart = np.linalg.norm(middles[i] - middles[j], axis=1)
    angles = np.einsum("pi,pi->p", normals[i], normals[j])
    between = np.linalg.norm(ends[:, :, None] - ends[:, None], axis=3)
    ways = np.einsum("nai,nbi->nab", inward, inward)
    one, other = orders[:, i], orders[:, j]
    off = ((between[:, one, other] - apart) ** 2).sum(axis=2) / EQUAL_LENGTH**2
    off += TURN * ((ways[:, one, other] - angles) ** 2).sum(axis=2)
    likely = np.argsort(off.round(TIE_DIGITS), axis=None, kind="stable")[:KEPT_POSTURES]
    which, order = np.unravel_index(likely, off.shape)
    tips = ends[which[:, None], orders[order]]
    held = tips.mean(axis=1)
    ours = np.concatenate([tips - held[:, None], ARM * inward[which[:, None], orders[order]]], 1)
    center = middles.mean(axis=0)
    theirs = np.concatenate([middles - center, ARM * normals])
    U, _, Vt = np.linalg.svd(np.einsum("nki,kj->nij", ours, theirs))
    Vt[:, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[:, None]
    turns = np.einsum("nji,nkj->nik", Vt, U)  # lay ours best over theirs
    rests = ((np.einsum("nij,nkj->nki", turns, ours) - theirs) ** 2).sum(axis=(1, 2))
    best = np.argsort((rests / ARM**2).round(TIE_DIGITS), kind="stable")[: asked.settings.starts]
    places = center - np.einsum("nij,nj->ni", turns, held)
    for n in best:
        turned, place = _steady(turns[n]), to_digits(places[n], EQUAL_LENGTH)
        yield (
            orders[order[n]].astype(np.int64),
            asked.pose(len(normals), turned, place, joints[which[n]]),
        )


def _steady(turn: Array) -> Array:
    """Return a rotation near one, (3, 3), without the last digits, which differ by processor.

    From some starts the search is so sensitive that they would decide where it ends.
    """
    x, aside = to_digits(turn.T[:2], 1.0)
    x = x / math.hypot(*x)
    z = cross(x, aside)
    z = z / math.hypot(*z)
    return np.array([x, cross(z, x), z]).T


@dataclass(frozen=True, slots=True, eq=False)
class FoundPose:
    """A pose in which a hand holds an object."""

    used: Indices  # indices of the grasp's contacts at which fingers stand, (k,)
    aims: Targets  # where they touch, with the finger at each
    pose: HandPose
    certificate: ClosureCertificate  # with the contacts that are reached
    within: tuple[bool, ...]  # whether each contact is in its region, or as planned
    starts: int = 1  # number of starts that were tried


@dataclass(frozen=True, slots=True, eq=False)
class MissedPose:
    """Where the search from one start ended without a pose that holds the object."""

    used: Indices  # indices of the grasp's contacts at which fingers were to stand, (k,)
    aims: Targets  # where they were to touch, or do, with the finger at each
    pose: HandPose
    is_open: bool = False  # whether fingertips touch and nothing overlaps, but no force closure


def find_pose(
    asked: AskedPose, choices: Sequence[tuple[int, ...]]
) -> FoundPose | tuple[MissedPose, ...]:
    """Look for a pose from one start after the other; without one, return where all ended."""
    missed = list[MissedPose]()
    for chosen in choices:
        used = np.array(chosen, np.int64)
        aims = targets(asked, used, regions=asked.settings.regions)
        for fingers, pose in starts(asked, aims.origins, aims.normals):
            ended = _tried(asked, used, aims._replace(fingers=fingers), pose)
            if isinstance(ended, FoundPose):
                return replace(ended, starts=len(missed) + 1)
            missed.append(ended)
    return tuple(missed)


def pose_if(
    asked: AskedPose, choices: Sequence[tuple[int, ...]], near: Sequence[MissedPose], **changed: Any
) -> FoundPose | None:
    """Look for a pose with something about the question changed: from poses, and few starts."""
    few = replace(asked.settings, starts=min(FEW_STARTS, asked.settings.starts))
    other = replace(asked, settings=few, **changed)
    for ended in near:
        aims = targets(other, ended.used, regions=few.regions)._replace(fingers=ended.aims.fingers)
        pose = other.pose(len(ended.used), ended.pose.palm, ended.pose.origin, ended.pose.q)
        found = _tried(other, ended.used, aims, pose)
        if isinstance(found, FoundPose):
            return found
    found = find_pose(other, choices)
    return found if isinstance(found, FoundPose) else None


def _tried(
    asked: AskedPose, used: Indices, aims: Targets, pose: HandPose
) -> FoundPose | MissedPose:
    """Move the hand from one start, in place, until it stands in the grasp or does not."""
    kernel = compiled(POSE_KERNEL)
    sums, clear = kernel.empty_sums(asked.arrays, aims), asked.settings.clearance_m
    room = clear + SEARCH_ROOM
    behind = NEVER_BEHIND if "links" in asked.left_out else clear
    far = Gaps(room, behind, room, EDGE_MARGIN, PULL, True, True)
    kernel.settle(asked.arrays, asked.tree, aims, far, pose, sums, MOST_SEARCH_STEPS, GOOD_MM)
    near = far._replace(overlaps=False, margin=LEAST_EDGE_MARGIN, pull=0.0)
    rest = None if sums.parts[0] > ROUGH_MM else _laid(asked, aims, near, pose)
    if rest is None:
        return MissedPose(used, aims, pose)
    laid, points = rest
    on_faces = (asked.solid.holds(*each, 2.0 * TIP_TOUCHING)
                for each in zip(points, laid.normals, strict=True))  # fmt: skip
    if blocking(asked, pose, aims.fingers) or not all(on_faces):
        return MissedPose(used, laid, pose)
    certificate = proved_closure(points, laid.normals, asked.friction)
    if certificate is None or not certificate.closed:
        return MissedPose(used, laid, pose, is_open=True)
    within = _are_within(aims, certificate.positions, EDGE_MARGIN)
    return FoundPose(used, laid, pose, certificate, within)


def _laid(
    asked: AskedPose, aims: Targets, near: Gaps, pose: HandPose
) -> tuple[Targets, Array] | None:
    """Move a hand that is near until its fingertips rest on the surface: planes and contacts.

    Which point of a block touches is only known then, so that its region is asked for again.
    """
    arrays, kernel = asked.arrays, compiled(POSE_KERNEL)
    laid = aims._replace(
        origins=np.array(aims.origins), normals=np.array(aims.normals),
        touching=np.array(aims.touching), soft=LAID_SOFTNESS,
    )  # fmt: skip
    sums, balls = kernel.empty_sums(arrays, aims), len(arrays.tip_corners) == len(arrays.tip_radii)
    points, off, before, inside = np.empty((len(laid.fingers), 3)), np.inf, np.inf, True
    for _ in range(MOST_TOUCHES):
        kernel.settle(arrays, asked.tree, laid, near, pose, sums, TOUCH_STEPS, FINE_MM)
        before, off = off, kernel.lay(arrays, asked.tree, laid, pose, points)
        inside = balls or all(_are_within(aims, points, TIP_TOUCHING))
        if inside and (off <= RESTING_MM or abs(before - off) <= SETTLED_M):
            break
    return (laid, points) if inside and off <= TIP_TOUCHING else None


def _are_within(aims: Targets, points: Array, slack: float) -> tuple[bool, ...]:
    """Return which contacts are in the regions that fingers aimed at, or at pinned points."""
    within = list[bool]()
    for k, point in enumerate(points):
        own = aims.edge_contacts == k
        inside = np.einsum("ej,ej->e", point - aims.edge_points[own], aims.edge_inward[own])
        pinned = aims.pinned[k] > 0.0
        off = np.linalg.norm(point - aims.origins[k]) if pinned else -inside.min(initial=np.inf)
        within.append(bool(off <= slack))
    return tuple(within)


def blocking(asked: AskedPose, pose: HandPose, fingers: Indices | None = None) -> bool:
    """Return whether a placed hand overlaps something."""
    return any(obstacles(asked, pose, asked.settings.clearance_m, fingers))


def obstacles(
    asked: AskedPose, pose: HandPose, clearance: float, fingers: Indices | None = None,
    tips: float = -TIP_TOUCHING,
) -> Iterator[Obstacle]:  # fmt: skip
    """Yield what a placed hand is nearer to than a clearance.

    The last links of touching fingers must only not overlap the object, and their tips keep a
    distance of their own from it, or overlap it by as much.
    """
    arrays, kernel = asked.arrays, compiled("grasp_core.hands.collisions_kernel")
    needs = np.full(len(arrays.shape_links), clearance)
    if fingers is not None:
        needs[np.isin(arrays.shape_links, arrays.starts[fingers + 1] - 1)] = 0.0
        needs[np.isin(arrays.shape_tips, fingers)] = tips
    shapes, (up, height) = (arrays, pose.turned, pose.middles), asked.table
    if kernel.of_itself(*shapes, clearance) < clearance:
        yield "self"
    if height > -np.inf and kernel.of_table(*shapes, up, height) < clearance:
        yield "table"
    of_palm = arrays.shape_links < 0
    own: dict[Obstacle, NDArray[np.bool_]] = {"palm": of_palm, "links": ~of_palm}
    for name in asked.left_out & own.keys():
        needs[own[name] & (needs >= 0.0)] = -np.inf  # fingertips still must not overlap
    if kernel.of_object(*shapes, asked.tree, needs) < 0.0:
        for name, part in own.items():
            if kernel.of_object(*shapes, asked.tree, np.where(part, needs, -np.inf)) < 0.0:
                yield name


GAPS_M = (0.015, 0.01, 0.006, 0.003)
"""Distances of fingertips from the surface that are tried, the largest first [m]."""
LEAST_OPEN_SHARE = 0.5  # part of such a distance that every fingertip must have
OPENING_STEPS = 30
WAY_TICK, LINE = 0.004, 0.06
"""Distance of the poses that are checked on the way in, and its length [m]."""
WAY_TILT = 0.4
"""Slope at which some ways in lean from the line from the palm to the contacts' middle."""
LEAST_ALONG = 0.2
"""Least cosine of the angle between a way in and the line from the palm to the contacts' middle."""


def opened(asked: AskedPose, found: FoundPose) -> tuple[Array | None, Array | None]:
    """Return joint angles with open fingers, and the palm's unit way in; None if not found."""
    planned = targets(asked, found.used, regions=False)._replace(fingers=found.aims.fingers)
    joints = _open_joints(asked, found, planned)
    if joints is None:
        return None, None
    ahead = found.pose._replace(q=joints)
    ways = (way for way in _ways(asked, found) if _is_free(asked, planned, ahead, way))
    return joints, next(ways, None)


def _open_joints(asked: AskedPose, found: FoundPose, planned: Targets) -> Array | None:
    arrays, kernel = asked.arrays, compiled(POSE_KERNEL)
    contacts, clear, held = found.certificate, asked.settings.clearance_m, found.pose
    wanted = Gaps(clear, clear, clear, 0.0, 0.0, overlaps=True, palm_moves=False)
    for gap in GAPS_M:
        aims = planned._replace(
            origins=contacts.positions - gap * contacts.normals, normals=np.array(contacts.normals),
            touching=found.aims.touching,
        )  # fmt: skip
        pose = asked.pose(len(found.used), held.palm, held.origin, held.q)
        sums = kernel.empty_sums(arrays, aims)
        kernel.settle(arrays, asked.tree, aims, wanted, pose, sums, OPENING_STEPS, 1e3 * 0.1 * gap)
        kernel.place(arrays, aims, pose)
        away = np.einsum("ki,ki->k", contacts.positions - pose.fronts, contacts.normals)
        open_by = away - arrays.tip_roundings[aims.fingers]
        if open_by.min() >= LEAST_OPEN_SHARE * gap and not blocking(asked, pose):
            return pose.q
    return None


def _ways(asked: AskedPose, found: FoundPose) -> Array:
    """Return unit vectors along which the palm may move in, the likeliest first, (n, 3)."""
    middle = found.certificate.positions.mean(axis=0)
    palm = np.array([shape.position for shape in asked.hand.palm] or [np.zeros(3)]).mean(axis=0)
    R = found.pose.palm
    ahead = middle - found.pose.origin - R @ palm
    ahead /= np.linalg.norm(ahead)
    steps = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    steps = steps[np.abs(steps).max(axis=1) > 0.0]
    others = (steps / np.linalg.norm(steps, axis=1, keepdims=True)) @ R.T
    along = others @ ahead
    order = np.argsort(-along.round(TIE_DIGITS), kind="stable")
    leaning = ahead + WAY_TILT * np.vstack([R.T, -R.T])
    leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
    return np.vstack([ahead, leaning, others[order[along[order] > LEAST_ALONG]]])


def _is_free(asked: AskedPose, planned: Targets, held: HandPose, way: Array) -> bool:
    for back in np.arange(WAY_TICK, LINE + 0.5 * WAY_TICK, WAY_TICK):
        pose = asked.pose(len(planned.fingers), held.palm, held.origin - back * way, held.q)
        compiled(POSE_KERNEL).place(asked.arrays, planned, pose)
        if blocking(asked, pose):
            return False
    return True
