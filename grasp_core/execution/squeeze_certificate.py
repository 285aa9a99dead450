"""A squeeze with both sides of a proof: what it survives, and what no other squeeze survives.

A multiplier for each contact shows by the S-lemma that the squeeze survives all loads of a set, (5)
of `loads`. Torques of joints are sums and lengths. What squeezes survive is in rows that are linear
in squeeze, scale and push limit, whose multipliers bound what any squeeze with this response
survives.

With the response of `grips` given, contact i keeps its cone under all loads w0 + s E z if, by (3)
of `loads`, for all angles of a tangent direction u

    u.t_i - mu n_i + s |B_i'u - mu a_i| <= mu n0_i - u.t0_i,                              (1)

where (n_i, t_i) is the squeeze and (n0_i, t0_i) what the offset w0 adds to it. Its push stays
between 0 and N if

    n_i + s |a_i| <= N - n0_i,    -n_i + s |a_i| <= n0_i.                                 (2)

Where w0 is not zero, the same is asked of the squeeze alone: at rest nothing slips either. These
are further *cases*, with a = B = 0 and no offset. Squeezes balance, G f = 0.

The joints of a hand have the torques L f + g under contact forces f, stacked, which motors with the
limits c hold (see `motors`). Under the loads the forces along the axes of the contacts are f + f0 +
s C z, with f0 what the offset w0 adds, and C what unit loads add. The largest torque of joint j
over the loads is that of the squeeze, plus s times the length of row j of L C, so that all loads
leave all joints within their limits if, with |.| for the lengths of rows,

    L f + s |L C| <= c - g - L f0,    -L f + s |L C| <= c + g + L f0.                     (3)

Where w0 is not zero, the same is asked at rest, with f0 = C = 0. Rows are divided by the longest
lever of their joint, so that they are forces. L stays as it is at rest, along axes that turn with
the object. The object moves by little against the length of the links, and that share of the
torques is left out.

Multipliers y >= 0 of some rows (1), of (2) and of (3), and z of the balance, combine the rows R f +
s c <= b + N d. If R'y + G'z = r, then for every squeeze that survives the scale s

    s c.y <= b.y + N d.y - r.f,    |f_i| <= N sqrt(1 + mu_i^2),                           (4)

which bounds s where c.y > 0. The residual r is zero but for rounding.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from grasp_core.arrays import Amount, Array, Figure, Indices, Shape, of_order_one
from grasp_core.closure.contacts import WRENCH, grasp_map, in_frames
from grasp_core.declared import Declared
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import LoadSet, Reactions
from grasp_core.kinds import NotNegative
from grasp_core.quality.motors import Motors, motors_for

ROUNDING = 1e-9
"""Slack of pushes, of torques and of the upper bound, relative to them."""
STARTS = 8
"""Tangent directions of each case in the first program."""
BOUNDING = 1e-6
"""Least c.y of (4), relative to |c| |y|, that bounds the scale."""
NEAR = 1e-5
"""Share by which a load larger than the worst makes a contact slip, or a joint reach its torque."""
NONE = 1e-9
"""Scale that is none, in pushes over the change of contact forces at scale one."""


@dataclass(frozen=True, eq=False)
class JointTorques:
    """Torques of the joints, over their longest levers, in groups: under the loads, and at rest."""

    levers: Array
    """Rows of L for forces in the contacts' frames, over the longest lever, (joints, 3k)."""
    limits: Array  # limits c, (joints,) [N]
    start: Array
    """What links and offset ask for in each group, g + L f0, (groups, joints) [N]."""
    change: Array
    """What the ellipsoid adds in each group, L C, (groups, joints, m) [N]."""

    @classmethod
    def of(cls, motors: Motors, frames: Array, offset: Array, change: Array) -> "JointTorques":
        """Take the joints of contacts with frames (k, 3, 3) and the responses of all groups."""
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
        """Number of rows (3)."""
        return 2 * self.start.size

    @cached_property
    def swing(self) -> Array:
        """How far each torque changes at scale one, |L C|, (groups, joints) [N]."""
        return np.linalg.norm(self.change, axis=2)

    def matrix(self) -> tuple[Array, Array, Array]:
        """Build the rows (3), R f + s c <= b, of all groups: R (rows, 3k), c (rows,), b (rows,)."""
        one_way = np.tile(self.levers, (len(self.start), 1))
        swing = self.swing.ravel()
        room = np.append(self.limits - self.start, self.limits + self.start)
        return np.vstack([one_way, -one_way]), np.append(swing, swing), room

    def under(self, local: Array) -> Array:
        """Compute the torques in the middle of the loads, (groups, joints) [N]."""
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Cuts(Declared):
    """Angles and cases of some rows (1)."""

    angles: Annotated[Array, Shape("r")]
    """Angles of the tangent directions in their contacts' frames, (r,) [rad]."""
    cases: Annotated[Indices, Shape("r", whole=True)]  # index of each row's case, (r,)

    @classmethod
    def first(cls, count: int) -> "Cuts":
        """Return evenly spread rows of each of `count` cases."""
        angles = np.tile(np.linspace(0.0, 2.0 * np.pi, STARTS, endpoint=False), count)
        return cls(angles, np.repeat(np.arange(count), STARTS))


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows R f + s c <= b + N d in local squeezes f (3k,), scale s and push limit N."""

    R: Array
    """(rows, 3k): rows (1), then both of (2) for all cases, then both of (3) for all joints."""
    c: Array  # what loads of scale one take, (rows,) [N]
    b: Array  # what the offset leaves, (rows,) [N]
    d: Array  # one where the row is a limit on a push, else zero, (rows,)


@dataclass(frozen=True, slots=True, eq=False)
class Survival:
    """What contacts with a given response ask of a squeeze under a set of loads."""

    G: Array
    """Matrix from local squeezes to wrenches, torques over the grip's size, (6, 3k)."""
    offset: Array
    """Forces (n0, t0) that the offset adds in each case, (cases, 3) [N]."""
    change: Array  # the rows (a, B) of each case, (cases, 3, m) [N]
    friction: Array  # Coulomb coefficient of each case, (cases,)
    joints: JointTorques
    """Torques of the joints, in a group for the cases under the loads, and one for those at rest.
    """

    @classmethod
    def of(cls, grip: Grip, loads: LoadSet, motors: Motors | None = None) -> "Survival":
        """Take the response of a grip at its squeeze."""
        joints = motors_for(motors, len(grip.friction))
        A, mu = grip.response, grip.friction
        offset, change = A @ loads.offset, A @ loads.axes
        if loads.offset.any():
            offset = np.concatenate([offset, np.zeros_like(offset)])
            change = np.concatenate([change, np.zeros_like(change)])
            mu = np.concatenate([mu, mu])
        G = in_frames(grasp_map(grip.arms / grip.size), grip.frames)
        torques = JointTorques.of(joints, grip.frames, offset, change)
        return cls(G, offset, change, mu, torques)

    @property
    def contacts(self) -> int:
        """Number of contacts."""
        return self.G.shape[1] // 3

    def reactions(self, local: Array) -> Reactions:
        """Compute the forces of all cases with a squeeze in the contacts' frames, (k, 3) [N]."""
        cases = len(self.friction) // self.contacts
        return Reactions(np.tile(local, (cases, 1)) + self.offset, self.change, self.friction)

    def rows(self, cuts: Cuts) -> Rows:
        """Build the rows (1) at some angles, and all of (2) and (3)."""
        i, k, count = cuts.cases, self.contacts, len(self.friction)
        r, mu = len(i), self.friction[cuts.cases]
        levers, taken, room = self.joints.matrix()
        u = np.stack([np.cos(cuts.angles), np.sin(cuts.angles)], axis=1)
        R = np.zeros((r + 2 * count, 3 * k))
        R[np.arange(r), 3 * (i % k)] = -mu
        R[np.arange(r), 3 * (i % k) + 1], R[np.arange(r), 3 * (i % k) + 2] = u.T
        normal = 3 * (np.arange(count) % k)
        R[r + np.arange(count), normal] = 1.0
        R[r + count + np.arange(count), normal] = -1.0
        nothing = Reactions(self.offset, self.change, self.friction)
        lean = np.linalg.norm(nothing.leaning(i, cuts.angles), axis=1)
        n0, t0 = self.offset[:, 0], self.offset[:, 1:]
        left = mu * n0[i] - np.einsum("rj,rj->r", u, t0[i])
        limits = np.zeros(len(R) + len(room))
        limits[r : r + count] = 1.0
        return Rows(
            np.vstack([R, levers]), np.concatenate([lean, nothing.swing, nothing.swing, taken]),
            np.concatenate([left, -n0, n0, room]), limits,
        )  # fmt: skip

    def bound(self, cuts: Cuts, multipliers: Array, balance: Array, max_push_n: float) -> float:
        """Bound by (4) the scale that any squeeze with this response survives; infinite if none."""
        rows = self.rows(cuts)
        # multipliers of any length mean the same
        multipliers, balance = of_order_one(multipliers, balance)
        taken = float(rows.c @ multipliers)
        if not taken > BOUNDING * float(np.linalg.norm(rows.c) * np.linalg.norm(multipliers)):
            return np.inf
        left = (rows.R.T @ multipliers + self.G.T @ balance).reshape(-1, 3)
        longest = max_push_n * np.sqrt(1.0 + self.friction[: self.contacts] ** 2)
        slack = float(np.linalg.norm(left, axis=1) @ longest)
        return (float(rows.b @ multipliers + max_push_n * rows.d @ multipliers) + slack) / taken


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
