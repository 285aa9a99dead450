"""Measures simulated motions, judges whether the object was held, and when that is known.

Displacements are differences between the object's pose and its pose at the moment from which it had
to stay; the number of contacts plays no part. A rotation counts as the path of a point one grasp
size away. The functions are pure, so that old traces can be judged again. Poses are (n, 7): a
position [m] and a quaternion.

A trial need not run to its full length once its answer is known:

Lost. A trial asks whether displacements and gaps stay below thresholds. The first sample in which a
displacement does not answers it: nothing that comes later can make that sample undone. That is
certain loss, and it is the same sample by which the trial is judged.

Settled. A trial is answered as held where what is still to come is bounded. From some sample on,
load, forces of the servos and friction are constant. Let x be the motion of object and fingertips.
While every contact stays closed and inside its friction cone, fingertips stick to the object (up to
creep, below), and x is the motion of one rigid assembly on the springs of its k fingertips: masses
M, stiffness K and dampers G. Springs and dampers sit at the same fingertips, alike in all
directions, so G = (g / s) K for dampers g and springs s. A constant load has a potential, so

    E = x'M x' / 2 + e K e / 2,    e = x - x*,                                           (1)

never grows about the equilibrium x*, and the equation of motion M x'' + G x' + K e = 0 gives e from
what is measured. With w0^2 = k s / (object's mass + masses of k fingertips), the least square of a
natural frequency (about any axis the contacts' root mean square lever is at least the grasp size,
and the object's inertia a quarter of its mass times the square of that, so turning is no slower),

    |e|_K <= |x''|_M / w0 + (g / s) |x'|_K.                                              (2)

e K e is s times the sum of squares of the tips' ways to their equilibrium. So no fingertip is or
gets farther from its equilibrium than B = sqrt(2 E / s), and the object, whose shift and size times
turn have at most sqrt(2 / k) of it, moves by 2 sqrt(2 / k) B at most from here on.              (3)

Contact forces are those of the servos less the tips' inertia. With w = sqrt(s / m) for a tip's mass
m, speeds are at most w B, so forces stay within s B + g w B + m (w^2 B + (g / m) w B) of those at
equilibrium: (2 + 2 g / sqrt(s m)) s B, now and later.                                           (4)

The simulator's friction is not quite rigid: contacts inside their cones creep, at speeds that are
proportional to the forces and so constant at rest. Creep hides in measured speeds, which differ
from it by the speed of the transient, at most w B. So it is at most the measured speed plus that,
for the time that is left, and tips carry it into the springs.                                   (5)

If contacts are deeper in their cones, and servos farther from their limits, than (4) twice and (5)
together, then no contact ever slips or opens, so (1) to (5) hold to the end. Both bounds are
doubled for what the linear model leaves out (forces that turn with the object weaken springs by up
to a fifth; the acceleration is a mean over the last sample), and they may use up half of a
threshold. Contacts near the border of their cones never meet this: their trials run on. Rigid
fingertips have no springs, contacts nearly on one line have levers shorter than the grasp size
that scenes take, and the torques of soft contacts do not show in the servos, so there trials end
early only by loss.

The same bound tells when an object has settled at high friction before it is lowered.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Annotated, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.allowed_values import Measured
from grasp_core.arrays import Array, Indices, Shape, cross
from grasp_core.closure.contacts import cross_matrix, normal_and_tangential
from grasp_core.declared import Declared, declared
from grasp_core.figures import Shown
from grasp_core.messages import MICRO, MILLI
from grasp_core.objects.on_faces import within
from scenes.mujoco.closure_scene import Layout, grasp_size
from scenes.mujoco.mjcf_text import IDENTITY_POSE
from sim_validate.engine.schedules import Schedule, Thresholds
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
    shifts = _lengths(ahead - starts[:, :3] - rotated(starts[:, 3:], layout.center))
    return shifts, rotation_angles(poses[:, 3:], starts[:, 3:])


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
    return 2.0 * np.arctan2(_lengths(across), along)


def _lengths(vectors: Array) -> Array:
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


SAFETY = 2.0
"""Factor on bounds of motions and forces, for what the linear model leaves out."""
USABLE = 0.5
"""Largest share of a threshold that an object may use up, bounds included, to count as held."""
SETTLED_MOTION = 0.01
"""Bound of the motion to come, relative to the threshold, at which an object has settled before
friction is lowered. The servos' forces are then within some 1e-4 of those at rest, in largest
normal forces, which is less than thresholds let pass."""
LEAST_WATCHED_SAMPLES = 3
"""Least number of samples for which an object is watched after friction was lowered. A contact that
must slip begins to in the first step."""
SIZE_SLACK = 1e-6
"""Difference of two sizes that is rounding, relative to them."""


class EarlyEnds:
    """Looks at the trials of a scene sample by sample, and tells which of them may end."""

    def __init__(
        self, layout: Layout, trials: Sequence[Schedule], sample_s: float, thresholds: Thresholds,
        start: Array | None = None,
    ) -> None:  # fmt: skip
        self.layout, self.thresholds, self.sample_s = layout, thresholds, sample_s
        self.resting = np.array([trial.resting for trial in trials])
        self.watched = np.array([trial.watched for trial in trials])
        # speeds of the sample before give the first acceleration under a constant load
        self.earliest = int(self.resting.min()) - 1
        self.frictions = np.array([trial.friction for trial in trials])
        pushes = np.array([trial.forces[-1] for trial in trials])
        self.commands = np.einsum("kij,nki->nkj", layout.frames, pushes).reshape(len(trials), -1)
        at = IDENTITY_POSE if start is None else start[:7]
        self.starts = np.tile(at, (len(trials), 1))
        self.began_m = np.full(len(trials), strayed(at[None], layout)[0])
        self.springs = _springs(layout)
        # |x'|_M of the look before; there is none before the first
        self.momenta: Array | None = None
        # a turn is at most 2.25 times the length of the difference of two quaternions
        self.lever = 2.25 * (float(np.linalg.norm(layout.center)) + layout.grasp_size_m)

    def following(self, places: Indices, samples: Indices, joints: Array, speeds: Array) -> Indices:
        """Give the sample after one for each trial that goes on (see `Bench.simulated`)."""
        after = samples + 1
        if samples.min() >= self.earliest:
            settled, answered = self.look(places, samples, joints[places], speeds[places])
            after = np.where(settled, self.watched[places], after)
            after[answered] = self.frictions.shape[1]
        return after

    def look(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array
    ) -> tuple[Mask, Mask]:
        """Tell from joints (n, 7 + 3k) and speeds (n, 6 + 3k) which trials go on.

        Gives those that need not settle any longer, and those that are answered, (n,) each.
        """
        settled = answered = np.zeros(len(places), dtype=np.bool_)
        with np.errstate(all="ignore"):  # what diverges is neither settled nor answered
            reach = self._reach(places, speeds)
            after = samples >= self.watched[places]
            if not after.all():
                settled = ~after & self._settled(places, samples, joints, speeds, reach)
                # from where objects must not move, in case friction is lowered next
                self.starts[places[~after]] = joints[~after, :7]
                self.began_m[places[~after]] = np.nan
            if after.any():
                answered = after & self._answered(places, samples, joints, speeds, reach)
        return settled, answered

    def _reach(self, places: Indices, speeds: Array) -> Array | None:
        """Bound the way of each tip to its equilibrium: B of (3), (n,) [m]; None if unknown."""
        if self.springs is None:
            return None
        # not by BLAS, whose last digits depend on how many trials there are
        momenta = np.einsum("ni,ij->nj", speeds, self.springs.roots)
        before = self.momenta
        # NaN where a trial was not looked at, which ends nothing
        self.momenta = np.full((len(self.watched), speeds.shape[1]), np.nan)
        self.momenta[places] = momenta
        if before is None:
            return None
        gained = _lengths(momenta - before[places]) / self.sample_s
        return self.springs.reach(_lengths(momenta), gained, _lengths(speeds[:, 6:]))

    def _settled(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array, reach: Array | None
    ) -> Mask:
        """Tell whether nothing that counts can come while friction is high, (n,)."""
        if self.springs is None or reach is None:
            return np.zeros(len(places), dtype=np.bool_)
        calm = self.springs.further(reach) <= SETTLED_MOTION * self.thresholds.watched_m
        calm &= samples >= self.resting[places]
        if calm.any():
            friction = self.frictions[places, samples]
            calm &= self.springs.stuck(self.commands[places], friction, joints, speeds, reach, 0.0)
        return calm

    def _answered(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array, reach: Array | None
    ) -> Mask:
        """Tell whether trials are lost, or held whatever is still to come, (n,)."""
        limits, springs, starts = self.thresholds, self.springs, self.starts[places]
        if np.isnan(self.began_m[places]).any():
            self.began_m[places] = strayed(starts, self.layout)
        began = self.began_m[places]
        away = joints[:, :7] - starts
        most = _lengths(away[:, :3]) + self.lever * _lengths(away[:, 3:])
        lost = np.zeros(len(places), dtype=np.bool_)
        # alone and beside others a trial must end alike, so only what may be lost is measured
        near = ~(np.maximum(most / limits.watched_m, (began + most) / limits.total_m) < 1.0)
        if near.any():
            moved = displaced(joints[near, :7], starts[near], self.layout)
            lost[near] = (moved >= limits.watched_m) | (began[near] + moved >= limits.total_m)
        seen = samples - self.watched[places] + 1 >= LEAST_WATCHED_SAMPLES
        if springs is None or reach is None or not seen.any():
            return lost
        left_s = self.sample_s * (self.frictions.shape[1] - 1 - samples)
        most = most + springs.further(reach) + SAFETY * left_s * springs.creep(speeds, reach)
        held = np.maximum(most / limits.watched_m, (began + most) / limits.total_m) <= USABLE
        held &= seen
        if held.any():
            friction = self.frictions[places, -1]
            commands = self.commands[places]
            held &= springs.stuck(commands, friction, joints, speeds, reach, left_s)
        return lost | held


class _Springs:
    """The linear model of an object that sticks to its fingertips."""

    def __init__(self, layout: Layout) -> None:
        drive, count = layout.drive, len(layout.contacts)
        self.spring, self.damper = drive.stiffness_n_per_m, drive.damping_n_s_per_m
        self.size, self.largest = layout.grasp_size_m, drive.max_normal_force_n
        self.share = math.sqrt(2.0 / count)
        moving = layout.object_kg + count * drive.tip_mass_kg
        self.slowest = math.sqrt(count * self.spring / moving)
        self.fastest = math.sqrt(self.spring / drive.tip_mass_kg)
        self.forces = 2.0 + 2.0 * self.damper / math.sqrt(self.spring * drive.tip_mass_kg)
        # angular velocity times this is how fast the simulated centre of mass moves with it
        arm = cross_matrix(layout.center)
        self.arms = np.block([[np.eye(3), np.zeros((3, 3))], [arm, self.size * np.eye(3)]])
        # speeds times these have the length |x'|_M
        roots = np.eye(6 + 3 * count) * math.sqrt(drive.tip_mass_kg)
        roots[:3, :3] = np.eye(3) * math.sqrt(layout.object_kg)
        roots[3:6, :3] = math.sqrt(layout.object_kg) * arm
        roots[3:6, 3:6] = np.linalg.cholesky(layout.inertia_kg_m2)
        self.roots = roots

    def reach(self, moving: Array, gaining: Array, tips: Array) -> Array:
        """Compute B of (3) from |x'|_M, |x''|_M and the length of all tips' velocities."""
        away = gaining / self.slowest + self.damper / math.sqrt(self.spring) * tips
        return np.sqrt((moving**2 + away**2) / self.spring)

    def further(self, reach: Array) -> Array:
        """Bound the motion of the object that transients can still cause, (3), (n,) [m]."""
        return SAFETY * 2.0 * self.share * reach

    def creep(self, speeds: Array, reach: Array) -> Array:
        """Bound the speed with which the object creeps, (5), (n,) [m/s]."""
        moving = np.einsum("ni,ij->nj", speeds[:, :6], self.arms)
        measured = _lengths(moving[:, :3]) + _lengths(moving[:, 3:])
        return measured + self.share * self.fastest * reach

    def stuck(
        self, commands: Array, friction: Array, joints: Array, speeds: Array, reach: Array,
        left_s: Array | float,
    ) -> Mask:  # fmt: skip
        """Tell whether all contacts stay inside the cones of a friction for a time, (n,)."""
        pushes = commands - self.spring * joints[:, 7:] - self.damper * speeds[:, 6:]
        pushes = pushes.reshape(len(pushes), -1, 3)
        crept = left_s * (_lengths(speeds[:, 6:]) + self.fastest * reach)
        change = (SAFETY * self.spring * (2.0 * self.forces * reach + crept))[:, None]
        normal, across = pushes[..., 0], np.hypot(pushes[..., 1], pushes[..., 2])
        slope = friction[:, None]
        inside = slope * normal - across > (1.0 + slope) * change
        good: Mask = inside & (normal > change) & (normal < self.largest - change)
        return np.logical_and.reduce(good, axis=1)


@lru_cache(maxsize=4)
def _springs(layout: Layout) -> _Springs | None:
    """Return the linear model of a layout; None where it would not bound the motion."""
    # contacts must be hard, and as far from their closest axis as the layout's grasp size
    if not layout.has_springs or layout.softness.is_soft:
        return None
    if grasp_size(layout.contacts) < layout.grasp_size_m * (1.0 - SIZE_SLACK):
        return None
    return _Springs(layout)
