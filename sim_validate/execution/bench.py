"""Simulates held objects under drives, and returns their motions and contact forces.

All trials of a scene run together. The palm is moved by forces: armature times the acceleration
that its path asks for. MuJoCo's bodies of motion capture would have no velocity, so the bases of
the fingers would not carry what they hold along.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core; plain arrays and numbers leave this module.

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError
from scenes.mujoco.held import hinged, rotations
from scenes.mujoco.held_mjcf import SAMPLE_S, HeldScene, palm_armature
from scenes.mujoco.mjcf_text import quaternion
from sim_validate.engine.bench import Health, batch, compiled, mujoco, stepped, touched
from sim_validate.execution.paths import WHOLE, Drive, Table

FREE, PALM = 6, 12
"""Joint velocities up to the end of the object's, and up to the end of the palm's."""
BOUNDLESS = 1e100
"""Size from which on a number of the simulator says nothing."""
LAID = 1e-7
"""Depth of a table in the object at the start, in object radii: more than the rounding of meshes to
single precision, and about as deep as objects rest."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldMotion:
    """Where object, palm and fingertips were in each of the n samples, in the world frame."""

    moved: Array
    """Displacement of the object's centre of mass, (n, 3) [m]."""
    turned: Array
    """Orientation of the object (w, x, y, z), (n, 4)."""
    palm: Array
    """Positions of the palm's slides and hinges, (n, 6) [m, rad]."""
    fingers: Array
    """Positions of the fingers' joints, (n, joints) [m, rad]."""
    tips: Array
    """Displacements of the fingertips along their springs, (n, k, 3) [m]."""
    forces: Array
    """Contact forces on the object along the axes of the springs, (n, k, 3) [N]."""
    pressed: Array
    """Orientation of the object in the palm when these forces acted, (n, 3, 3): at the start of the
    last step of a sample."""
    table: Array
    """Force of the table on the object, (n, 3) [N]; other loads are taken away."""
    states: Array
    """Complete state of the simulator, from which a trial can go on, (n, size)."""
    health: Health
    tip_turns: Array | None
    """Orientations of the fingertips as the palm sees them, (n, k, 3, 3); None where they do not
    turn."""

    @property
    def joints(self) -> Array:
        """Return the positions of all joints as the scene has them, (n, 13 + joints)."""
        return np.concatenate([self.moved, self.turned, self.palm, self.fingers], axis=1)


SERIES = tuple(each.name for each in fields(HeldMotion) if each.name != "health")
"""Fields of a motion that have a row for each sample, where they are known."""


def motions_joined(first: HeldMotion, second: HeldMotion) -> HeldMotion:
    """Return one motion after another, with the faults of both."""
    both: dict[str, Any] = {}
    for name in SERIES:
        parts = getattr(first, name), getattr(second, name)
        both[name] = None if parts[0] is None else np.concatenate(parts)
    return HeldMotion(**both, health=second.health.after(first.health))


def begun_motion(motion: HeldMotion, count: int) -> HeldMotion:
    """Return the first samples of a motion, as if nothing had gone wrong after them."""
    rows = ((name, getattr(motion, name)) for name in SERIES)
    first: dict[str, Any] = {name: None if own is None else own[:count] for name, own in rows}
    return HeldMotion(**first, health=Health())


class HeldBench:
    """A compiled scene of execution on which many trials run at once."""

    def __init__(
        self, scene: HeldScene, *, threads: int = 1, sample_s: float = SAMPLE_S,
        lost_m: float = math.inf, step_s: float | None = None,
    ) -> None:  # fmt: skip
        self.scene, self.threads, self.lost_m = scene, threads, lost_m
        self.model = compiled(scene.xml)
        if step_s is None:
            step_s = float(self.model.opt.timestep)
        self.model.opt.timestep = self.step_s = step_s
        self.chunk = max(1, round(sample_s / step_s))
        self.sample_s = self.chunk * step_s
        if sample_s == SAMPLE_S and abs(self.sample_s - SAMPLE_S) > WHOLE * SAMPLE_S:
            raise InputError(
                f"physics.timestep must divide the sample of {SAMPLE_S:g} s, got {step_s:g} s; "
                "take 0.00125 s"
            )
        self.body = self.model.body("object").id
        self.tips = [self.model.geom(name).id for name in scene.layout.tip_names]

    def run(
        self, drives: Sequence[Drive], start: Array | None = None, friction: Array | None = None,
        lost: Sequence[tuple[float, float]] | None = None,
    ) -> tuple[HeldMotion, ...]:  # fmt: skip
        """Simulate trials, all from the same state or from their own start.

        Takes `start` (size,) or (n, size); `friction` (k,) or (n, k). Trials end where the object
        is `lost`, farther from its planned place in the hand, or turned by more [m, rad].
        """
        trials = self._begun(drives, start, friction)
        return self._stepped(trials, drives, lost or [(self.lost_m, math.inf)] * len(drives))

    def settled(self, drive: Drive, start: Array | None = None) -> tuple[HeldMotion, Array]:
        """Simulate one trial; return its motion and the simulator's complete state at its end."""
        (motion,) = self.run([drive], start)
        return motion, motion.states[-1]

    def touched(self, reached: Array) -> tuple[Array, Array]:
        """Find what each fingertip touches before anything moves, as `bench.touched` gives it."""
        data = mujoco.MjData(self.model)
        data.qpos[PALM + 1 :] = self.scene.layout.joints(reached)
        return touched(self.model, data, self.tips)

    def _begun(
        self, drives: Sequence[Drive], start: Array | None, friction: Array | None
    ) -> batch.Batch:
        trials = batch.Batch(self.model, len(drives), self.threads)
        trials.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        if start is not None:
            trials.state[:] = start
        joints, speeds = trials.bind("qpos"), trials.bind("qvel")
        for place, drive in enumerate(drives):
            if drive.pose is not None and start is None:
                joints[place, :7] = [*drive.pose.moved, *drive.pose.quaternion]
            if drive.reached is not None and start is None:
                joints[place, PALM + 1 :] = self.scene.layout.joints(drive.reached)
            speeds[place, :3] += drive.velocity
            speeds[place, FREE : FREE + 3] += drive.velocity
            if drive.table is not None:  # where it touches: objects would fall, sink and rise
                into = LAID * self.scene.layout.radius_m
                trials.bind("mocap_pos")[place, 0] = drive.table.point + into * drive.table.normal
                trials.bind("mocap_quat")[place, 0] = quaternion(facing(drive.table))
        if friction is not None:
            trials.expand("geom_friction")[:, self.tips, 0] = friction
        return trials

    def _stepped(
        self, trials: batch.Batch, drives: Sequence[Drive], limits: Sequence[tuple[float, float]]
    ) -> tuple[HeldMotion, ...]:
        lengths = [len(drive) for drive in drives]
        loads, motors, commands = self._applied(drives, max(lengths))
        joints, lost = trials.bind("qpos"), np.zeros(len(drives), dtype=bool)
        most_m, most_rad = np.transpose(limits)
        least_cosine = np.cos(np.minimum(most_rad, math.pi))
        turns_count = bool((least_cosine > -1.0).any())

        def following(going: Indices, samples: Indices) -> Indices:
            with np.errstate(over="ignore", invalid="ignore"):  # where the simulator diverges
                away = np.linalg.norm(joints[going, :3] - joints[going, 7:10], axis=1)
                gone = away > most_m[going]
                if turns_count:
                    gone |= _cosines(joints[going]) < least_cosine[going]
            lost[going] = gone
            return np.where(gone, max(lengths), samples + 1)

        told = [
            (trials.bind("xfrc_applied")[:, self.body], loads),
            (trials.bind("qfrc_applied")[:, FREE:PALM], motors), (trials.bind("ctrl"), commands),
        ]  # fmt: skip
        kept = [joints, trials.bind("qvel"), trials.bind("qfrc_constraint"), trials.state]
        done = stepped(self.model, trials, self.chunk, told, kept, lengths, following)
        moved, speeds, forces, states = done.series
        for trial in np.flatnonzero(lost):  # it stays where it was lost
            last = done.counts[trial] - 1
            moved[trial, last:], forces[trial, last:] = moved[trial, last], 0.0
        return tuple(
            self._motion(
                moved[trial, :length], speeds[trial, :length], forces[trial, :length],
                states[trial, :length], done.health[trial],
            )
            for trial, length in enumerate(lengths)
        )  # fmt: skip

    def _applied(self, drives: Sequence[Drive], most: int) -> tuple[Array, Array, Array]:
        """Return loads, forces of the palm and commands, (trials, n, ...); zero after an end."""
        layout = self.scene.layout
        loads = np.zeros((len(drives), most, 6))
        motors = np.zeros((len(drives), most, PALM - FREE))
        commands = np.zeros((len(drives), most, self.model.nu))
        for place, drive in enumerate(drives):
            n = len(drive)
            loads[place, :n] = drive.wrenches
            loads[place, :n, :3] += layout.object_kg * (drive.gravity - layout.gravity)
            motors[place, :n] = drive.accelerations * palm_armature(layout)
            commands[place, :n] = layout.commands(drive.grasping.reshape(n, -1), drive.reached)
        return loads, motors, commands

    def _motion(
        self, joints: Array, speeds: Array, forces: Array, states: Array, health: Health
    ) -> HeldMotion:
        # where the simulator diverges: what is beyond all bounds has no cosine and no square
        joints, speeds, forces = (
            np.where(np.abs(each) < BOUNDLESS, each, np.nan) for each in (joints, speeds, forces)
        )
        layout, palm, fingers = self.scene.layout, joints[:, 7 : PALM + 1], joints[:, PALM + 1 :]
        object_turns = rotations(joints[:, 3:7])
        turned = hinged(palm[:, 3:]).transpose(0, 2, 1) @ object_turns
        # contact forces are those of the last step's start, from which speeds lead to its end
        back = -self.step_s * speeds
        half = np.column_stack([np.ones(len(back)), 0.5 * back[:, 3:FREE]])
        half /= np.linalg.norm(half, axis=1)[:, None]
        palm_then = hinged(palm[:, 3:] + back[:, FREE + 3 : PALM]).transpose(0, 2, 1)
        pressed = palm_then @ object_turns @ rotations(half)
        tips, _, turns = layout.fingers_seen(fingers, forces[:, PALM:], turned)
        before = fingers + back[:, PALM:]
        _, contact, _ = layout.fingers_seen(before, forces[:, PALM:], pressed)
        finger_forces = np.einsum("kij,nkj->ni", layout.axes, contact)
        return HeldMotion(
            joints[:, :3], joints[:, 3:7], palm, fingers, tips, contact, pressed,
            forces[:, :3] - finger_forces, states, health, turns,
        )  # fmt: skip


def _cosines(joints: Array) -> Array:
    """Return the cosines of the object's turns against the palm, (n,)."""
    turned = hinged(joints[:, 10 : PALM + 1]).transpose(0, 2, 1) @ rotations(joints[:, 3:7])
    return 0.5 * (np.einsum("nii->n", turned) - 1.0)


def facing(table: Table) -> Array:
    """Return a rotation whose third column is the table's normal, (3, 3)."""
    normal = table.normal
    aside = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(aside, normal)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first), normal])
