"""Sets of loads that a grip must survive, and the worst of each for every contact.

A set has an offset, and every direction of an ellipsoid about it,

    w = w0 + scale E z,   |z| <= 1                                                        (1)

with wrenches (force, torque about the centre of mass), along the world's axes. The weight of an
object in any orientation is the ball of forces of radius m g; an acceleration a in any direction
beside it makes the radius m (g + a); an upright object that is shaken has the offset -m g e_z.

In the linear model contact i keeps its cone under all loads w0 + s E z if for every tangent
direction u (a unit vector in the plane, angle phi) and every z its force along the contact's axes,
of normal part n0 + s a.z and tangential part t0 + s B z with (a, B) the rows of A_i E, has

    u.(t0 + s B z) <= mu (n0 + s a.z).                                                    (2)

The worst z for a direction u is known, so (2) is a condition on the angle phi alone:

    u.t0 + s |B'u - mu a| <= mu n0    for all phi,                                        (3)

and the largest scale up to which no load makes contact i slip is a minimum over one angle:

    s_i = min over phi of (mu n0 - u.t0) / |B'u - mu a|.                                  (4)

The load that makes contact i slip there is z = (B'u - mu a) / |B'u - mu a|.

Whether (3) holds at a scale has a certificate, too. With n0 >= s |a|, (3) says that the quadratic
(mu n(z))^2 - |t(z)|^2 is not negative on the ball, which by the S-lemma (lossless for one
quadratic) holds if and only if some tau >= 0 makes

    mu^2 [n0, s a]'[n0, s a] - [t0, s B]'[t0, s B] - tau diag(1, -1, ..., -1)             (5)

positive semidefinite: a number per contact, and eigenvalues of a small matrix to check it. The
push of contact i stays between 0 and N where n0 - s |a| >= 0 and n0 + s |a| <= N.

With R the numerator and L the square of the denominator of (4), a quadratic form in (-mu, u), the
derivative of (4) vanishes where 2 R'L - R L' does. In powers of e = exp(i phi), with coefficients
r_j of R and l_j of L, that is i times

    sum_m p_m e^m,   p_m = sum_j (3 j - m) r_j l_(m - j),   p_-m = -conj(p_m),            (6)

of degree two only, as p_3 = 0. So (4) has at most two minima, at angles of roots of a quartic.

Source of the S-lemma: Polik & Terlaky, "A survey of the S-lemma", SIAM Review (2007).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, SMALLEST, Quantity, number, value_of
from grasp_core.arrays import Array, Shape, frozen
from grasp_core.closure.contacts import WRENCH
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.execution.grips import Grip
from grasp_core.solvers.ties import first_best

GRAVITY_M_PER_S2 = 9.80665
VANISHING = 1e-9
"""Size of the first coefficient of (6), relative to the largest, that takes the place of a smaller
one: roots move by as much, and (4) by its square."""
FIRST_ANGLE = -0.1
"""Where angles are counted from, far from those of symmetric grasps [rad]."""
MULTIPLIER_HALVINGS = 50
"""Halvings of the interval of a multiplier, down to rounding."""
EIGENVALUE_SLACK = 1e-12
"""Least eigenvalue of (5) that counts as none, relative to its largest entry: a thousand times
what rounding leaves. Forces near the tip of a cone may leave it by its root, a millionth."""


@declared
class LoadSet(Declared):
    """Loads offset + E z with |z| <= 1, the torques about the centre of mass."""

    offset: Annotated[Array, Shape(WRENCH, least=-LARGEST, most=LARGEST)]
    """Load in the middle, (6,) [N, N m]."""
    axes: Annotated[Array, Shape(WRENCH, None, least=-LARGEST, most=LARGEST)]
    """Columns E of the ellipsoid, (6, m) [N, N m]."""

    def _check_together(self) -> None:
        axes = self.axes
        if not 1 <= axes.shape[1] <= WRENCH:
            raise InputError(f"axes must have 1 to {WRENCH} columns, got {axes.shape[1]}")
        if float(np.abs(axes).max()) < SMALLEST:
            raise InputError(
                f"axes must not be zero: the largest entry is from {SMALLEST:g} to {LARGEST:g}, "
                f"got {float(np.abs(axes).max()):.3g}"
            )


def any_direction(
    mass_kg: float, acceleration_m_per_s2: float = 0.0, *, gravity: ArrayLike | None = None
) -> LoadSet:
    """Make the loads of an object's weight and of accelerations of the palm in every direction.

    Args:
        mass_kg: Mass of the object [kg].
        acceleration_m_per_s2: Largest acceleration of the palm, in any direction [m/s^2].
        gravity: Gravity in the palm's frame, (3,) [m/s^2], where the palm does not turn; None for
            gravity in any direction.

    Raises:
        InputError: A number is out of range, or there is nothing that has any direction.
    """
    mass = value_of(Quantity, mass_kg, "mass_kg")
    most = number(acceleration_m_per_s2, "acceleration_m_per_s2", ge=0.0, le=LARGEST)
    offset, axes = np.zeros(WRENCH), np.zeros((WRENCH, 3))
    if gravity is None:
        axes[:3] = mass * (GRAVITY_M_PER_S2 + most) * np.eye(3)
        return LoadSet(offset, axes)
    if most == 0.0:
        raise InputError(
            "acceleration_m_per_s2 must be above zero where the direction of gravity is given; "
            "leave gravity out for gravity in any direction"
        )
    offset[:3] = mass * frozen(gravity, (3,), "gravity", most=LARGEST)
    axes[:3] = mass * most * np.eye(3)
    return LoadSet(offset, axes)


@dataclass(frozen=True, eq=False)
class Reactions:
    """Contact forces under w0 + s E z, in the contacts' frames: start + s change z."""

    start: Array
    """Forces (normal, tangent, tangent) under the offset w0, (k, 3) [N]."""
    change: Array
    """Their change over the ellipsoid, the rows (a, B) of each contact, (k, 3, m) [N]."""
    friction: Array  # Coulomb coefficients, (k,)

    @classmethod
    def of(cls, grip: Grip, loads: LoadSet) -> "Reactions":
        """Compute the forces of a grip under a set of loads, in the linear model."""
        A = grip.response
        return cls(grip.local_squeeze + A @ loads.offset, A @ loads.axes, grip.friction)

    @cached_property
    def swing(self) -> Array:
        """How far each push changes at scale one, |a|, (k,) [N]."""
        return np.linalg.norm(self.change[:, 0], axis=1)

    def scales(self, angles: Array) -> Array:
        """Compute the scales of (4) at angles of each contact, (k, g)."""
        mu = np.broadcast_to(self.friction[:, None], angles.shape)
        weights = np.stack([-mu, np.cos(angles), np.sin(angles)], axis=2)
        room = -np.einsum("kgi,ki->kg", weights, self.start)
        length = np.linalg.norm(weights @ self.change, axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = room / length
        return np.where(length > 0.0, found, np.where(room >= 0.0, np.inf, -np.inf))

    def worst_angles(self) -> tuple[Array, Array]:
        """Find an angle of the least scale (4) of each contact, (k,), by `ties`, and that scale."""
        # the worst where nothing changes
        across = np.arctan2(self.start[:, 2:], self.start[:, 1:2])
        angles = np.hstack([across, self._level_angles()])
        found = self.scales(angles)
        chosen = [first_best(-row) for row in found]
        return angles[np.arange(len(angles)), chosen], found.min(axis=1)

    def _level_angles(self) -> Array:
        """Find the angles of the roots of (6), ascending, (k, 4)."""
        k, form = len(self.friction), self.change @ self.change.transpose(0, 2, 1)
        # (-mu, u) is the middle, plus e times the turning part, plus the conjugate of that
        middle, turning = np.outer(-self.friction, np.eye(3)[0]), np.array([0.0, 0.5, -0.5j])
        r0, r1 = self.friction * self.start[:, 0], -self.start @ turning
        l0 = np.einsum("ki,kij,kj->k", middle, form, middle)
        l0 = l0 + 2.0 * (turning @ form @ turning.conj()).real
        l1 = 2.0 * np.einsum("ki,kij,j->k", middle, form, turning)
        l2 = turning @ form @ turning
        p2, p1 = r1 * l1 - 2.0 * r0 * l2, 2.0 * r1 * l0 - r0 * l1 - 4.0 * r1.conj() * l2
        p0 = 6j * (r1 * l1.conj()).imag
        sizes = np.abs([p2, p1, p0]).max(axis=0)
        least = VANISHING * np.where(sizes > 0.0, sizes, 1.0)
        leading = np.where(np.abs(p2) > least, p2, least)
        companion = np.tile(np.eye(4, k=-1, dtype=complex), (k, 1, 1))
        companion[:, 0] = -np.stack([p1, p0, -p1.conj(), -p2.conj()], axis=1) / leading[:, None]
        angles = np.asarray(np.angle(np.linalg.eigvals(companion)), dtype=np.float64)
        return np.sort((angles - FIRST_ANGLE) % (2.0 * np.pi), axis=1) + FIRST_ANGLE

    def worst_of(self, contact: int, angle: float) -> Array:
        """Find the z at which a contact slips first in a direction, of unit length, (m,)."""
        weights = np.array([-self.friction[contact], np.cos(angle), np.sin(angle)])
        leaning = weights @ self.change[contact]  # B'u - mu a of (3)
        return leaning / (float(np.linalg.norm(leaning)) or 1.0)

    def survives(self, scale: float, multipliers: Array) -> bool:
        """Return whether multipliers tau, (k,) [N^2], prove by (5) that no contact slips."""
        M, ball = self._certificates(scale)
        pressed = self.start[:, 0] >= scale * self.swing * (1.0 - EIGENVALUE_SLACK)
        least = np.linalg.eigvalsh(M - multipliers[:, None, None] * ball)[:, 0]
        allowed = EIGENVALUE_SLACK * np.abs(M).max(axis=(1, 2))
        return bool((pressed & (multipliers >= 0.0) & (least >= -allowed)).all())

    def multipliers(self, scale: float) -> Array:
        """Find tau for `survives`, (k,) [N^2]: those with the largest least eigenvalue of (5)."""
        M, ball = self._certificates(scale)
        low, high = np.zeros(len(M)), np.maximum(M[:, 0, 0], 0.0)
        for _ in range(MULTIPLIER_HALVINGS):
            middle = 0.5 * (low + high)
            # the least eigenvalue changes by minus its vector's form of the ball
            least = np.linalg.eigh(M - middle[:, None, None] * ball)[1][..., 0]
            rising = np.einsum("ki,ij,kj->k", least, ball, least) < 0.0
            low, high = np.where(rising, (middle, high), (low, middle))
        return 0.5 * (low + high)

    def _certificates(self, scale: float) -> tuple[Array, Array]:
        rows = np.concatenate([self.start[:, :, None], scale * self.change], axis=2)
        normal, across = rows[:, 0], rows[:, 1:]
        inside = self.friction[:, None, None] ** 2 * normal[:, :, None] * normal[:, None]
        ball = np.diag(np.append(1.0, -np.ones(rows.shape[2] - 1)))
        return inside - across.transpose(0, 2, 1) @ across, ball
