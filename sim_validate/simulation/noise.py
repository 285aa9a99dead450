"""Draws seeded noise on a grasp: in the object's pose, its surface normals, friction and mass.

The fingers come along their planned lines, but the object is displaced. Each finger touches where
its line enters the same face, if the line does (on a curved object, the surface near the planned
contact). There the surface normal leans a little from that of the model. Friction is the same at
all contacts; mass scales the simulated mass and every load. Loads turn with the object.

All noise is drawn from normal distributions; friction and mass are multiplied by the exponential of
the drawn number. The draws of a trial depend only on the seed and the trial's number. So every
grasp gets the same draws, and a larger deviation only scales them.
"""

import math
from dataclasses import asdict, dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import BOUNDS, number
from grasp_core.closure.contacts import contact_frames
from grasp_core.objects.on_faces import within
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from sim_validate.simulation.traces import rotated

STREAM = 1
"""Number of the random stream that noise is drawn from, apart from other draws with the same
seed."""


@dataclass(frozen=True, slots=True)
class Noise:
    """How uncertain the pose, surface, friction and mass are, as standard deviations.

    Raises:
        InputError: A number is negative or out of its range.
    """

    shift: float = 0.01
    """Deviation of the object's position along each axis, in object radii."""
    turn_deg: float = 1.0
    """Deviation of the object's orientation about each axis through its centre of mass [deg]."""
    normal_deg: float = 1.0
    """Deviation of the surface normal at each contact, about two axes in the surface [deg]."""
    friction: float = 0.05
    """Deviation of the friction coefficient, relative to the coefficient."""
    mass: float = 0.05
    """Deviation of the mass and of every load, relative to the planned values."""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            number(value, name, **BOUNDS[f"noise_{name}"])


@dataclass(frozen=True, slots=True, eq=False)
class Disturbed:
    """A grasp after one draw of noise."""

    landed: tuple[Contact, ...]
    """Where fingers meet the surface, with the model's normals; fewer than k contacts if some
    miss."""
    contacts: tuple[Contact, ...]
    """The contacts in `landed`, with surface normals tilted by the noise."""
    missed: tuple[int, ...]
    """Indices of the fingers whose lines do not meet their faces."""
    friction: float
    mass: float
    """Mass of the trial, relative to the planned mass."""


def disturbed(
    body: Polyhedron, grasp: Grasp, friction: float, noise: Noise, draw: tuple[int, int]
) -> Disturbed:
    """Disturb a grasp by one draw of noise."""
    seed, number = draw
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, number)))
    shift, turn = noise.shift * body.radius * rng.normal(size=3), rng.normal(size=3)
    slipperiness, heaviness = rng.normal(size=2)
    leaning = math.radians(noise.normal_deg) * rng.normal(size=(len(grasp.contacts), 2))
    # Turning the object is the same as turning the fingers' lines back.
    back = _quaternion(-math.radians(noise.turn_deg) * turn)
    center = body.center_of_mass
    points = rotated(back, grasp.positions - center - shift) + center
    ways = rotated(back, grasp.normals)
    found = [
        _landing(body, face, point, way)
        for face, point, way in zip(grasp.faces, points, ways, strict=True)
    ]
    return Disturbed(
        landed=tuple(contact for contact in found if contact is not None),
        contacts=tuple(
            Contact(contact.position, _leaning(contact.normal, lean))
            for contact, lean in zip(found, leaning, strict=True)
            if contact is not None
        ),
        missed=tuple(finger for finger, contact in enumerate(found) if contact is None),
        friction=friction * math.exp(noise.friction * slipperiness),
        mass=math.exp(noise.mass * heaviness),
    )


def _quaternion(rotation: Array) -> Array:
    """Convert a rotation vector [rad] into a unit quaternion wxyz, (4,)."""
    angle = float(np.linalg.norm(rotation))
    return np.append(math.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / math.pi) * rotation)


def _leaning(normal: Array, lean: Array) -> Array:
    """Turn a normal about an axis in the surface, given by its tangential coordinates [rad]."""
    tangents = contact_frames(normal[None])[0, :, 1:]
    return rotated(_quaternion(tangents @ lean), normal)


def _landing(body: Polyhedron, face: int, point: Array, way: Array) -> Contact | None:
    """Find where a line enters a face, or a curved surface near a point; None if nowhere."""
    if body.patches is None:
        plane = body.faces[face]
        at = _crossing(plane.centroid[None], plane.normal[None], point, way)[0]
        inside = np.isfinite(at).all() and any(
            within(at, piece, plane.normal, 0.0) for piece in plane.pieces
        )
        return Contact(at, plane.normal) if inside else None
    corners = body.vertices[body.triangles[:, ::-1]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    corners, normals = corners[sizes > 0.0], (normals[sizes > 0.0].T / sizes[sizes > 0.0]).T
    at = _crossing(corners[:, 0], normals, point, way)
    edges = np.roll(corners, -1, axis=1) - corners
    beside = np.einsum("tei,tei->te", np.cross(normals[:, None], edges), at[:, None] - corners)
    hit = np.flatnonzero((beside >= 0.0).all(axis=1))
    if not hit.size:
        return None
    first = hit[np.linalg.norm(at[hit] - point, axis=1).argmin()]
    return Contact(at[first], normals[first])


def _crossing(points: Array, normals: Array, point: Array, way: Array) -> Array:
    """Find the points where a line enters each of n planes, (n, 3); NaN where it enters none."""
    falling = normals @ way
    entering = falling > 0.0
    share = np.einsum("ni,ni->n", normals, points - point) / np.where(entering, falling, np.nan)
    return point + share[:, None] * way
