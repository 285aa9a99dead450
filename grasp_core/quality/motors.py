"""Motors behind fingertips: limits on joint torques, as limits on the contact forces.

A hand at rest applies the contact forces f, stacked, through the joint torques

    tau = L f + g,   |tau_j| <= c_j,                                                    (1)

with L the transposed Jacobian of its contact points, g the torques that carry the links' weight,
and c the motors' limits. For any multipliers m of the joints, one each,

    m.L f  <=  sum_j |m_j| c_j - m_j g_j,                                               (2)

so that a bound on a linear function v.f of the contact forces is one on (v - L'm).f without (1),
plus the right side of (2): the Lagrange relaxation of (1), which loses nothing for the best m.

Links that move, friction in the joints and the motors' dynamics are left out. Friction in the
joints only helps a hold.
"""

from dataclasses import replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, SMALLEST, instance
from grasp_core.arrays import Array, Shape, frozen, frozen_each
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError


@declared
class Motors(Declared):
    """The joints of a hand in one pose, with the torques of their motors."""

    levers: Annotated[Array, Shape("j", None)]
    """The matrix L from contact forces on the object, stacked, to joint torques, (joints, 3k) [m],
    object axes: the transposed Jacobian of the contact points by the joints."""
    limits: Annotated[Array, Shape("j", least=SMALLEST, most=LARGEST)]
    """Largest torque of each joint, either way, (joints,) [N m]."""
    gravity: Annotated[Array, Shape("j")]
    """Torque of each joint that carries the weight of the links, (joints,) [N m]."""

    def _check_together(self) -> None:
        columns = self.levers.shape[1]
        if columns % 3:
            raise InputError(
                f"levers must have three columns for each contact, got {columns} columns"
            )
        weak = np.flatnonzero(np.abs(self.gravity) >= self.limits)
        if weak.size:
            raise InputError(
                f"gravity of joint {int(weak[0])} asks for {abs(self.gravity[weak[0]]):.6g} N m, "
                f"but its limit is {self.limits[weak[0]]:.6g} N m: the hand cannot carry its own "
                "links; give larger limits, or another pose"
            )

    @classmethod
    def of(cls, levers: ArrayLike, limits: ArrayLike, gravity: ArrayLike = 0.0) -> "Motors":
        """Make motors from numbers that may be one for all joints.

        Args:
            levers: Transposed Jacobian of the contact points, (joints, 3k) [m], object axes.
            limits: Largest torque of each joint, one for all or one each [N m].
            gravity: Torque that carries the links' weight, one for all or one each [N m].

        Raises:
            InputError: Shapes or ranges are wrong, or a motor cannot carry the links.
        """
        rows = frozen(levers, (None, None), "levers")
        joints = len(rows)
        each = frozen_each(limits, joints, "limits"), frozen_each(gravity, joints, "gravity")
        return cls(rows, *each)

    @classmethod
    def in_any_orientation(
        cls, levers: ArrayLike, limits: ArrayLike, weights: ArrayLike
    ) -> "Motors":
        """Make motors that carry their links in every orientation of the hand.

        A hand that turns with its object has the torques g = w_j.d in joint j, with the direction d
        of gravity. As |w_j.d| <= |w_j|, forces with |L f| <= c_j - |w_j| are allowed in all
        orientations: these lower limits are those of the motors, and their gravity is zero. Where
        the object's own torque opposes that of the links, they give away up to twice |w_j|, and
        nothing where both load the joint alike. Forces that are chosen anew for each orientation
        hold at most (c_j + |w_j|) / (c_j - |w_j|) times as much as under them, for the worst joint.

        Args:
            levers: Transposed Jacobian of the contact points, (joints, 3k) [m], object axes.
            limits: Largest torque of each joint, one for all or one each [N m].
            weights: Torque of each joint that carries the weight of the links, per unit vector of
                the direction of gravity, (joints, 3) [N m], object axes.

        Raises:
            InputError: Shapes or ranges are wrong, or a motor cannot carry the links somewhere.
        """
        strong = cls.of(levers, limits)
        shape = (len(strong.limits), 3)
        carried = np.linalg.norm(frozen(weights, shape, "weights"), axis=1)
        left = strong.limits - carried
        weak = np.flatnonzero(left < SMALLEST)
        if weak.size:
            joint = int(weak[0])
            raise InputError(
                f"weights of joint {joint} ask for {carried[joint]:.6g} N m in some orientation, "
                f"but its limit is {strong.limits[joint]:.6g} N m: the hand cannot carry its own "
                "links there; give larger limits"
            )
        return cls(strong.levers, left, np.zeros(len(left)))

    def are_for(self, contacts: int) -> bool:
        """Return whether the levers are those of so many contacts."""
        return self.levers.shape[1] == 3 * contacts

    def torques(self, forces: Array) -> Array:
        """Compute the joint torques (1) under contact forces (k, 3) [N], (joints,)."""
        return self.levers @ forces.ravel() + self.gravity

    def relaxed(self, multipliers: Array) -> float:
        """Compute the right side of (2) for multipliers of the joints, (joints,)."""
        return float(np.abs(multipliers) @ self.limits - multipliers @ self.gravity)


def motors_for(motors: Motors | None, contacts: int) -> Motors:
    """Check that motors are those of so many contacts; None gives a hand without joints."""
    if motors is None:
        return Motors(np.zeros((0, 3 * contacts)), np.zeros(0), np.zeros(0))
    # a certificate's check takes them from anywhere
    motors = replace(instance(motors, Motors, "motors", "gc.Motors.of makes one"))
    if not motors.are_for(contacts):
        raise InputError(
            f"motors must have levers with three columns for each of {contacts} contacts, "
            f"{3 * contacts} in all, got an array of shape {motors.levers.shape}"
        )
    return motors
