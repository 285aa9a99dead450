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
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.allowed_values import NotNegative
from grasp_core.arrays import Amount, Array, Indices, ProofNumber, Shape, of_order_one
from grasp_core.closure.contacts import WRENCH, grasp_map, in_frames
from grasp_core.declared import Declared, declared, trusted
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import LoadSet, Reactions
from grasp_core.quality.motors import Motors, motors_for

PROOF_SLACK = 1e-9
"""Slack of pushes, of torques and of the upper bound, relative to them."""
FILED_SLACK = 1e-6
"""Slack of pushes and torques of a squeeze that is read from a file, relative to their limits."""
FIRST_ANGLES = 8
"""Tangent directions of each case in the first program."""
BOUNDING = 1e-6
"""Least c.y of (4), relative to |c| |y|, that bounds the scale."""
SLIP_NEAR = 1e-5
"""Share by which a load larger than the worst makes a contact slip, or a joint reach its torque."""
NO_SCALE = 1e-9
"""Scale that is none, in pushes over the change of contact forces at scale one."""


@declared
class Cuts(Declared):
    """Angles and cases of some rows (1)."""

    angles: Annotated[Array, Shape("r")]
    """Angles of the tangent directions in their contacts' frames, (r,) [rad]."""
    cases: Annotated[Indices, Shape("r", whole=True)]  # index of each row's case, (r,)

    @classmethod
    def first(cls, count: int) -> "Cuts":
        """Return evenly spread rows of each of `count` cases."""
        angles = np.tile(np.linspace(0.0, 2.0 * np.pi, FIRST_ANGLES, endpoint=False), count)
        return cls(angles, np.repeat(np.arange(count), FIRST_ANGLES))


@dataclass(frozen=True, eq=False)
class SlipRows:
    """Rows R f + start + s |way| <= most + N d in local squeezes f (3k,), scale s, push limit N.

    They are rows (1), then both of (2) for all cases, then (3) in one direction and in the other,
    each for all joints under the loads, and at rest.
    """

    R: Array  # (rows, 3k)
    start: Array  # what offset and links add, (rows,) [N]
    way: Array  # what the ellipsoid adds for each of its axes, (rows, m) [N]
    most: Array  # limits that are known: those of joints, else zero, (rows,) [N]
    d: Array  # one where the row is a limit on a push, else zero, (rows,)

    @cached_property
    def c(self) -> Array:
        """What loads of scale one take, (rows,) [N]."""
        return np.linalg.norm(self.way, axis=1)

    @property
    def b(self) -> Array:
        """What offset and links leave, (rows,) [N]."""
        return self.most - self.start

    @property
    def limited(self) -> NDArray[np.bool_]:
        """Which rows are limits on pushes from above, and on torques, (rows,)."""
        return self.d + self.most > 0.0

    def limits(self, max_push_n: float) -> Array:
        """Return what each row may reach, (rows,) [N]."""
        return self.most + max_push_n * self.d

    def reached(self, local: Array, scale: float = 0.0) -> Array:
        """Return the most that each row reaches under a squeeze up to a scale, (rows,) [N]."""
        return self.R @ local.ravel() + self.start + scale * self.c

    def scales(self, local: Array, max_push_n: float) -> Array:
        """Find the scale at which each row reaches its limit under a squeeze, (rows,)."""
        limits, taken = self.limits(max_push_n), self.c
        room = limits - self.reached(local)
        scales = np.where(taken > 0.0, room / np.where(taken > 0.0, taken, 1.0), np.inf)
        return np.where(room >= -PROOF_SLACK * limits, scales, -np.inf)

    def worst_of(self, row: int) -> Array:
        """Find the z, of unit length, whose load takes most of a row, (m,)."""
        return self.way[row] / self.c[row]


@dataclass(frozen=True, slots=True, eq=False)
class Survival:
    """What contacts with a given response ask of a squeeze under a set of loads."""

    G: Array
    """Matrix from local squeezes to wrenches, torques over the grip's size, (6, 3k)."""
    offset: Array
    """Forces (n0, t0) that the offset adds in each case, (cases, 3) [N]."""
    change: Array  # the rows (a, B) of each case, (cases, 3, m) [N]
    friction: Array  # Coulomb coefficient of each case, (cases,)
    motors: Motors
    """Joints behind the contacts, for forces in the contacts' frames, over their longest levers."""

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
        levers = in_frames(joints.levers, grip.frames)
        longest = np.linalg.norm(levers.reshape(-1, len(grip.arms), 3), axis=2).max(axis=1)
        longest = np.where(longest > 0.0, longest, 1.0)  # a joint that no contact loads
        scaled = trusted(
            Motors, levers=levers / longest[:, None], limits=joints.limits / longest,
            gravity=joints.gravity / longest,
        )  # fmt: skip
        return cls(G, offset, change, mu, scaled)

    @property
    def contacts(self) -> int:
        """Number of contacts."""
        return self.G.shape[1] // 3

    @property
    def groups(self) -> int:
        """Number of groups of cases: under the loads, and at rest where they have an offset."""
        return len(self.friction) // self.contacts

    @property
    def torque_rows(self) -> int:
        """Number of rows (3)."""
        return 2 * self.groups * len(self.motors.limits)

    def torques(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return those of rows (3), (2, groups, joints), of values of all rows, (rows,)."""
        return values[len(values) - self.torque_rows :].reshape(2, self.groups, -1)

    def reactions(self, local: Array) -> Reactions:
        """Compute the forces of all cases with a squeeze in the contacts' frames, (k, 3) [N]."""
        return Reactions(np.tile(local, (self.groups, 1)) + self.offset, self.change, self.friction)

    def rows(self, cuts: Cuts) -> SlipRows:
        """Build the rows (1) at some angles, and all of (2) and (3)."""
        r, count, k = len(cuts.cases), len(self.friction), self.contacts
        squeezes = np.tile(np.eye(3 * k).reshape(k, 3, 3 * k), (self.groups, 1, 1))
        links, none = np.tile(self.motors.gravity, self.groups), np.zeros(r + 2 * count)
        limits = np.tile(self.motors.limits, 2 * self.groups)
        limited = np.zeros(r + 2 * count + len(limits))
        limited[r : r + count] = 1.0
        return SlipRows(
            self._sums(cuts, squeezes),
            self._sums(cuts, self.offset[:, :, None])[:, 0] + np.concatenate([none, links, -links]),
            self._sums(cuts, self.change), np.append(none, limits), limited,
        )  # fmt: skip

    def _sums(self, cuts: Cuts, forces: Array) -> Array:
        """Compute what rows ask of forces in all cases, (cases, 3, m), without links, (rows, m)."""
        sides = np.cos(cuts.angles), np.sin(cuts.angles)
        v = np.stack([-self.friction[cuts.cases], *sides], axis=1)
        cones, pushes = np.einsum("rj,rjm->rm", v, forces[cuts.cases]), forces[:, 0]
        stacked = forces.reshape(self.groups, -1, forces.shape[2])
        torques = (self.motors.levers @ stacked).reshape(-1, forces.shape[2])
        return np.concatenate([cones, pushes, -pushes, torques, -torques])

    def bound(self, rows: SlipRows, multipliers: Array, balance: Array, max_push_n: float) -> float:
        """Bound by (4) the scale that any squeeze with this response survives; infinite if none."""
        # multipliers of any length mean the same
        multipliers, balance = of_order_one(multipliers, balance)
        taken = float(rows.c @ multipliers)
        if not taken > BOUNDING * float(np.linalg.norm(rows.c) * np.linalg.norm(multipliers)):
            return np.inf
        left = (rows.R.T @ multipliers + self.G.T @ balance).reshape(-1, 3)
        longest = max_push_n * np.sqrt(1.0 + self.friction[: self.contacts] ** 2)
        slack = float(np.linalg.norm(left, axis=1) @ longest)
        return (float(rows.b @ multipliers + max_push_n * rows.d @ multipliers) + slack) / taken


@declared
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
    upper: ProofNumber
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
        reached = survival.rows(self.cuts).reached(self.grip.local_squeeze, self.scale)
        return (survival.torques(reached) / survival.motors.limits).max(axis=(0, 1))

    def verify(self) -> bool:
        """Re-check every field in plain arithmetic; False if they are no certificate.

        The check is that the squeeze is stable and balances, to a millionth of its forces, that
        S-lemma multipliers, pushes and torques prove the scale once the object has moved into exact
        balance, that the worst load is one, and that the multipliers of rows prove the upper bound.
        Whether the contacts are those of an object can only be checked with it, and whether the
        joints are those of a hand only with the hand.
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
        if not self._fits(survival):
            return False
        rows = survival.rows(self.cuts)
        upper = survival.bound(rows, self.multipliers, self.balance, self.max_push_n)
        return (
            self._survives(survival, rows)
            and self._ends(survival, rows)
            and upper <= self.upper * (1.0 + PROOF_SLACK)
        )

    def _fits(self, survival: Survival) -> bool:
        cases, r = len(survival.friction), len(self.cuts.cases)
        # a contact or a joint, and not both
        if self.joint == -1:
            named = 0 <= self.contact < survival.contacts
        else:
            named = self.contact == -1 and 0 <= self.joint < len(survival.motors.limits)
        return (
            r > 0
            and bool((self.cuts.cases < cases).all())
            and len(self.multipliers) == r + 2 * cases + survival.torque_rows
            and bool((self.multipliers >= 0.0).all())
            and len(self.proofs) == cases
            and named
            and len(self.direction) == self.loads.axes.shape[1]
            and abs(float(np.linalg.norm(self.direction)) - 1.0) <= PROOF_SLACK
        )

    def _survives(self, survival: Survival, rows: SlipRows) -> bool:
        local = self.grip.settled
        most = rows.limits(self.max_push_n) * (1.0 + PROOF_SLACK)
        within = (rows.reached(local, self.scale) <= most)[rows.limited]
        # the S-lemma proves all else: cones, and pushes from below
        return bool(within.all()) and survival.reactions(local).survives(self.scale, self.proofs)

    def _ends(self, survival: Survival, rows: SlipRows) -> bool:
        further = self.scale * (1.0 + SLIP_NEAR) + no_scale(survival, self.max_push_n)
        if self.joint >= 0:
            under = rows.reached(self.grip.settled) + rows.way @ (further * self.direction)
            beyond = survival.torques(under) >= survival.motors.limits
            return bool(beyond[:, 0, self.joint].any())
        reactions = survival.reactions(self.grip.settled)
        start, change = reactions.start[self.contact], reactions.change[self.contact]
        normal, *across = (start + further * change @ self.direction).tolist()
        slipping = float(np.hypot(*across)) >= reactions.friction[self.contact] * normal
        return bool(slipping or normal >= self.max_push_n)


def survives(
    held: Grip, loads: LoadSet, scale: float, max_push_n: float, motors: Motors | None = None
) -> bool:
    """Return whether it is proved that a squeeze survives loads up to a scale (see `BestSqueeze`).

    Pushes and torques may exceed their limits by a millionth, as numbers of files are rounded.
    """
    survival, local = Survival.of(held, loads, motors), held.local_squeeze
    rows = survival.rows(Cuts.first(len(survival.friction)))
    within = rows.reached(local, scale) <= rows.limits(max_push_n) * (1.0 + FILED_SLACK)
    reactions = survival.reactions(local)
    proofs = reactions.multipliers(scale)
    return bool(within[rows.limited].all()) and reactions.survives(scale, proofs)


def no_scale(survival: Survival, max_push_n: float) -> float:
    """Return the scale that is none, a share of what changes a force by the largest push."""
    largest = float(np.linalg.norm(survival.change, axis=(1, 2)).max())
    return NO_SCALE * max_push_n / largest if largest > 0.0 else 0.0
