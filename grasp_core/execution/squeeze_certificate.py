"""A squeeze with both sides of a proof: what it survives, and what no other squeeze survives.

A multiplier for each contact shows by the S-lemma that the squeeze survives all loads of a set, (4)
of `worst_loads`. Multipliers of rows that are linear in the squeeze bound what any squeeze with
this response survives, (4) of `squeeze_rows`. Torques of joints are sums and lengths.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from grasp_core.arrays import Amount, Array, Figure, Shape
from grasp_core.closure.contacts import WRENCH
from grasp_core.declared import Declared
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import LoadSet
from grasp_core.execution.squeeze_rows import Cuts, Survival
from grasp_core.kinds import NotNegative
from grasp_core.quality.motors import Motors

ROUNDING = 1e-9
"""Slack of pushes and of the upper bound, relative to them."""
NEAR = 1e-5
"""Share by which a load larger than the worst makes a contact slip, or a joint reach its torque."""
NONE = 1e-9
"""Scale that is none, in pushes over the change of contact forces at scale one."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BestSqueeze(Declared):
    """A squeeze, the loads that it survives without replanning, and a bound on what others survive.

    All of this is about the linear model of small motions. The upper bound is for squeezes under
    which the contact forces respond to loads as under this one: the response depends on the squeeze
    through the geometric stiffness, which is small against that of the fingertips unless they are
    soft.
    """

    grip: Grip
    """The contacts with the squeeze, `grip.squeeze` (k, 3) [N]."""
    loads: LoadSet
    """The loads that were asked about."""
    max_push_n: NotNegative
    """Largest push of any finger, at rest and under all loads up to the scale [N]."""
    scale: Amount
    """Scale of the set's ellipsoid up to which no contact slips, no push exceeds the limit, and no
    joint its torque."""
    upper: Figure
    """Scale that no squeeze with the same response and largest push exceeds."""
    contact: int
    """Index of the contact that slips, or reaches the limit, first; -1 where a joint is first."""
    direction: Annotated[Array, Shape(None)]
    """Place z in the ellipsoid, of unit length, of the load that makes it, or the joint, do so,
    (m,)."""
    proofs: Annotated[Array, Shape(None)]
    """S-lemma multiplier of each case, (cases,) [N^2]: contacts under the loads, then, where the
    loads have an offset, contacts at rest."""
    cuts: Cuts
    """Tangent directions whose rows bound the scale from above."""
    multipliers: Annotated[Array, Shape(None)]
    """Multipliers of these rows, of the limits on pushes from above and from below in each case,
    and of both directions of the joints, under the loads and at rest, (r + 2 cases + joint rows,).
    """
    balance: Annotated[Array, Shape(WRENCH)]
    """Multipliers of the balance, (6,)."""
    motors: Motors | None = None
    """Joints behind the contacts, with the torques of their motors; None for fingers that are as
    strong as `max_push_n` says."""
    joint: int = -1
    """Index of the joint that reaches its torque first; -1 where a contact is first, or as early.
    """

    @property
    def load(self) -> Array:
        """The worst load at the scale, (6,) [N, N m], torque about the centre of mass."""
        return self.loads.offset + self.scale * self.loads.axes @ self.direction

    @property
    def torque_shares(self) -> Array:
        """Largest torque of each joint up to the scale, over its limit, (joints,), if any.

        Joints at one are those that more torque would help. The best squeeze is no harder than it
        must be, so that contacts mostly slip where joints reach their torques.
        """
        survival = Survival.of(self.grip, self.loads, self.motors)
        return survival.joints.shares(self.grip.local_squeeze, self.scale)

    def verify(self) -> bool:
        """Re-check every field in plain arithmetic; False if they are no certificate.

        The check is that the squeeze balances, to a millionth of its forces, and is stable, that
        its S-lemma multipliers, pushes and torques prove the scale, that the worst load is one, and
        that the multipliers of rows prove the upper bound. Whether the contacts are those of an
        object can only be checked with it, and whether the joints are those of a hand only with the
        hand.
        """
        with np.errstate(all="ignore"):
            if not (self.is_sound() and self.scale <= self.upper):
                return False
            # without what the grip has kept, which may be anything
            return replace(self, grip=replace(self.grip))._is_proved()

    def _is_proved(self) -> bool:
        grip, motors = self.grip, self.motors
        if not (grip.stable and (motors is None or motors.are_for(len(grip.friction)))):
            return False
        survival = Survival.of(grip, self.loads, motors)
        return (
            self._fits(survival)
            and self._survives(survival)
            and self._ends(survival)
            and survival.bound(self.cuts, self.multipliers, self.balance, self.max_push_n)
            <= self.upper * (1.0 + ROUNDING) + no_scale(survival, self.max_push_n)
        )

    def _fits(self, survival: Survival) -> bool:
        cases, r = len(survival.friction), len(self.cuts.cases)
        return (
            r > 0
            and bool((self.cuts.cases < cases).all())
            and len(self.multipliers) == r + 2 * cases + survival.joints.rows
            and bool((self.multipliers >= 0.0).all())
            and len(self.proofs) == cases
            and self._names_one(survival.contacts, len(survival.joints.limits))
            and len(self.direction) == self.loads.axes.shape[1]
            and abs(float(np.linalg.norm(self.direction)) - 1.0) <= ROUNDING
        )

    def _names_one(self, contacts: int, joints: int) -> bool:
        """Return whether the fields name a contact or a joint, and not both."""
        if self.joint == -1:
            return 0 <= self.contact < contacts
        return self.contact == -1 and 0 <= self.joint < joints

    def _survives(self, survival: Survival) -> bool:
        reactions = survival.reactions(self.grip.local_squeeze)
        pushes = reactions.start[:, 0] + self.scale * reactions.swing
        limited = bool((pushes <= self.max_push_n * (1.0 + ROUNDING)).all())
        strong = survival.joints.holds(self.grip.local_squeeze, self.scale)
        return limited and strong and reactions.survives(self.scale, self.proofs)

    def _ends(self, survival: Survival) -> bool:
        further = self.scale * (1.0 + NEAR) + no_scale(survival, self.max_push_n)
        if self.joint >= 0:
            joints = survival.joints
            torque = joints.under(self.grip.local_squeeze)[0, self.joint]
            torque += joints.change[0, self.joint] @ (further * self.direction)
            return bool(abs(torque) >= joints.limits[self.joint])
        reactions = survival.reactions(self.grip.local_squeeze)
        start, change = reactions.start[self.contact], reactions.change[self.contact]
        normal, *across = (start + further * change @ self.direction).tolist()
        slipping = float(np.hypot(*across)) >= reactions.friction[self.contact] * normal
        return bool(slipping or normal >= self.max_push_n)


def no_scale(survival: Survival, max_push_n: float) -> float:
    """Return the scale that is none, `NONE` of what changes a contact force by the largest push."""
    largest = float(np.linalg.norm(survival.change, axis=(1, 2)).max())
    return NONE * max_push_n / largest if largest > 0.0 else 0.0
