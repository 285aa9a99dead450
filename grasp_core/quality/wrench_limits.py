"""How large a multiple of a wrench contacts resist, proved on both sides.

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

Forces that balance the multiple prove that it is resisted, see `allowed_forces`, and a facet, (2)
and (3), that no larger one is: rounding of its support and power is added to the upper bound. No
wrench of unit size has a limit below f_max times the `linf` quality of the contacts (see
`ferrari_canny`), which is the bound over all directions.

The weakest wrench. The wrench -y / |y| meets a limiting facet squarely, so

    limit of -y / |y|  <=  h(y) / |y|:                                                  (4)

stepping from a wrench to the one its limiting facet points at never raises the limit, and stops
at a wrench that is locally the weakest. Without motors the direction of the `linf` quality is a
start that no other wrench beats by more than the quality's gap; with motors, which that direction
does not know, the weakest axes are starts as well. Torques are compared with forces through a
stated length.
"""

from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, SMALLEST, Quantity, value_of
from grasp_core.arrays import Amount, Array, Points, ProofNumber, Shape, Wrench, cross, frozen
from grasp_core.closure.contacts import (
    LOCAL,
    WRENCH,
    contact_arrays,
    contact_frames,
    contact_frictions,
    contact_torsions,
    in_frames,
    to_center,
    to_origin,
    torsion_lengths,
    unit_size,
)
from grasp_core.closure.proofs import ContactCones
from grasp_core.closure.wrench_sets import WrenchSet, contact_program
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, SolverError
from grasp_core.quality.allowed_forces import SUM_ROUNDING, AllowedForces, AskedLoad, Mixture
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.quality.motors import Motors, motors_for
from grasp_core.solvers.conic import minimize
from grasp_core.solvers.ties import first_best, smallest_first
from grasp_core.values import Contact, Grasp

MOST_OFF = 1e-6
"""Largest error of the facet's power."""
LEAST_GAIN = 1e-3
"""The search for the weakest wrench ends when a step lowers the limit by less than this share."""
MAX_STEPS = 30
SEARCH_STARTS = 3
"""How many of the weakest axis wrenches the search starts from, where there are motors."""
WEAKEST_GAP = 0.01
"""Gap of the quality whose direction the search for the weakest wrench starts from."""


class Farthest(NamedTuple):
    """How large a multiple of a wrench is resisted, by the program (1), and what limits it."""

    multiple: float
    """Negative, if at all, by rounding."""
    local: Array
    """Contact forces that resist it, in the contacts' frames, (k, w), over the largest push."""
    facet: Array
    """Twist y of the limiting facet about the centre, (6,)."""
    multipliers: Array
    """Multipliers m of the joints, (joints,) [1/(N m)]."""


class WrenchBody:
    """The body of wrenches that contacts can apply, and the program for its farthest points."""

    def __init__(
        self, arms: Array, normals: Array, friction: Array, max_normal_force: float,
        motors: Motors | None = None, torsions: Array | None = None,
    ) -> None:  # fmt: skip
        """Set up the conic program; its last column will hold the wrench in question."""
        self.max_normal_force = value_of(Quantity, max_normal_force, "max_normal_force")
        self.count = k = len(arms)
        self.motors = motors_for(motors, k)
        # at the contacts' own middle and at unit size all numbers are of order one
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        units, self.middle, size = unit_size(arms)  # a far centre would swamp the levers
        self.size = float(size)
        self.scale = np.array([1.0] * 3 + [self.size] * 3)
        self.frames = contact_frames(normals)
        self.lengths = None if torsions is None else torsion_lengths(torsions, friction)
        torsion = None if torsions is None else torsions / size
        cones = ContactCones.at(units, normals, friction, torsion)
        self.bounded, self.width = WrenchSet.within(cones, "linf"), cones.width
        self.G, levers = self.bounded.G, in_frames(self.motors.levers, self.frames)
        self.levers = levers if torsions is None else np.zeros((0, LOCAL * k))
        # (1) in units of f_max: G f + lambda w = 0, then 0 <= normal parts <= 1, then the torques
        # of each joint over its limit, both ways
        n, carried = self.width * k, self.motors.gravity / self.motors.limits
        forces, multiple = np.eye(n, n + 1), np.eye(n + 1)[n]
        shares = self.max_normal_force * (self.levers @ forces) / self.motors.limits[:, None]
        pushes = forces[:: self.width]
        self.allowed = AllowedForces(
            self.G, friction, cones.sliding, shares[:, :n], carried,
            1.0 + float(np.linalg.norm(self.middle)) / self.size,
        )  # fmt: skip
        self.program = contact_program(
            -multiple, friction, self.width, [(self.G @ forces, 0.0)],
            [(pushes, 1.0), (-pushes, 0.0), (shares, 1.0 - carried), (-shares, 1.0 + carried)],
        )  # fmt: skip

    def largest(self, wrench: Array, carried: Array) -> Farthest:
        """Find the largest multiple of a wrench that is resisted while joints carry as many times.

        With `carried` q, (joints,) [N m], the facet has m.q - y.w = 1, so that no multiple above
        (3) is resisted.
        """
        unit = self.about_middle(wrench)
        length = float(np.linalg.norm(unit))
        A = self.program.A.copy()
        k, joints = self.count, len(self.levers)
        # a wrench of unit length keeps lambda of order one; it is scaled back below
        A[:6, -1] = unit / length
        share = self.max_normal_force / length
        torques = self.program.zeros + 2 * k + np.arange(2 * joints)
        asked = carried / self.motors.limits
        A[torques, -1] = share * np.concatenate([asked, -asked])
        answer = minimize(replace(self.program, A=A))
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
        facet = to_origin(answer.z[:6] / power, self.middle, self.size)
        return Farthest(share * float(answer.x[-1]), local, facet, multipliers)

    def in_space(self, local: Array) -> tuple[Array, Array | None]:
        """Return forces (k, 3) [N], and torques about the normals (k,) [N m] with torsion."""
        local = self.max_normal_force * local
        forces = np.einsum("kij,kj->ki", self.frames, local[:, :3])
        return forces, None if self.lengths is None else self.lengths * local[:, 3]

    def in_frames(self, forces: Array, torques: Array | None) -> Array:
        """Return forces and torques in the contacts' frames, (k, w), over the largest push."""
        local = np.einsum("kij,ki->kj", self.frames, forces) / self.max_normal_force
        if self.lengths is None or torques is None:
            return local
        turns = torques / self.max_normal_force
        # a torque that a contact cannot transmit is in no cone
        lacking = np.where(turns == 0.0, 0.0, np.inf)
        turns = np.divide(turns, self.lengths, out=lacking, where=self.lengths > 0.0)
        return np.column_stack([local, turns])

    def support(self, facet: Array, multipliers: Array) -> float:
        """Bound the support of the body by (3), for a twist about the centre, (6,)."""
        twist = to_center(facet, self.middle, self.size)
        slopes = twist @ self.G - multipliers @ self.levers
        pushed = self.max_normal_force * self.bounded.reach(slopes)[0]
        return pushed + self.motors.relaxed(multipliers)

    def lost(self, facet: Array, multipliers: Array) -> float:
        """Return how much of the support (3) may be lost to rounding."""
        twist, sizes = np.abs(facet * self.scale), np.abs(multipliers)
        twist[:3] += np.linalg.norm(facet[3:]) * np.linalg.norm(self.middle)
        terms = float((twist @ np.abs(self.G) + sizes @ np.abs(self.levers)).sum())
        pushed = self.max_normal_force * (1.0 + float(self.bounded.friction.max())) * terms
        return SUM_ROUNDING * (pushed + float(sizes @ self.motors.limits))

    def bound(
        self, wrench: Array, facet: Array, multipliers: Array, rounding: float = 1.0
    ) -> float:
        """Return the multiple of a wrench that is not exceeded, by (3); infinite without power."""
        power = -float(facet @ wrench) - rounding * SUM_ROUNDING * float(
            np.abs(facet) @ np.abs(wrench)
        )
        support = self.support(facet, multipliers) + rounding * self.lost(facet, multipliers)
        return max(support, 0.0) / power if power > 0.0 else np.inf

    def load(self, wrench: Array, carried: Array) -> AskedLoad:
        """Return a wrench and the torques [N m] that joints carry with it, (joints,), as a load."""
        force, torque = np.linalg.norm(wrench.reshape(2, 3), axis=1).tolist()
        moved = (torque + 2.0 * float(np.linalg.norm(self.middle)) * force) / self.size
        unit = self.about_middle(wrench) / self.max_normal_force
        return AskedLoad(
            unit, carried / self.motors.limits, (force + moved) / self.max_normal_force
        )

    def settled(self, found: Farthest, wrench: Array, carried: Array) -> Mixture:
        """Find the multiple of a wrench next to the largest that local forces prove."""
        load = self.load(wrench, carried)
        size = float(np.linalg.norm(load.wrench))
        start = Mixture(found.local, found.multiple * size)
        forces, multiple = self.allowed.settled(start, load.times(1.0 / size))
        return Mixture(forces, multiple / size)

    def pushed(self, torque_scale: float) -> WrenchSet:
        """Return the wrenches of unit pushes about the centre, with torques over a scale [m]."""
        G = self.G * self.scale[:, None]
        G[3:] = (G[3:] + cross(self.middle, G[:3].T).T) / torque_scale
        return replace(self.bounded, G=G)

    def about_middle(self, wrench: Array) -> Array:
        """Move wrenches' reference point to the contacts' mean, and scale to unit size, (.., 6)."""
        force, torque = wrench[..., :3], wrench[..., 3:]
        moved = np.concatenate([force, torque - cross(self.middle, force)], axis=-1)
        return moved / self.scale


@declared
class WrenchLimit(Declared):
    """The largest multiple of an external wrench that contacts resist, proved from both sides."""

    wrench: Wrench
    """External wrench (force, torque), (6,) [N, N m], torque about the stated centre."""
    limit: Amount
    """Largest multiple of `wrench` that is resisted; `forces` prove it by balancing that multiple.
    """
    upper: ProofNumber
    """Multiple above which the wrench is not resisted: the support of `facet`, in plain arithmetic,
    and its rounding."""
    forces: Points
    """Contact forces that resist the wrench at the limit, (k, 3) [N]: in their cones, with normal
    parts up to the largest, and so near balance that forces exactly in balance are there, too."""
    facet: Annotated[Array, Shape(WRENCH)]
    """Twist y of the facet that limits the wrench, (6,), with y.wrench = -1, about the stated
    centre."""
    motor_multipliers: Annotated[Array, Shape(None)] = field(default_factory=lambda: np.zeros(0))
    """Multipliers m of the joints in (3), (joints,) [1/(N m)]; none where no motors are given."""
    torques: Annotated[Array, Shape("k")] | None = field(default=None, repr=False)
    """Torques about the inward normals that act with `forces`, (k,) [N m]; None without torsion."""

    def verify(
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
            return self.holds_for(body)

    def holds_for(self, body: WrenchBody) -> bool:
        """Return whether the fields prove both bounds for the contacts of a body."""
        soft = body.lengths is not None
        return (
            self.is_sound()
            and bool(self.wrench.any())
            and len(self.forces) == body.count
            and len(self.motor_multipliers) == len(body.levers)
            and (self.torques is not None) == soft
            and self.limit <= self.upper
            and attains(body, self)
            and bounds(body, self)
        )


def body_of(
    arms: Array, normals: Array, friction: ArrayLike, max_normal_force: float,
    motors: Motors | None, torsion_m: ArrayLike,
) -> WrenchBody:  # fmt: skip
    """Make the body of contacts; arms (k, 3) [m] start at the centre of torques."""
    mu = contact_frictions(friction, len(arms))
    torsions = contact_torsions(torsion_m, mu)
    if torsions is not None and motors is not None:
        raise InputError(
            "torsion_m must be zero with motors: their levers have no column for the torque of a "
            "contact; leave one of the two out"
        )
    return WrenchBody(arms, normals, mu, max_normal_force, motors, torsions)


def limit_of(body: WrenchBody, wrench: Array) -> WrenchLimit:
    """Find the largest multiple of an external wrench, (6,), that a body holds, with its proof."""
    nothing = np.zeros(len(body.levers))
    found = body.largest(wrench, nothing)
    upper = body.bound(wrench, found.facet, found.multipliers, rounding=2.0)
    if not upper < np.inf:
        raise SolverError(
            "the facet that limits a wrench is too long for its power to be known, so that it "
            "bounds nothing"
        )
    local, limit = body.settled(found, wrench, nothing)
    forces, torques = body.in_space(local)
    return WrenchLimit(
        wrench, limit, max(limit, upper), forces, found.facet, found.multipliers, torques
    )


def attains(body: WrenchBody, found: WrenchLimit) -> bool:
    """Return whether the forces prove that the limit's multiple of the wrench is resisted."""
    load = body.load(found.wrench, np.zeros(len(body.levers))).times(found.limit)
    return body.allowed.balance(body.in_frames(found.forces, found.torques), load)


def bounds(body: WrenchBody, found: WrenchLimit) -> bool:
    """Return whether the facet proves that no multiple above the upper one is resisted."""
    if not abs(float(found.facet @ found.wrench) + 1.0) <= MOST_OFF:
        return False
    return body.bound(found.wrench, found.facet, found.motor_multipliers) <= found.upper


def wrench_limits(
    positions: ArrayLike | Grasp | Sequence[Contact],
    normals: ArrayLike | None,
    friction: ArrayLike,
    wrenches: ArrayLike,
    *,
    max_normal_force: float,
    center: ArrayLike = (0.0, 0.0, 0.0),
    motors: Motors | None = None,
    torsion_m: ArrayLike = 0.0,
) -> tuple[WrenchLimit, ...]:
    """Find the largest multiple of each wrench that contacts resist, with forces and a bound.

    The weakest of the limits is `min(limits, key=lambda found: found.limit)`.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp or Contacts, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each.
        wrenches: External (force, torque), (n, 6) [N, N m], torque about `center`.
        max_normal_force: Largest normal force of each contact [N].
        center: Point about which torques are taken, (3,) [m].
        motors: Joints that the contact forces load, with the torques of their motors; None for
            fingers that are as strong as `max_normal_force` says.
        torsion_m: Torsional coefficient, one for all contacts or one each, (k,) [m]; zero is a hard
            finger. With motors it must be zero.

    Raises:
        InputError: Shapes or limits are wrong, or a wrench is zero.
        SolverError: A program's answer failed its check.
    """
    points, units = contact_arrays(positions, normals)
    loads = frozen(wrenches, (None, 6), "wrenches")
    sizes = np.abs(loads).max(axis=1)
    # every multiple of zero is resisted
    if len(loads) and not SMALLEST <= float(sizes.min()) <= float(sizes.max()) <= LARGEST:
        wrong = sizes[(sizes < SMALLEST) | (sizes > LARGEST)][0]
        raise InputError(
            f"wrenches must not be zero nor huge: each needs a largest component from {SMALLEST:g} "
            f"to {LARGEST:g}, got {float(wrong):.6g}"
        )
    about = frozen(center, (3,), "center")
    body = body_of(points - about, units, friction, max_normal_force, motors, torsion_m)
    return tuple(limit_of(body, load) for load in loads)


def axis_wrenches(torque_scale: float) -> Array:
    """Return the twelve unit wrenches along and against each axis, (12, 6) [N, N m]."""
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    return np.vstack([np.eye(6), -np.eye(6)]) * scale


def weakest_from(
    body: WrenchBody, limits: Iterable[WrenchLimit], torque_scale: float
) -> WrenchLimit:
    """Search for the weakest wrench with |(force, torque / torque_scale)| = 1.

    Takes the limits of other such wrenches, from the weakest of which the search starts, too.
    """
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    # on a grid, so that of equally weak wrenches every machine starts from the same one
    quality = wrench_set_quality(body.pushed(torque_scale).on_grid(), WEAKEST_GAP)
    starts, ends = [limit_of(body, -quality.direction * scale)], list[WrenchLimit]()
    if len(body.levers):
        every = list(limits)
        starts += [
            every[at] for at in smallest_first([each.limit for each in every])[:SEARCH_STARTS]
        ]
    for best in starts:
        for _ in range(MAX_STEPS):
            # (4): the wrench that the limiting facet points at, by the scaled product of wrenches
            facing = -best.facet * scale**2
            found = limit_of(body, facing / float(np.linalg.norm(facing / scale)))
            if found.limit > best.limit * (1.0 - LEAST_GAIN):
                break
            best = found
        ends.append(best)
    return ends[first_best([-found.limit for found in ends])]
