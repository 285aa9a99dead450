"""What a scene of execution consists of: the object as it is, fingers on springs, and a palm.

The world frame is the object's frame moved to the centre of mass, as the object rests in the hand.
Nothing is scaled here: the object has its true mass, centre of mass and inertia, and gravity pulls.

Each fingertip slides on three springs along axes in which its stiffness is diagonal. A damper goes
with each spring. Its coefficient is that of an object of mass m between k equal springs K,

    c = 2 zeta sqrt(K (m / k + m_t)),                                                     (1)

with the damping ratio zeta and the tip's mass m_t. The springs' bases are fixed to the palm.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.closure.contacts import WRENCH, contact_frames, grasp_map
from grasp_core.errors import InputError
from grasp_core.execution.grips import Grip, check_grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.kinds import Quantity, instance, value_of
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from scenes.mujoco.scene_parts import TOUCH
from scenes.mujoco.surface import touched_solids
from scenes.settings import HeldSettings


def rotations(quaternions: Array) -> Array:
    """Return the rotation matrices of unit quaternions (w, x, y, z), (n, 4), as (n, 3, 3)."""
    w, x, y, z = quaternions.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ],
        axis=1,
    )


def hinged(angles: Array) -> Array:
    """Return the palm's rotation, (n, 3, 3): about x, then the turned y, then the turned z."""
    half = 0.5 * angles
    zero = np.zeros(len(angles))
    turn = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in range(3):
        parts = [np.cos(half[:, axis]), zero, zero, zero]
        parts[axis + 1] = np.sin(half[:, axis])
        turn = turn @ rotations(np.stack(parts, axis=1))
    return turn


ISOTROPIC = 1e-9
"""Relative difference of a spring's stiffnesses that counts as none."""


def gravity_of(settings: HeldSettings) -> Array:
    """Return the acceleration of gravity in the object's frame, (3,) [m/s^2]."""
    down = np.asarray(settings.down, dtype=np.float64)
    return to_digits(GRAVITY_M_PER_S2 * down / np.linalg.norm(down))


@dataclass(frozen=True, slots=True, eq=False)
class HeldLayout:
    """Positions, masses and springs of everything in a scene of execution, in the world frame."""

    name: str
    vertices: Array
    """Object mesh about its centre of mass, (n, 3) [m]."""
    triangles: Indices
    solids: tuple[Array, ...] | None
    """Corners of each convex solid that fingertips can touch, (n, 3) each [m]; None where they
    touch the object's mesh itself."""
    radius_m: float
    object_kg: float
    inertia_kg_m2: Array
    """Inertia about the centre of mass, along the world axes, (3, 3) [kg m^2]."""
    contacts: Array
    frames: Array
    """Columns (inward normal, tangent, tangent) of each contact, (k, 3, 3)."""
    friction: Array
    squeeze: Array
    """Contact forces at rest, on the object, world axes, (k, 3) [N]."""
    axes: Array
    """Columns: directions of each fingertip's three springs, (k, 3, 3)."""
    stiffness: Array
    """Stiffness of each fingertip's three springs, (k, 3) [N/m]."""
    damping: Array
    """Coefficients of the dampers beside the springs, (k, 3) [N s/m]."""
    tip_radius_m: Array
    tip_mass_kg: float
    gravity: Array

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Return the names of the fingertips' shapes in the scene."""
        return tuple(f"finger{finger}" for finger in range(len(self.contacts)))

    @property
    def tip_masses(self) -> Array:
        """Return the inertia of each fingertip along its springs, (k, 3) [kg]."""
        return np.full(self.stiffness.shape, self.tip_mass_kg)

    @property
    def tips_carried(self) -> Array:
        """Return the mass of each fingertip that the palm carries along, (k,) [kg]."""
        return np.full(len(self.contacts), self.tip_mass_kg)

    @property
    def stiffest(self) -> float:
        """Return the stiffness of the stiffest spring [N/m]."""
        return float(self.stiffness.max())

    @property
    def above_table(self) -> tuple[Array, Array]:
        """Return balls that a table must not meet: middles (n, 3) and radii (n,) [m]."""
        return self.tip_centers, self.tip_radius_m

    def joints(self, reached: Array) -> Array:
        """Find where the joints of the fingers are."""
        return reached.ravel()

    def commands(self, shares: Array, reached: Array | None) -> Array:
        """Find what the fingers are told, (n, joints)."""
        base = 0.0 if reached is None else reached
        told = base + shares[:, :, None] * (self.pushes / self.stiffness)
        return told.reshape(len(shares), -1)

    def fingers_seen(
        self, joints: Array, loads: Array, turned: Array
    ) -> tuple[Array, Array, Array | None]:
        """See what fingers did in n samples, as the palm sees it.

        Gives displacements of fingertips, (n, k, 3) [m], and contact forces on the object,
        (n, k, 3) [N], along the springs, and orientations of fingertips, (n, k, 3, 3), or None
        where they do not turn.
        """
        shape = (len(turned), *self.stiffness.shape)
        return joints.reshape(shape), -loads.reshape(shape), None

    @property
    def tip_centers(self) -> Array:
        """Return the centres of the fingertips at their contacts, (k, 3) [m]."""
        height = self.tip_radius_m - TOUCH * self.radius_m
        return self.contacts - height[:, None] * self.frames[:, :, 0]

    def stiffness_along(self, way: Array) -> float:
        """Return the stiffness of all springs against a motion along a unit vector [N/m]."""
        return float(((way @ self.axes) ** 2 * self.stiffness).sum())

    @property
    def fastest_ring(self) -> float:
        """Return a bound on the natural frequencies of the held object [rad/s].

        It is the highest one of the springs and masses, or that of a cube of this mass held at the
        middles of its faces if it is larger. The latter's square is k / (m_t + 2 m / (3 n)) for n
        fingertips.
        """
        maps = grasp_map(self.contacts).reshape(WRENCH, -1, 3).transpose(1, 0, 2)
        springs = (self.axes * self.stiffness[:, None]) @ self.axes.transpose(0, 2, 1)
        stiff: Array = (maps @ springs @ maps.transpose(0, 2, 1)).sum(axis=0)
        mass: Array = self.tip_mass_kg * (maps @ maps.transpose(0, 2, 1)).sum(axis=0)
        mass[:3, :3] += self.object_kg * np.eye(3)
        mass[3:, 3:] += self.inertia_kg_m2
        root = np.linalg.inv(np.linalg.cholesky(mass))
        own = float(np.linalg.eigvalsh(root @ stiff @ root.T)[-1])
        cube = self.tip_mass_kg + 2.0 * self.object_kg / (3.0 * len(self.contacts))
        return math.sqrt(max(own, self.stiffest / cube))

    @property
    def fastest_tip(self) -> float:
        """Return the largest rate at which a loose fingertip swings or comes to rest [1/s]."""
        swing = math.sqrt(self.stiffest / self.tip_mass_kg)
        return max(swing, float(self.damping.max()) / self.tip_mass_kg)

    @property
    def pushes(self) -> Array:
        """Return the squeeze along the axes of the springs, (k, 3) [N]."""
        return np.einsum("kij,ki->kj", self.axes, self.squeeze)


def held_layout(
    body: Polyhedron, grip: Grip, settings: HeldSettings, reach_m: float | None = None
) -> HeldLayout:
    """Place an object between the springs of a grip."""
    check_body(body)
    check_grip(grip)
    reach = body.radius if reach_m is None else value_of(Quantity, reach_m, "reach_m")
    mass = instance(settings, HeldSettings, "settings").mass_of(body)
    if not (grip.tip_radius_m > 0.0).all():
        raise InputError("tip_radius_m must be above zero: points cannot be simulated")
    normals = to_digits(grip.normals)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    frames = contact_frames(normals)
    contacts = to_digits(grip.arms, body.radius)
    axes, stiffness = _spring_axes(grip.stiffness, frames)
    share = mass / len(contacts) + settings.tip_mass_kg
    return HeldLayout(
        name=body.name,
        vertices=to_digits(body.vertices - body.center_of_mass),
        triangles=body.triangles,
        solids=touched_solids(body, contacts, reach),
        radius_m=body.radius,
        object_kg=mass,
        inertia_kg_m2=to_digits(mass / body.volume * body.inertia),
        contacts=contacts,
        frames=frames,
        friction=grip.friction,
        squeeze=to_digits(grip.squeeze),
        axes=axes,
        stiffness=stiffness,
        damping=2.0 * settings.damping_ratio * np.sqrt(stiffness * share),
        tip_radius_m=grip.tip_radius_m,
        tip_mass_kg=settings.tip_mass_kg,
        gravity=gravity_of(settings),
    )


def _spring_axes(stiffness: Array, frames: Array) -> tuple[Array, Array]:
    """Return axes in which each stiffness (k, 3, 3) is diagonal, and its diagonal, (k, 3)."""
    values, vectors = np.linalg.eigh(stiffness)
    vectors[:, :, 0] *= np.sign(np.linalg.det(vectors))[:, None]
    alike = values[:, 2] - values[:, 0] <= ISOTROPIC * values[:, 2]
    return np.where(alike[:, None, None], frames, vectors), values
