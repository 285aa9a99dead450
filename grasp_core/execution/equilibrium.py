"""The object's pose under a load of any size, as long as no contact slips.

The linear response of `grips` holds for small motions. Soft fingertips let the object move by
millimetres, so the load is raised in steps and the equilibrium is found anew at each: Newton steps
with the stiffness (5) of `grips` at the pose reached. A turn by t carries tip centres along by
(2) there and rolls them on their faces. Rolling depends on the path, of which every Newton step is
a part; the steps are short, and what remains is of third order in their length.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.closure.contacts import WRENCH, grasp_map
from grasp_core.errors import SolverError
from grasp_core.execution.grips import Grip

SETTLED = 1e-11
"""Largest wrench that is left, relative to the pushes and the load."""
MOST_STEPS = 50
"""Newton steps for one load; four or five are usual."""


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """A grip in equilibrium under a load."""

    grip: Grip
    """The grip in this pose: arms, normals and forces as they are now."""
    moved: Array
    """Displacement of the centre of mass, (3,) [m]."""
    rotation: Array
    """Orientation of the object against the one at rest, (3, 3)."""
    tips: Array
    """Displacements of the tips' centres, (k, 3) [m]."""
    load: Array
    """External wrench on the object, (6,) [N, N m], about the centre of mass."""

    @property
    def forces(self) -> Array:
        """Contact forces on the object, world axes, (k, 3) [N]."""
        return self.grip.squeeze


def at_rest(grip: Grip) -> Held:
    """Return a grip as it is before any load."""
    return Held(grip, np.zeros(3), np.eye(3), np.zeros_like(grip.arms), np.zeros(WRENCH))


def under(held: Held, start: Grip, load: Array) -> Held:
    """Find the equilibrium under a load, starting from one under a load nearby.

    Takes `load` (6,) [N, N m].
    """
    size = start.size
    scale = np.repeat([1.0, size], 3)
    unit = np.linalg.norm(start.squeeze, axis=1).sum() + float(np.linalg.norm(load / scale))
    for _ in range(MOST_STEPS):
        left = grasp_map(held.grip.arms) @ held.forces.ravel() + load
        if float(np.abs(left / scale).max()) <= SETTLED * unit:
            return Held(held.grip, held.moved, held.rotation, held.tips, load)
        held = stepped(held, start, held.grip.compliance @ left)
        if not np.isfinite(held.grip.arms).all():
            break
    raise SolverError("no equilibrium of the loaded grip was found")


def stepped(held: Held, start: Grip, step: Array) -> Held:
    """Move the object by a translation and a turn, and let the tips follow.

    Takes `step` (6,) [m, rad].
    """
    shift, turn = step[:3], step[3:]
    R = rotation(turn)
    grip = held.grip
    radii = grip.tip_radius_m[:, None]
    # a tip's centre is at r - rho n from the centre of mass, and rolls by rho (t x n) on the face
    half = rotation(0.5 * turn)
    centers = (grip.arms - radii * grip.normals) @ R.T
    centers += radii * cross(turn, grip.normals @ half.T)
    normals = grip.normals @ R.T
    arms = centers + radii * normals
    moved = held.moved + shift
    tips = moved + centers - (start.arms - radii * start.normals)
    forces = start.squeeze - np.einsum("kij,kj->ki", start.stiffness, tips)
    turned = Grip(arms, normals, grip.friction, forces, grip.stiffness, grip.tip_radius_m)
    return Held(turned, moved, R @ held.rotation, tips, held.load)


def rotation(turn: Array) -> Array:
    """Compute the rotation by a vector, (3,) [rad], as a matrix (3, 3)."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    C = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # sin(a) / a and (1 - cos(a)) / a^2, the second without cancellation
    return np.eye(3) + np.sinc(angle / np.pi) * C + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * C @ C
