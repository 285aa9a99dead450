"""Torques of joints under a squeeze and loads, as rows that are linear in squeeze and scale.

The joints of a hand have the torques L f + g under contact forces f, stacked, which motors with the
limits c hold (see `motors`). Under the loads w0 + s E z, |z| <= 1, the forces along the axes of the
contacts are f + f0 + s C z, with f0 what the offset w0 adds to the squeeze f, and C what unit loads
add (see `grips`). The largest torque of joint j over the loads is that of the squeeze, plus s times
the length of row j of L C, so that all loads leave all joints within their limits if

    L f + s |L C| <= c - g - L f0,    -L f + s |L C| <= c + g + L f0,                     (1)

with |.| for the lengths of rows. Where w0 is not zero, the same is asked of the squeeze alone, with
f0 = C = 0. Rows are divided by the longest lever of their joint, so that they are forces.

L stays as it is at rest, along axes that turn with the object. The object moves by little against
the length of the links, and that share of the torques is left out.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import in_frames
from grasp_core.quality.motors import Motors

ROUNDING = 1e-9
"""How far a torque may exceed its limit by rounding, relative to the limit."""


@dataclass(frozen=True, eq=False)
class JointTorques:
    """Torques of the joints, over their longest levers, in groups: under the loads, and at rest."""

    levers: Array
    """Rows of L for forces in the contacts' frames, over the longest lever, (joints, 3k)."""
    limits: Array
    """Limits c, (joints,) [N]."""
    start: Array
    """What links and offset ask for in each group, g + L f0, (groups, joints) [N]."""
    change: Array
    """What the ellipsoid adds in each group, L C, (groups, joints, m) [N]."""

    @classmethod
    def of(cls, motors: Motors, frames: Array, offset: Array, change: Array) -> "JointTorques":
        """Take the joints of contacts with given responses.

        Takes `frames` (k, 3, 3); `offset` (groups k, 3) [N]; `change` (groups k, 3, m) [N].
        """
        k, joints = len(frames), len(motors.limits)
        groups = len(offset) // k
        local = in_frames(motors.levers, frames)
        arms = np.linalg.norm(local.reshape(joints, k, 3), axis=2).max(axis=1)
        arms = np.where(arms > 0.0, arms, 1.0)  # a joint that no contact loads
        levers = local / arms[:, None]
        start = motors.gravity / arms + offset.reshape(groups, 3 * k) @ levers.T
        stacked = change.reshape(groups, 3 * k, change.shape[2])
        return cls(levers, motors.limits / arms, start, levers @ stacked)

    @property
    def rows(self) -> int:
        """Number of rows (1)."""
        return 2 * self.start.size

    @cached_property
    def swing(self) -> Array:
        """How far each torque changes at scale one, |L C|, (groups, joints) [N]."""
        return np.linalg.norm(self.change, axis=2)

    def matrix(self) -> tuple[Array, Array, Array]:
        """Build the rows (1), R f + s c <= b, of all groups: R (rows, 3k), c (rows,), b (rows,)."""
        one_way = np.tile(self.levers, (len(self.start), 1))
        swing = self.swing.ravel()
        room = np.concatenate(
            [(self.limits - self.start).ravel(), (self.limits + self.start).ravel()]
        )
        return np.vstack([one_way, -one_way]), np.append(swing, swing), room

    def under(self, local: Array) -> Array:
        """Compute the torques in the middle of the loads, (groups, joints) [N].

        Takes `local` (k, 3) [N].
        """
        return self.start + self.levers @ local.ravel()

    def scales(self, local: Array) -> Array:
        """Find the scale at which each torque reaches its limit, (groups, joints)."""
        room, swing = self.limits - np.abs(self.under(local)), self.swing
        scales = np.where(swing > 0.0, room / np.where(swing > 0.0, swing, 1.0), np.inf)
        return np.where(room >= -ROUNDING * self.limits, scales, -np.inf)

    def shares(self, local: Array, scale: float) -> Array:
        """Compute the largest torques up to a scale of the loads, over their limits, (joints,)."""
        reached = np.abs(self.under(local)) + scale * self.swing
        return (reached / self.limits).max(axis=0)

    def holds(self, local: Array, scale: float) -> bool:
        """Return whether all torques stay within their limits up to a scale of the loads."""
        return bool((self.shares(local, scale) <= 1.0 + ROUNDING).all())

    def worst_of(self, joint: int, local: Array) -> Array:
        """Find the z, of unit length, whose load takes most torque of a joint, (m,)."""
        way = self.change[0, joint] / self.swing[0, joint]
        return way if self.under(local)[0, joint] >= 0.0 else -way

    def is_reached(self, joint: int, local: Array, place: Array) -> bool:
        """Return whether a load, scale times z as `place`, takes a joint to its limit."""
        torque = self.under(local)[0, joint] + self.change[0, joint] @ place
        return bool(abs(torque) >= self.limits[joint])


def torque_steps(torques: Array, rates: Array, limits: Array) -> Array:
    """Find the further multiple of a load at which each torque reaches its limit, (joints,).

    Takes `torques`, `limits` (joints,) [N m]; `rates` (joints,).
    """
    # a torque grows towards the limit of its own sign, or falls to that of the other
    left = np.maximum(limits - np.sign(rates) * torques, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(rates != 0.0, left / np.abs(rates), np.inf)


def torque_excess(torques: Array, rates: Array, limits: Array) -> float:
    """Find how much less load brings joints that are just beyond their limits back, or zero.

    Takes `torques`, `limits` (joints,) [N m]; `rates` (joints,).
    """
    growing = np.sign(torques) * rates
    with np.errstate(divide="ignore", invalid="ignore"):
        back = (np.abs(torques) - limits) / growing
    return float(np.max(np.where(growing > 0.0, back, 0.0), initial=0.0))
