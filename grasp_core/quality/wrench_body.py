"""How large a wrench contacts resist: the largest multiple of a given one, proved on both sides.

With each normal force at most f_max, the wrenches that the contacts can apply form a convex
body W around the origin. An external wrench w is resisted up to

    the largest lambda  with  -lambda w in W,                                           (1)

a conic program. Its dual is a facet of W: a twist y with

    y.w = -1  and  lambda = h(y) = f_max sum_i max(0, s_i(y)),                          (2)

the support of W (s_i as in `force_closure`). `weakest_wrench` steps along such facets to the wrench
of unit size that is hardest to resist. No such wrench has a limit below f_max times the `linf`
quality of the contacts (see `ferrari_canny`), which is the bound over all directions.

Where motors hold the fingertips, the torques of their joints are limited too: rows of (1) that are
linear in the forces. With a multiplier m for each joint, (2) of `motors` bounds

    h(y) <= f_max sum_i max(0, s_i(G'y - L'm)) + sum_j |m_j| c_j - m_j g_j              (3)

for every m, with equality for the multipliers of the program; s_i is the support of cone i in the
direction that contact i has in its argument.

Soft contacts also transmit a torque m about their normal. It enters as a fourth component of the
local force, u = m mu / mu_t [N] with the torsional coefficient mu_t, so that the cone is
|(f_t, u)| <= mu f_n and all of the above stays as it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen, frozen_copy
from grasp_core.by_value import ByValue
from grasp_core.checked import positive
from grasp_core.closure.contact_arrays import contact_arrays, contact_frictions
from grasp_core.closure.soft.contacts import LOCAL, contact_torsions, torsion_lengths
from grasp_core.closure.wrench_sets import WrenchSet, with_torques
from grasp_core.closure.wrenches import WRENCH, contact_frames, grasp_map, in_frames
from grasp_core.compiled import compiled
from grasp_core.errors import InputError
from grasp_core.fields import is_array, is_number
from grasp_core.quality.motors import Motors, motors_for
from grasp_core.solvers.conic import ConicProgram, minimize
from grasp_core.values import Contact, Grasp

KERNEL = "grasp_core.quality.wrench_limits_kernel"
CLOSE = 1e-7
"""Distance up to which two bounds of a limit count as one, relative to it."""
HALF = 0.5
"""Largest normal force from which the compiled code starts, in units of f_max."""
HELD = 1e-7
"""How far forces at a limit may leave cones and balance, relative to the largest wrench of a unit
normal force: the accuracy of conic programs."""
FACET_SLACK = 1e-9
"""Slack of the upper bound, relative to it, and of the facet's power, relative to the lengths of
its factors."""
MOST_OFF = 1e-6
"""Largest error of the facet's power, whatever the lengths of its factors: rounding takes less even
from facets that are a thousand million times as long as their wrench asks for."""
LAST_DIGITS = 1e-12
"""Slack of an upper bound near zero, relative to the largest that the facet's length allows."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WrenchLimit(ByValue):
    """The largest multiple of an external wrench that contacts resist, proved from both sides."""

    wrench: Array
    """External wrench (force, torque), (6,) [N, N m], torque about the stated centre."""
    limit: float
    """Largest multiple of `wrench` that is resisted; `forces` prove it by balancing that multiple.
    """
    upper: float
    """Multiple above which the wrench is not resisted: the support of `facet`, in plain arithmetic.
    """
    forces: Array
    """Contact forces that resist the wrench at the limit, (k, 3) [N]: in their cones, with normal
    parts up to the largest, and balanced, all to within `HELD`."""
    facet: Array
    """Twist y of the facet that limits the wrench, (6,), with y.wrench = -1, about the stated
    centre."""
    motor_multipliers: Array = field(default_factory=lambda: frozen_copy(np.zeros(0)))
    """Multipliers m of the joints in (3), (joints,) [1/(N m)]; none where no motors are given."""
    torques: Array | None = field(default=None, repr=False)
    """Torques about the inward normals that act with `forces`, (k,) [N m]; None without torsion."""

    def verify(  # noqa: PLR0913 - each is a quantity of its own
        self,
        positions: ArrayLike | Grasp | Sequence[Contact],
        normals: ArrayLike | None,
        friction: ArrayLike,
        *,
        max_normal_force: float,
        center: ArrayLike = (0.0, 0.0, 0.0),
        motors: Motors | None = None,
        torsion_m: ArrayLike = 0.0,
    ) -> bool:
        """Check both bounds again in plain arithmetic, for the contacts they refer to.

        Args:
            positions: Contact points or Grasp, as given to `wrench_limits`, (k, 3) [m].
            normals: Unit vectors into the object, (k, 3), or None with a Grasp or Contacts.
            friction: Coulomb coefficient, one for all contacts or one each.
            max_normal_force: Largest normal force of each contact [N].
            center: Point about which torques are taken, (3,) [m].
            motors: The motors that were given to `wrench_limits`.
            torsion_m: The torsional coefficients that were given to `wrench_limits`.

        Returns:
            Whether both bounds are proved; False if the fields are no certificate.

        Raises:
            InputError: The arguments do not describe contacts.
        """
        points, units = contact_arrays(positions, normals)
        about = frozen(center, (3,), "center")
        body = body_of(points - about, units, friction, max_normal_force, motors, torsion_m)
        with np.errstate(all="ignore"):
            soft = body.lengths is not None
            known = self.has_numbers(len(points), len(body.levers), soft=soft)
            return known and body.attains(self) and body.bounds(self)

    def has_numbers(self, count: int, joints: int = 0, *, soft: bool = False) -> bool:
        """Return whether fields are numbers of the right shapes, for `count` contacts."""
        return (
            is_array(self.wrench, WRENCH)
            and bool(self.wrench.any())
            and is_array(self.facet, WRENCH)
            and is_array(self.forces, count, 3)
            and is_array(self.motor_multipliers, joints)
            and self._has_torques(count, soft=soft)
            and is_number(self.limit, least=0.0)
            and is_number(self.upper)
            and self.limit <= self.upper
        )

    def _has_torques(self, count: int, *, soft: bool) -> bool:
        return is_array(self.torques, count) if soft else self.torques is None


def body_of(
    arms: Array, normals: Array, friction: ArrayLike, max_normal_force: float,
    motors: Motors | None, torsion_m: ArrayLike,
) -> "WrenchBody":  # fmt: skip
    """Make the body of contacts; arms (k, 3) [m] start at the centre of torques.

    Raises:
        InputError: The arguments do not describe contacts, or torsion is given with motors.
    """
    mu = contact_frictions(friction, len(arms))
    torsions = contact_torsions(torsion_m, mu)
    if torsions is not None and motors is not None:
        raise InputError(
            "torsion_m must be zero with motors: their levers have no column for the torque of a "
            "contact; leave one of the two out"
        )
    return WrenchBody(arms, normals, mu, max_normal_force, motors, torsions)


class WrenchBody:
    """The body of wrenches that contacts can apply with bounded normal forces and joint torques."""

    def __init__(
        self, arms: Array, normals: Array, friction: Array, max_normal_force: float,
        motors: Motors | None = None, torsions: Array | None = None,
    ) -> None:  # fmt: skip
        """Set up the conic program; its last column will hold the wrench in question.

        Args:
            arms: Contact points from the centre of torques, (k, 3) [m].
            normals: Unit vectors into the object, (k, 3).
            friction: Coulomb coefficients, (k,).
            max_normal_force: Largest normal force of each contact [N].
            motors: Joints that the forces load; None for none.
            torsions: Torsional coefficients, (k,) [m], without motors; None for hard fingers.

        Raises:
            InputError: The motors are not those of so many contacts.
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

    def limit(self, wrench: Array) -> WrenchLimit:
        """Find the largest multiple of an external wrench that is resisted, with its proof."""
        multiple, local, twist, multipliers = self.largest(wrench, np.zeros(len(self.levers)))
        limit = max(multiple, 0.0)
        return WrenchLimit(
            wrench=wrench,
            limit=limit,
            upper=max(limit, self._support(twist, multipliers)),
            forces=self.in_object_frame(local),
            facet=self.about_center(twist / self.scale),
            motor_multipliers=multipliers,
            torques=None
            if self.lengths is None
            else self.max_normal_force * self.lengths * local[:, 3],
        )

    def largest(self, wrench: Array, carried: Array) -> tuple[float, Array, Array, Array]:
        """Find the largest multiple of a wrench that is resisted while joints carry as many times.

        Args:
            wrench: External wrench, (6,).
            carried: Torques q that each joint has to add for one wrench, (joints,) [N m].

        Returns:
            The multiple; local forces over the largest normal force, (k, 3) or (k, 4); and a facet,
            a twist y that is scaled and about the contacts' mean, with multipliers m of the joints,
            so that m.q - y.w = 1 and no multiple above (3) is resisted.
        """
        unit = self._about_middle(wrench)
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
        multipliers = self.max_normal_force * (more - less) / (power * -self.motors.limits)
        local = answer.x[:-1].reshape(k, self.width)
        return share * float(answer.x[-1]), local, answer.z[:6] / power, multipliers

    def in_object_frame(self, local: Array) -> Array:
        """Turn local forces over the largest normal force, (k, 3) or (k, 4), to forces (k, 3)."""
        return self.max_normal_force * np.einsum("kij,kj->ki", self.frames, local[:, :3])

    def support(self, facet: Array, multipliers: Array) -> float:
        """Bound the support of the body by (3), for a twist about the centre, (6,)."""
        return self._support(self._scaled(facet), multipliers)

    def _support(self, twist: Array, multipliers: Array) -> float:
        """Bound the support of the body by (3), for a scaled twist about the contacts' mean."""
        slopes = twist @ self.G - multipliers @ self.levers
        pushed = self.max_normal_force * self.bounded.reach(slopes)[0]
        return pushed + self.motors.relaxed(multipliers)

    def attains(self, found: WrenchLimit) -> bool:
        """Return whether the forces are allowed and balance the limit's multiple of the wrench."""
        shares = self._shares(found)
        # what is left of (1) after adding the limit's multiple of the wrench
        left = self.G @ shares.ravel()
        left += found.limit / self.max_normal_force * self._about_middle(found.wrench)
        balanced = float(np.linalg.norm(left)) <= HELD * self.bounded.size
        allowed = self.bounded.holds(shares.ravel()[None], HELD * self.bounded.size)
        # rows of torques are met as all rows of the program are, by shares of the motors' limits
        torques = np.abs(self.motors.torques(found.forces)) / self.motors.limits
        return balanced and allowed and bool((torques <= 1.0 + HELD * self.strongest).all())

    def _shares(self, found: WrenchLimit) -> Array:
        """Return the local forces of a limit over the largest normal force, (k, 3) or (k, 4)."""
        shares = np.einsum("kij,ki->kj", self.frames, found.forces) / self.max_normal_force
        if self.lengths is None or found.torques is None:
            return shares
        arms, torques = self.lengths, found.torques / self.max_normal_force
        # a torque that a contact cannot transmit is in no cone
        lacking = np.where(torques == 0.0, 0.0, np.inf)
        turns = np.divide(torques, arms, out=lacking, where=arms > 0.0)
        return np.column_stack([shares, turns])

    @property
    def strongest(self) -> float:
        """Return how many times its limit a joint's torque is at most under unit pushes, or one."""
        shares = np.linalg.norm(self.levers.reshape(-1, 3), axis=1).max(initial=0.0)
        weakest = self.motors.limits.min(initial=np.inf)
        return max(1.0, self.max_normal_force * float(shares) / float(weakest))

    def bounds(self, found: WrenchLimit) -> bool:
        """Return whether the facet proves that no multiple above the upper one is resisted."""
        load, twist = self._about_middle(found.wrench), self._scaled(found.facet)
        power = float(twist @ load)
        lengths = float(np.linalg.norm(twist) * np.linalg.norm(load))
        # (3): h(y) is at most the upper limit, and y.w = -1, each but for rounding
        bound = self._support(twist, found.motor_multipliers)
        farthest = self.bounded.size * float(np.linalg.norm(twist))
        slack = LAST_DIGITS * self.max_normal_force * farthest
        bounded = bound <= found.upper * (1.0 + FACET_SLACK) + slack
        return bounded and abs(power + 1.0) <= min(FACET_SLACK * lengths, MOST_OFF)

    def limits(self, wrenches: Array, inside: Array) -> Array:
        """Find the largest multiple of each wrench that is resisted, (n,) (see `many_limits`)."""
        if len(self.levers) or self.lengths is not None:  # the compiled code knows neither
            return np.array([self.limit(wrench).limit for wrench in wrenches])
        local = np.einsum("kij,ki->kj", self.frames, inside)
        start = (HALF / local[:, 0].max() * local).ravel()
        units = np.array([self._about_middle(wrench) for wrench in wrenches])
        lengths = np.linalg.norm(units, axis=1)
        loads, found = units / lengths[:, None], np.empty(len(units))
        forces, facets = np.empty((len(units), len(start))), np.empty(units.shape)
        friction = self.bounded.friction
        kernel = compiled(KERNEL)
        contacts = kernel.Contacts(self.G, friction, start)
        kernel.limits(contacts, loads, found, forces, facets)
        upper = self.bounded.supports(facets) / -np.einsum("ij,ij->i", facets, loads)
        close = np.abs(upper - found) <= CLOSE * np.abs(upper)
        close &= np.abs(forces @ self.G.T + found[:, None] * loads).max(axis=1) <= CLOSE * upper
        normal, *across = forces.reshape(len(units), -1, 3).transpose(2, 0, 1)
        close &= (np.hypot(*across) <= friction * normal).all(axis=1) & (normal <= 1.0).all(axis=1)
        limits = self.max_normal_force / lengths * found
        for place in np.flatnonzero(~close):
            limits[place] = self.limit(wrenches[place]).limit
        return limits

    def _about_middle(self, wrench: Array) -> Array:
        """Move a wrench's reference point to the contacts' mean, and scale it to unit size."""
        moved = np.append(wrench[:3], wrench[3:] - _across(self.middle, wrench[:3]))
        return moved / self.scale

    def _scaled(self, facet: Array) -> Array:
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
