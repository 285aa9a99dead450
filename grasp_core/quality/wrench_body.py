"""The wrenches that contacts can apply with bounded normal forces and joint torques.

With each normal force at most f_max, the wrenches that the contacts can apply form a convex
body W around the origin. An external wrench w is resisted up to

    the largest lambda  with  -lambda w in W,                                           (1)

a conic program. Its dual is a facet of W: a twist y with

    y.w = -1  and  lambda = h(y) = f_max sum_i max(0, s_i(y)),                          (2)

the support of W (s_i as in `force_closure`).

Where motors hold the fingertips, the torques of their joints are limited too: rows of (1) that are
linear in the forces. With a multiplier m for each joint, (2) of `motors` bounds

    h(y) <= f_max sum_i max(0, s_i(G'y - L'm)) + sum_j |m_j| c_j - m_j g_j              (3)

for every m, with equality for the multipliers of the program; s_i is the support of cone i in the
direction that contact i has in its argument.

Soft contacts also transmit a torque m about their normal. It enters as a fourth component of the
local force, u = m mu / mu_t [N] with the torsional coefficient mu_t, so that the cone is
|(f_t, u)| <= mu f_n and all of the above stays as it is.
"""

from typing import NamedTuple

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import positive
from grasp_core.closure.soft.contacts import LOCAL, torsion_lengths
from grasp_core.closure.wrench_sets import WrenchSet, with_torques
from grasp_core.closure.wrenches import WRENCH, contact_frames, grasp_map, in_frames
from grasp_core.errors import SolverError
from grasp_core.quality.motors import Motors, motors_for
from grasp_core.solvers.conic import ConicProgram, minimize


class Farthest(NamedTuple):
    """How large a multiple of a wrench is resisted, by the program (1), and what limits it."""

    multiple: float
    """Largest multiple that is resisted; it may be negative by rounding."""
    local: Array
    """Local forces over the largest normal force that resist it, (k, 3) or (k, 4)."""
    twist: Array
    """Twist y of the limiting facet, scaled and about the contacts' mean, (6,)."""
    multipliers: Array
    """Multipliers m of the joints that go with it, (joints,) [1/(N m)]."""


class WrenchBody:
    """The body of wrenches that contacts can apply, and the program for its farthest points."""

    def __init__(
        self, arms: Array, normals: Array, friction: Array, max_normal_force: float,
        motors: Motors | None = None, torsions: Array | None = None,
    ) -> None:  # fmt: skip
        """Set up the conic program; its last column will hold the wrench in question.

        Takes `arms` (k, 3) [m]; `normals` (k, 3); `friction` (k,); `max_normal_force` [N];
        `torsions` (k,) [m].
        """
        self.max_normal_force = positive(max_normal_force, "max_normal_force")
        self.count = k = len(arms)
        self.motors = motors_for(motors, k)
        # at the contacts' own middle and at unit size all numbers are of order one
        self.middle = arms.mean(axis=0)  # a far centre would swamp the levers
        arms = arms - self.middle
        self.size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
        self.scale = np.array([1.0] * 3 + [self.size] * 3)
        self.frames = contact_frames(normals)
        hard = in_frames(grasp_map(arms / self.size), self.frames)
        self.lengths = lengths = None if torsions is None else torsion_lengths(torsions, friction)
        self.G = hard if lengths is None else with_torques(hard, normals, lengths / self.size)
        self.bounded = WrenchSet(self.G, friction, "linf")
        self.width = LOCAL if torsions is not None else 3
        levers = in_frames(self.motors.levers, self.frames)
        self.levers = levers if torsions is None else np.zeros((0, LOCAL * k))
        self.A, self.b = self._rows(friction)

    def _rows(self, friction: Array) -> tuple[Array, Array]:
        """Build the rows of (1) in units of f_max.

        They are G f + lambda w = 0, then 0 <= normal parts <= 1, then the torques of each joint
        over its limit, both ways, then the cones.
        """
        k, joints, width = self.count, len(self.levers), self.width
        n = width * k
        A = np.zeros((WRENCH + 2 * k + 2 * joints + n, n + 1))
        A[:WRENCH, :-1] = self.G
        caps, torques = WRENCH + np.arange(2 * k), WRENCH + 2 * k + np.arange(2 * joints)
        cones = WRENCH + 2 * k + 2 * joints + np.arange(n)
        A[caps, np.tile(np.arange(0, n, width), 2)] = np.repeat([1.0, -1.0], k)
        shares = self.max_normal_force * self.levers / self.motors.limits[:, None]
        A[torques, :-1] = np.vstack([shares, -shares])
        A[cones, np.arange(n)] = -1.0
        A[cones[::width], np.arange(0, n, width)] = -friction
        carried = self.motors.gravity / self.motors.limits
        b = [np.zeros(6), np.ones(k), np.zeros(k), 1.0 - carried, 1.0 + carried, np.zeros(n)]
        return A, np.concatenate(b)

    def largest(self, wrench: Array, carried: Array) -> Farthest:
        """Find the largest multiple of a wrench that is resisted while joints carry as many times.

        Takes `wrench` (6,); `carried` (joints,) [N m]. Gives the multiple, and a facet with m.q -
        y.w = 1, so that none above (3) is resisted.
        """
        unit = self.about_middle(wrench)
        length = float(np.linalg.norm(unit))
        A = self.A.copy()
        k, joints = self.count, len(self.levers)
        # a wrench of unit length keeps lambda of order one; it is scaled back below
        A[:6, -1] = unit / length
        share = self.max_normal_force / length
        torques = 6 + 2 * k + np.arange(2 * joints)
        asked = carried / self.motors.limits
        A[torques, -1] = share * np.concatenate([asked, -asked])
        q = np.zeros(A.shape[1])
        q[-1] = -1.0
        answer = minimize(ConicProgram(q, A, self.b, 6, 2 * (k + joints), (self.width,) * k))
        # the equations' multipliers, scaled to (2), and those of the torques alike
        more, less = answer.z[torques].reshape(2, joints)
        power = -float(answer.z[:6] @ unit) - self.max_normal_force * float((more - less) @ asked)
        # exact multipliers have the power -|w|: the last column of A times them is one
        if not power < 0.0:
            raise SolverError(
                "the program for the largest multiple of a wrench has multipliers without power "
                f"against it ({power:.3g}), so that they bound nothing"
            )
        multipliers = self.max_normal_force * (more - less) / (power * -self.motors.limits)
        local = answer.x[:-1].reshape(k, self.width)
        return Farthest(share * float(answer.x[-1]), local, answer.z[:6] / power, multipliers)

    def in_object_frame(self, local: Array) -> Array:
        """Turn local forces over the largest normal force, (k, 3) or (k, 4), to forces (k, 3)."""
        return self.max_normal_force * np.einsum("kij,kj->ki", self.frames, local[:, :3])

    def support(self, facet: Array, multipliers: Array) -> float:
        """Bound the support of the body by (3), for a twist about the centre, (6,)."""
        return self.scaled_support(self.scaled(facet), multipliers)

    def scaled_support(self, twist: Array, multipliers: Array) -> float:
        """Bound the support of the body by (3), for a scaled twist about the contacts' mean."""
        slopes = twist @ self.G - multipliers @ self.levers
        pushed = self.max_normal_force * self.bounded.reach(slopes)[0]
        return pushed + self.motors.relaxed(multipliers)

    def holds(self, shares: Array, loads: Array, slack: float | Array) -> bool:
        """Return whether forces are in their cones, no larger than allowed, and balance loads.

        Takes `shares` (n, 3k) or (n, 4k); `loads` (n, 6); `slack` (n,).
        """
        left = np.linalg.norm(shares @ self.G.T + loads, axis=1)
        return bool((left <= slack).all()) and self.bounded.holds(shares, slack)

    def is_strong_enough(self, torques: Array, slack: float | Array) -> bool:
        """Return whether motors have torques, (n, joints) [N m], to a slack over their limits."""
        return bool((np.abs(torques) / self.motors.limits <= 1.0 + slack).all())

    @property
    def strongest(self) -> Array:
        """Return how many times its limit each joint's torque is at most under one push, (j,)."""
        each = self.levers.reshape(len(self.levers), self.count, 3)
        longest = np.linalg.norm(each, axis=2).max(axis=1)
        return self.max_normal_force * longest / self.motors.limits

    def about_middle(self, wrench: Array) -> Array:
        """Move a wrench's reference point to the contacts' mean, and scale it to unit size."""
        moved = np.append(wrench[:3], wrench[3:] - _across(self.middle, wrench[:3]))
        return moved / self.scale

    def scaled(self, facet: Array) -> Array:
        """Move a facet about the centre to a scaled twist about the contacts' mean."""
        twist = facet * self.scale
        twist[:3] += _across(facet[3:], self.middle)
        return twist

    def about_center(self, facet: Array) -> Array:
        """Move a facet about the contacts' mean to the centre, (6,)."""
        slides = _across(facet[3:], self.middle)
        return np.concatenate([facet[:3] - slides, facet[3:]])


def _across(one: Array, two: Array) -> Array:
    """Return the cross product of two vectors, (3,): NumPy's takes ten times as long for one."""
    a, b, c = one.tolist()
    x, y, z = two.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])
