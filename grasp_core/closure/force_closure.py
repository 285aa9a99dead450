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

Many sets of contacts are decided at once in compiled code, and checked as `verify` checks one; what
it leaves open is decided one by one. Soft contacts also transmit a torque about their normal; with
it all of the above holds in one dimension more (see `proofs`).

Source: Sudsang & Ponce 1995, Definition 1 and Proposition 1, with the condition on the rank
made explicit; the cone program is standard.
"""

import math
from collections.abc import Sequence
from dataclasses import field
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import (
    SMALLEST_SIZE,
    UNIT_SLACK,
    Array,
    Frictions,
    Points,
    Shape,
    UnitVectors,
    Wrench,
    of_order_one,
)
from grasp_core.closure.contacts import (
    contact_arrays,
    contact_frictions,
    contact_torsions,
    normal_and_tangential,
    to_center,
    to_origin,
    torsion_lengths,
    unit_size,
)
from grasp_core.closure.decision import decide, decided_at_once
from grasp_core.closure.proofs import ContactCones, margin_ceiling, proved_margin
from grasp_core.declared import Declared, declared, trusted
from grasp_core.errors import UndecidedError
from grasp_core.kinds import LARGEST
from grasp_core.values import Contact, Grasp

CLEAR_MARGIN = 1e-6
"""Size of a margin above which the margin itself does not explain why nothing can be proved."""
MARGIN_CAUTION = 1.01
"""Factor on the allowance for rounding in the reported margin, relative to that in `verify`: sums
and singular values differ in their last digits from processor to processor."""
SUMMED = 1e-9
"""Error that closing forces may have: in the sum of their normal parts, which is 1, and in their
wrench at unit size, which is zero."""
FAR_BELOW = -1e6
"""Least margin that is reported: hardly any forces balance, or none at all."""


@declared
class ClosureCertificate(Declared):
    """A verdict on force closure, with the forces or the wrench that prove it."""

    closed: bool
    """Whether the contacts are in force closure."""
    margin: float
    """Proved bound of the optimum t of the margin program, dimensionless, unchanged by moving and
    scaling. If closed, the optimum is no less. If not, it is no more than a negative margin, while
    zero says only that there is no closure: contacts may balance deep inside their cones, and yet
    leave the object free. `force_closure` gives the optimum to some 1e-9 where contacts and
    friction are not nearly degenerate; a margin below -1e6 is reported as -1e6."""
    positions: Points
    """Contact points, (k, 3) [m]."""
    normals: UnitVectors
    """Inward normals, (k, 3), of length 1 to nine digits; only their directions count."""
    friction: Frictions
    """Coulomb coefficient of each contact, (k,)."""
    forces: Points | None
    """If closed: balancing forces strictly inside the cones, (k, 3), with normal parts that sum to
    1, both to within 1e-9; torques are about the mean contact, at unit size. None otherwise."""
    separating_wrench: Wrench | None
    """If not closed: y = (a, b), (6,), about the frame's origin, with y.w <= 0 for every wrench w
    that the contacts can apply, to within 1e-12 of lengths at unit size; an external wrench w with
    y.w < 0 is not resisted. None otherwise."""
    torsion_m: Annotated[Array, Shape("k", least=0.0, most=LARGEST)] | None = field(
        default=None, repr=False
    )
    """Torsional coefficient of each contact, (k,) [m]; None if no contact has torsion."""
    torques: Annotated[Array, Shape("k")] | None = field(default=None, repr=False)
    """If closed, with torsion: torques about the inward normals that balance with the forces, (k,)
    [m], strictly inside the cones. None otherwise."""

    def verify(self) -> bool:
        """Check every field again in plain arithmetic, without any solver.

        Returns:
            Whether the fields prove the verdict and the margin; False if they are no certificate.
        """
        with np.errstate(all="ignore"):
            if not self.is_sound():
                return False
            if self.closed:
                return self.separating_wrench is None and 0.0 < self.margin <= self.proved()
            no_forces = self.forces is None and self.torques is None
            return no_forces and 0.0 >= self.margin >= self.proved()

    def separates(self) -> bool:
        """Return whether the wrench separates, whatever the margin, in sound fields."""
        return self.forces is None and self.proved() <= 0.0

    def _is_consistent(self) -> bool:
        """Return whether there are contacts, none of them too near the others."""
        if len(self.friction) == 0:
            return False
        spread = float(np.ptp(self.positions, axis=0).max())
        if self.torsion_m is None:
            rubbing = self.torques is None
        else:
            rubbing = (self.friction > 0.0) | (self.torsion_m == 0.0)
            rubbing = bool(self.torsion_m.any() and rubbing.all())
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
        torsion = None if self.torsion_m is None else self.torsion_m / size
        cones = ContactCones.at(arms, normals, self.friction, torsion)
        if not self.closed:
            if self.separating_wrench is None:
                return math.inf
            # the twist of (4), whose length means nothing
            twist = to_center(of_order_one(self.separating_wrench)[0], center, size)
            return float(_upper_bound(cones, twist, caution))
        forces = self.forces
        if forces is None or (self.torques is None) is not (torsion is None):
            return -math.inf
        if torsion is not None and self.torques is not None:
            lengths = size * torsion_lengths(torsion, self.friction)[:, None]
            turning = self.torques[:, None]
            if np.abs(np.where(lengths > 0.0, 0.0, turning)).max() > SUMMED * size:
                return -math.inf
            turning = np.divide(turning, lengths, out=np.zeros_like(turning), where=lengths > 0.0)
            forces = np.hstack([forces, turning])
        return float(_lower_bound(cones, forces, caution))


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
    arms, center, size = unit_size(points)
    cones = ContactCones.at(arms, units, mu, None if torsions is None else torsions / size)
    answer = decide(cones)
    forces, wrench, torques = None, None, None
    if answer.closed:
        # (2) exactly: scaling forces leaves (1) and the sign of (3) alone
        scaled = answer.forces / float(np.einsum("ki,ki->", answer.forces, cones.normals))
        forces = np.array(scaled[:, :3])
        if torsions is not None:
            torques = scaled[:, 3] * torsion_lengths(torsions, mu)
    elif answer.closed is False:
        wrench = to_origin(answer.twist, center, size)
    if answer.closed is not None:
        for array in (points, units, forces, wrench, torques):
            if array is not None:
                array.setflags(write=False)
        made = partial(
            trusted, ClosureCertificate, closed=answer.closed, positions=points, normals=units,
            friction=mu, forces=forces, separating_wrench=wrench, torsion_m=torsions,
            torques=torques,
        )  # fmt: skip
        # a caution above one leaves room for `verify` to round otherwise on another processor
        found = made(margin=made(margin=0.0).proved(MARGIN_CAUTION))
        if found.verify():
            return found
    if abs(answer.margin) < CLEAR_MARGIN:
        raise UndecidedError(
            f"the closure margin is {answer.margin:.2g}, too close to zero to decide; change the "
            "friction or the contacts slightly"
        )
    raise UndecidedError(
        f"neither force closure nor its opposite can be proved (margin {answer.margin:.2g}): "
        "contacts or normals nearly coincide, or lie nearly on a line; move them apart or leave "
        "some out"
    )


def closing_margins(positions: Array, normals: Array, friction: float) -> Array:
    """Compute margins of many closed sets of contacts, (g,); NaN where closure is not proved."""
    closed, margins, _, _ = _decided(positions, normals, friction)
    return np.where(closed, margins, math.nan)


def certificates(
    positions: Array, normals: Array, friction: float
) -> list[ClosureCertificate | None]:
    """Find the certificates that `force_closure` gives for many sets of contacts, or None."""
    closed, margins, forces, wrenches = _decided(positions, normals, friction)
    points, units = np.array(positions), np.array(normals)
    mu = np.full(points.shape[1], friction)
    for array in (points, units, forces, wrenches, mu):
        array.setflags(write=False)
    return [
        None if math.isnan(margin) else trusted(
            ClosureCertificate, closed=shut, margin=margin, positions=points[i],
            normals=units[i], friction=mu, forces=forces[i] if shut else None,
            separating_wrench=None if shut else wrenches[i], torsion_m=None, torques=None,
        )
        for i, (shut, margin) in enumerate(zip(closed.tolist(), margins.tolist(), strict=True))
    ]  # fmt: skip


def _decided(
    positions: Array, normals: Array, friction: float
) -> tuple[NDArray[np.bool_], Array, Array, Array]:
    """Decide like `force_closure`: closed, proved margins or NaN, forces, wrenches, (g, ...)."""
    count = len(positions)
    if not (friction > 0.0 and count):
        never, nothing = np.zeros(count, dtype=bool), np.full(count, math.nan)
        return never, nothing, np.zeros_like(positions), np.zeros((count, 6))
    arms, centers, sizes = unit_size(positions)
    closed, separated, _, forces, twists = decided_at_once(
        ContactCones.at(arms, normals, np.full(positions.shape[:2], friction))
    )
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    straight = (np.abs(lengths - 1.0) <= UNIT_SLACK).all(axis=(1, 2))
    closed, separated = closed & straight, separated & straight
    cones = ContactCones.at(arms, normals / lengths, np.full(positions.shape[:2], friction))
    pushes = np.einsum("gki,gki->g", forces, normals)
    forces = forces / np.where(closed, pushes, 1.0)[:, None, None]
    wrenches = to_origin(twists, centers, sizes)
    # the bounds at a caution of one, which `verify` asks for, are farther away
    found = np.full(count, math.nan)
    proved = _lower_bound(cones.only(closed), forces[closed], MARGIN_CAUTION)
    found[closed] = np.where(proved > 0.0, proved, math.nan)
    back = to_center(wrenches, centers, sizes)[separated]  # as `verify` does
    proved = _upper_bound(cones.only(separated), back, MARGIN_CAUTION)
    found[separated] = np.where(proved <= 0.0, proved, math.nan)
    return closed & ~np.isnan(found), found, forces, wrenches


def _lower_bound(cones: ContactCones, forces: Array, caution: float) -> Array:
    """Compute the margins that forces prove; minus infinity where they miss (1) or (2)."""
    along, across = normal_and_tangential(forces, cones.normals)
    met = np.abs(cones.wrench(forces)).max(axis=-1) <= SUMMED
    met &= np.abs(along.sum(axis=-1) - 1.0) <= SUMMED
    # without friction `proved_margin` sees only normal parts, so slides are checked here
    met &= (np.where(cones.friction == 0.0, across, 0.0) <= SUMMED).all(axis=-1)
    return np.where(met, proved_margin(cones, forces, caution), -math.inf)


def _upper_bound(cones: ContactCones, twist: Array, caution: float) -> Array:
    """Bound margins by twists, from `FAR_BELOW` on."""
    return np.maximum(margin_ceiling(cones, twist, caution), FAR_BELOW)
