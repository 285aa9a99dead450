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
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grasp_core.arrays import UNIT_SLACK, Array
from grasp_core.closure.closure_certificate import ClosureCertificate, lower_bound, upper_bound
from grasp_core.closure.contacts import (
    contact_arrays,
    contact_frictions,
    contact_torsions,
    to_center,
    to_origin,
    torsion_lengths,
    unit_size,
)
from grasp_core.closure.decision import Decision, decide, decided_at_once
from grasp_core.closure.proofs import ContactCones
from grasp_core.declared import trusted
from grasp_core.errors import UndecidedError
from grasp_core.values import Contact, Grasp

CLEAR_MARGIN = 1e-6
"""Size of a margin above which the margin itself does not explain why nothing can be proved."""
MARGIN_CAUTION = 1.01
"""Factor on the allowance for rounding in the reported margin, relative to that in `verify`: sums
and singular values differ in their last digits from processor to processor."""


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
    contacts = _checked(positions, normals, friction, torsion_m)
    decision = decide(contacts.cones)
    certificate = contacts.certificate(decision)
    if certificate is not None and certificate.verify():
        return certificate
    raise _undecided(decision.margin)


class _Contacts(NamedTuple):
    """Contacts that were checked, and their cones at unit size about a centre."""

    points: Array
    normals: Array
    friction: Array
    torsions: Array | None
    cones: ContactCones
    center: Array
    size: Array

    def certificate(self, decision: Decision) -> ClosureCertificate | None:
        """Put what was decided at unit size into a certificate; None where nothing was."""
        forces, wrench, torques = None, None, None
        if decision.closed is None:
            return None
        if decision.closed:
            # (2) exactly: scaling forces leaves (1) and the sign of (3) alone
            pushes = float(np.einsum("ki,ki->", decision.forces, self.cones.normals))
            scaled = decision.forces / pushes
            forces = np.array(scaled[:, :3])
            if self.torsions is not None:
                torques = scaled[:, 3] * torsion_lengths(self.torsions, self.friction)
        else:
            wrench = to_origin(decision.twist, self.center, self.size)
        for array in (self.points, self.normals, forces, wrench, torques):
            if array is not None:
                array.setflags(write=False)
        made = partial(
            trusted, ClosureCertificate, closed=decision.closed, positions=self.points,
            normals=self.normals, friction=self.friction, forces=forces, separating_wrench=wrench,
            torsion_m=self.torsions, torques=torques,
        )  # fmt: skip
        # a caution above one leaves room for `verify` to round otherwise on another processor
        return made(margin=made(margin=0.0).proved(MARGIN_CAUTION))


def _checked(
    positions: ArrayLike | Grasp | Sequence[Contact], normals: ArrayLike | None,
    friction: ArrayLike, torsion_m: ArrayLike,
) -> _Contacts:  # fmt: skip
    points, units = contact_arrays(positions, normals)
    mu = contact_frictions(friction, len(points))
    torsions = contact_torsions(torsion_m, mu)
    arms, center, size = unit_size(points)
    cones = ContactCones.at(arms, units, mu, None if torsions is None else torsions / size)
    return _Contacts(points, units, mu, torsions, cones, center, size)


def _undecided(margin: float) -> UndecidedError:
    if abs(margin) < CLEAR_MARGIN:
        return UndecidedError(
            f"the closure margin is {margin:.2g}, too close to zero to decide; change the friction "
            "or the contacts slightly"
        )
    return UndecidedError(
        f"neither force closure nor its opposite can be proved (margin {margin:.2g}): contacts or "
        "normals nearly coincide, or lie nearly on a line; move them apart or leave some out"
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
    proved = lower_bound(cones.only(closed), forces[closed], MARGIN_CAUTION)
    found[closed] = np.where(proved > 0.0, proved, math.nan)
    back = to_center(wrenches, centers, sizes)[separated]  # as `verify` does
    proved = upper_bound(cones.only(separated), back, MARGIN_CAUTION)
    found[separated] = np.where(proved <= 0.0, proved, math.nan)
    return closed & ~np.isnan(found), found, forces, wrenches
