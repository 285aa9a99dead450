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
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices, frozen_copy
from grasp_core.execution.ball_in_hull import ball_in, nearest_facet, outward
from grasp_core.execution.carrying_hand import ROUNDING, CarryingHand, HandPayload
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.solvers.ties import first_best

GAP = 1e-3
"""Gap between the bounds, relative to the lower one, at which no more rays follow."""
RAYS = 500
"""Most rays; twenty to forty are usual, and more than a hundred where motors hardly matter."""
PASSES = 3
"""Times that the first rays are cast, each at the mass that bounds those before."""
NOTHING = 1e-6
"""Mass that is none, in pushes over gravity: the accuracy of conic programs is a tenth."""
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


def carried_mass(hand: CarryingHand, gap: float = GAP) -> HandPayload:
    """Bound the mass that a hand holds in every orientation, by rays until the bounds meet.

    Args:
        hand: Contacts, and motors that can carry their links.
        gap: Wanted (upper - lower) / lower. It is larger where `RAYS` do not suffice.

    Raises:
        SolverError: A program's answer failed its check.
    """
    none = NOTHING * hand.max_push_n / GRAVITY_M_PER_S2
    rays, weakest = _first_rays(hand, none)
    mass = rays[0].mass
    while True:
        mass = min(mass, weakest.most / (1.0 + gap))
        # where a direction is hardly resisted, so is one of these or the one that its facet faces
        if mass <= none or min(ray.mass * ray.reach for ray in rays) <= none:
            return _nothing_held(hand, weakest)
        ends, shares = _ends(hand, rays, mass)
        normal, distance, triangles = nearest_facet(ends)
        if distance >= 1.0:
            triangles = outward(ends, triangles)
            if ball_in(ends, triangles) >= 1.0 - ROUNDING:
                forces = shares[:, None, None] * np.array([ray.forces for ray in rays])
                return _held(hand, mass, weakest, ends, forces, triangles)
        if len(rays) < RAYS:
            rays.append(_ray(hand, mass, normal / np.linalg.norm(normal)))
            weakest = _weakest([weakest, rays[-1]])
        else:
            mass /= 1.0 + gap


def _first_rays(hand: CarryingHand, none: float) -> tuple[list[Ray], Ray]:
    """Cast the first rays at a mass that is a little too large, by Newton's steps from above.

    Returns:
        The rays of the last step, and of all steps the one with the least bound.
    """
    # no forces are larger than all fingers' together
    mass = hand.max_push_n * float((1.0 + hand.friction).sum()) / GRAVITY_M_PER_S2
    rays = [_ray(hand, mass, way) for way in FIRST]
    weakest = _weakest(rays)
    for _ in range(PASSES - 1):
        if not none < weakest.most < mass:
            break
        mass = weakest.most
        rays = [_ray(hand, mass, way) for way in FIRST]
        weakest = _weakest([weakest, *rays])
    return rays, weakest


def _ray(hand: CarryingHand, mass: float, way: Array) -> Ray:
    """Find how far a mass and the links are held along a direction, a unit vector (3,)."""
    weight = np.append(GRAVITY_M_PER_S2 * mass * way, np.zeros(3))
    reach, local, twist, multipliers = hand.body.largest(weight, hand.weights @ way)
    facet = hand.body.about_center(twist / hand.body.scale)
    return Ray(
        mass, way, max(reach, 0.0), hand.body.in_object_frame(local), facet, multipliers,
        hand.most(facet, multipliers),
    )  # fmt: skip


def _weakest(rays: list[Ray]) -> Ray:
    """Return the ray with the least bound, the first of several that are equal."""
    return rays[first_best([-ray.most for ray in rays])]


def _ends(hand: CarryingHand, rays: list[Ray], mass: float) -> tuple[Array, Array]:
    """Mix the ends of rays with links alone to points of S(m') for a mass m' up to the rays'.

    Returns:
        The points by (1), (n, 3), and the shares a of the rays' forces that hold them, (n,).
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
