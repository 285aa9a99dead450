"""The largest mass that a hand holds in every orientation with its links, proved from both sides.

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
prove (3); `ball_in_hull` shows that by triangles.

*A mass that is not.* For any twist y and multipliers u of the joints,

    y.(G f) = (G'y - L'u).f + u.(L f + W v) - u.(W v),

and (3) of `wrench_body` bounds the sum of the first two by h(y, u). With G f = -m g v for forces:

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
its terms' sizes. h is raised by more than these, `LOST` times such a sum.

*What forces prove.* They meet (1) to within `HELD` of the largest contact force, and in any case to
within `MOST_LEFT` of the weight and of the motors' limits.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from grasp_core.arrays import (
    SHIFT,
    Array,
    Indices,
    are_frictions,
    are_units,
    cross,
    is_a,
    is_array,
    is_indices,
    is_number,
    of_order_one,
)
from grasp_core.by_value import ByValue, summary
from grasp_core.checked import LARGEST, SMALLEST
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.closure.wrenches import WRENCH, contact_frames, in_frames
from grasp_core.execution.ball_in_hull import ball_in
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_body import WrenchBody
from grasp_core.quality.wrench_limit import HELD

ROUNDING = 1e-9
"""Slack of the unit ball and of the upper bound, relative to them: a thousand times what sums and
square roots lose of either."""
MOST_LEFT = 1e-4
"""What forces may lack of (1) at most, over the weight and the motors' limits: a tenth of the usual
gap between the bounds."""
LOST = 64.0 * float(np.finfo(np.float64).eps)
"""Rounding of products in (5) and (6): sums in them have six components of a wrench, three of each
contact or one of each joint, a few tens in all."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandPayload(ByValue):
    """The largest mass that a hand holds in every orientation, proved from both sides.

    The hand stands still, its motors carry its links too, and forces are chosen anew for each
    orientation. Everything is along the object's axes and about its centre of mass.
    """

    lower: float
    """Mass that is held in every orientation [kg]; zero where none is shown to be, without corners
    of a hull then."""
    upper: float
    """Mass above which some orientation is not held [kg]."""
    gravities: Array
    """Corners of a hull that contains the unit ball, (n, 3): gravity in units of its own size.
    Under each of them the lower mass and the links are held."""
    forces: Array
    """Contact forces on the object that hold them there, (n, k, 3) [N]."""
    triangles: Indices
    """Triangles of that hull, by the indices of their corners, (t, 3)."""
    facet: Array
    """Twist y in (5), (6,)."""
    motor_multipliers: Array
    """Multipliers u of the joints in (5), (joints,)."""
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

        The upper bound is exact but for rounding, 1e-9 of it. Forces hold the lower mass to within
        1e-7 of the largest of them, the accuracy of conic programs: balance, friction cones and
        torques are met to that, whatever the largest push, and to 1e-4 of the weight and of the
        motors' limits where forces are more than a thousand times the weight.

        Whether the contacts are those of an object can only be checked with it, and whether joints
        and links are those of a hand only with the hand.

        Returns:
            Whether both bounds are proved.
        """
        with np.errstate(all="ignore"):
            if not (is_a(self.hand, CarryingHand) and self.hand.sound() and self._has_numbers()):
                return False
            hand = replace(self.hand)  # without what it has kept
            most = hand.most(self.facet, self.motor_multipliers)
            return most <= self.upper * (1.0 + ROUNDING) and self._holds(hand)

    def _has_numbers(self) -> bool:
        n = len(self.gravities) if is_array(self.gravities, None, 3) else 0
        return (
            is_number(self.lower, least=0.0)
            and is_number(self.upper, least=self.lower)
            and is_array(self.gravities, n, 3)
            and is_array(self.forces, n, len(self.hand.friction), 3)
            and is_indices(self.triangles, None, 3)
            and is_array(self.facet, WRENCH)
            and is_array(self.motor_multipliers, len(self.hand.motors.limits))
        )

    def _holds(self, hand: "CarryingHand") -> bool:
        """Return whether the lower mass is held wherever gravity points, by (3)."""
        if self.lower == 0.0:  # claims nothing, by nothing
            return not (len(self.gravities) or len(self.triangles))
        covered = ball_in(self.gravities, self.triangles) >= 1.0 - ROUNDING
        return covered and hand.holds(self.lower, self.gravities, self.forces)


@dataclass(frozen=True, eq=False, repr=False)
class CarryingHand(ByValue):
    """Contacts on an object, with the motors of the hand behind them and the links they carry.

    Everything is along the object's axes and about its centre of mass.
    """

    arms: Array
    """Contact points from the centre of mass, (k, 3) [m]."""
    normals: Array
    """Unit normals into the object, (k, 3)."""
    friction: Array
    """Coulomb coefficients, (k,)."""
    max_push_n: float
    """Largest normal force of a fingertip [N]."""
    motors: Motors
    """The joints behind the contacts, without gravity."""
    weights: Array
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
        felt += LOST * (1.0 + float(self.friction.max())) * sizes.sum(axis=1)
        strengths = self.motors.limits + np.linalg.norm(self.weights, axis=1)
        allowed = self.max_push_n * felt + np.abs(multipliers) @ strengths
        most = float(np.minimum(allowed[:k], allowed[k]).max())
        # the next power of two, shifted as grids are, so that round numbers are far from its steps
        return min(self.max_push_n, 2.0 ** (math.ceil(math.log2(most) - SHIFT) + SHIFT))

    @cached_property
    def body(self) -> WrenchBody:
        """The wrenches that the contacts resist where links have no weight."""
        return WrenchBody(self.arms, self.normals, self.friction, self.push_n, self.motors)

    def sound(self) -> bool:
        """Return whether the fields are those of contacts, and of motors that carry their links."""
        k = len(self.friction) if is_array(self.friction, None) else 0
        return (
            k > 0
            and are_frictions(self.friction, k)
            and is_array(self.arms, k, 3)
            and float(np.abs(self.arms).max()) <= LARGEST
            and are_units(self.normals, k, 3)
            and is_number(self.max_push_n, least=SMALLEST, most=LARGEST)
            and is_a(self.motors, Motors)
            and self.motors.sound(k)
            and not self.motors.gravity.any()
            and is_array(self.weights, len(self.motors.limits), 3)
            # then (5) has a root, and links without a mass are held in every orientation
            and bool((np.linalg.norm(self.weights, axis=1) < self.motors.limits).all())
        )

    def sides(self, facet: Array, multipliers: Array) -> tuple[Array, Array]:
        """Return the vectors a and b of (5), |m a + b| <= h."""
        return -GRAVITY_M_PER_S2 * facet[:3], self.weights.T @ multipliers

    def most(self, facet: Array, multipliers: Array, rounding: float = 1.0) -> float:
        """Return the mass above which (5) fails [kg]; infinite if there is none.

        Takes `facet` (6,); `multipliers` (joints,).
        """
        # facets of any length mean the same
        facet, multipliers = of_order_one(facet, multipliers)
        a, b = self.sides(facet, multipliers)
        h = self.body.support(facet, multipliers) + rounding * self._lost(facet, multipliers)
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

    def _lost(self, facet: Array, multipliers: Array) -> float:
        """Return how much of h may be lost to rounding."""
        body, sizes = self.body, np.abs(multipliers)
        twist = np.abs(facet * body.scale)
        twist[:3] += np.linalg.norm(facet[3:]) * np.linalg.norm(body.middle)
        terms = float((twist @ np.abs(body.G) + sizes @ np.abs(body.levers)).sum())
        pushed = body.max_normal_force * (1.0 + float(self.friction.max())) * terms
        return LOST * (pushed + float(sizes @ self.motors.limits))

    def holds(self, mass: float, gravities: Array, forces: Array) -> bool:
        """Return whether forces (n, k, 3) hold a mass and the links under gravities (n, 3)."""
        body = self.body
        local = np.einsum("kij,nki->nkj", body.frames, forces) / body.max_normal_force
        weights = GRAVITY_M_PER_S2 * mass * gravities / body.max_normal_force
        loads = np.hstack([weights, -cross(body.middle, weights)]) / body.scale
        largest = np.linalg.norm(local, axis=2).max(axis=1)
        slack = np.minimum(
            HELD * body.bounded.size * largest, MOST_LEFT * np.linalg.norm(weights, axis=1)
        )
        torques = forces.reshape(len(forces), -1) @ body.motors.levers.T
        torques += gravities @ self.weights.T
        spare = np.minimum(HELD * np.maximum(1.0, np.outer(largest, body.strongest)), MOST_LEFT)
        return body.holds(local.reshape(len(local), -1), loads, slack) and body.is_strong_enough(
            torques, spare
        )
