"""Decides equilibrium and force closure with exact circular friction cones, with a proof.

Solved: whether contact forces f_i in the friction cones C_i can balance every wrench.

Contacts are in force closure iff the contact wrenches have rank 6 and some forces in the
interior of the cones balance each other: a neighbourhood of such forces maps onto a
neighbourhood of the zero wrench, and scaling does the rest. The margin program

    maximise t  subject to  sum f_i = 0,  sum x_i x f_i = 0,                            (1)
                            sum n_i.f_i = 1,                                            (2)
                            |f_i - (n_i.f_i) n_i| + t <= mu_i n_i.f_i                   (3)

is therefore positive for force closure. Its dual is a twist y = (a, b): with the contact
velocities v_i = a + b x x_i, the support of cone i in direction y is

    s_i(y) = n_i.v_i + mu_i |tangential part of v_i|,                                   (4)

and t = max_i s_i(y) for the best y. If no s_i(y) is positive, then no contact wrench has a
positive product with y, and no external wrench w with y.w < 0 can be resisted.

Both answers are certificates: `verify` uses sums, norms and one singular value. Both also bound
the optimum, forces from below and twists from above (see `proofs`).

Soft contacts also transmit a torque about their normal; `soft` has their cones of four dimensions,
their program and their proofs.

Source: Sudsang & Ponce 1995, Definition 1 and Proposition 1, with the condition on the rank
made explicit; the cone program is standard.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import (
    SMALLEST_SIZE,
    Array,
    are_frictions,
    are_units,
    cross,
    is_array,
    is_number,
    of_order_one,
    real_array,
)
from grasp_core.by_value import ByValue
from grasp_core.closure.contact_arrays import contact_arrays, contact_frictions, unit_size
from grasp_core.closure.decision import decide
from grasp_core.closure.proofs import margin_ceiling, proved_margin
from grasp_core.closure.soft import decision as soft_decision
from grasp_core.closure.soft import proofs as soft_proofs
from grasp_core.closure.soft.contacts import SoftContacts, are_torsions, contact_torsions
from grasp_core.closure.wrenches import normal_and_tangential
from grasp_core.errors import UndecidedError
from grasp_core.values import Contact, Grasp

UNSAFE = 1e-6
"""Size of a margin above which the margin itself does not explain why nothing can be proved."""
CAUTION = 1.01
"""Factor on the allowance for rounding in the reported margin, relative to that in `verify`: sums
and singular values differ in their last digits from processor to processor."""
SUMMED = 1e-9
"""Error that closing forces may have: in the sum of their normal parts, which is 1, and in their
wrench at unit size, which is zero."""
FAR_BELOW = -1e6
"""Margin below which minus infinity is reported: hardly any forces balance."""
ARRAYS = (
    "positions", "normals", "friction", "forces", "separating_wrench", "torsion_m", "torques",
)  # fmt: skip
"""Fields of a certificate that hold an array."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ClosureCertificate(ByValue):
    """A verdict on force closure, with the forces or the wrench that prove it."""

    closed: bool
    """Whether the contacts are in force closure."""
    margin: float
    """Proved bound of the optimum t of the margin program, dimensionless, unchanged by moving and
    scaling. If closed, the optimum is no less. If not, it is no more than a negative margin, while
    zero says only that there is no closure: contacts may balance deep inside their cones, and yet
    leave the object free. `force_closure` gives the optimum to some 1e-9 where contacts and
    friction are not nearly degenerate; a margin below -1e6 is reported as minus infinity."""
    positions: Array
    """Contact points, (k, 3) [m]."""
    normals: Array
    """Inward normals, (k, 3), of length 1 to nine digits; only their directions count."""
    friction: Array
    """Coulomb coefficient of each contact, (k,)."""
    forces: Array | None
    """If closed: balancing forces strictly inside the cones, (k, 3), with normal parts that sum to
    1, both to within 1e-9; torques are about the mean contact, at unit size. None otherwise."""
    separating_wrench: Array | None
    """If not closed: y = (a, b), (6,), about the frame's origin, with y.w <= 0 for every wrench w
    that the contacts can apply, to within 1e-12 of lengths at unit size; an external wrench w with
    y.w < 0 is not resisted. None otherwise."""
    torsion_m: Array | None = field(default=None, repr=False)
    """Torsional coefficient of each contact, (k,) [m]; None if no contact has torsion."""
    torques: Array | None = field(default=None, repr=False)
    """If closed, with torsion: torques about the inward normals that balance with the forces, (k,)
    [m], strictly inside the cones. None otherwise."""

    def __post_init__(self) -> None:
        for name in ARRAYS:
            array = getattr(self, name)
            if array is not None:
                kept = real_array(array, name)
                kept.setflags(write=False)
                object.__setattr__(self, name, kept)

    def verify(self) -> bool:
        """Check every field again in plain arithmetic, without any solver.

        Returns:
            Whether the fields prove the verdict and the margin; False if they are no certificate.
        """
        with np.errstate(all="ignore"):
            if not (self._are_contacts() and is_number(self.margin, least=-math.inf)):
                return False
            if self.closed is True:
                return self.separating_wrench is None and 0.0 < self.margin <= self.proved()
            no_forces = self.forces is None and self.torques is None
            return self.closed is False and no_forces and 0.0 >= self.margin >= self.proved()

    def separates(self) -> bool:
        """Return whether the wrench separates, whatever the margin.

        Shapes and types of the fields are not checked again.
        """
        return self.forces is None and self.proved() <= 0.0

    def _are_contacts(self) -> bool:
        count = len(self.normals) if is_array(self.normals, None, 3) else 0
        placed = is_array(self.positions, count, 3) and are_units(self.normals, count, 3)
        if count == 0 or not placed:
            return False
        spread = float(np.ptp(self.positions, axis=0).max())
        rubbing = are_frictions(self.friction, count) and (
            self.torques is None
            if self.torsion_m is None
            else are_torsions(self.torsion_m, self.friction)
        )
        return (spread == 0.0 or spread >= SMALLEST_SIZE) and rubbing

    def proved(self, caution: float = 1.0) -> float:
        """Compute the margin that the fields prove: a lower bound if closed, else an upper one.

        Args:
            caution: Factor on the rounding that is allowed for.

        Returns:
            The bound; minus infinity if closed, or infinity if not, where the fields prove none.
        """
        arms, center, size = unit_size(self.positions)
        # `verify` asks only for unit length to nine digits, so the directions are taken exactly
        normals = self.normals / np.linalg.norm(self.normals, axis=1, keepdims=True)
        if self.torsion_m is not None:
            soft = SoftContacts.of(self.positions, normals, self.friction, self.torsion_m)
            return self._proved_with_torsion(soft, caution)
        if self.closed:
            forces = self.forces
            if not (is_array(forces, *arms.shape) and _balance(forces, arms, normals)):
                return -math.inf
            # without friction `proved_margin` sees only normal parts, so slides are checked here
            if (normal_and_tangential(forces, normals)[1][self.friction == 0.0] > SUMMED).any():
                return -math.inf
            return proved_margin(forces, arms, normals, self.friction, caution)
        wrench = self._direction()
        if wrench is None:
            return math.inf
        # the twist of (4), moved from the frame's origin to the mean contact, at unit size
        turned = cross(wrench[3:], center)
        twist = np.concatenate([wrench[:3] + turned, wrench[3:] * size])
        ceiling = margin_ceiling(twist, arms, normals, self.friction, caution)
        return -math.inf if ceiling <= FAR_BELOW else ceiling

    def _proved_with_torsion(self, contacts: SoftContacts, caution: float) -> float:
        """Compute the margin that the fields prove for soft contacts."""
        if self.closed:
            forces, torques, count = self.forces, self.torques, len(self.friction)
            if not (is_array(forces, count, 3) and is_array(torques, count)):
                return -math.inf
            local = contacts.local(forces, torques)
            missed = max(contacts.missed(forces, torques), abs(float(local[:, 0].sum()) - 1.0))
            if not missed <= SUMMED:
                return -math.inf
            return soft_proofs.proved_margin(contacts, local, caution)
        wrench = self._direction()
        if wrench is None:
            return math.inf
        ceiling = soft_proofs.margin_ceiling(contacts, contacts.at_unit_size(wrench), caution)
        return -math.inf if ceiling <= FAR_BELOW else ceiling

    def _direction(self) -> Array | None:
        """Return the separating wrench, whose length means nothing, at order one; None if none."""
        wrench = self.separating_wrench
        return of_order_one(wrench)[0] if is_array(wrench, 6) else None


def _balance(forces: Array, arms: Array, normals: Array) -> bool:
    """Return whether forces balance at unit size, (1), and their normal parts sum to 1, (2)."""
    wrench = np.concatenate([forces.sum(axis=0), cross(arms, forces).sum(axis=0)])
    pushes = float(np.einsum("ki,ki->", forces, normals))
    return float(np.abs(wrench).max()) <= SUMMED and abs(pushes - 1.0) <= SUMMED


def force_closure(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None = None,
    friction: ArrayLike = 0.5,
    *,
    torsion_m: ArrayLike = 0.0,
) -> ClosureCertificate:
    """Decide force closure of contacts under Coulomb friction, hard ones or soft ones.

    Args:
        positions: Contact points, (k, 3) [m], k >= 2; or a Grasp or Contacts.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each, (k,).
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]: the largest
            torque about the normal over the normal force, where the contact does not slide. Zero
            is a hard finger.

    Raises:
        InputError: Shapes, lengths or signs are wrong.
        UndecidedError: The contacts are within rounding of the boundary of closure.
        SolverError: The program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals)
    mu = contact_frictions(friction, len(points))
    torsions = contact_torsions(torsion_m, mu)
    if torsions is not None:
        return _with_torsion(points, units, mu, torsions)
    arms, center, size = unit_size(points)
    answer = decide(arms, units, mu)
    if answer.closed is not None:
        forces, wrench = None, None
        if answer.closed:
            # (2) exactly: scaling forces leaves (1) and the sign of (3) alone
            forces = answer.forces / float(np.einsum("ki,ki->", answer.forces, units))
        else:
            wrench = _about_origin(answer.twist, center, size)
        found = ClosureCertificate(answer.closed, answer.margin, points, units, mu, forces, wrench)
        # a caution above one leaves room for `verify` to round otherwise on another processor
        found = replace(found, margin=found.proved(CAUTION))
        if found.verify():
            return found
    raise UndecidedError(_why_undecided(answer.margin))


def _with_torsion(
    points: Array, units: Array, friction: Array, torsions: Array
) -> ClosureCertificate:
    contacts = SoftContacts.of(points, units, friction, torsions)
    answer = soft_decision.decide(contacts)
    if answer.closed is not None:
        forces, wrench, torques = None, None, None
        if answer.closed:
            forces, torques = contacts.in_space(answer.local / float(answer.local[:, 0].sum()))
        else:
            wrench = contacts.about_origin(answer.twist)
        found = ClosureCertificate(
            answer.closed, answer.margin, points, units, friction, forces, wrench, torsions, torques
        )
        found = replace(found, margin=found.proved(CAUTION))
        if found.verify():
            return found
    raise UndecidedError(_why_undecided(answer.margin))


def _why_undecided(margin: float) -> str:
    if abs(margin) < UNSAFE:
        return (
            f"the closure margin is {margin:.2g}, too close to zero to decide; change the "
            "friction or the contacts slightly"
        )
    return (
        f"neither force closure nor its opposite can be proved (margin {margin:.2g}): contacts or "
        "normals nearly coincide, or lie nearly on a line; move them apart or leave some out"
    )


def _about_origin(twist: Array, center: Array, size: Array) -> Array:
    turning = twist[3:] / size
    return np.concatenate([twist[:3] - cross(turning, center), turning])
