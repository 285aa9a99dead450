"""Bounds the Ferrari-Canny quality from both sides, with exact circular friction cones.

Solved: Q, the radius of the largest ball around the zero wrench inside the set W of wrenches
that bounded contact forces can apply (see `wrench_sets`); if zero lies outside W, minus its
distance from W. With h the support of W, (1) of `wrench_sets`, over unit directions y,

    Q  =  min h(y)  <=  h(y) for any y.                                                       (1)

A polytope inside W bounds Q from below, with n.x <= b the planes of its simplices:

    Q  >=  min b, if the simplices enclose zero.                                              (2)

The polytope is grown where it is weakest: the point of W farthest along the normal of the nearest
plane is added, until that plane and its support agree. If zero is outside, the nearest point of W
is found by a cone program; its forces bound the distance from above, its direction from below:

    -|w|  <=  Q  for any w in W.                                                              (3)

Without closure, Q of `l1` is negative; that of `linf` is zero, since fingers may then rest.

Both proofs are kept and can be checked again in plain arithmetic; `inner_polytope` explains the one
of the lower bound. A compiled kernel grows the polytopes; one whose proof fails counts for nothing,
and the bounds are then those of (1) and (3).

Source: Ferrari & Canny 1992; the growing polytope is the expanding-polytope algorithm of
collision detection in six dimensions (also Zheng 2013 for this metric).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Figure, Shape
from grasp_core.closure.contacts import WRENCH
from grasp_core.closure.wrench_sets import Norm, WrenchSet, nearest_wrench
from grasp_core.compiled import compiled
from grasp_core.declared import Declared, trusted
from grasp_core.kinds import Range, value_of
from grasp_core.quality.inner_polytope import InnerPolytope
from grasp_core.values import Contact, Grasp

GAP = 1e-4
"""Default of the largest relative gap (upper - lower) / upper between the bounds of a quality."""
FINEST_GAP = 1e-7
"""Smallest gap that may be asked for: below it, rounding of the planes of tiny simplices costs more
than they gain."""
QualityGap = Annotated[float, Range(least=FINEST_GAP, below=1.0)]
MOST_SIMPLICES, MOST_POINTS = 60_000, 4096
"""Simplices and corners at which the polytope stops growing; its bounds hold all the same, farther
apart."""
CHECK_SLACK = 1e-12
"""Slack of the plain-arithmetic checks, relative to the longest wrench."""
MOST_SLACK = 1e-6
"""Largest slack of a quality, however long wrenches are [N]."""
KERNEL = "grasp_core.quality.ferrari_canny_kernel"
UnitTwist = Annotated[Array, Shape(WRENCH, units=True)]
"""A velocity and an angular velocity, of length one, with torques over a torque scale, (6,)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FerrariCanny(Declared):
    """Bounds of a quality, with the direction and the polytope, or forces, that prove them."""

    lower: Figure
    """Lower bound of the quality [N]."""
    upper: Figure
    """Upper bound of the quality [N]."""
    wrenches: WrenchSet
    """The set of wrenches to whose largest inscribed ball the quality refers."""
    direction: UnitTwist
    """Unit twist, (6,), with torques over the torque scale, in which the support is at most
    `upper`."""
    polytope: InnerPolytope | None
    """Polytope that proves `lower` if the zero wrench is inside the set; None otherwise."""
    forces: Annotated[Array, Shape(None)] | None
    """Local forces, (3k,), or (4k,) with torsion, whose wrench is no longer than -`lower`, if the
    zero wrench is outside the set; None otherwise."""

    def verify(self) -> bool:
        """Check every field again in plain arithmetic, without any solver.

        The bounds hold for the set `wrenches`, which is checked to be that of some contacts, to
        within 1e-12 of its longest wrench, and 1e-6 N at most.
        """
        with np.errstate(all="ignore"):
            if not (self.is_sound() and self.lower <= self.upper and is_unit(self.direction)):
                return False
            slack = min(CHECK_SLACK * self.wrenches.size, MOST_SLACK)
            # (1) for the direction
            support, _ = self.wrenches.support(self.direction)
            return support <= self.upper + slack and self._proves_lower(slack)

    def _proves_lower(self, slack: float) -> bool:
        width = self.wrenches.G.shape[1]
        # (2), the points being wrenches of allowed forces
        if self.polytope is not None:
            return (
                self.forces is None
                and self.polytope.forces.shape[1] == width
                and are_allowed(self.polytope.forces, self.wrenches)
                and self.polytope.proved_radius(self.wrenches) >= self.lower - slack
            )
        # (3), by the wrench of allowed forces
        return (
            self.forces is not None
            and self.forces.shape == (width,)
            and are_allowed(self.forces[None], self.wrenches)
            and float(np.linalg.norm(self.wrenches.G @ self.forces)) <= -self.lower + slack
        )


def is_unit(direction: Array) -> bool:
    """Return whether a vector has length one, to `CHECK_SLACK`."""
    return abs(float(np.linalg.norm(direction)) - 1.0) <= CHECK_SLACK


def are_allowed(forces: Array, wrenches: WrenchSet) -> bool:
    """Return whether wrenches of forces, one a row, are in a set, to `CHECK_SLACK` of its longest.

    What all contacts together miss counts, so that more contacts do not allow more.
    """
    longest = 1.0 + float(wrenches.friction.max())
    return wrenches.holds(forces, CHECK_SLACK * longest / len(wrenches.friction))


def ferrari_canny(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    *,
    center: ArrayLike = (0.0, 0.0, 0.0),
    torque_scale: float,
    norm: Norm = "l1",
    gap: float = GAP,
    torsion_m: ArrayLike = 0.0,
) -> FerrariCanny:
    """Bound the largest wrench that bounded contact forces resist in every direction.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each, (k,).
        center: Point about which torques are taken, (3,) [m].
        torque_scale: Length that makes a torque comparable with a force [m], such as the
            object's radius. Values with different scales cannot be compared.
        norm: `l1`, normal forces sum to 1 N, or `linf`, each is at most 1 N.
        gap: Wanted (upper - lower) / upper, from 1e-7. Where more simplices would be needed than
            are kept, for very symmetric or many contacts, the bounds are some per cent apart.
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]; zero is a hard
            finger.

    Returns:
        Bounds in newtons. Without closure: of `l1`, minus the distance of the zero wrench from the
        set; of `linf`, zero.

    Raises:
        InputError: Shapes, lengths or signs are wrong.
        SolverError: The cone program's answer failed its check.
    """
    value_of(QualityGap, gap, "gap")
    wrenches = WrenchSet.of(
        positions, normals, friction, center=center, torque_scale=torque_scale, norm=norm,
        torsion_m=torsion_m,
    )  # fmt: skip
    return wrench_set_quality(wrenches, gap)


def wrench_set_quality(wrenches: WrenchSet, gap: float = GAP) -> FerrariCanny:
    """Bound the signed distance of zero from the border of a wrench set, with proofs."""
    kernel = compiled(KERNEL)
    linf = wrenches.norm == "linf"
    cones = kernel.Cones(np.array(wrenches.G, order="C"), np.array(wrenches.friction), linf)
    status, forces, corners, normals, weakest = kernel.grow(
        cones, wrenches.edges(), gap, MOST_SIMPLICES, MOST_POINTS
    )
    slack = CHECK_SLACK * wrenches.size
    if status == kernel.GROWN:
        polytope = trusted(InnerPolytope, forces=forces, corners=corners, normals=normals)
        radius = polytope.proved_radius(wrenches)
        if radius > slack:
            upper = wrenches.support(weakest)[0]
            lower = min(radius - slack, upper)
            return FerrariCanny(lower, upper, wrenches, weakest, polytope, None)
    return _outside(wrenches, weakest if weakest.any() else None)


def _outside(wrenches: WrenchSet, direction: Array | None) -> FerrariCanny:
    """Bound the quality where zero is outside the set, or no polytope shows that it is inside."""
    unit = replace(wrenches, norm="l1")
    forces, facing = nearest_wrench(unit)
    wrench = unit.G @ forces
    length = float(np.linalg.norm(wrench))
    # a degenerate set has support zero across its span; each direction bounds Q by (1)
    trials = [] if direction is None else [direction]
    _, _, right = np.linalg.svd(wrenches.edges() @ wrenches.G.T, full_matrices=False)
    others = [y for y in (-wrench, facing, right[-1], -right[-1]) if y.any()]
    trials += [y / float(np.linalg.norm(y)) for y in others]
    weakest = min(trials, key=lambda y: wrenches.support(y)[0])
    upper = wrenches.support(weakest)[0]
    # resting fingers apply no wrench, which is allowed by linf
    if wrenches.norm == "linf":
        forces, length = np.zeros_like(forces), 0.0
    return FerrariCanny(-length, max(upper, -length), wrenches, weakest, None, forces)
