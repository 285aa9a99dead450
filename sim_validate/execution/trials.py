"""Which trials an execution consists of, what each applies, and where object and fingertips are.

In `misplaced` the object is moved by a stated distance and turned by a stated angle, both in
directions drawn by a seed. Each fingertip comes along its normal until it touches, as far behind
its planned place as the object can have moved; one that meets nothing stops as far beyond it. From
there the squeeze is commanded as planned. A fingertip advances by its distance from the surface
less its radius, so it never passes the first point that it meets (sphere tracing, Hart 1996).

In `lift` the object rests on a table, on a face of its convex hull that carries its centre of mass:
the centre, dropped onto the face, lies inside. An object that is thrown and settles without sliding
comes to rest on a face about as often as the solid angle says under which the centre of mass sees
the face, so faces are tried in this order.
"""

import importlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices, to_digits
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.objects.on_faces import nearest_on_surface
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.sheets import solid_angles
from grasp_core.solvers.ties import largest_first
from scenes.mujoco.held import TOUCH, HeldLayout, rotations
from scenes.mujoco.mjcf_text import quaternion
from sim_validate.execution import paths
from sim_validate.execution.paths import Drive, Pose, Table, joined
from sim_validate.execution.verdict import Skipped
from sim_validate.settings import ExecutionSettings, TrialKind

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
    """Return where fingertips stop, from their planned places along springs, (poses, k, 3) [m]."""
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


FLAT = 1e-6
"""Difference of normals, and of offsets in object radii, up to which facets are one face."""
CLEAR = 0.01
"""Least gap between fingertips and the table, in object radii."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """A face of the convex hull on which the object can rest."""

    down: Array
    """Unit normal out of the object."""
    height: float
    likelihood: float
    """Share of the sphere that the face takes, as the centre of mass sees it."""


def rests(body: Polyhedron) -> tuple[Rest, ...]:
    """Return the faces on which an object can rest, the likeliest first."""
    spatial: Any = importlib.import_module("scipy.spatial")
    points = (body.vertices - body.center_of_mass) / body.radius
    hull = spatial.ConvexHull(points)
    normals, offsets = hull.equations[:, :3], -hull.equations[:, 3]
    left = set(range(len(normals)))
    found = list[Rest]()
    for first in range(len(normals)):
        if first not in left:
            continue
        alike = (np.abs(normals - normals[first]).max(axis=1) <= FLAT) & (
            np.abs(offsets - offsets[first]) <= FLAT
        )
        own = [facet for facet in np.flatnonzero(alike) if facet in left]
        left -= set(own)
        triangles = points[hull.simplices[own]]
        # the origin, dropped along the normal, falls into one of the triangles
        if any(_is_inside(corners, normals[first]) for corners in triangles):
            angles = solid_angles(triangles.transpose(2, 1, 0), np.zeros((1, 3)))
            share = float(np.abs(angles).sum() / (4.0 * np.pi))
            found.append(Rest(normals[first], float(offsets[first]) * body.radius, share))
    order = largest_first([rest.likelihood for rest in found])
    return tuple(found[place] for place in order)


def resting(body: Polyhedron, tips: Array, radii: Array) -> Rest | None:
    """Return the likeliest rest in which no fingertip meets the table; None if there is none."""
    for rest in rests(body):
        if (tips @ rest.down + radii).max() <= rest.height - CLEAR * body.radius:
            return rest
    return None


def _is_inside(corners: Array, normal: Array) -> bool:
    sides = np.cross(np.roll(corners, -1, axis=0) - corners, -corners) @ normal
    return bool((sides >= 0.0).all() or (sides <= 0.0).all())


AXES = ("x", "y", "z")
SIDES = tuple((sign, axis) for axis in range(3) for sign in (1.0, -1.0))
"""Sign and axis of the six directions of stops and knocks."""
OF_NO_SIZE: dict[TrialKind, str] = {"shake": "shake_g", "knock": "knock_n_s"}
"""Setting whose zero leaves no trial of a kind."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One trial: what is applied, and from when on the object must stay where it is."""

    kind: TrialKind
    name: str
    drive: Drive
    begun: int
    apart: bool = False
    """Whether the trial starts with open fingers, not from the squeezed object."""
    weighing: int = 0
    """Number of samples at the start in which the weight comes, as in other trials of the grasp."""
    turning: bool = False
    """Whether the load keeps turning, so that small slips add up."""
    expected: Drive | None = None
    """What the prediction is for, if not for the drive itself."""


def trials_of(
    body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings, lowest_frequency: float
) -> tuple[tuple[Trial, ...], tuple[Skipped, ...]]:
    """Return the trials that are asked for, and the kinds that are left out with the reasons."""
    found, skipped = list[Trial](), list[Skipped]()
    sized = {"shake": _shakes, "stop": _stops, "knock": _knocks, "misplaced": _misplaced}
    for kind in settings.trials:
        if (size := OF_NO_SIZE.get(kind)) and getattr(settings, size) == 0.0:
            flag = size.replace("_", "-")
            skipped.append(Skipped(kind, f"its size is 0 ({size}, --{flag})"))
        elif kind == "weight":
            drive = paths.turned_weight(lowest_frequency)
            found.append(Trial(kind, kind, drive, 0, turning=True))
        elif kind == "lift":
            lift = _lift(body, layout, settings)
            found += [lift] if isinstance(lift, Trial) else []
            skipped += [lift] if isinstance(lift, Skipped) else []
        else:
            found += sized[kind](layout, settings)
    return tuple(found), tuple(skipped)


def _lift(body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings) -> Trial | Skipped:
    rest = resting(body, *layout.above_table)
    if rest is None:
        return Skipped(
            "lift", "a fingertip is in the way of the table on every face that the object rests on"
        )
    give_m = layout.object_kg * GRAVITY_M_PER_S2 / layout.stiffness_along(rest.down)
    drive, begun = paths.lift(-rest.down, settings.lift_m, settings.lift_s, give_m)
    table = Table(rest.height * rest.down, -rest.down)
    return Trial("lift", "lift", replace(drive, table=table), begun - 1, apart=True)


def _shakes(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    size = GRAVITY_M_PER_S2 * settings.shake_g
    sizes = np.repeat([size, size / layout.radius_m], len(AXES))
    names = [f"shake {how} {axis}" for how in ("along", "about") for axis in AXES]
    for name, axis in zip(names, np.diag(sizes), strict=True):
        drive = paths.shake(layout.gravity, axis, settings.shake_hz)
        yield Trial("shake", name, drive, 0, weighing=paths.WEIGHING)


def _stops(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    for sign, axis in SIDES:
        way = sign * np.eye(3)[axis]
        drive = paths.stop(layout.gravity, way, settings.stop_m_per_s2, settings.stop_from_m_per_s)
        yield Trial("stop", f"stop {_side(sign, axis)}", drive, 0, weighing=paths.WEIGHING)


def _knocks(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    """Yield knocks along both sides of each axis, half the object's radius beside its middle."""
    for sign, axis in SIDES:
        point = 0.5 * layout.radius_m * np.eye(3)[(axis + 1) % 3]
        drive = paths.knock(layout.gravity, sign * settings.impulse_n_s * np.eye(3)[axis], point)
        yield Trial("knock", f"knock {_side(sign, axis)}", drive, 0, weighing=paths.WEIGHING)


def _misplaced(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    off_m, off_rad = settings.off_mm / 1000.0, math.radians(settings.off_deg)
    poses = misplacements(layout, off_m, off_rad, settings.misplacements, settings.seed)
    reached = met(layout, poses, off_m, off_rad)
    closing, weight = paths.closing(), paths.held_weight(layout.gravity)
    for place, (pose, tips) in enumerate(zip(poses, reached, strict=True)):
        drive = replace(joined(closing, weight), pose=pose, reached=tips)
        name = f"misplaced {place}"
        yield Trial("misplaced", name, drive, len(closing) - 1, apart=True, expected=weight)


def _side(sign: float, axis: int) -> str:
    return f"{'+' if sign > 0.0 else '-'}{AXES[axis]}"
