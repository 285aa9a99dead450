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
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array, Indices, cross
from grasp_core.by_value import ByValue
from grasp_core.checked import LARGEST, SMALLEST
from grasp_core.closure.wrenches import WRENCH
from grasp_core.execution.ball_in_hull import ball_in
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.fields import are_frictions, are_units, is_a, is_array, is_indices, is_number
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_body import HELD, WrenchBody
from grasp_core.short_text import summary

ROUNDING = 1e-9
"""Slack of the unit ball and of bounds, relative to them or to the largest push."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HandPayload(ByValue):
    """The largest mass that a hand holds in every orientation, proved from both sides.

    The hand stands still, its motors carry its links too, and forces are chosen anew for each
    orientation. Everything is along the object's axes and about its centre of mass.
    """

    lower: float
    """Mass that is held in every orientation [kg]."""
    upper: float
    """Mass above which some orientation is not held [kg]."""
    gravities: Array
    """Corners of a hull that contains the unit ball, (n, 3): gravity in units of its own size.
    Under each of them the lower mass and the links are held; none where the lower bound is zero."""
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
        a, b, _ = self.hand.bound(self.facet, self.motor_multipliers)
        way = self.upper * a + b
        return way / (float(np.linalg.norm(way)) or 1.0)

    def __repr__(self) -> str:
        return summary("HandPayload", lower_kg=self.lower, upper_kg=self.upper)

    def verify(self) -> bool:
        """Re-check every field in plain arithmetic; False if they are no certificate.

        Whether the contacts are those of an object can only be checked with it, and whether joints
        and links are those of a hand only with the hand.
        """
        with np.errstate(all="ignore"):
            if not (is_a(self.hand, CarryingHand) and self.hand.sound() and self._has_numbers()):
                return False
            hand = replace(self.hand)  # without what it has kept
            none = ROUNDING * hand.max_push_n / GRAVITY_M_PER_S2
            most = hand.most(self.facet, self.motor_multipliers)
            return most <= self.upper * (1.0 + ROUNDING) + none and self._holds(hand)

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
        if self.lower == 0.0:
            return True
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
    def body(self) -> WrenchBody:
        """The wrenches that the contacts resist where links have no weight."""
        return WrenchBody(self.arms, self.normals, self.friction, self.max_push_n, self.motors)

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

    def bound(self, facet: Array, multipliers: Array) -> tuple[Array, Array, float]:
        """Return the vectors a and b and the number h of (5), |m a + b| <= h."""
        h = self.body.support(facet, multipliers)
        return -GRAVITY_M_PER_S2 * facet[:3], self.weights.T @ multipliers, h

    def most(self, facet: Array, multipliers: Array) -> float:
        """Return the mass above which (5) fails [kg]; infinite if there is none."""
        a, b, h = self.bound(facet, multipliers)
        # facets of any length mean the same; squares of very short ones would vanish
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
        body = self.body
        local = np.einsum("kij,nki->nkj", body.frames, forces) / body.max_normal_force
        shares = local.reshape(len(forces), -1)
        weights = GRAVITY_M_PER_S2 * mass * gravities / body.max_normal_force
        loads = np.hstack([weights, -cross(body.middle, weights)]) / body.scale
        slack = HELD * body.bounded.size
        # (1), to the accuracy that forces of wrench limits have
        balanced = np.linalg.norm(shares @ body.G.T + loads, axis=1) <= slack
        torques = forces.reshape(len(forces), -1) @ body.motors.levers.T
        torques += gravities @ self.weights.T
        strong = np.abs(torques) <= body.motors.limits * (1.0 + HELD * body.strongest)
        return bool(balanced.all() and strong.all()) and body.bounded.holds(shares, slack)
