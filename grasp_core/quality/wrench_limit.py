"""How large a multiple of a wrench contacts resist, proved on both sides.

Forces that balance the multiple prove that it is resisted, and a facet of the body of wrenches,
(2) and (3) of `wrench_body`, that no larger one is. `weakest_wrench` steps along such facets to the
wrench of unit size that is hardest to resist. No such wrench has a limit below f_max times the
`linf` quality of the contacts (see `ferrari_canny`), which is the bound over all directions.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen, frozen_copy, is_array, is_number
from grasp_core.by_value import ByValue
from grasp_core.closure.contact_arrays import contact_arrays, contact_frictions
from grasp_core.closure.soft.contacts import contact_torsions
from grasp_core.closure.wrenches import WRENCH
from grasp_core.errors import InputError
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_body import WrenchBody
from grasp_core.values import Contact, Grasp

HELD = 1e-7
"""How far forces at a limit may leave cones and balance, relative to the largest wrench of a unit
normal force: the accuracy of conic programs."""
FACET_SLACK = 1e-9
"""Slack of the upper bound, relative to it."""
LAST_DIGITS = 1e-12
"""Slack of an upper bound near zero, relative to the largest that the facet's length allows, and
`HELD` of the largest force at most, however long the facet is."""
MOST_OFF = 1e-6
"""Largest error of the facet's power."""
LONGEST = 1e8
"""Most that the lengths of facet and load, or of multipliers, levers and load, may be together:
rounding takes about `HELD` from factors that are longer."""


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
            soft = body.lengths is not None
            known = self.has_numbers(len(points), len(body.levers), soft=soft)
            return known and attains(body, self) and bounds(body, self)

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
    found = body.largest(wrench, np.zeros(len(body.levers)))
    limit = max(found.multiple, 0.0)
    return WrenchLimit(
        wrench=wrench,
        limit=limit,
        upper=max(limit, body.scaled_support(found.twist, found.multipliers)),
        forces=body.in_object_frame(found.local),
        facet=body.about_center(found.twist / body.scale),
        motor_multipliers=found.multipliers,
        torques=None
        if body.lengths is None
        else body.max_normal_force * body.lengths * found.local[:, 3],
    )


def attains(body: WrenchBody, found: WrenchLimit) -> bool:
    """Return whether the forces are allowed and balance the limit's multiple of the wrench."""
    shares = _shares(body, found).reshape(1, -1)
    load = found.limit / body.max_normal_force * body.about_middle(found.wrench)
    torques = body.motors.torques(found.forces)
    # rows of torques are met as all rows of the program are, by shares of the motors' limits
    balanced = body.holds(shares, load[None], HELD * body.bounded.size)
    return balanced and body.is_strong_enough(torques[None], HELD * np.maximum(1.0, body.strongest))


def _shares(body: WrenchBody, found: WrenchLimit) -> Array:
    """Return the local forces of a limit over the largest normal force, (k, 3) or (k, 4)."""
    shares = np.einsum("kij,ki->kj", body.frames, found.forces) / body.max_normal_force
    if body.lengths is None or found.torques is None:
        return shares
    arms, torques = body.lengths, found.torques / body.max_normal_force
    # a torque that a contact cannot transmit is in no cone
    lacking = np.where(torques == 0.0, 0.0, np.inf)
    turns = np.divide(torques, arms, out=lacking, where=arms > 0.0)
    return np.column_stack([shares, turns])


def bounds(body: WrenchBody, found: WrenchLimit) -> bool:
    """Return whether the facet proves that no multiple above the upper one is resisted."""
    load, twist = body.about_middle(found.wrench), body.scaled(found.facet)
    power, length = float(twist @ load), float(np.linalg.norm(load))
    if not (_are_short(body, found, length) and abs(power + 1.0) <= MOST_OFF):
        return False
    # (3): h(y) is at most the upper limit times -y.w, but for rounding
    bound = body.scaled_support(twist, found.motor_multipliers)
    largest = body.max_normal_force * body.bounded.size
    slack = largest * min(LAST_DIGITS * float(np.linalg.norm(twist)), HELD / length)
    return bound <= found.upper * min(1.0, -power) * (1.0 + FACET_SLACK) + slack


def _are_short(body: WrenchBody, found: WrenchLimit, load: float) -> bool:
    """Return whether facet and multipliers are short enough for rounding, given a load's length."""
    twist, middle = np.abs(found.facet * body.scale), float(np.linalg.norm(body.middle))
    moved = float(np.linalg.norm(twist) + np.linalg.norm(found.facet[3:]) * middle)
    pulled = float((np.abs(found.motor_multipliers) @ np.abs(body.levers)).max(initial=0.0))
    return (moved + pulled) * load <= LONGEST
