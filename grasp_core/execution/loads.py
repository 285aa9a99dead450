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

The load that makes contact i slip there is z = (B'u - mu a) / |B'u - mu a|. With R the numerator
and L the square of the denominator, a quadratic form in (mu, u), the derivative of (4) vanishes
where 2 R'L - R L' does, a trigonometric polynomial of degree three, so that (4) has at most three
minima. They are bracketed on a grid and met by Newton steps.

Whether (3) holds at a scale has a certificate, too. With n0 >= s |a|, (3) says that the quadratic
(mu n(z))^2 - |t(z)|^2 is not negative on the ball, which by the S-lemma (lossless for one
quadratic) holds if and only if some tau >= 0 makes

    mu^2 [n0, s a]'[n0, s a] - [t0, s B]'[t0, s B] - tau diag(1, -1, ..., -1)             (5)

positive semidefinite: a number per contact, and eigenvalues of a small matrix to check it. The
push of contact i stays between 0 and N where n0 - s |a| >= 0 and n0 + s |a| <= N.

Source of the S-lemma: Polik & Terlaky, "A survey of the S-lemma", SIAM Review (2007).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, Shape, frozen
from grasp_core.closure.contacts import WRENCH
from grasp_core.declared import Declared
from grasp_core.errors import InputError
from grasp_core.execution.grips import Grip
from grasp_core.kinds import LARGEST, SMALLEST, Quantity, number, value_of
from grasp_core.solvers.ties import first_best

GRAVITY_M_PER_S2 = 9.80665
"""Standard gravity."""
ANGLES = 96
"""Directions of the grid on which minima of (4) are bracketed."""
MINIMA = 3
"""Most minima of (4) over the circle."""
NEWTON_STEPS = 12
"""Each halves the bracket at least; from a good start four reach rounding."""
GOLDEN_STEPS = 70
"""Golden sections for a multiplier, each to 0.62 of the interval: down to rounding."""
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
ROUNDING = 1e-12
"""Least eigenvalue of (5) that counts as none, relative to its largest entry: a thousand times
what rounding leaves. Forces near the tip of a cone may leave it by its root, a millionth."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
    most = number(acceleration_m_per_s2, "acceleration_m_per_s2", least=0.0, most=LARGEST)
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

    @cached_property
    def _form(self) -> Array:
        """L of (4) as a quadratic form in (mu, u), (k, 3, 3)."""
        return self.change @ self.change.transpose(0, 2, 1)

    def room(self, angles: Array) -> Array:
        """Compute mu n0 - u.t0 of (3) at angles of each contact, (k, g) [N]."""
        n, t = self.start[:, 0, None], self.start[:, 1:]
        across = np.cos(angles) * t[:, :1] + np.sin(angles) * t[:, 1:]
        return self.friction[:, None] * n - across

    def scales(self, angles: Array) -> Array:
        """Compute the scales of (4) at angles of each contact, (k, g)."""
        room, L = self.room(angles), self._length(angles)[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            found = room / np.sqrt(L)
        return np.where(L > 0.0, found, np.where(room >= 0.0, np.inf, -np.inf))

    def worst_angles(self) -> tuple[Array, Array]:
        """Find an angle of the least scale (4) of each contact, (k,), by `ties`, and that scale."""
        k, step = len(self.friction), 2.0 * np.pi / ANGLES
        grid = np.tile(np.linspace(0.0, 2.0 * np.pi, ANGLES, endpoint=False), (k, 1))
        values = self.scales(grid)
        lowest = values <= np.minimum(np.roll(values, 1, axis=1), np.roll(values, -1, axis=1))
        order = np.argsort(np.where(lowest, values, np.inf), axis=1, kind="stable")[:, :MINIMA]
        starts = np.take_along_axis(grid, order, axis=1)
        # the worst where nothing changes
        across = np.arctan2(self.start[:, 2:], self.start[:, 1:2])
        angles = np.hstack([across, self._polished(starts, step), starts])
        found = self.scales(angles)
        chosen = [first_best(-row) for row in found]
        return angles[np.arange(k), chosen], found.min(axis=1)

    def worst_of(self, contact: int, angle: float) -> Array:
        """Find the z at which a contact slips first in a direction, of unit length, (m,)."""
        weights = np.array([-self.friction[contact], np.cos(angle), np.sin(angle)])
        leaning = weights @ self.change[contact]  # B'u - mu a of (3)
        return leaning / (float(np.linalg.norm(leaning)) or 1.0)

    def survives(self, scale: float, multipliers: Array) -> bool:
        """Return whether multipliers tau, (k,) [N^2], prove by (5) that no contact slips."""
        M, ball = self._certificates(scale)
        pressed = self.start[:, 0] >= scale * self.swing * (1.0 - ROUNDING)
        least = np.linalg.eigvalsh(M - multipliers[:, None, None] * ball)[:, 0]
        allowed = ROUNDING * np.abs(M).max(axis=(1, 2))
        return bool((pressed & (multipliers >= 0.0) & (least >= -allowed)).all())

    def multipliers(self, scale: float) -> Array:
        """Find tau for `survives`, (k,) [N^2]: those with the largest least eigenvalue of (5)."""
        M, ball = self._certificates(scale)
        low, high = np.zeros(len(M)), np.maximum(M[:, 0, 0], 0.0)
        for _ in range(GOLDEN_STEPS):
            inner = np.stack([high - GOLDEN * (high - low), low + GOLDEN * (high - low)])
            left, right = np.linalg.eigvalsh(M - inner[..., None, None] * ball)[..., 0]
            low, high = np.where(left < right, (inner[0], high), (low, inner[1]))
        return 0.5 * (low + high)

    def _certificates(self, scale: float) -> tuple[Array, Array]:
        rows = np.concatenate([self.start[:, :, None], scale * self.change], axis=2)
        normal, across = rows[:, 0], rows[:, 1:]
        inside = self.friction[:, None, None] ** 2 * normal[:, :, None] * normal[:, None]
        ball = np.diag(np.append(1.0, -np.ones(rows.shape[2] - 1)))
        return inside - across.transpose(0, 2, 1) @ across, ball

    def _length(self, angles: Array) -> tuple[Array, Array, Array]:
        """Compute L of (4) and its two derivatives at angles of each contact, (k, g) each."""
        Q, mu = self._form[:, None], self.friction[:, None]
        c, s = np.cos(angles), np.sin(angles)
        mean, half = 0.5 * (Q[..., 1, 1] + Q[..., 2, 2]), 0.5 * (Q[..., 1, 1] - Q[..., 2, 2])
        c2, s2 = c * c - s * s, 2.0 * c * s
        twist, p, q = Q[..., 1, 2], -2.0 * mu * Q[..., 0, 1], -2.0 * mu * Q[..., 0, 2]
        L = mu**2 * Q[..., 0, 0] + mean + half * c2 + twist * s2 + p * c + q * s
        first = 2.0 * (twist * c2 - half * s2) - p * s + q * c
        second = -4.0 * (half * c2 + twist * s2) - p * c - q * s
        return np.maximum(L, 0.0), first, second

    def _polished(self, angles: Array, step: float) -> Array:
        """Improve angles that are within a step of minima of (4), by bracketed Newton steps."""
        low, high = angles - step, angles + step
        slack = self.friction[:, None] * self.start[:, :1]
        for _ in range(NEWTON_STEPS):
            R = self.room(angles)
            quarter = self.room(angles + 0.5 * np.pi)
            R1, R2 = quarter - slack, slack - R
            L, L1, L2 = self._length(angles)
            slope, bend = 2.0 * R1 * L - R * L1, 2.0 * R2 * L + R1 * L1 - R * L2
            high, low = np.where(slope > 0.0, angles, high), np.where(slope > 0.0, low, angles)
            with np.errstate(divide="ignore", invalid="ignore"):
                newton = angles - slope / bend
            inside = (newton >= low) & (newton <= high)  # nor if it is not a number
            angles = np.where(inside, newton, 0.5 * (low + high))
        return angles
