"""The largest mass that contacts hold in every orientation, with forces fixed or chosen anew.

*Fixed.* The largest mass under the best squeeze, which is chosen beforehand and never replanned, is
the scale of a `BestSqueeze` for the weight of one kilogram in any direction.

*Free.* Forces that are chosen anew for each orientation hold the mass m if all weights m g d, |d| =
1, are in the set S of forces through the centre of mass that contacts with limited pushes resist.
S is convex, so the largest such mass is the distance from the origin to the border of S, in units
of weight. The ray in a direction d meets the border at a mass lambda with a facet y of the body of
wrenches (see `wrench_limits`), both proved:

    lambda d is in S,   and   m d' in S  implies  m <= h(y) / (-g y_F.d') for all d',     (1)

where y_F is the force part of y. So the free mass is at most h(y) / (g |y_F|) for every ray, and
at least the distance of the origin from the hull of the points lambda d. The next ray goes through
the hull's nearest facet.

If triangles of points have the origin on their inner side, and every edge belongs to two of them in
opposite directions, then the cones over them cover all directions, and the ball whose radius is the
least distance of their planes is inside the points' hull.                            (2)

No hull is computed again to check this: sums, cross products and a look at the edges do.

With the same limits on pushes and torques the fixed mass is at most the free one where fingertips
do not roll, as the forces at rest plus their change balance the load at the contacts. Rolling moves
the contacts by tip radius times turn.

Where motors hold the fingertips, S is the set of forces through the centre of mass that contacts
resist within the torques of the joints, too. These are bounds that are linear in the contact
forces, and zero meets them: the allowed forces stay a convex set around zero, and so does S, its
image under a linear map, cut with the wrenches without torque. (1) and (2) ask for no more, with
h(y) the support under these bounds, (3) of `wrench_limits`. The hand turns with its object, and so
the weight of its links turns: `Motors.in_any_orientation` has limits that leave room for it.
"""

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Amount, Array, Indices, Triangles, is_array
from grasp_core.closure.contacts import WRENCH
from grasp_core.declared import Declared, summary
from grasp_core.errors import InputError
from grasp_core.execution.best_squeeze import searched
from grasp_core.execution.grips import STIFFNESS_N_PER_M, TIP_RADIUS_M, Grip, unsqueezed
from grasp_core.execution.loads import GRAVITY_M_PER_S2, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.kinds import Quantity, Range, value_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors, motors_for
from grasp_core.quality.wrench_limits import WrenchBody, WrenchLimit, limit_of
from grasp_core.solvers.ties import first_best, on_grid
from grasp_core.values import Contact, Grasp

UNITS_LOST = 16.0
"""Rounding units by which the volume of a triangle's cone may be off, relative to the product of
its sides and its distance: differences, products and sums lose about one each."""
GAP = 1e-3
"""Gap between the bounds of the free mass, relative to it, at which no more rays follow."""
RAYS = 200
"""Most rays; twenty to eighty are usual."""
NOTHING = 1e-6
"""Free mass that is none, in pushes over gravity: the accuracy of conic programs is a tenth."""
ROUNDING = 1e-9
"""Slack of bounds, relative to them."""
FIRST = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
"""Directions of the first rays, whose hull contains the origin."""


def nearest_facet(points: Array) -> tuple[Array, float, Indices]:
    """Find the hull's facet nearest to zero: normal, distance; and all triangles, (t, 3)."""
    spatial: Any = importlib.import_module("scipy.spatial")
    hull = spatial.ConvexHull(points)
    equations: Array = hull.equations
    # equally near facets are taken in the order of their normals, the same on every machine
    equations = equations[np.lexsort(on_grid(equations[:, :3]).T)]
    nearest = equations[first_best(equations[:, 3])]
    return nearest[:3], -float(nearest[3]), np.asarray(hull.simplices, dtype=np.int64)


def outward(points: Array, triangles: Indices) -> Indices:
    """Turn triangles, (t, 3), so that the origin is on their inner side."""
    turned = np.linalg.det(points[triangles]) < 0.0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)


def least_distance(corners: Array) -> float:
    """Return the least distance of the origin from planes of triangles, (t, 3, 3).

    The distance is negative where a triangle has the origin on its outer side, and lower by what
    rounding may add, which is much for corners that are nearly in line.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    if not (lengths > 0.0).all():
        return -np.inf
    far = np.linalg.norm(corners, axis=2).max(axis=1)
    # a cross product is off by some rounding units of the product of its factors
    sides = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    lost = UNITS_LOST * np.finfo(np.float64).eps * far * sides
    return float(((np.einsum("ti,ti->t", normals, a) - lost) / lengths).min())


def ball_in(points: Array, triangles: Any) -> float:
    """Return the radius of the ball that triangles show by (2) to be in a hull, or -inf."""
    if not (is_array(triangles, None, 3, whole=True) and len(triangles)):
        return -np.inf
    if triangles.min() < 0 or triangles.max() >= len(points) or not _is_closed(triangles):
        return -np.inf
    return least_distance(points[triangles])


def _is_closed(triangles: Indices) -> bool:
    """Return whether every edge belongs to two triangles, in opposite directions."""
    edges = [tuple(edge) for t in triangles.tolist() for edge in zip(t, t[1:] + t[:1], strict=True)]
    known = set(edges)
    return len(known) == len(edges) and all((b, a) in known for a, b in edges)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FreeMass(Declared):
    """Bounds of the mass that forces chosen anew for each orientation hold."""

    lower: Amount
    """Mass that is held in every orientation [kg]."""
    upper: Annotated[float, Range(most=np.inf)]
    """Mass above which some orientation is not held [kg]."""
    rays: tuple[WrenchLimit, ...]
    """Largest masses in some directions: weights of one kilogram, and multiples of them."""
    triangles: Triangles
    """Triangles (2) of the hull of the rays' ends, by their indices, (t, 3); none where the lower
    bound is zero."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Payload(Declared):
    """The largest mass held in every orientation, with forces chosen beforehand and chosen anew."""

    fixed: BestSqueeze
    """The squeeze that holds the largest mass, `fixed.scale` [kg], without replanning."""
    free: FreeMass
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

        The free mass is about the contacts, the largest push and the motors of `fixed`, and its
        bounds hold to within 1e-7 of that push, the accuracy of conic programs. Whether the
        contacts are those of an object can only be checked with it.
        """
        with np.errstate(all="ignore"):
            return (
                self.is_sound()
                and self.fixed.verify()
                and _is_weight(self.fixed)
                and (self.fixed.motors is None or not self.fixed.motors.gravity.any())
                and self.free.lower <= self.free.upper < np.inf
                and self._are_rays()
                and _outer(self.free.rays) <= self.free.upper * (1.0 + ROUNDING)
                and (
                    self.free.lower == 0.0
                    or ball_in(_ends(self.free.rays), self.free.triangles) * (1.0 + ROUNDING)
                    >= self.free.lower
                )
            )

    def _are_rays(self) -> bool:
        body = _body(self.fixed.grip, self.fixed.max_push_n, self.fixed.motors)
        return all(
            ray.holds_for(body)
            and not ray.wrench[3:].any()
            and abs(np.linalg.norm(ray.wrench) / GRAVITY_M_PER_S2 - 1.0) <= ROUNDING
            for ray in self.free.rays
        )


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
    loaded = np.flatnonzero(motors_for(motors, len(start.friction)).gravity)
    if loaded.size:
        raise InputError(
            f"motors must have no gravity for a payload, but joint {int(loaded[0])} carries links: "
            "the hand turns with its object, and so does the weight of its links; give "
            "gc.Motors.in_any_orientation(levers, limits, weights), which leaves room for it"
        )
    fixed = searched(start, any_direction(1.0), most, motors)
    return Payload(fixed, _free_mass(_body(start, most, motors)))


def _body(grip: Grip, max_push_n: float, motors: Motors | None) -> WrenchBody:
    return WrenchBody(grip.arms, grip.normals, grip.friction, max_push_n, motors)


def _free_mass(body: WrenchBody) -> FreeMass:
    rays = [_ray(body, direction) for direction in FIRST]
    none = NOTHING * body.max_normal_force / GRAVITY_M_PER_S2
    # where a direction is hardly resisted, so is one of these or the one that its facet faces
    weakest = rays[first_best([-ray.limit for ray in rays])]
    if weakest.limit <= none or _outer(rays) <= none:
        return _nothing_held(rays)
    while True:
        normal, distance, triangles = nearest_facet(_ends(rays))
        if _outer(rays) <= none:
            return _nothing_held(rays)
        if _outer(rays) <= distance * (1.0 + GAP) or len(rays) == RAYS:
            break
        rays.append(_ray(body, normal))
    triangles = outward(_ends(rays), triangles)
    lower = least_distance(_ends(rays)[triangles])
    return FreeMass(lower, max(_outer(rays), lower), tuple(rays), triangles)


def _nothing_held(rays: list[WrenchLimit]) -> FreeMass:
    return FreeMass(0.0, _outer(rays), tuple(rays), np.zeros((0, 3), dtype=np.int64))


def _ray(body: WrenchBody, direction: Array) -> WrenchLimit:
    weight = np.zeros(WRENCH)
    weight[:3] = GRAVITY_M_PER_S2 * direction / np.linalg.norm(direction)
    return limit_of(body, weight)


def _ends(rays: Iterable[WrenchLimit]) -> Array:
    """Return the ends lambda d of rays, (n, 3) [kg]."""
    return np.array([ray.limit * ray.wrench[:3] / GRAVITY_M_PER_S2 for ray in rays])


def _outer(rays: Iterable[WrenchLimit]) -> float:
    """Return the least bound (1) of rays on the free mass [kg]; infinite if there is none."""
    forces = [(ray.upper, GRAVITY_M_PER_S2 * float(np.linalg.norm(ray.facet[:3]))) for ray in rays]
    return min((upper / force for upper, force in forces if force > 0.0), default=np.inf)


def _is_weight(fixed: BestSqueeze) -> bool:
    """Return whether the loads of a squeeze are the weight of one kilogram in any direction."""
    E = fixed.loads.axes
    ball = np.zeros((WRENCH, WRENCH))
    ball[:3, :3] = GRAVITY_M_PER_S2**2 * np.eye(3)
    near = bool((np.abs(E @ E.T - ball) <= ROUNDING * GRAVITY_M_PER_S2**2).all())
    return near and not fixed.loads.offset.any()
