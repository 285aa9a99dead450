"""Measures a simulated motion: how far the object moved and turned, and what each contact did.

Displacements are differences between the object's pose and its pose at the moment from which it had
to stay; the number of contacts plays no part. A rotation counts as the path of a point one grasp
size away.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.closure.wrenches import normal_and_tangential
from scenes.layout import Layout
from sim_validate.simulation.simulate import Motion

CLOCK_SLACK_S = 1e-9
"""Largest clock error that counts as rounding [s]: simulated time is a sum of equal steps, and a
reset would change it by milliseconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Motion of object and fingertips in the n samples from the moment the object must stay."""

    times_s: Array
    """Times of the samples, (n,) [s]."""
    displacements_m: Array
    """Motion of the point between the contacts plus grasp size times rotation, (n,) [m]."""
    shifts_m: Array
    """Motion of the point between the contacts alone, (n,) [m]."""
    rotations_rad: Array
    """Rotation of the object, (n,) [rad]."""
    slips_m: Array
    """Tangential motion of each fingertip over its face, (n, k) [m]."""
    gaps_m: Array
    """Distance of each fingertip from its face, negative in contact, (n, k) [m]."""
    touched_m: Array
    """Where each fingertip touches, in the object's frame about its centre of mass, (n, k, 3)
    [m]."""
    start_m: float
    """Displacement from the planned pose at the first sample of the trace [m]."""
    finite: bool
    """Whether every number of the simulator's state stayed finite."""
    warnings: int
    """How many warnings the simulator raised."""
    clock_error_s: float
    """Simulated time minus the time stepped [s]; it is not zero after a silent reset."""
    error: str = ""
    """The simulator's own message if it gave up, otherwise empty."""
    timed_out: bool = False
    """Whether the trial was stopped before its end."""

    @property
    def fault(self) -> str:
        """Why the trial proves nothing about the object, such as divergence; else empty."""
        if self.error:
            return self.error
        if self.timed_out:
            return "stopped before its end"
        if not self.finite:
            return "a number of the state is not finite"
        if self.warnings:
            return f"the simulator raised {self.warnings} warnings"
        if abs(self.clock_error_s) > CLOCK_SLACK_S:
            return f"the simulator's clock is off by {self.clock_error_s:.3g} s: it was reset"
        return ""

    def stayed(self, threshold_m: float) -> bool | None:
        """Tell whether no displacement reached a threshold [m]; None if the trial is not valid."""
        return None if self.fault else bool((self.displacements_m < threshold_m).all())


def trace(motion: Motion, layout: Layout, watched: int, earlier: Motion | None = None) -> Trace:
    """Measure displacements, slips and gaps in a motion.

    Args:
        motion: Motion of one trial.
        layout: The simulated layout.
        watched: Index of the first sample in which the object had to stay where it was.
        earlier: The motion from whose end this one started; None for the planned pose.
    """
    before = min(watched, len(motion.joints)) - 1
    planned = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0]])
    at_start = planned
    if before >= 0:
        at_start = motion.joints[before]
    elif earlier is not None and len(earlier.joints):
        at_start = earlier.joints[-1]
    joints = motion.joints[before + 1 :]
    shifts, rotations = _moved(joints, at_start, layout)
    start_shift, start_turn = _moved(at_start[None], planned, layout)
    # the pose at the start first, then all others
    rows = np.zeros((1 + len(joints), joints.shape[1]))
    rows[0, : len(at_start)], rows[1:] = at_start, joints
    normals, tips = layout.frames[:, :, 0], _tips(rows, layout)
    _, slips = normal_and_tangential(tips[1:] - tips[:1], normals)
    tips = tips[1:]
    heights = np.einsum("ki,nki->nk", normals, layout.contacts - tips)
    size = layout.grasp_size_m
    return Trace(
        times_s=motion.times_s[: len(shifts)],
        displacements_m=shifts + size * rotations,
        shifts_m=shifts,
        rotations_rad=rotations,
        slips_m=slips,
        gaps_m=heights - layout.drive.radius_m,
        touched_m=tips + layout.drive.radius_m * normals,
        start_m=float(start_shift[0] + size * start_turn[0]),
        finite=motion.finite,
        warnings=motion.warnings,
        clock_error_s=motion.clock_error_s,
        error=motion.error,
        timed_out=motion.timed_out,
    )


def _moved(joints: Array, start: Array, layout: Layout) -> tuple[Array, Array]:
    """Measure motion of the point between the contacts [m] and rotation [rad], (n,) each."""
    ahead = joints[:, :3] + rotated(joints[:, 3:7], layout.center)
    shifts = np.linalg.norm(ahead - start[:3] - rotated(start[None, 3:7], layout.center), axis=1)
    return shifts, rotation_angles(joints[:, 3:7], start[3:7])


def lengths(vectors: Array) -> Array:
    """Measure vectors (n, d), (n,); a length does not depend on the other rows."""
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))


def displaced(poses: Array, starts: Array, layout: Layout) -> Array:
    """Measure displacements as in `trace`, of n poses from a start each, (n,) [m].

    Args:
        poses: Positions and quaternions of the object's frame, (n, 7).
        starts: The poses from which displacements count, (n, 7).
        layout: The simulated layout.
    """
    now, then = poses[:, 3:], starts[:, 3:]
    shifts = poses[:, :3] + rotated(now, layout.center)
    shifts = shifts - starts[:, :3] - rotated(then, layout.center)
    across = then[:, :1] * now[:, 1:] - now[:, :1] * then[:, 1:] - cross(now[:, 1:], then[:, 1:])
    along = np.abs(np.einsum("ni,ni->n", now, then))
    return _path(shifts, across, along, layout)


def strayed(poses: Array, layout: Layout) -> Array:
    """Measure displacements of n poses from the planned one, (n,) [m]: as `displaced`, but faster.

    Args:
        poses: Positions and quaternions of the object's frame, (n, 7).
        layout: The simulated layout.
    """
    shifts = poses[:, :3] + rotated(poses[:, 3:], layout.center) - layout.center
    return _path(shifts, poses[:, 4:], np.abs(poses[:, 3]), layout)


def _path(shifts: Array, across: Array, along: Array, layout: Layout) -> Array:
    """Add the length of shifts (n, 3) and the grasp size times turns, (n,) [m].

    The sines (n, 3) and cosines (n,) of half the turns may have a common positive factor.
    """
    turns = 2.0 * np.arctan2(lengths(across), along)
    return lengths(shifts) + layout.grasp_size_m * turns


def _tips(joints: Array, layout: Layout) -> Array:
    """Compute fingertip centres in the object's frame, (n, k, 3)."""
    slides = joints[:, 7:].reshape(len(joints), (joints.shape[1] - 7) // 3, 3)
    if not slides.shape[1]:  # rigid fingertips
        slides = np.zeros((1, len(layout.contacts), 3))
    slid = np.einsum("kij,nkj->nki", layout.frames, slides)
    centers = layout.tip_centers + slid - joints[:, None, :3]
    # The conjugate of the object's quaternion turns world vectors into its frame.
    backwards = joints[:, None, 3:7] * np.array([1.0, -1.0, -1.0, -1.0])
    return rotated(backwards, centers)


def rotated(quaternions: Array, vectors: Array) -> Array:
    """Turn vectors (..., 3) by quaternions (..., 4) wxyz of any length but zero."""
    w, v = quaternions[..., :1], quaternions[..., 1:]
    squares = np.add.reduce(quaternions**2, axis=-1, keepdims=True)
    twice = 2.0 * cross(v, vectors) / squares
    return vectors + w * twice + cross(v, twice)


def rotation_angles(quaternions: Array, start: Array) -> Array:
    """Compute angles between orientations (n, 4) and one (4,), exact when small, (n,) [rad]."""
    w, v = quaternions[:, 0], quaternions[:, 1:]
    along = np.abs(quaternions @ start)
    across = start[0] * v - w[:, None] * start[1:] - cross(v, start[1:])
    return 2.0 * np.arctan2(np.linalg.norm(across, axis=1), along)
