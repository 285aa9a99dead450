"""Objects that are not where fingers expect them: draws of errors, and where fingers then touch.

Fingers come along their planned lines, whatever the object does. Seen from an object that was moved
and turned, the lines are moved and turned back. A line touches a planar face where it enters the
face's plane, and the surface of an object where a ball on the line first meets it: the ball
advances by its distance from the surface less its radius, so it never passes the first point that
it meets (sphere tracing, Hart 1996).

All errors are drawn from normal distributions. The draws of a trial depend only on a seed and on
the trial's number or name, so a larger deviation only scales them.
"""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.closure.contacts import contact_frames, unit_size
from grasp_core.closure.decision import decide
from grasp_core.closure.proofs import ContactCones
from grasp_core.objects.on_faces import nearest_on_surface, within
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import facets_of
from grasp_core.values import Contact, Grasp
from scenes.mujoco.held_scene import HeldLayout
from scenes.mujoco.mjcf_text import quaternion, rotations
from scenes.mujoco.scene_text import TOUCH_DEPTH
from sim_validate.engine.held_or_let_go import rotated
from sim_validate.settings import Noise, OffBy

NOISE_STREAM = 1
"""Number of the random stream of noise, apart from other draws with the same seed."""
ROOM_TO_COME = 1.5
"""Distance from which fingertips come, relative to how far points of the object can have moved."""
MEETS = 1e-7
"""Distance from the surface at which a ball has met it, in object radii."""
MOST_ADVANCES = 100
"""Advances after which a ball stops: beside a surface that it nearly grazes they are tiny."""


def draws_by_name(seed: int, *names: object) -> np.random.Generator:
    """Return the generator of what is drawn under some names."""
    digest = hashlib.sha256(" ".join(map(str, (seed, *names))).encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "big"))


def drawn_errors(count: int, seed: int, off_by: OffBy) -> Array:
    """Draw errors of place and turn, (count, 2, 3), of length one or of deviation one."""
    drawn = np.random.default_rng(seed).normal(size=(count, 2, 3))
    return drawn if off_by == "deviation" else drawn / np.linalg.norm(drawn, axis=2, keepdims=True)


@dataclass(frozen=True, slots=True, eq=False)
class ObjectPose:
    """Where the object lies, against its planned place in the hand."""

    moved: Array
    quaternion: Array
    """Orientation (w, x, y, z), (4,)."""

    def seen(self, points: Array, ways: Array) -> tuple[Array, Array]:
        """Return fingers' lines, points and ways (k, 3) each, as the object in the pose has them.

        Points are from the point about which the object turns.
        """
        back = self.quaternion * np.array([1.0, -1.0, -1.0, -1.0])
        return rotated(back, points - self.moved), rotated(back, ways)


def turned_by(rotation: Array) -> Array:
    """Convert a rotation vector [rad] into a unit quaternion wxyz, (4,)."""
    angle = float(np.linalg.norm(rotation))
    return np.append(math.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / math.pi) * rotation)


@dataclass(frozen=True, slots=True, eq=False)
class Disturbed:
    """A grasp after one draw of noise: `contacts` are `landed` with normals that lean."""

    landed: tuple[Contact, ...]
    """Where fingers meet the surface, with the model's normals; fewer than k contacts if some
    miss."""
    contacts: tuple[Contact, ...]
    missed: tuple[int, ...]
    friction: float
    mass: float  # mass of the trial, relative to the planned mass


def disturbed(
    body: Polyhedron, grasp: Grasp, friction: float, noise: Noise, seed: int, number: int
) -> Disturbed:
    """Disturb a grasp by the noise of one repeated trial."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(NOISE_STREAM, number)))
    center = body.center_of_mass
    shift, turn = noise.shift * body.radius * rng.normal(size=3), rng.normal(size=3)
    slipperiness, heaviness = rng.normal(size=2)
    leaning = math.radians(noise.normal_deg) * rng.normal(size=(len(grasp.contacts), 2))
    pose = ObjectPose(shift, turned_by(math.radians(noise.turn_deg) * turn))
    points, ways = pose.seen(grasp.positions - center, grasp.normals)
    found = [
        _landing(body, face, point, way)
        for face, point, way in zip(grasp.faces, points + center, ways, strict=True)
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


def _leaning(normal: Array, lean: Array) -> Array:
    """Turn a normal about an axis in the surface, given by its tangential coordinates [rad]."""
    tangents = contact_frames(normal[None])[0, :, 1:]
    return rotated(turned_by(tangents @ lean), normal)


def _landing(body: Polyhedron, face: int, point: Array, way: Array) -> Contact | None:
    """Find where a line enters a face, or a curved surface near a point; None if nowhere."""
    if body.patches is None:
        plane = body.faces[face]
        at = _crossing(plane.centroid[None], plane.normal[None], point, way)[0]
        inside = np.isfinite(at).all() and any(
            within(at, piece, plane.normal, 0.0) for piece in plane.pieces
        )
        return Contact(at, plane.normal) if inside else None
    facets = facets_of(body)
    corners, normals = facets.corners, facets.normals
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


def misplaced_poses(layout: HeldLayout, off_m: Array, off_rad: Array) -> tuple[ObjectPose, ...]:
    """Return poses of the object that is off by translations and turns, (count, 3) each."""
    turned = [rotations(to_digits(turned_by(turning))[None])[0] for turning in off_rad]
    return tuple(
        ObjectPose(to_digits(way, layout.radius_m), quaternion(rotation))
        for way, rotation in zip(off_m, turned, strict=True)
    )


def tips_met(
    layout: HeldLayout, poses: Sequence[ObjectPose], off_m: float, off_rad: float
) -> Array:
    """Return where fingertips stop, from their planned places along springs, (poses, k, 3) [m]."""
    ways, room = layout.frames[:, :, 0], ROOM_TO_COME * (off_m + off_rad * layout.radius_m)
    lines = [pose.seen(layout.tip_centers - room * ways, ways) for pose in poses]
    starts, seen = (np.array(each) for each in zip(*lines, strict=True))
    radii = layout.tip_radius_m - TOUCH_DEPTH * layout.radius_m
    gone, middles = np.zeros(starts.shape[:2]), starts + room * seen
    near = [_near(layout, middles[:, finger], room) for finger in range(len(radii))]
    for _ in range(MOST_ADVANCES):
        centers = starts + gone[..., None] * seen
        nearest = np.stack(
            [
                nearest_on_surface(layout.vertices, triangles, centers[:, finger])
                for finger, triangles in enumerate(near)
            ],
            axis=1,
        )
        gaps = np.linalg.norm(nearest - centers, axis=2) - radii
        going = (gaps > MEETS * layout.radius_m) & (gone < 2.0 * room)
        if not going.any():
            break
        gone = np.where(going, np.minimum(gone + gaps, 2.0 * room), gone)
    back = (to_digits(gone, layout.radius_m) - room)[..., None] * ways
    return np.einsum("kij,pki->pkj", layout.axes, back)


def _near(layout: HeldLayout, middles: Array, room: float) -> Indices:
    """Return the triangles, (t, 3), that can be the nearest to a point within `room` of others."""
    # with the surface at d from a middle, one beyond d + 2 room from it is nowhere the nearest
    corners = layout.vertices[layout.triangles]
    nearest = nearest_on_surface(layout.vertices, layout.triangles, middles)
    reach = np.linalg.norm(nearest - middles, axis=1) + 2.0 * room + MEETS * layout.radius_m
    centers = corners.mean(axis=1)
    extents = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    distances = np.linalg.norm(centers - middles[:, None], axis=2) - extents
    return layout.triangles[(distances <= reach[:, None]).any(axis=0)]


def closed_there(layout: HeldLayout, pose: ObjectPose, tips: Array) -> bool | None:
    """Decide whether fingertips that stop as `tips_met` says hold a moved object in force closure.

    None where it is too close to decide.
    """
    centers = layout.tip_centers + np.einsum("kij,kj->ki", layout.axes, tips) - pose.moved
    centers = centers @ rotations(pose.quaternion[None])[0]
    contacts = nearest_on_surface(layout.vertices, layout.triangles, centers)
    normals, gaps = contacts - centers, np.linalg.norm(contacts - centers, axis=1)
    if (gaps > layout.tip_radius_m + MEETS * layout.radius_m).any():
        return False
    arms, _, _ = unit_size(contacts[None])
    return decide(ContactCones.at(arms[0], normals / gaps[:, None], layout.friction)).closed
