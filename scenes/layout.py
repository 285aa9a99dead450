"""Contacts on an object -> where everything stands in the scene, as plain numbers.

The world frame is the object's frame moved to its centre of mass: T_world_object is the
translation by minus the centre of mass. Lengths and forces are true to the object and the
user. Masses are not: a quasi-static test asks whether forces balance, and similar grasps
should behave alike, so all of the dynamics is scaled by the size of the grasp, which is the
lever of the contacts about the axis they are closest to. Object and fingers get the mass
that the largest normal force moves by that lever in a fixed time, centred between the
contacts, and the servos the stiffness that keeps such a lever stable.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.closure import force_closure
from grasp_core.errors import InputError, UndecidedError
from grasp_core.values import Contact, Grasp, Polyhedron
from grasp_core.wrenches import contact_frames

RESPONSE_TIME_S = 0.07
"""Square root of mass x grasp size / largest normal force: 1 kg for 10 N and 5 cm, where the
settings were measured."""
STIFFNESS = 5.0
"""Servo stiffness in largest normal forces per grasp size: below 1 a force-controlled grasp
is unstable, above 50 the servo fights the planned forces."""
LEAST_SIZE = 0.01
"""Smallest grasp size in object radii, for contacts that are nearly on one line."""
SQUEEZE = 0.6
"""Largest normal force of the gentle grasp, in largest normal forces."""
TIP_RADIUS = 0.1
PAD_HALF_WIDTH = 0.2
PAD_DEPTH = 0.1
"""Fingertip radius and pad size, in object radii."""
FLAT = 1e-6
"""Share added to all moments of inertia: those of coplanar contacts are the limit of what a
body can have, and rounding must not pass it."""
RETREAT = 0.5
"""Distance of approach, in grasp sizes: from much farther the fingers would arrive too fast."""


@dataclass(frozen=True, slots=True, eq=False)
class FingerDrive:
    """How a fingertip is built and driven."""

    radius_m: float
    mass_kg: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float
    max_normal_force_n: float


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Everything that stands in a scene, in the world frame."""

    name: str
    vertices: Array
    """Object mesh about its centre of mass, (n, 3) [m]."""
    triangles: Indices
    """(t, 3)"""
    radius_m: float
    """Largest distance of the object's surface from its centre of mass."""
    center: Array
    """Mean of the contacts, where the simulated mass is, (3,) [m]."""
    grasp_size_m: float
    """Lever of the contacts about the axis through `center` that they are closest to."""
    mass_kg: float
    inertia_kg_m2: Array
    """About `center`, along the world axes, (3, 3)."""
    contacts: Array
    """(k, 3) [m]"""
    frames: Array
    """Columns (inward normal, tangent, tangent) of each contact, (k, 3, 3)."""
    friction: float
    drive: FingerDrive
    squeeze: Array
    """Forces of a gentle grasp, balanced where possible, in the contact frames, (k, 3) [N]."""

    @property
    def tip_centers(self) -> Array:
        """Centres of the fingertips touching the object, (k, 3) [m]."""
        return self.contacts - self.drive.radius_m * self.frames[:, :, 0]


def arrange(
    body: Polyhedron,
    grasp: Grasp | Sequence[Contact],
    friction: float,
    *,
    max_normal_force: float = 10.0,
    fingertip_radius: float | None = None,
) -> Layout:
    """Place object, fingertips and drives for a grasp.

    Args:
        body: The object.
        grasp: A grasp, or contacts from elsewhere.
        friction: Coulomb coefficient at every contact.
        max_normal_force: Limit of each finger's push [N].
        fingertip_radius: [m]; a tenth of the object's radius when None.

    Raises:
        InputError: A number is not positive.
    """
    contacts = grasp.contacts if isinstance(grasp, Grasp) else tuple(grasp)
    radius = body.radius
    tip = TIP_RADIUS * radius if fingertip_radius is None else fingertip_radius
    positive = {"friction": friction, "max_normal_force": max_normal_force, "fingertip_radius": tip}
    for name, value in positive.items():
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number, got {value}")
    normals = np.array([contact.normal for contact in contacts])
    positions = np.array([contact.position for contact in contacts])
    size = max(grasp_size(positions), LEAST_SIZE * radius)
    mass = max_normal_force * RESPONSE_TIME_S**2 / size
    stiffness = STIFFNESS * max_normal_force / size
    return Layout(
        name=body.name,
        vertices=body.vertices - body.center_of_mass,
        triangles=body.triangles,
        radius_m=radius,
        center=positions.mean(axis=0) - body.center_of_mass,
        grasp_size_m=size,
        mass_kg=mass,
        inertia_kg_m2=_inertia(mass, positions, size),
        contacts=positions - body.center_of_mass,
        frames=contact_frames(normals),
        friction=friction,
        drive=FingerDrive(
            radius_m=tip,
            mass_kg=mass,
            stiffness_n_per_m=stiffness,
            damping_n_s_per_m=2.0 * float(np.sqrt(stiffness * mass)),
            max_normal_force_n=max_normal_force,
        ),
        squeeze=SQUEEZE * max_normal_force * _pushes(positions, normals, friction),
    )


def grasp_size(positions: Array) -> float:
    """Root mean square distance of contacts from the axis they are closest to [m].

    Args:
        positions: (k, 3) [m].
    """
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    lever = np.linalg.norm(spread[1:]) / math.sqrt(len(positions))
    return float(to_digits(np.array(lever, dtype=np.float64)))


def _inertia(mass: float, positions: Array, size: float) -> Array:
    """A quarter of the inertia of the mass shared between the contacts, (3, 3) [kg m^2].

    About the axis that the contacts are closest to it is mass (size / 2)^2; about the others it
    grows with their levers. The same about all axes would let long grasps spring loose.
    """
    arms = positions - positions.mean(axis=0)
    second = arms.T @ arms / len(arms)
    shared = np.trace(second) * np.eye(3) - second
    _, axes = np.linalg.eigh(shared)
    levers = np.maximum(np.einsum("ij,ik,kj->j", axes, shared, axes), size**2)
    levers += FLAT * levers.max()
    return to_digits(0.25 * mass * (axes * levers) @ axes.T)


def _pushes(positions: Array, normals: Array, friction: float) -> Array:
    """Forces in the contact frames, (k, 3), that hold the object still if any do.

    The largest normal part is one. Contacts that are not in force closure just push.
    """
    try:
        forces = force_closure(positions, normals, friction).forces
    except UndecidedError:
        forces = None
    local = np.einsum("kij,ki->kj", contact_frames(normals), normals if forces is None else forces)
    return to_digits(local / local[:, 0].max())
