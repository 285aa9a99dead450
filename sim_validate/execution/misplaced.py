"""Where fingertips meet an object that is not where they expect it.

The object is moved by a stated distance and turned by a stated angle, both in directions drawn by a
seed. Each fingertip comes along its normal until it touches, as far behind its planned place as
the object can have moved; one that meets nothing stops as far beyond it. From there the squeeze is
commanded as planned. A fingertip advances by its distance from the surface less its radius, so it
never passes the first point that it meets (sphere tracing, Hart 1996).
"""

import math

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.geometry.nearest_points import nearest_on_surface
from scenes.execution.held import TOUCH, HeldLayout
from scenes.execution.turns import rotations
from scenes.mjcf_text import quaternion
from sim_validate.execution.drives import Pose

MET = 1e-7
"""Distance from the surface at which a fingertip has met it, in object radii."""
MOST_STEPS = 100
"""Advances after which a fingertip stops: beside a surface that it nearly grazes they are tiny."""
ROOM = 1.5
"""Distance from which fingertips come, relative to how far points of the object can have moved."""


def misplacements(layout: HeldLayout, off_m: float, off_rad: float, count: int, seed: int) -> tuple[
    Pose, ...
]:  # fmt: skip
    """Draw poses of the object that are off by a distance and an angle, in random directions."""
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(count, 2, 3))
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    poses = list[Pose]()
    for way, axis in ways:
        turn = np.concatenate([[math.cos(0.5 * off_rad)], math.sin(0.5 * off_rad) * axis])
        turned = rotations(to_digits(turn / np.linalg.norm(turn))[None])[0]
        poses.append(Pose(to_digits(off_m * way, layout.radius_m), quaternion(turned)))
    return tuple(poses)


def met(layout: HeldLayout, poses: tuple[Pose, ...], off_m: float, off_rad: float) -> Array:
    """Return how far each fingertip is from its planned place when it stops, (poses, k, 3) [m].

    The displacements are along the axes of the springs.
    """
    ways = layout.frames[:, :, 0]
    room = ROOM * (off_m + off_rad * layout.radius_m)
    starts = layout.tip_centers - room * ways
    turned = np.array([rotations(pose.quaternion[None])[0] for pose in poses])
    moved = np.array([pose.moved for pose in poses])
    starts = np.einsum("pji,pkj->pki", turned, starts[None] - moved[:, None])
    ways = np.einsum("pji,kj->pki", turned, ways)
    radii = layout.tip_radius_m - TOUCH * layout.radius_m
    gone = np.zeros(starts.shape[:2])
    middles = starts + room * ways
    near = [_near(layout, middles[:, finger], room) for finger in range(len(radii))]
    for _ in range(MOST_STEPS):
        centers = starts + gone[..., None] * ways
        nearest = np.stack(
            [
                nearest_on_surface(layout.vertices, triangles, centers[:, finger])
                for finger, triangles in enumerate(near)
            ],
            axis=1,
        )
        gaps = np.linalg.norm(nearest - centers, axis=2) - radii
        open_ = (gaps > MET * layout.radius_m) & (gone < 2.0 * room)
        if not open_.any():
            break
        gone = np.where(open_, np.minimum(gone + gaps, 2.0 * room), gone)
    back = (to_digits(gone, layout.radius_m) - room)[..., None] * layout.frames[:, :, 0]
    return np.einsum("kij,pki->pkj", layout.axes, back)


def _near(layout: HeldLayout, middles: Array, room: float) -> Indices:
    """Return the triangles, (t, 3), that can be the nearest to a point within `room` of others.

    If the surface is at a distance d from a middle, it is at most d + room from such a point, so
    that a triangle farther than d + 2 room from the middle is not the nearest.
    """
    corners = layout.vertices[layout.triangles]
    nearest = nearest_on_surface(layout.vertices, layout.triangles, middles)
    reach = np.linalg.norm(nearest - middles, axis=1) + 2.0 * room + MET * layout.radius_m
    centers = corners.mean(axis=1)
    extents = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    distances = np.linalg.norm(centers - middles[:, None], axis=2) - extents
    return layout.triangles[(distances <= reach[:, None]).any(axis=0)]
