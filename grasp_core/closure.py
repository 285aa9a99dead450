"""Equilibrium and force closure with exact circular friction cones, proved either way.

Solved: whether contact forces f_i in the friction cones C_i can balance every wrench.

Contacts are in force closure iff the contact wrenches have rank 6 and some forces in the
interior of the cones balance each other: a neighbourhood of such forces maps onto a
neighbourhood of the zero wrench, and scaling does the rest. The margin program

    maximise t  subject to  sum f_i = 0,  sum x_i x f_i = 0,  sum n_i.f_i = 1,
                            |f_i - (n_i.f_i) n_i| + t <= mu_i n_i.f_i

is therefore positive for force closure. Its dual is a twist y = (a, b): with the contact
velocities v_i = a + b x x_i, the support of cone i in direction y is
s_i(y) = n_i.v_i + mu_i |tangential part of v_i|, and t = max_i s_i(y) for the best y. If no
s_i(y) is positive, then no contact wrench has a positive product with y, and no external
wrench w with y.w < 0 can be resisted.

Both answers are certificates: `verify` uses sums, norms and one singular value.

Source: Sudsang & Ponce 1995, Definition 1 and Proposition 1, with the condition on the rank
made explicit; the cone program is standard.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.closure_margin import decide, proves_closure, refutes_closure
from grasp_core.contact_arrays import contact_arrays, contact_frictions
from grasp_core.errors import UndecidedError
from grasp_core.values import Grasp

UNSAFE = 1e-6
"""A margin larger than this is not itself why nothing can be proved."""


@dataclass(frozen=True, slots=True, eq=False)
class ClosureCertificate:
    """A verdict on force closure with what proves it."""

    closed: bool
    margin: float
    """Optimum t of the margin program: dimensionless, unchanged by moving and scaling."""
    positions: Array
    """(k, 3) [m]"""
    normals: Array
    """(k, 3)"""
    friction: Array
    """Coulomb coefficient of each contact, (k,)."""
    forces: Array | None
    """If closed: balancing forces strictly inside the cones, (k, 3), normal parts summing to 1."""
    separating_wrench: Array | None
    """If not: y = (a, b), (6,), about the frame's origin, with y.w <= 0 for every wrench w that
    the contacts can apply; an external wrench w with y.w < 0 is not resisted."""

    def __post_init__(self) -> None:
        for name in ("positions", "normals", "friction", "forces", "separating_wrench"):
            array = getattr(self, name)
            if array is not None:
                kept = np.array(array, dtype=np.float64)
                kept.setflags(write=False)
                object.__setattr__(self, name, kept)

    def verify(self) -> bool:
        """Re-check the verdict in plain arithmetic, without any solver."""
        if self.closed:
            arms, _, _ = unit_size(self.positions)
            return self.forces is not None and proves_closure(
                self.forces, arms, self.normals, self.friction
            )
        return self.separating_wrench is not None and self._separates(self.separating_wrench)

    def _separates(self, wrench: Array) -> bool:
        arms, center, size = unit_size(self.positions)
        twist = np.concatenate(
            [wrench[:3] + np.cross(wrench[3:], center), wrench[3:] * size]
        )  # about the contacts' centre, at unit size
        return refutes_closure(twist, arms, self.normals, self.friction)


def force_closure(
    positions: ArrayLike | Grasp,
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
) -> ClosureCertificate:
    """Decide force closure of hard-finger contacts under Coulomb friction.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each, (k,).

    Raises:
        InputError: Shapes, lengths or signs are wrong.
        UndecidedError: The contacts are within rounding of the boundary of closure.
        SolverError: The program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals)
    mu = contact_frictions(friction, len(points))
    arms, center, size = unit_size(points)
    answer = decide(arms, units, mu)
    if answer.closed:
        return ClosureCertificate(True, answer.margin, points, units, mu, answer.forces, None)
    if answer.closed is False:
        wrench = _about_origin(answer.twist, center, size)
        verdict = ClosureCertificate(False, answer.margin, points, units, mu, None, wrench)
        if verdict.verify():
            return verdict
    raise UndecidedError(_why_undecided(answer.margin))


def _why_undecided(margin: float) -> str:
    if abs(margin) < UNSAFE:
        return (
            f"the closure margin is {margin:.2g}, too close to zero to decide; change the "
            "friction or the contacts slightly"
        )
    return (
        f"the closure margin is {margin:.2g}, but neither answer can be proved: contacts or "
        "normals nearly coincide, or lie nearly on a line; move them apart or leave some out"
    )


def unit_size(points: Array) -> tuple[Array, Array, float]:
    """Arms from the mean contact over the longest one, with that centre and length."""
    center = points.mean(axis=0)
    arms = points - center
    size = float(np.linalg.norm(arms, axis=1).max())
    size = size if size > 0.0 else 1.0
    return arms / size, center, size


def _about_origin(twist: Array, center: Array, size: float) -> Array:
    turning = twist[3:] / size
    return np.concatenate([twist[:3] - np.cross(turning, center), turning])
