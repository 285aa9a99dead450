"""Searches for the largest mass that a hand holds in every orientation, its links included.

The letters are those of `carrying_hand`. A ray along a direction d at a mass m finds the largest t
with t (m d, d) in C. Its end t d is a point of S(m), and its dual y and u bound the mass by (5).

The end of a ray is one of S(m') for smaller masses m', too, once it is mixed with (0, s d), which
f = 0 holds up to s = min_j c_j / |W_j.d|. With a share a of the forces, t (m d, d) a + (0, s d)
(1 - a) has the mass m' over its length if

    a = m' / (m' + t (m - m') / s),   and its length is   a t m / m'.                   (1)

The bound falls from ray to ray. The mass that would close the gap is tried: the next ray goes
through the nearest facet of the hull of points of S, and either the hull grows there or the bound
falls. Rays are cast at falling masses, so that (1) is for smaller ones.

Programs know forces to a share of the largest push. Where fingers may push much harder than is of
use, and motors do not limit them, forces that hold the mass may not pass the check of a
certificate. Then they are sought among smaller ones, which are allowed as well.
"""

from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, Indices, frozen_copy
from grasp_core.checked import SMALLEST, number
from grasp_core.execution.ball_in_hull import ball_in, nearest_facet, outward
from grasp_core.execution.carrying_hand import ROUNDING, CarryingHand, HandPayload
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.solvers.ties import first_best

GAP = 1e-3
"""Gap between the bounds, relative to the lower one, at which no more rays follow."""
FINEST_GAP = 1e-4
"""Smallest gap that may be asked for: what forces may lack of the weight where they are large."""
RAYS = 500
"""Most rays, ten times as many as are usual: twenty to forty bring the bounds to 1e-3 of each
other, and to 1e-4, with motors and without."""
NOTHING, HARDLY = 1e-6, 1e-9
"""Weight that is none, over the largest of the forces that hold it, and over the largest push:
programs' forces are balanced to a tenth of the former, and known to a tenth of the latter."""
WEAKER, TIMES = 1e-3, 3
"""Share of the largest push with which forces are sought again that are not balanced well enough,
and how often: a thousand times smaller ones are known a thousand times better, and after three
times the largest push that is taken, 1e9 N, is one newton."""
FIRST = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
"""Directions of the first rays, whose hull contains the origin."""


@dataclass(frozen=True, slots=True, eq=False)
class Ray:
    """The farthest gravity along a direction under which a mass and the links are held."""

    mass: float
    """The mass m [kg]."""
    direction: Array
    """Unit vector d of the direction, (3,)."""
    reach: float
    """Largest t with t (m d, d) in C."""
    forces: Array
    """Contact forces that hold it, (k, 3) [N]."""
    facet: Array
    """Twist y in (5) of `carrying_hand`, (6,)."""
    multipliers: Array
    """Multipliers u in it, (joints,)."""
    most: float
    """Largest mass that it allows [kg]."""
    push_n: float
    """Largest push of a finger [N]."""

    @property
    def nothing(self) -> float:
        """Mass that is none beside the forces [kg]."""
        largest = float(np.linalg.norm(self.forces, axis=1).max())
        return max(NOTHING * largest, HARDLY * self.push_n) / GRAVITY_M_PER_S2


def carried_mass(hand: CarryingHand, gap: float = GAP) -> HandPayload:
    """Bound the mass that a hand holds in every orientation, by rays until the bounds meet.

    Gives both bounds with their proofs; a lower bound of zero where no mass is shown to be held.
    """
    number(gap, "gap", least=FINEST_GAP, below=1.0)
    first, weakest = _searched(hand, gap)
    found, push = first, hand.push_n
    for _ in range(TIMES):
        if found.lower == 0.0 or hand.holds(found.lower, found.gravities, found.forces):
            return found
        push = max(WEAKER * push, SMALLEST)
        lower, _ = _searched(replace(hand, max_push_n=push), gap)
        found = replace(lower, upper=max(first.upper, lower.lower), facet=first.facet,
                        motor_multipliers=first.motor_multipliers, hand=hand)  # fmt: skip
    known = found.lower > 0.0 and hand.holds(found.lower, found.gravities, found.forces)
    return found if known else _nothing_held(hand, weakest)


def _searched(hand: CarryingHand, gap: float) -> tuple[HandPayload, Ray]:
    """Bound the mass by rays; forces are as accurate as programs are.

    Gives a certificate whose forces may not be balanced well enough, and the ray with its upper
    bound.
    """
    rays, weakest = _first_rays(hand)
    mass, lowered = rays[0].mass, gap
    while True:
        mass = min(mass, weakest.most / (1.0 + gap))
        # where a direction is hardly resisted, so is one of these or the one that its facet faces
        if any(min(mass, ray.mass * ray.reach) <= ray.nothing for ray in rays):
            return _nothing_held(hand, weakest), weakest
        ends, shares = _ends(hand, rays, mass)
        normal, distance, triangles = nearest_facet(ends)
        if distance >= 1.0:
            triangles = outward(ends, triangles)
            if ball_in(ends, triangles) >= 1.0 - ROUNDING:
                forces = shares[:, None, None] * np.array([ray.forces for ray in rays])
                return _held(hand, mass, weakest, ends, forces, triangles), weakest
        if len(rays) < RAYS:
            rays.append(_ray(hand, mass, normal / np.linalg.norm(normal)))
            weakest = _weakest([weakest, rays[-1]])
        else:
            # the hull grows as the mass falls; steps are doubled, so that a few tens end it
            mass, lowered = mass / (1.0 + lowered), 2.0 * lowered


def _first_rays(hand: CarryingHand) -> tuple[list[Ray], Ray]:
    """Cast the first rays at a mass that is a little too large, by a step of Newton's from above.

    Gives the rays at that mass, and of all rays the one with the least bound.
    """
    # no forces are larger than all fingers' together
    mass = hand.push_n * float((1.0 + hand.friction).sum()) / GRAVITY_M_PER_S2
    rays = [_ray(hand, mass, way) for way in FIRST]
    weakest = _weakest(rays)
    # once is enough: the bound is then within 1e-5 of where further steps lead
    if weakest.nothing < weakest.most < mass:
        rays = [_ray(hand, weakest.most, way) for way in FIRST]
        weakest = _weakest([weakest, *rays])
    return rays, weakest


def _ray(hand: CarryingHand, mass: float, way: Array) -> Ray:
    """Find how far a mass and the links are held along a direction, a unit vector (3,)."""
    weight = np.append(GRAVITY_M_PER_S2 * mass * way, np.zeros(3))
    found = hand.body.largest(weight, hand.weights @ way)
    facet = hand.body.about_center(found.twist / hand.body.scale)
    return Ray(
        mass, way, max(found.multiple, 0.0), hand.body.in_object_frame(found.local), facet,
        found.multipliers, hand.most(facet, found.multipliers, rounding=2.0), hand.push_n,
    )  # fmt: skip


def _weakest(rays: list[Ray]) -> Ray:
    """Return the ray with the least bound, the first of several that are equal."""
    return rays[first_best([-ray.most for ray in rays])]


def _ends(hand: CarryingHand, rays: list[Ray], mass: float) -> tuple[Array, Array]:
    """Mix the ends of rays with links alone to points of S(m') for a mass m' up to the rays'.

    Gives the points by (1), (n, 3), and the shares a of the rays' forces that hold them, (n,).
    """
    ways = np.array([ray.direction for ray in rays])
    reach, masses = np.array([(ray.reach, ray.mass) for ray in rays]).T
    # 1 / s, the largest share of a motor's torque that the links ask for
    asked = (np.abs(ways @ hand.weights.T) / hand.motors.limits).max(axis=1, initial=0.0)
    shares = mass / (mass + reach * (masses - mass) * asked)
    return (shares * reach * masses / mass)[:, None] * ways, shares


def _held(
    hand: CarryingHand, mass: float, weakest: Ray, ends: Array, forces: Array, triangles: Indices
) -> HandPayload:
    """Make the certificate of a mass, without the points that are no corners of the hull."""
    used, corners = np.unique(triangles, return_inverse=True)
    numbered = corners.reshape(-1, 3).astype(np.int64)
    numbered.setflags(write=False)
    return HandPayload(
        mass, max(weakest.most, mass), frozen_copy(ends[used]), frozen_copy(forces[used]),
        numbered, frozen_copy(weakest.facet), frozen_copy(weakest.multipliers), hand,
    )  # fmt: skip


def _nothing_held(hand: CarryingHand, weakest: Ray) -> HandPayload:
    """Make the certificate of no mass, which needs no forces."""
    none = np.zeros((0, 3), dtype=np.int64)
    forces = np.zeros((0, len(hand.friction), 3))
    return _held(hand, 0.0, weakest, np.zeros((0, 3)), forces, none)
