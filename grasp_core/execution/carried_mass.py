"""The largest mass that is held in every orientation, by contacts or by a hand, from both sides.

A hand turns with its object. Under gravity along a unit vector d, in the object's frame, a mass m
at the centre of mass is held if some contact forces f in their cones, with normal parts up to
f_max, meet

    G f + (g m d, 0) = 0   and   |L f + W d|_j <= c_j,                                  (1)

with L and c of `motors`, and W the torques that carry the links, (joints, 3). Forces are chosen
anew for each d. Let C be the set of pairs (p, v) with G f + (g p, 0) = 0 and |L f + W v|_j <= c_j
for such f. It is convex, as cones and bounds are and all else is linear in (f, p, v), and it
contains zero, with f = 0. The mass m is held under d if (m d, d) is in C, and hence

    S(m) = { v : (m v, v) in C }   is convex, with zero in it,                          (2)
    m is held in every orientation if S(m) contains the unit ball.                      (3)

*A mass that is held.* Points v of S(m), each with its forces, whose hull contains the unit ball
prove (3). Triangles between them show the ball, as simplices do in `ferrari_canny`: no hull is
computed again to check this.

*A mass that is not.* For any twist y and multipliers u of the joints,

    y.(G f) = (G'y - L'u).f + u.(L f + W v) - u.(W v),

and (3) of `wrench_limits` bounds the sum of the first two by h(y, u). With G f = -m g v for forces:

    (W'u - g m y_F).d  <=  h(y, u)    wherever m is held under d,                       (4)

where y_F is the force part of y, and h takes no gravity. All directions are held only if

    |W'u - g m y_F|  <=  h(y, u),                                                       (5)

which fails, if y_F is not zero, above the larger root of a quadratic in m. It has one: |W'u| <=
sum_j |u_j| |W_j| is less than h where each motor can carry its links, |W_j| < c_j.

*How hard fingers can push.* A push that motors do not allow counts nowhere, so that f_max may be
taken as small as they make it. For a sum p.f of pushes, any multipliers q of the joints, and |v| up
to one,

    p.f = (p - L'q).f + q.(L f)  <=  f_max sum_i max(0, s_i(p - L'q)) + sum_j |q_j| (c_j + |W_j|).
                                                                                        (6)

This is asked of each push, and of the sum of all, each with the q whose L'q is nearest to p: zero
is left of p where motors feel such pushes. The largest push is rounded up, to less than twice as
much, so that last digits do not decide. All slacks are then relative to forces that there can be.

*Rounding of (5).* A product of sums with n terms is off by less than n rounding units of the sum of
its terms' sizes. h is raised by more than these, `LOST_DIGITS` times such a sum.

*What forces prove.* Forces that meet (1) exactly are next to them; see `allowed_forces`.

*The search.* A ray along a direction d at a mass m finds the largest t with t (m d, d) in C. Its
end t d is a point of S(m), and its dual y and u bound the mass by (5).

The end of a ray is one of S(m') for smaller masses m', too, once it is mixed with (0, s d), which
f = 0 holds up to s = min_j c_j / |W_j.d|. With a share a of the forces, t (m d, d) a + (0, s d)
(1 - a) has the mass m' over its length if

    a = m' / (m' + t (m - m') / s),   and its length is   a t m / m'.                   (7)

The bound falls from ray to ray. The mass that would close the gap is tried: the next ray goes
through the nearest facet of the hull of points of S, and either the hull grows there or the bound
falls. Rays are cast at falling masses, so that (7) is for smaller ones.

Programs know forces to a share of the largest push. Where fingers may push much harder than is of
use, and motors do not limit them, little of the mass may be proved. Then forces are sought among
smaller ones, which are allowed as well.

*Contacts alone.* What forces that are chosen anew for each orientation hold is what a hand holds
whose links have no weight. What one squeeze holds, which is chosen beforehand and never replanned,
is the scale of a `BestSqueeze` for the weight of one kilogram in any direction. With the same
limits on pushes and torques this fixed mass is at most the free one where fingertips do not roll,
as the forces at rest plus their change balance the load at the contacts. Rolling moves the contacts
by tip radius times turn. The hand turns with its object, and so the weight of its links turns:
`Motors.in_any_orientation` has limits that leave room for it.
"""

import importlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike

from grasp_core.allowed_values import SMALLEST, Quantity, number, value_of
from grasp_core.arrays import (
    SHIFT,
    Amount,
    Array,
    Frictions,
    Indices,
    Shape,
    Triangles,
    UnitVectors,
    cross,
    of_order_one,
)
from grasp_core.by_value import summary
from grasp_core.closure.contacts import WRENCH, contact_frames, in_frames
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.declared import Declared, declared, trusted
from grasp_core.errors import InputError
from grasp_core.execution.best_squeeze import searched
from grasp_core.execution.grips import STIFFNESS_N_PER_M, TIP_RADIUS_M, Bounded, Grip, unsqueezed
from grasp_core.execution.loads import GRAVITY_M_PER_S2, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import InnerPolytope
from grasp_core.quality.motors import Motors, motors_for
from grasp_core.quality.wrench_limits import WrenchBody
from grasp_core.solvers.ties import first_best, on_grid
from grasp_core.values import Contact, Grasp

FIRST_RAYS = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
"""Directions of the first rays, whose hull contains the origin."""
BOUND_SLACK = 1e-9
"""Slack of the unit ball and of the upper bound, relative to them: a thousand times what sums and
square roots lose of either."""
LOST_DIGITS = 64.0 * float(np.finfo(np.float64).eps)
"""Rounding of heights of corners, and of products in (5) and (6): sums in them have six components
of a wrench, three of each contact or one of each joint, a few tens in all."""
MASS_GAP = 1e-3
"""Gap between the bounds, relative to the lower one, at which no more rays follow."""
FINEST_MASS_GAP = 1e-4
"""Smallest gap that may be asked for: more rays than are cast would be needed below it."""
MOST_RAYS = 500
"""Most rays, ten times as many as are usual: twenty to forty bring the bounds to 1e-3 of each
other, and to 1e-4, with motors and without."""
NO_WEIGHT, TINY_PUSH = 1e-6, 1e-9
"""Weight that is none, over the largest of the forces that hold it, and over the largest push:
programs' forces are balanced to a tenth of the former, and known to a tenth of the latter."""
WEAKER, TIMES = 1e-3, 3
"""Share of the largest push with which forces are sought again that leave a gap, and how often: a
thousand times smaller ones are known a thousand times better, and after three times the largest
push that is taken, 1e9 N, is one newton."""


def nearest_facet(points: Array) -> tuple[Array, float, Indices]:
    """Find the hull's facet nearest to zero: normal, distance; and all triangles, (t, 3)."""
    spatial: Any = importlib.import_module("scipy.spatial")
    hull = spatial.ConvexHull(points)
    equations: Array = hull.equations
    # equally near facets are taken in the order of their normals, the same on every machine
    equations = equations[np.lexsort(on_grid(equations[:, :3]).T)]
    nearest = equations[first_best(equations[:, 3])]
    return nearest[:3], -float(nearest[3]), np.asarray(hull.simplices, dtype=np.int64)


def ball_in(points: Array, triangles: Indices) -> float:
    """Return the radius of the ball that triangles show to be in the hull of points, or -inf."""
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= len(points):
        return -np.inf
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normals = cross(b - a, c - a)
    normals *= np.where((normals * a).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    shown = trusted(InnerPolytope, forces=points, corners=triangles, normals=normals)
    return shown.radius_between(points) - LOST_DIGITS * float(np.linalg.norm(points, axis=1).max())


@declared
class HandPayload(Declared):
    """The largest mass that a hand holds in every orientation, proved from both sides.

    The hand stands still, its motors carry its links too, and forces are chosen anew for each
    orientation. Contacts alone are held as by a hand whose links have no weight. Everything is
    along the object's axes and about its centre of mass.
    """

    lower: Amount
    """Mass that is held in every orientation [kg]; zero where none is shown to be, without corners
    of a hull then."""
    upper: Annotated[float, Interval(le=math.inf)]
    """Mass above which some orientation is not held [kg]."""
    gravities: Annotated[Array, Shape("n", 3)]
    """Corners of a hull that contains the unit ball, (n, 3): gravity in units of its own size.
    Under each of them the lower mass and the links are held."""
    forces: Annotated[Array, Shape("n", None, 3)]
    """Contact forces on the object that hold them there, (n, k, 3) [N]."""
    triangles: Triangles
    """Triangles of that hull, by the indices of their corners, (t, 3)."""
    facet: Annotated[Array, Shape(WRENCH)]
    """Twist y that proves the upper bound by (5) of `carried_mass`, (6,)."""
    motor_multipliers: Annotated[Array, Shape(None)]
    """Multipliers u of the joints in it, (joints,)."""
    hand: "CarryingHand"
    """The contacts, and the motors and links behind them."""

    @property
    def weakest(self) -> Array:
        """Direction of gravity, of unit length, in which the hand lets go first, (3,)."""
        a, b = self.hand.sides(self.facet, self.motor_multipliers)
        way = self.upper * a + b
        return way / (float(np.linalg.norm(way)) or 1.0)

    def __repr__(self) -> str:
        return summary("HandPayload", lower_kg=self.lower, upper_kg=self.upper)

    def verify(self) -> bool:
        """Re-check every field in plain arithmetic; False if they are no certificate.

        The upper bound is exact but for rounding, 1e-9 of it. Forces hold the lower mass in exact
        cones and limits, but for rounding.

        Whether the contacts are those of an object can only be checked with it, and whether joints
        and links are those of a hand only with the hand.

        Returns:
            Whether both bounds are proved.
        """
        with np.errstate(all="ignore"):
            if not self.is_sound():
                return False
            hand = replace(self.hand)  # without what it has kept
            most = hand.most(self.facet, self.motor_multipliers)
            if not most <= self.upper * (1.0 + BOUND_SLACK):
                return False
            if self.lower == 0.0:  # claims nothing, by nothing
                return not (len(self.gravities) or len(self.triangles))
            covered = ball_in(self.gravities, self.triangles) >= 1.0 - BOUND_SLACK  # (3)
            return covered and hand.holds(self.lower, self.gravities, self.forces)

    def _is_consistent(self) -> bool:
        return (
            self.lower <= self.upper < math.inf
            and self.forces.shape[1] == len(self.hand.friction)
            and len(self.motor_multipliers) == len(self.hand.motors.limits)
        )


@declared(slots=False)
class CarryingHand(Declared):
    """Contacts, motors and links of a hand, in the object's axes, about its centre of mass."""

    arms: Bounded  # contact points from the centre of mass, (k, 3) [m]
    normals: UnitVectors  # into the object, (k, 3)
    friction: Frictions  # Coulomb coefficients, (k,)
    max_push_n: Quantity  # largest normal force of a fingertip [N]
    motors: Motors  # the joints behind the contacts, without gravity
    weights: Annotated[Array, Shape(None, 3)]
    """Torque W of each joint that carries the weight of the links, per unit vector of the direction
    of gravity, (joints, 3) [N m]."""

    @cached_property
    def push_n(self) -> float:
        """The largest normal force of a fingertip that counts [N], by (6)."""
        k = len(self.friction)
        levers = in_frames(self.motors.levers, contact_frames(self.normals))
        sums = np.zeros((k + 1, 3 * k))
        sums[np.arange(k), 3 * np.arange(k)] = 1.0
        sums[k, ::3] = 1.0
        multipliers = np.linalg.lstsq(levers.T, sums.T, rcond=None)[0].T
        left, sizes = sums - multipliers @ levers, sums + np.abs(multipliers) @ np.abs(levers)
        cones = WrenchSet(np.zeros((WRENCH, 3 * k)), self.friction, "linf")
        felt = np.array([cones.reach(row)[0] for row in left])
        felt += LOST_DIGITS * (1.0 + float(self.friction.max())) * sizes.sum(axis=1)
        strengths = self.motors.limits + np.linalg.norm(self.weights, axis=1)
        allowed = self.max_push_n * felt + np.abs(multipliers) @ strengths
        most = float(np.minimum(allowed[:k], allowed[k]).max())
        # the next power of two, shifted as grids are, so that round numbers are far from its steps
        return min(self.max_push_n, 2.0 ** (math.ceil(math.log2(most) - SHIFT) + SHIFT))

    @cached_property
    def body(self) -> WrenchBody:
        """The wrenches that the contacts resist where links have no weight."""
        return WrenchBody(self.arms, self.normals, self.friction, self.push_n, self.motors)

    def _is_consistent(self) -> bool:
        k = len(self.friction)
        return (
            k > 0
            and self.motors.are_for(k)
            and not self.motors.gravity.any()
            and len(self.weights) == len(self.motors.limits)
            # then (5) has a root, and links without a mass are held in every orientation
            and bool((np.linalg.norm(self.weights, axis=1) < self.motors.limits).all())
        )

    def sides(self, facet: Array, multipliers: Array) -> tuple[Array, Array]:
        """Return the vectors a and b of (5), |m a + b| <= h."""
        return -GRAVITY_M_PER_S2 * facet[:3], self.weights.T @ multipliers

    def most(self, facet: Array, multipliers: Array, rounding: float = 1.0) -> float:
        """Return the mass above which (5) fails [kg]; infinite if there is none."""
        # facets of any length mean the same
        facet, multipliers = of_order_one(facet, multipliers)
        a, b = self.sides(facet, multipliers)
        h = self.body.support(facet, multipliers) + rounding * self.body.lost(facet, multipliers)
        size = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)), abs(h))
        if size == 0.0:
            return np.inf
        a, b, h = a / size, b / size, h / size
        turn = float(np.linalg.norm(b))
        square, along, left = float(a @ a), float(a @ b), max((h - turn) * (h + turn), 0.0)
        root = float(np.sqrt(along * along + square * left))
        if square == 0.0:
            return np.inf
        # the form without a difference of near numbers
        return left / (along + root) if along > 0.0 else (root - along) / square

    def holds(self, mass: float, gravities: Array, forces: Array) -> bool:
        """Return whether forces (n, k, 3) hold a mass and the links under gravities (n, 3)."""
        body, each = self.body, zip(gravities, forces, strict=True)
        return all(
            body.allowed.balance(body.in_frames(f, None), body.load(*self.load(mass, gravity)))
            for gravity, f in each
        )

    def load(self, mass: float, gravity: Array) -> tuple[Array, Array]:
        """Return the weight of a mass, (6,), and the torques of the links, (joints,) [N m]."""
        weight = np.append(GRAVITY_M_PER_S2 * mass * gravity, np.zeros(3))
        return weight, self.weights @ gravity


@dataclass(frozen=True, slots=True, eq=False)
class Ray:
    """The farthest gravity along a direction under which a mass and the links are held."""

    mass: float  # the mass m [kg]
    direction: Array  # unit vector d of the direction, (3,)
    reach: float  # largest t with t (m d, d) in C
    forces: Array  # contact forces that hold it, (k, 3) [N]
    facet: Array  # twist y in (5), (6,)
    multipliers: Array  # multipliers u in it, (joints,)
    most: float  # largest mass that it allows [kg]
    push_n: float  # largest push of a finger [N]

    @property
    def nothing(self) -> float:
        """Mass that is none beside the forces [kg]."""
        largest = float(np.linalg.norm(self.forces, axis=1).max())
        return max(NO_WEIGHT * largest, TINY_PUSH * self.push_n) / GRAVITY_M_PER_S2


def carried_mass(hand: CarryingHand, gap: float = MASS_GAP) -> HandPayload:
    """Bound the mass that a hand holds in every orientation, by rays until the bounds meet."""
    number(gap, "gap", ge=FINEST_MASS_GAP, lt=1.0)
    found, weakest = _searched(hand, gap)
    push, none = hand.push_n, _nothing_held(hand, weakest)
    for _ in range(TIMES):
        if found.upper <= max((1.0 + 2.0 * gap) * found.lower, TINY_PUSH * push / GRAVITY_M_PER_S2):
            break
        push = max(WEAKER * push, SMALLEST)
        lower, _ = _searched(replace(hand, max_push_n=push), gap)
        if lower.lower > found.lower:
            found = replace(lower, upper=max(none.upper, lower.lower), facet=none.facet,
                            motor_multipliers=none.motor_multipliers, hand=hand)  # fmt: skip
    return found if hand.holds(found.lower, found.gravities, found.forces) else none


def _searched(hand: CarryingHand, gap: float) -> tuple[HandPayload, Ray]:
    """Bound the mass by rays, with forces as programs know them; and the ray of the upper bound."""
    # no forces are larger than all fingers' together
    mass = hand.push_n * float((1.0 + hand.friction).sum()) / GRAVITY_M_PER_S2
    rays = [_ray(hand, mass, way) for way in FIRST_RAYS]
    weakest = _weakest(rays)
    # one step of Newton's is enough: the bound is then within 1e-5 of where further steps lead
    if weakest.nothing < weakest.most < mass:
        rays = [_ray(hand, weakest.most, way) for way in FIRST_RAYS]
        weakest = _weakest([weakest, *rays])
    mass, lowered = rays[0].mass, gap
    while True:
        mass = min(mass, weakest.most / (1.0 + gap))
        # where a direction is hardly resisted, so is one of these or the one that its facet faces
        if any(min(mass, ray.mass * ray.reach) <= ray.nothing for ray in rays):
            return _nothing_held(hand, weakest), weakest
        ends, shares = _ends(hand, rays, mass)
        normal, distance, triangles = nearest_facet(ends)
        if distance >= 1.0 and ball_in(ends, triangles) >= 1.0 - BOUND_SLACK:
            forces = shares[:, None, None] * np.array([ray.forces for ray in rays])
            return _held(hand, mass, weakest, ends, forces, triangles), weakest
        if len(rays) < MOST_RAYS:
            rays.append(_ray(hand, mass, normal / np.linalg.norm(normal)))
            weakest = _weakest([weakest, rays[-1]])
        else:
            # the hull grows as the mass falls; steps are doubled, so that a few tens end it
            mass, lowered = mass / (1.0 + lowered), 2.0 * lowered


def _ray(hand: CarryingHand, mass: float, way: Array) -> Ray:
    """Find how far a mass and the links are held along a direction, a unit vector (3,)."""
    load = hand.load(mass, way)
    found = hand.body.largest(*load)
    most = hand.most(found.facet, found.multipliers, rounding=2.0)
    local, multiple = hand.body.settled(found, *load)
    forces, _ = hand.body.in_space(local)
    return Ray(mass, way, multiple, forces, found.facet, found.multipliers, most, hand.push_n)


def _weakest(rays: list[Ray]) -> Ray:
    return rays[first_best([-ray.most for ray in rays])]


def _ends(hand: CarryingHand, rays: list[Ray], mass: float) -> tuple[Array, Array]:
    """Mix ends of rays to points of S(m'), (n, 3), by (7), with the shares a of forces, (n,)."""
    ways = np.array([ray.direction for ray in rays])
    reach, masses = np.array([(ray.reach, ray.mass) for ray in rays]).T
    # 1 / s, the largest share of a motor's torque that the links ask for
    asked = (np.abs(ways @ hand.weights.T) / hand.motors.limits).max(axis=1, initial=0.0)
    shares = mass / (mass + reach * (masses - mass) * asked)
    return (shares * reach * masses / mass)[:, None] * ways, shares


def _held(
    hand: CarryingHand, mass: float, weakest: Ray, ends: Array, forces: Array, triangles: Indices
) -> HandPayload:
    used, corners = np.unique(triangles, return_inverse=True)
    return HandPayload(
        mass, max(weakest.most, mass), ends[used], forces[used], corners.reshape(-1, 3),
        weakest.facet, weakest.multipliers, hand,
    )  # fmt: skip


def _nothing_held(hand: CarryingHand, weakest: Ray) -> HandPayload:
    none = np.zeros((0, 3), dtype=np.int64)
    forces = np.zeros((0, len(hand.friction), 3))
    return _held(hand, 0.0, weakest, np.zeros((0, 3)), forces, none)


@declared
class Payload(Declared):
    """The largest mass held in every orientation, with forces chosen beforehand and chosen anew."""

    fixed: BestSqueeze
    """The squeeze that holds the largest mass, `fixed.scale` [kg], without replanning."""
    free: HandPayload
    """The largest mass that any forces with such pushes hold."""

    @property
    def mass_kg(self) -> float:
        """The largest mass that is held without replanning [kg]."""
        return self.fixed.scale

    @property
    def bound_kg(self) -> float:
        """The mass above which no forces with such pushes hold some orientation [kg]."""
        return self.free.upper

    def __repr__(self) -> str:
        return summary("Payload", mass_kg=self.mass_kg, bound_kg=self.bound_kg)

    def verify(self) -> bool:
        """Re-check every field in plain arithmetic; False if they are no certificate.

        The free mass is about the contacts, the largest push and the motors of `fixed` (see
        `HandPayload.verify`). Whether the contacts are those of an object can only be checked with
        it.
        """
        with np.errstate(all="ignore"):
            if not (self.is_sound() and self.fixed.verify() and _is_weight(self.fixed)):
                return False
            motors = motors_for(self.fixed.motors, len(self.fixed.grip.friction))
            hand = _unweighted(self.fixed.grip, self.fixed.max_push_n, motors)
            return self.free.hand == hand and self.free.verify()


def payload(
    body: Polyhedron,
    contacts: Grasp | Iterable[Contact],
    friction: ArrayLike,
    *,
    max_push_n: float,
    stiffness: ArrayLike = STIFFNESS_N_PER_M,
    tip_radius_m: ArrayLike = TIP_RADIUS_M,
    motors: Motors | None = None,
) -> Payload:
    """Find the largest mass that contacts hold in every orientation.

    Args:
        body: The object, of which only the centre of mass counts.
        contacts: A grasp, or contacts, at least two.
        friction: Coulomb coefficient, one for all contacts or one each.
        max_push_n: Largest normal force of a finger, at rest and under the weight [N].
        stiffness: Stiffness of the fingertips' springs [N/m]: one number, one each, or a symmetric
            matrix each, (k, 3, 3).
        tip_radius_m: Radius of the fingertips [m], one for all or one each.
        motors: Joints that the contact forces load, with the torques of their motors, without
            gravity (see `Motors.in_any_orientation`); None for fingers that are as strong as
            `max_push_n` says.

    Raises:
        InputError: Shapes or ranges are wrong, the contacts have no stiffness in some motion, or
            the motors carry links in one orientation only.
        NoForcesError: The grip is unstable under the best squeeze.
        SolverError: A program's answer failed its check.
    """
    start = unsqueezed(body, contacts, friction, stiffness=stiffness, tip_radius_m=tip_radius_m)
    most = value_of(Quantity, max_push_n, "max_push_n")
    joints = motors_for(motors, len(start.friction))
    loaded = np.flatnonzero(joints.gravity)
    if loaded.size:
        raise InputError(
            f"motors must have no gravity for a payload, but joint {int(loaded[0])} carries links: "
            "the hand turns with its object, and so does the weight of its links; give "
            "gc.Motors.in_any_orientation(levers, limits, weights), which leaves room for it"
        )
    fixed = searched(start, any_direction(1.0), most, motors)
    return Payload(fixed, carried_mass(_unweighted(start, most, joints)))


def _unweighted(grip: Grip, max_push_n: float, motors: Motors) -> CarryingHand:
    """Return what holds the contacts of a grip, by links without weight."""
    weights = np.zeros((len(motors.limits), 3))
    return CarryingHand(grip.arms, grip.normals, grip.friction, max_push_n, motors, weights)


def _is_weight(fixed: BestSqueeze) -> bool:
    """Return whether the loads of a squeeze are the weight of one kilogram in any direction."""
    E = fixed.loads.axes
    ball = np.zeros((WRENCH, WRENCH))
    ball[:3, :3] = GRAVITY_M_PER_S2**2 * np.eye(3)
    near = bool((np.abs(E @ E.T - ball) <= BOUND_SLACK * GRAVITY_M_PER_S2**2).all())
    return near and not fixed.loads.offset.any()
