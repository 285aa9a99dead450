"""Certificates of force closure of contacts, or of its opposite, checked in plain arithmetic.

`force_closure` finds such certificates, and derives the margin program, (1) to (4) there. `proofs`
derives the bounds of its optimum: `verify` uses sums, norms and one singular value.
"""

import math
from dataclasses import field
from typing import Annotated

import numpy as np

from grasp_core.allowed_values import LARGEST
from grasp_core.arrays import (
    SMALLEST_SIZE,
    Array,
    Frictions,
    Points,
    Shape,
    UnitVectors,
    Wrench,
    of_order_one,
)
from grasp_core.closure.contacts import normal_and_tangential, to_center, torsion_lengths, unit_size
from grasp_core.closure.proofs import ContactCones, margin_ceiling, proved_margin
from grasp_core.declared import Declared, declared

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
            return float(upper_bound(cones, twist, caution))
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
        return float(lower_bound(cones, forces, caution))


def lower_bound(cones: ContactCones, forces: Array, caution: float) -> Array:
    """Compute the margins that forces prove; minus infinity where they miss (1) or (2)."""
    along, across = normal_and_tangential(forces, cones.normals)
    met = np.abs(cones.wrench(forces)).max(axis=-1) <= SUMMED
    met &= np.abs(along.sum(axis=-1) - 1.0) <= SUMMED
    # without friction `proved_margin` sees only normal parts, so slides are checked here
    met &= (np.where(cones.friction == 0.0, across, 0.0) <= SUMMED).all(axis=-1)
    return np.where(met, proved_margin(cones, forces, caution), -math.inf)


def upper_bound(cones: ContactCones, twist: Array, caution: float) -> Array:
    """Bound margins by twists, from `FAR_BELOW` on."""
    return np.maximum(margin_ceiling(cones, twist, caution), FAR_BELOW)
