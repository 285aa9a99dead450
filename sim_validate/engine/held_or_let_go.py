"""Measures simulated motions, and judges whether the object was held.

Displacements are differences between the object's pose and its pose at the moment from which it had
to stay; the number of contacts plays no part. A rotation counts as the path of a point one grasp
size away. The functions are pure, so that old traces can be judged again. Poses are (n, 7): a
position [m] and a quaternion.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.allowed_values import Measured
from grasp_core.arrays import Array, Shape, cross
from grasp_core.closure.contacts import normal_and_tangential
from grasp_core.declared import Declared, declared
from grasp_core.figures import Shown
from grasp_core.messages import MICRO, MILLI
from grasp_core.objects.on_faces import within
from scenes.mujoco.closure_scene import Layout
from scenes.mujoco.mjcf_text import IDENTITY_POSE
from sim_validate.engine.stepping import Health, Motion
from sim_validate.settings import HoldProtocol

Mask: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Motion of object and fingertips in the n samples from the moment the object must stay."""

    times_s: Array
    displacements_m: Array
    """Motion of the point between the contacts plus grasp size times rotation, (n,) [m]."""
    shifts_m: Array
    """Motion of the point between the contacts alone, (n,) [m]."""
    rotations_rad: Array
    slips_m: Array
    """Tangential motion of each fingertip over its face, (n, k) [m]."""
    gaps_m: Array
    """Distance of each fingertip from its face, negative in contact, (n, k) [m]."""
    touched_m: Array
    """Where each fingertip touches, in the object's frame about its centre of mass, (n, k, 3)
    [m]."""
    start_m: float
    """Displacement from the planned pose at the first sample of the trace [m]."""
    health: Health

    def stayed(self, threshold_m: float) -> bool | None:
        """Tell whether no displacement reached a threshold [m]; None if the trial is not valid."""
        return None if self.health.fault else bool((self.displacements_m < threshold_m).all())


def traces(
    motions: Sequence[Motion], layout: Layout, watched: Sequence[int],
    earlier: Motion | None = None,
) -> tuple[Trace, ...]:  # fmt: skip
    """Measure displacements, slips and gaps in motions, all together, which takes less time."""
    firsts = [
        min(first, len(motion.joints)) for motion, first in zip(motions, watched, strict=True)
    ]
    starts = np.array(
        [_start(motion, first, earlier) for motion, first in zip(motions, firsts, strict=True)]
    )
    parts = [motion.joints[first:] for motion, first in zip(motions, firsts, strict=True)]
    of = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    joints, ends = np.concatenate(parts), np.cumsum([len(part) for part in parts])[:-1]
    size, normals, radii = layout.grasp_size_m, layout.frames[:, :, 0], layout.holder.tip_radii
    shifts, rotations = moved(joints[:, :7], starts[of, :7], layout)
    tips, began = _tips(joints, layout), _tips(starts, layout)
    _, slips = normal_and_tangential(tips - began[of], normals)
    heights = np.einsum("ki,nki->nk", normals, layout.contacts - tips)
    each = [
        np.split(measured, ends)
        for measured in (
            shifts + size * rotations, shifts, rotations, slips, heights - radii,
            tips + radii[:, None] * normals,
        )
    ]  # fmt: skip
    return tuple(
        Trace(motion.times_s[: len(measured[0])], *measured, start_m=start_m, health=motion.health)
        for motion, start_m, *measured in zip(
            motions, strayed(starts[:, :7], layout).tolist(), *each, strict=True
        )
    )


def _start(motion: Motion, first: int, earlier: Motion | None) -> Array:
    """Return the joint positions from which the object must not move, (7 + 3k,)."""
    if first > 0:
        return motion.joints[first - 1]
    if earlier is not None and len(earlier.joints):
        return earlier.joints[-1]
    return np.append(IDENTITY_POSE, np.zeros(motion.joints.shape[1] - len(IDENTITY_POSE)))


def displaced(poses: Array, starts: Array, layout: Layout) -> Array:
    """Measure displacements of n poses from a start each, (n,) [m]."""
    shifts, turns = moved(poses, starts, layout)
    return shifts + layout.grasp_size_m * turns


def strayed(poses: Array, layout: Layout) -> Array:
    """Measure displacements from the planned pose, (n,) [m]."""
    return displaced(poses, np.broadcast_to(IDENTITY_POSE, poses.shape), layout)


def moved(poses: Array, starts: Array, layout: Layout) -> tuple[Array, Array]:
    """Measure motion of the point between the contacts [m] and rotation [rad], (n,) each."""
    ahead = poses[:, :3] + rotated(poses[:, 3:], layout.center)
    shifts = lengths_of(ahead - starts[:, :3] - rotated(starts[:, 3:], layout.center))
    return shifts, rotation_angles(poses[:, 3:], starts[:, 3:])


def displacements(poses: Array, middle: Array, size_m: float) -> Array:
    """Measure displacements of poses (n, 7) from the first, (n,) [m].

    A rotation counts as the path of a point that is a size [m] away from a middle (3,).
    """
    starts = np.broadcast_to(poses[:1], poses.shape)
    ahead = poses[:, :3] + rotated(poses[:, 3:], middle)
    shifts = lengths_of(ahead - starts[:, :3] - rotated(starts[:, 3:], middle))
    return shifts + size_m * rotation_angles(poses[:, 3:], starts[:, 3:])


def _tips(joints: Array, layout: Layout) -> Array:
    """Compute fingertip centres in the object's frame, (n, k, 3)."""
    centers = layout.holder.tips(joints[:, 7:]) - joints[:, None, :3]
    # The conjugate of the object's quaternion turns world vectors into its frame.
    backwards = joints[:, None, 3:7] * np.array([1.0, -1.0, -1.0, -1.0])
    return rotated(backwards, centers)


def rotated(quaternions: Array, vectors: Array) -> Array:
    """Turn vectors (..., 3) by quaternions (..., 4) wxyz of any length but zero."""
    w, v = quaternions[..., :1], quaternions[..., 1:]
    squares = np.add.reduce(quaternions**2, axis=-1, keepdims=True)
    twice = 2.0 * cross(v, vectors) / squares
    return vectors + w * twice + cross(v, twice)


def rotation_angles(quaternions: Array, starts: Array) -> Array:
    """Compute angles between n orientations and one each (n, 4), exact when small, (n,) [rad]."""
    now, then = quaternions, starts
    across = then[:, :1] * now[:, 1:] - now[:, :1] * then[:, 1:] - cross(now[:, 1:], then[:, 1:])
    along = np.abs(np.einsum("ni,ni->n", now, then))
    return 2.0 * np.arctan2(lengths_of(across), along)


def lengths_of(vectors: Array) -> Array:
    """Return lengths, (n,), which do not depend on how many vectors there are."""
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))


class Outcome(StrEnum):
    """How a trial ended."""

    HELD = "held"
    SLIPPED = "slipped"
    LOST_CONTACT = "lost_contact"
    DIVERGED = "diverged"
    INVALID_START = "invalid_start"
    TIMEOUT = "timeout"
    ERROR = "error"


LET_GO = (Outcome.SLIPPED, Outcome.LOST_CONTACT)
"""Outcomes which say that the object was not held. All other outcomes but `HELD` leave open whether
it is held."""


@declared
class HoldVerdict(Declared):
    """The outcome of a trial, with the figures that led to it."""

    outcome: Annotated[Outcome, Shown("outcome")]
    """`held`, or how the object was lost."""
    reason: str
    """What happened; empty if the object was held."""
    displacement_m: Annotated[Measured, Shown("um moved", ".2g", MICRO)]
    """Largest displacement while the object had to be held [m]: motion of the point between the
    contacts plus grasp size times rotation."""
    start_displacement_m: Measured
    """Displacement before friction was lowered, while the object was loaded [m]."""
    rotation_rad: Measured
    """Largest rotation of the object while it had to be held [rad]."""
    slip_m: Annotated[Array, Shape(None, nan=True)]
    """Largest tangential motion of each fingertip over its face, (k,) [m]."""
    failed_after_s: float | None
    """When a threshold was first crossed [s], from the moment friction was lowered; None if
    never."""


def judge(
    trace: Trace, layout: Layout, protocol: HoldProtocol, amiss: Sequence[str] = ()
) -> HoldVerdict:
    """Judge a trial: compare its motion with the thresholds of a protocol.

    Where fingertips do not stand as they were put, `amiss` says why, and the start is invalid.
    """
    size = layout.grasp_size_m
    moved = trace.displacements_m >= protocol.hold_threshold * size
    strayed = trace.start_m + trace.displacements_m >= protocol.total_threshold * size
    apart = (trace.gaps_m > protocol.gap_threshold * size).any(axis=1)
    failing = np.flatnonzero(moved | strayed | apart)
    first = int(failing[0]) if failing.size else None
    outcome, reason = _outcome(trace, layout, protocol, first)
    if amiss:
        outcome, reason = Outcome.INVALID_START, "; ".join(amiss)
    return HoldVerdict(
        outcome=outcome,
        reason=reason,
        displacement_m=float(trace.displacements_m.max(initial=0.0)),
        start_displacement_m=trace.start_m,
        rotation_rad=float(trace.rotations_rad.max(initial=0.0)),
        slip_m=trace.slips_m.max(axis=0, initial=0.0),
        failed_after_s=None if first is None else float(trace.times_s[first]),
    )


def holds(trace: Trace, layout: Layout, protocol: HoldProtocol) -> bool | None:
    """Tell whether a trace shows the object held; None if the trace does not decide it."""
    outcome = judge(trace, layout, protocol).outcome
    return outcome is Outcome.HELD if outcome in (Outcome.HELD, *LET_GO) else None


def _outcome(
    trace: Trace, layout: Layout, protocol: HoldProtocol, first: int | None
) -> tuple[Outcome, str]:
    health = trace.health
    if health.fault:
        stopped = Outcome.TIMEOUT if health.timed_out else Outcome.DIVERGED
        return Outcome.ERROR if health.error else stopped, health.fault
    if trace.start_m >= protocol.total_threshold * layout.grasp_size_m:
        moved = f"the object moved by {_um(trace.start_m)} while it was loaded at high friction"
        return Outcome.SLIPPED, moved
    if first is None:
        return Outcome.HELD, ""
    # the finger that lost its face, or slid farthest, when a threshold was first crossed
    gaps, slips = trace.gaps_m[first], trace.slips_m[first]
    on_faces = [  # true where the face is not known
        not border or any(within(point, piece, frame[:, 0], 0.0) for piece in border)
        for point, border, frame in zip(
            trace.touched_m[first], layout.borders, layout.frames, strict=True
        )
    ]
    if not all(on_faces):
        return Outcome.LOST_CONTACT, f"finger {on_faces.index(False)} rolled off its face"
    finger = int(np.argmax(gaps))
    if gaps[finger] > protocol.gap_threshold * layout.grasp_size_m:
        return Outcome.LOST_CONTACT, f"finger {finger} is {_um(gaps[finger])} off its face"
    finger = int(np.argmax(slips))
    turned = f"the object turned by {MILLI * trace.rotations_rad[first]:.3g} mrad"
    if trace.displacements_m[first] < protocol.hold_threshold * layout.grasp_size_m:
        turned += f" after {_um(trace.start_m)} of motion while it was loaded"
    return Outcome.SLIPPED, f"finger {finger} slid {_um(slips[finger])} over its face, {turned}"


def _um(length_m: float) -> str:
    return f"{MICRO * length_m:.3g} um"
