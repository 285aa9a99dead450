"""How much a grasp resists: the largest multiple of a wrench, and the weakest wrench.

With each normal force at most f_max, the wrenches that the contacts can apply form a convex
body W around the origin. An external wrench w is resisted up to the largest lambda with
-lambda w in W, a conic program. Its dual is a facet of W: a twist y with y.w = -1 and
lambda = h(y) = f_max sum_i max(0, s_i(y)), the support of W (s_i as in `closure`). The
wrench -y / |y| meets that facet squarely, so its limit is at most h(y) / |y|: stepping from
a wrench to the one its limiting facet points at never raises the limit, and stops at a
wrench that is locally the weakest.

Torques are compared with forces through a stated length.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, frozen
from grasp_core.closure import contact_frictions
from grasp_core.conic import ConicProgram, minimize
from grasp_core.errors import InputError
from grasp_core.polygons import plane_frame
from grasp_core.values import Grasp, contact_arrays
from grasp_core.wrenches import grasp_map

SETTLED = 1e-3
"""The search for the weakest wrench ends when a step lowers the limit by less than this share."""
MAX_STEPS = 30
STARTS = 3
"""From how many of the weakest axis wrenches the search starts."""


@dataclass(frozen=True, slots=True, eq=False)
class WrenchLimit:
    """How far one external wrench is resisted, with both sides of the proof."""

    wrench: Array
    """(6,) [N, N m], torque about the stated centre."""
    limit: float
    """Largest multiple of `wrench` that is resisted."""
    forces: Array
    """Contact forces that resist it at the limit, (k, 3) [N]."""
    facet: Array
    """Twist y of the limiting facet, (6,), with y.wrench = -1 and the limit as support."""


def max_resisted_wrench(
    positions: ArrayLike | Grasp,
    normals: ArrayLike | None,
    friction: ArrayLike,
    wrench: ArrayLike,
    *,
    max_normal_force: float,
    center: ArrayLike = (0.0, 0.0, 0.0),
) -> float:
    """Largest multiple of an external wrench that the contacts can resist.

    Args:
        positions: Contact points, (k, 3) [m]; or a Grasp, with `normals` None.
        normals: Unit vectors into the object, (k, 3).
        friction: Coulomb coefficient, one for all contacts or one each.
        wrench: External (force, torque), (6,) [N, N m], torque about `center`.
        max_normal_force: Largest normal force of each contact [N].
        center: (3,) [m]

    Raises:
        InputError: Shapes or limits are wrong, or the wrench is zero.
    """
    points, units = contact_arrays(positions, normals)
    load = frozen(wrench, (6,), "wrench")
    if not load.any():
        raise InputError("wrench must not be zero: every multiple of it is resisted")
    about = frozen(center, (3,), "center")
    body = WrenchBody(
        points - about, units, contact_frictions(friction, len(points)), max_normal_force
    )
    return body.limit(load).limit


class WrenchBody:
    """The wrenches that contacts can apply with bounded normal forces."""

    def __init__(
        self, arms: Array, normals: Array, friction: Array, max_normal_force: float
    ) -> None:
        """Set up the conic program, whose last column is the wrench asked about.

        Args:
            arms: Contact points from the centre of torques, (k, 3) [m].
            normals: Unit vectors into the object, (k, 3).
            friction: Coulomb coefficients, (k,).
            max_normal_force: [N]
        """
        if not (math.isfinite(max_normal_force) and max_normal_force > 0.0):
            raise InputError(f"max_normal_force must be positive, got {max_normal_force}")
        self.max_normal_force = max_normal_force
        self.count = k = len(arms)
        self.size = float(np.linalg.norm(arms, axis=1).max()) or 1.0
        self.scale = np.array([1.0] * 3 + [self.size] * 3)
        cones = np.zeros((3 * k, 3 * k + 1))
        caps = np.zeros((k, 3 * k + 1))
        for i, (normal, mu) in enumerate(zip(normals, friction, strict=True)):
            block = slice(3 * i, 3 * i + 3)
            caps[i, block] = normal
            cones[3 * i, block] = -mu * normal
            cones[3 * i + 1 : 3 * i + 3, block] = -plane_frame(normal).T
        balance = np.hstack([grasp_map(arms / self.size), np.zeros((6, 1))])
        self.A = np.vstack([balance, caps, -caps, cones])
        self.b = np.concatenate([np.zeros(6), np.ones(k), np.zeros(4 * k)])

    def limit(self, wrench: Array) -> WrenchLimit:
        """Largest multiple of an external wrench that is resisted, with its proof."""
        unit = wrench / self.scale
        length = float(np.linalg.norm(unit))
        A = self.A.copy()
        A[:6, -1] = unit / length
        q = np.zeros(A.shape[1])
        q[-1] = -1.0
        k = self.count
        answer = minimize(ConicProgram(q, A, self.b, 6, 2 * k, (3,) * k))
        share = self.max_normal_force / length
        return WrenchLimit(
            wrench=wrench,
            limit=max(share * float(answer.x[-1]), 0.0),
            forces=self.max_normal_force * answer.x[:-1].reshape(k, 3),
            facet=-answer.z[:6] / (length * self.scale),
        )

    def weakest(self, wrenches: Array, torque_scale: float) -> WrenchLimit:
        """A wrench of unit size that is locally the hardest to resist.

        Args:
            wrenches: Where to start, (n, 6); the weakest of them are followed.
            torque_scale: Length that makes a torque comparable with a force [m].

        Returns:
            The weakest found: a wrench with |(force, torque / torque_scale)| = 1.
        """
        scale = np.array([1.0] * 3 + [torque_scale] * 3)
        starts = sorted(
            (self.limit(_unit(w, scale)) for w in wrenches), key=lambda found: found.limit
        )
        return min(
            (self._descend(start, scale) for start in starts[:STARTS]), key=lambda w: w.limit
        )

    def _descend(self, start: WrenchLimit, scale: Array) -> WrenchLimit:
        best = start
        for _ in range(MAX_STEPS):
            facing = -best.facet * scale**2
            found = self.limit(_unit(facing, scale))
            if found.limit > best.limit * (1.0 - SETTLED):
                break
            best = found
        return best


def axis_wrenches(torque_scale: float) -> Array:
    """The twelve wrenches along and against each axis, (12, 6) [N, N m].

    Args:
        torque_scale: Torque that goes with a force of one newton [m].
    """
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    return np.vstack([np.eye(6), -np.eye(6)]) * scale


def _unit(wrench: Array, scale: Array) -> Array:
    return wrench / float(np.linalg.norm(wrench / scale))
