"""The largest mass that contacts hold in every orientation, with forces fixed or chosen anew.

*Fixed.* The largest mass under the best squeeze, which is chosen beforehand and never replanned, is
the scale of a `BestSqueeze` for the weight of one kilogram in any direction.

*Free.* What forces that are chosen anew for each orientation hold is what `carried_mass` says of a
hand whose links have no weight.

With the same limits on pushes and torques the fixed mass is at most the free one where fingertips
do not roll, as the forces at rest plus their change balance the load at the contacts. Rolling moves
the contacts by tip radius times turn.

Where motors hold the fingertips, both are held within the torques of the joints. The hand turns
with its object, and so the weight of its links turns: `Motors.in_any_orientation` has limits that
leave room for it.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.closure.contacts import WRENCH
from grasp_core.declared import Declared, summary
from grasp_core.errors import InputError
from grasp_core.execution.best_squeeze import searched
from grasp_core.execution.carried_mass import ROUNDING, CarryingHand, HandPayload, carried_mass
from grasp_core.execution.grips import STIFFNESS_N_PER_M, TIP_RADIUS_M, Grip, unsqueezed
from grasp_core.execution.loads import GRAVITY_M_PER_S2, any_direction
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.kinds import Quantity, value_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors, motors_for
from grasp_core.values import Contact, Grasp

FreeMass = HandPayload
"""Bounds of the mass that forces chosen anew for each orientation hold."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Payload(Declared):
    """The largest mass held in every orientation, with forces chosen beforehand and chosen anew."""

    fixed: BestSqueeze
    """The squeeze that holds the largest mass, `fixed.scale` [kg], without replanning."""
    free: HandPayload
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

        The free mass is about the contacts, the largest push and the motors of `fixed` (see
        `HandPayload.verify`). Whether the contacts are those of an object can only be checked with
        it.
        """
        with np.errstate(all="ignore"):
            if not (self.is_sound() and self.fixed.verify() and _is_weight(self.fixed)):
                return False
            motors = motors_for(self.fixed.motors, len(self.fixed.grip.friction))
            hand = _unweighted(self.fixed.grip, self.fixed.max_push_n, motors)
            return self.free.hand == hand and self.free.verify()


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
    joints = motors_for(motors, len(start.friction))
    loaded = np.flatnonzero(joints.gravity)
    if loaded.size:
        raise InputError(
            f"motors must have no gravity for a payload, but joint {int(loaded[0])} carries links: "
            "the hand turns with its object, and so does the weight of its links; give "
            "gc.Motors.in_any_orientation(levers, limits, weights), which leaves room for it"
        )
    fixed = searched(start, any_direction(1.0), most, motors)
    return Payload(fixed, carried_mass(_unweighted(start, most, joints)))


def _unweighted(grip: Grip, max_push_n: float, motors: Motors) -> CarryingHand:
    """Return what holds the contacts of a grip, by links without weight."""
    weights = np.zeros((len(motors.limits), 3))
    return CarryingHand(grip.arms, grip.normals, grip.friction, max_push_n, motors, weights)


def _is_weight(fixed: BestSqueeze) -> bool:
    """Return whether the loads of a squeeze are the weight of one kilogram in any direction."""
    E = fixed.loads.axes
    ball = np.zeros((WRENCH, WRENCH))
    ball[:3, :3] = GRAVITY_M_PER_S2**2 * np.eye(3)
    near = bool((np.abs(E @ E.T - ball) <= ROUNDING * GRAVITY_M_PER_S2**2).all())
    return near and not fixed.loads.offset.any()
