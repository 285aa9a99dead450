"""Simulates held objects under drives, and says what their motions and contact forces mean.

All trials of a scene run together. The palm is moved by forces: armature times the acceleration
that its path asks for. MuJoCo's bodies of motion capture would have no velocity, so the bases of
the fingers would not carry what they hold along.

A motion says how far contacts slipped, how far the object moved, and when that began. Everything
is seen from the palm. In the object's frame the centre of tip i is u_i. A fingertip that turns
against the object by dt since the last sample, as one on springs does when the object turns by -dt,
rolls on it, so with the inward normal n_i the point of contact slides on the object by the
tangential part of

    du_i + rho_i dt x n_i.                                                                (1)

The load of first slip is taken from the contact forces. They are (n, t) at rest and change by
(a, b), in the frames of the contacts, so a load that is larger by the factor s would change them by
s (a, b) as long as motions are small. The least s that brings a contact to its cone, times the
share of the load that is applied, is the multiple of the load at which the first contact slips. It
is taken in the sample before the first contact is on its cone. If none ever is, the least of all
samples under the full load says how far away slip stayed. A load that is all there when a contact
slips, as that of a knock, has no share by which it could be measured; then the trial is followed
again with contacts that stick, and the least of all samples is the multiple.

An object that leaves a table rocks on its last edge and rings, so that a contact may touch its cone
for some milliseconds, slide by micrometres, and hold. Such a touch is no slip: a row of samples on
the cone counts only if the contact slides by more than `TOUCH_SLIDE` in it, or if the row reaches
the full load.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, cross
from grasp_core.errors import InputError
from grasp_core.execution.first_slip import slip_steps
from scenes.mujoco.held_scene import SAMPLE_S, HeldLayout, HeldScene, hinged, palm_armature
from scenes.mujoco.mjcf_text import rotations
from sim_validate.engine.simulated_friction import LEAST_PUSHING
from sim_validate.engine.stepping import OBJECT_END, PALM_END, Bench, Health, Motion, Told
from sim_validate.execution.paths import WHOLE_SLACK, SampleRows, TrialDrive, closing

KEPT_STATE = ("qvel", "qfrc_constraint", "state")
"""What is read beside the positions of joints."""
BOUNDLESS = 1e100
"""Size from which on a number of the simulator says nothing."""
LAID = 1e-7
"""Depth of a table in the object at the start, in object radii: more than the rounding of meshes to
single precision, and about as deep as objects rest."""


@dataclass(frozen=True, eq=False)
class HeldMotion(SampleRows):
    """Where object, palm and fingertips were in each of the n samples of a trial.

    What is in the world's frame is kept, and what the palm or the object sees is made from it.
    """

    ROWS = ("joints", "states", "tips", "tip_turns", "forces", "pressed", "table")

    layout: HeldLayout
    health: Health
    joints: Array
    """Positions of the scene's joints, (n, 13 + joints) [m, rad]: those of the object and its
    orientation (w, x, y, z), those of the palm's slides and hinges, and those of the fingers."""
    states: Array
    """Complete state of the simulator, from which a trial can go on, (n, size)."""
    tips: Array
    """Displacements of the fingertips along their springs, (n, k, 3) [m]."""
    tip_turns: Array
    """Orientations of the fingertips in the palm, (n, k, 3, 3), or (n, 1, 3, 3) if alike."""
    forces: Array
    """Contact forces on the object along the axes of the springs, (n, k, 3) [N]."""
    pressed: Array
    """Orientation of the object in the palm when these forces acted, (n, 3, 3): at the start of the
    last step of a sample."""
    table: Array
    """Force of the table on the object, (n, 3) [N]; other loads are taken away."""

    @property
    def moved(self) -> Array:
        """Displacement of the object's centre of mass in the world, (n, 3) [m]."""
        return self.joints[:, :3]

    @property
    def turned(self) -> Array:
        """Orientation of the object in the world (w, x, y, z), (n, 4)."""
        return self.joints[:, 3:7]

    @property
    def palm(self) -> Array:
        """Positions of the palm's slides and hinges, (n, 6) [m, rad]."""
        return self.joints[:, 7 : PALM_END + 1]

    @cached_property
    def shifts(self) -> Array:
        """Displacement of the object's centre of mass in the palm, (n, 3) [m]."""
        return np.einsum("nji,nj->ni", hinged(self.palm[:, 3:]), self.moved - self.palm[:, :3])

    @cached_property
    def turns(self) -> Array:
        """Orientation of the object in the palm, (n, 3, 3)."""
        return hinged(self.palm[:, 3:]).transpose(0, 2, 1) @ rotations(self.turned)

    @cached_property
    def spun(self) -> Array:
        """Orientations of the fingertips in the object, as `tip_turns`."""
        back: Array = self.turns.transpose(0, 2, 1)[:, None]
        return back @ self.tip_turns

    @cached_property
    def centers(self) -> Array:
        """Centres of the fingertips in the object's frame, (n, k, 3) [m]."""
        layout = self.layout
        centers = layout.tip_centers + np.einsum("kij,nkj->nki", layout.axes, self.tips)
        return np.einsum("nji,nkj->nki", self.turns, centers - self.shifts[:, None])

    @cached_property
    def pushes(self) -> Array:
        """Contact forces on the object in its contacts' frames, which turn with it, (n, k, 3)."""
        along = np.einsum("kij,nkj->nki", self.layout.axes, self.forces)
        own = np.einsum("nji,nkj->nki", self.pressed, along)
        return np.einsum("kij,nki->nkj", self.layout.frames, own)

    def slid(self, begun: int = 0) -> Array:
        """Return the displacement of each point of contact by (1) since a sample, (n, k, 3) [m]."""
        normals, spun = self.layout.frames[:, :, 0], self.spun[begun:]
        change: Array = spun[:-1] @ spun[1:].transpose(0, 1, 3, 2)  # its axis is that of minus dt
        turns = 0.5 * np.stack(
            [change[..., 2, 1] - change[..., 1, 2], change[..., 0, 2] - change[..., 2, 0],
             change[..., 1, 0] - change[..., 0, 1]], axis=-1,
        )  # fmt: skip
        rolled = self.layout.tip_radius_m[:, None] * cross(turns, normals)
        slid = np.diff(self.centers[begun:], axis=0) - rolled
        slid -= np.einsum("nki,ki->nk", slid, normals)[..., None] * normals
        return np.concatenate([np.zeros((1, *slid.shape[1:])), np.cumsum(slid, axis=0)])

    def slides(self, begun: int = 0) -> Array:
        """Return how far each point of contact has slid by (1) since a sample, (n, k) [m]."""
        return np.linalg.norm(self.slid(begun), axis=2)


class HeldBench(Bench[HeldScene]):
    """A compiled scene of execution on which many trials run at once."""

    def __init__(
        self, scene: HeldScene, *, threads: int = 1, sample_s: float = SAMPLE_S,
        lost_m: float = math.inf, step_s: float | None = None,
    ) -> None:  # fmt: skip
        step_s = scene.physics.timestep if step_s is None else step_s
        chunk = max(1, round(sample_s / step_s))
        if sample_s == SAMPLE_S and abs(chunk * step_s - SAMPLE_S) > WHOLE_SLACK * SAMPLE_S:
            raise InputError(
                f"physics.timestep must divide the sample of {SAMPLE_S:g} s, got {step_s:g} s; "
                "take 0.00125 s"
            )
        super().__init__(scene, threads=threads, chunk=chunk, step_s=step_s, kept=KEPT_STATE)
        self.lost_m = lost_m
        self.tips = self.shapes(scene.layout.holder.tip_names)
        self.rubbing = slice(min(self.tips), max(self.tips) + 1)

    def run(
        self, drives: Sequence[TrialDrive], start: Array | None = None
    ) -> tuple[HeldMotion, ...]:
        """Simulate trials, all from the same state, (size,), or from one each, (n, size)."""
        losing = _Losing([drive.lost or (self.lost_m, math.inf) for drive in drives])
        told = [self._told_by(drive, fresh=start is None) for drive in drives]
        motions = self.simulated(told, start, losing.following)
        return tuple(
            self._motion(motion, len(drive), lost=place in losing.lost)
            for place, (motion, drive) in enumerate(zip(motions, drives, strict=True))
        )

    def settled(self, drive: TrialDrive, start: Array | None = None) -> tuple[HeldMotion, Array]:
        """Simulate one trial; return its motion and the simulator's complete state at its end."""
        (motion,) = self.run([drive], start)
        return motion, motion.states[-1]

    @cached_property
    def squeezed(self) -> Array:
        """The simulator's complete state when fingers have closed on the weightless object."""
        return self.settled(closing())[1]

    def placed(self, reached: Array | None) -> Array:
        """Return the positions of all joints where fingertips are displaced along their springs."""
        joints = self.home.copy()
        if reached is not None:
            joints[PALM_END + 1 :] = self.scene.layout.holder.joints(reached)
        return joints

    def _told_by(self, drive: TrialDrive, *, fresh: bool) -> Told:
        """Return what a drive tells the scene; where its trial is fresh, it begins in its pose."""
        layout, n, joints, table, friction = self.scene.layout, len(drive), None, None, None
        loads = drive.wrenches.copy()
        loads[:, :3] += layout.object_kg * (drive.gravity - layout.gravity)
        if fresh:
            joints = self.placed(drive.reached)
            if drive.pose is not None:
                joints[:7] = [*drive.pose.moved, *drive.pose.quaternion]
        if drive.table is not None:  # where it touches: objects would fall, sink and rise
            point = drive.table.point + LAID * layout.radius_m * drive.table.normal
            table = np.tile([*point, *drive.table.quaternion], (n, 1))
        if drive.friction is not None:
            friction = np.tile(self.roughness[self.rubbing], (n, 1))
            friction[:, np.array(self.tips) - self.rubbing.start] = drive.friction
        return Told(
            loads, layout.commands(drive.grasping.reshape(n, -1), drive.reached),
            drive.accelerations * palm_armature(layout), friction, table, joints, drive.velocity,
        )  # fmt: skip

    def _motion(self, motion: Motion, length: int, *, lost: bool) -> HeldMotion:
        """See a motion as that of a held object, which stays where it was lost."""
        last = len(motion.joints) - 1
        joints, (speeds, forces, states) = motion.joints, motion.kept
        if lost:
            rest = ((0, length - 1 - last), (0, 0))
            joints = np.pad(joints, rest, mode="edge")
            speeds, forces, states = (np.pad(each, rest) for each in motion.kept)
            forces[last:] = 0.0
        # where the simulator diverges: what is beyond all bounds has no cosine and no square
        joints, speeds, forces = (
            np.where(np.abs(each) < BOUNDLESS, each, np.nan) for each in (joints, speeds, forces)
        )
        palm, fingers = joints[:, 7 : PALM_END + 1], joints[:, PALM_END + 1 :]
        layout = self.scene.layout
        object_turns = rotations(joints[:, 3:7])
        turned = hinged(palm[:, 3:]).transpose(0, 2, 1) @ object_turns
        # contact forces are those of the last step's start, from which speeds lead to its end
        back = -self.step_s * speeds
        half = np.column_stack([np.ones(len(back)), 0.5 * back[:, 3:OBJECT_END]])
        half /= np.linalg.norm(half, axis=1)[:, None]
        palm_then = hinged(palm[:, 3:] + back[:, OBJECT_END + 3 : PALM_END]).transpose(0, 2, 1)
        pressed = palm_then @ object_turns @ rotations(half)
        tips, _, turns = layout.holder.seen(fingers, forces[:, PALM_END:], turned)
        before = fingers + back[:, PALM_END:]
        _, contact, _ = layout.holder.seen(before, forces[:, PALM_END:], pressed)
        if turns is None:
            turns = np.broadcast_to(np.eye(3), (length, 1, 3, 3))
        table = forces[:, :3] - np.einsum("kij,nkj->ni", layout.axes, contact)
        return HeldMotion(
            layout, motion.health, joints, states, tips, turns, contact, pressed, table
        )


class _Losing:
    """Ends trials where their object is farther from its place, or turned by more, than it may."""

    def __init__(self, limits: Sequence[tuple[float, float]]) -> None:
        self.most_m, most_rad = np.transpose(limits)
        self.least_cosine = np.cos(np.minimum(most_rad, math.pi))
        self.turns_count = bool((self.least_cosine > -1.0).any())
        self.lost = set[int]()

    def following(self, going: Indices, samples: Indices, joints: Array, _speeds: Array) -> Indices:
        """Give the sample after one for each trial that goes on (see `Bench.simulated`)."""
        with np.errstate(over="ignore", invalid="ignore"):  # where the simulator diverges
            away = joints[going, :3]
            away -= joints[going, 7:10]
            gone = np.sqrt(np.einsum("ni,ni->n", away, away)) > self.most_m[going]
            if self.turns_count:
                now = joints[going]
                palm = hinged(now[:, 10 : PALM_END + 1]).transpose(0, 2, 1)
                gone |= cosines(palm @ rotations(now[:, 3:7])) < self.least_cosine[going]
        if not gone.any():
            return samples + 1
        self.lost |= set(going[gone].tolist())
        return np.where(gone, np.iinfo(np.intp).max, samples + 1)


def cosines(turned: Array) -> Array:
    """Return the cosines of the angles of rotations, (n,)."""
    return 0.5 * (np.einsum("nii->n", turned) - 1.0)


ON_CONE = 0.9995
"""Tangential force, relative to friction times normal force, at which a contact counts as on its
cone: the simulator's contacts approach it within as much."""
SLIPPED_BY = 2e-3
"""Distance that counts as slipped, in object radii: between two samples a contact may slip and
hold again, and rolling over large turns is known to about a tenth of it."""
TOUCH_SLIDE = 1e-4
"""Distance that a contact on its cone may slide while an object leaves a table and still count as
held, in object radii: contacts that stick creep by a twentieth of it in a lift."""
FULL_LOAD = 0.999
"""Share of the load above which it is all there."""


@dataclass(frozen=True, slots=True)
class TrialFigures:
    """What became of an object in one trial, against its place when the trial began.

    The figures are those of `ExecutionTrial`.
    """

    slip_m: float
    displacement_m: float
    turn_rad: float
    dropped: bool
    slipped: bool
    """Whether a contact slipped: one was on its cone, or slid by more than `SLIPPED_BY`."""
    first_slip: float
    """Multiple of the trial's load at which the first contact slips; at most one if one did."""


def outcome(motion: HeldMotion, drive: TrialDrive, friction: Array, begun: int = 0) -> TrialFigures:
    """Say what became of the object since a sample of a trial."""
    (moved, turned), radius_m = moves(motion, begun), motion.layout.radius_m
    slid = float(motion.slides(begun).max(initial=0.0))
    leaving = None if drive.table is None else motion.slid(begun) / radius_m
    multiple = _first_slip(motion.pushes, drive.shares, friction, begun, leaving)
    slipped = multiple <= 1.0 or slid > SLIPPED_BY * radius_m
    return TrialFigures(
        slip_m=slid,
        displacement_m=float(moved.max()),
        turn_rad=float(turned.max()),
        dropped=not (motion.pushes[-1, :, 0] > 0.0).any(),
        slipped=slipped,
        first_slip=min(multiple, 1.0) if slipped else multiple,
    )


def moves(motion: HeldMotion, begun: int) -> tuple[Array, Array]:
    """Return how far an object has moved [m] and turned [rad] since a sample, (n - begun,) each."""
    moved, turned = motion.shifts[begun:], motion.turns[begun:]
    angles = np.arccos(np.clip(cosines(turned @ turned[0].T), -1.0, 1.0))
    return np.linalg.norm(moved - moved[0], axis=1), angles


def sticking_multiple(motion: HeldMotion, drive: TrialDrive, friction: Array, begun: int) -> float:
    """Return the multiple of the load at which contacts that stick would reach their cones."""
    pushing, _ = _on_cone(motion.pushes, friction, begun)
    if not pushing.any():  # the object was lost before the load came
        return 0.0
    return _under_full_load(motion.pushes[:, pushing], drive.shares, friction[pushing], begun)


def first_trouble(motion: HeldMotion, friction: Array, begun: int) -> int:
    """Return the first sample in which a contact slips or opens, or the simulator fails; else n."""
    on_cone = _on_cone(motion.pushes, friction, begun)[1].any(axis=1)
    troubled = np.flatnonzero(on_cone | ~np.isfinite(motion.joints).all(axis=1))
    return int(troubled[0]) if len(troubled) else len(motion.joints)


def _on_cone(
    pushes: Array, friction: Array, begun: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which contacts push at rest, (k,), and when those slip or are open, (n, pushing)."""
    rest_n = pushes[begun, :, 0]
    # a fingertip that pushes at nothing cannot slip
    pushing = rest_n > LEAST_PUSHING * rest_n.max()
    forces = pushes[:, pushing]
    across = np.linalg.norm(forces[..., 1:], axis=2)
    on_cone = across >= ON_CONE * friction[pushing] * forces[..., 0]
    on_cone[: begun + 1] = False
    return pushing, on_cone


def _first_slip(
    pushes: Array, shares: Array, friction: Array, begun: int, leaving: Array | None = None
) -> float:
    pushing, on_cone = _on_cone(pushes, friction, begun)
    if not pushing.any():
        return 0.0
    forces, friction = pushes[:, pushing], friction[pushing]
    if leaving is not None:
        on_cone[begun:] &= ~_touches(on_cone[begun:], shares[begun:], leaving[:, pushing])
    slipping = on_cone.any(axis=1)
    if not slipping.any():
        return _under_full_load(forces, shares, friction, begun)
    at = int(np.argmax(slipping))
    before, after = sorted((float(shares[at - 1]), float(shares[at])))
    (multiple,) = _extrapolated(forces, shares, friction, begun, np.array([at - 1]))
    return min(max(float(multiple), before), after)


def _touches(on_cone: NDArray[np.bool_], shares: Array, slid: Array) -> NDArray[np.bool_]:
    """Return which samples on the cone only touch it before the full load comes, (n, k)."""
    found = np.zeros_like(on_cone)
    last = len(on_cone) - 1
    for contact, own in enumerate(on_cone.T):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], own, [0]])))
        for first, end in edges.reshape(-1, 2):
            by = slid[min(end, last), contact] - slid[first - 1, contact]
            little = np.linalg.norm(by) <= TOUCH_SLIDE
            found[first:end, contact] = little and shares[end - 1] < FULL_LOAD
    return found


def _under_full_load(forces: Array, shares: Array, friction: Array, begun: int) -> float:
    """Return the least multiple of the load at first slip that is seen while all of it is there."""
    loaded = np.flatnonzero(shares[begun:] >= FULL_LOAD) + begun
    return float(_extrapolated(forces, shares, friction, begun, loaded).min(initial=np.inf))


def _extrapolated(forces: Array, shares: Array, friction: Array, begun: int, at: Indices) -> Array:
    """Return the multiple of the load at first slip as it is seen in samples `at`, (m,)."""
    least = slip_steps(forces[begun], forces[at] - forces[begun], friction).min(axis=1)
    return np.multiply(shares[at], least, out=np.full(len(at), np.inf), where=np.isfinite(least))
