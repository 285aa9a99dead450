"""Runs a published test in simulation: what is told and applied, sample by sample, and each look.

A palm that moves is a palm at rest with an object that is pulled back: at the mass m and the
inertia J, the palm's acceleration a and its angular acceleration b act as

    force = -m a,   torque = -J b                                                        (1)

in the frame of the palm. Accelerations are second differences of the path over one sample, so a
start at full speed takes one sample. Light fingertips are left out, and so is what a turn at
constant speed does to an object whose centre is not on its axis.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core; plain arrays and numbers leave this module.

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.declared import Declared
from grasp_core.kinds import Measured, Number
from scenes.mujoco.tested import TestedScene
from sim_validate.engine.bench import batch, compiled, mujoco, samples, stepped
from sim_validate.engine.traces import rotation_angles
from sim_validate.protocols.published import Passing, PublishedProtocol, Run

CHUNK = 10
"""Simulation steps per sample: DexGraspBench moves its commands every ten steps."""
FREE = 7
"""Coordinates of the object's free joint, which come first."""
AT_REST = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Pose of the object where it is planned to be, from which displacement and turn count."""


@dataclass(frozen=True, slots=True, eq=False)
class Timeline:
    """What is told to the servos and acts on the object in each of the n samples of a run."""

    commands: Array
    """Commands of the servos, (n, u) [m or rad], as in `TestedScene`."""
    wrenches: Array
    """Force and torque on the object, along the world's axes, (n, 6) [N, N m]."""
    looks: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """The object in each of the n samples of a run, and which fingers touch it at each look."""

    poses: Array
    """Position of the object's centre of mass and its orientation (w, x, y, z), (n, 7)."""
    touching: tuple[frozenset[int], ...]
    fault: str


@dataclass(frozen=True, slots=True)
class RunVerdict(Declared):
    """How one run of a published test ended."""

    number: Number
    passed: bool
    reason: str
    displacement_m: Measured
    """Largest displacement at a look, up to the first that did not pass [m]."""
    turn_deg: Measured
    """Largest turn at a look, likewise [deg]."""
    fingers: Number
    """Least number of fingers that touched the object at a look, likewise."""


def their_verdict(
    protocol: PublishedProtocol, scene: TestedScene, threads: int = 1
) -> tuple[RunVerdict, ...]:
    """Simulate all runs of a test and judge each."""
    runs = [timeline(protocol, scene, run) for run in protocol.runs]
    began = scene.opened if protocol.close_s else scene.shut
    motions = TestBench(scene, threads).run(runs, began)
    return tuple(
        judged_run(number, motion, run, protocol.passing)
        for number, (motion, run) in enumerate(zip(motions, runs, strict=True))
    )


def timeline(protocol: PublishedProtocol, scene: TestedScene, run: Run) -> Timeline:
    """Lay out one run: closing, squeezing, then its steps."""
    sample_s = CHUNK * scene.physics.timestep
    closing = _closing(protocol, scene, sample_s)
    counts = [samples(step.seconds, sample_s) for step in run]
    begins = np.cumsum([len(closing), *counts]).tolist()
    looks = list[int]()
    for first, end, part in zip(begins, begins[1:], run, strict=False):
        every = end - first if part.look_s is None else samples(part.look_s, sample_s)
        looks += sorted({*range(first + every - 1, end, every), end - 1})
    n = begins[-1]
    wrenches = np.zeros((n, 6))
    wrenches[len(closing) :] = _wrenches(run, counts, scene, sample_s)
    wrenches = (wrenches.reshape(n, 2, 3) @ scene.axes.T).reshape(n, 6)
    held = np.broadcast_to(scene.squeezing, (sum(counts), len(scene.squeezing)))
    return Timeline(np.vstack([closing, held]), wrenches, tuple(looks))


def _closing(protocol: PublishedProtocol, scene: TestedScene, sample_s: float) -> Array:
    """Return commands from open to touching, then to squeezing, at equal steps, (n, u)."""
    parts = [np.zeros((0, len(scene.shut)))]
    for seconds, begin, end in (
        (protocol.close_s, scene.opened, scene.shut),
        (protocol.squeeze_s, scene.shut, scene.squeezing),
    ):
        if seconds:
            parts.append(np.linspace(begin, end, samples(seconds, sample_s) + 1)[1:])
    return np.vstack(parts)


def _wrenches(run: Run, counts: list[int], scene: TestedScene, sample_s: float) -> Array:
    """Return forces of the steps with what the palm's motion adds: (1), (n, 6)."""
    forces, paths, angles = list[Array](), [np.zeros((1, 3))], [np.zeros(1)]
    for part, count in zip(run, counts, strict=True):
        time = np.arange(1, count + 1) / count
        forces.append(np.tile(part.force(scene.mass_kg), (count, 1)))
        wave = np.sin(2.0 * np.pi * time)
        path = time[:, None] * np.array(part.line_m) + wave[:, None] * np.array(part.wave_m)
        paths.append(paths[-1][-1] + path)
        angles.append(angles[-1][-1] + time * np.radians(part.turn_deg))
    found = np.zeros((sum(counts), 6))
    found[:, :3] = np.vstack(forces) - scene.mass_kg * _acceleration(np.vstack(paths), sample_s)
    turning = _acceleration(np.concatenate(angles)[:, None], sample_s)
    found[:, 3:] = -turning * (scene.axes.T @ scene.inertia_kg_m2 @ scene.axes)[:, 2]
    return found


def _acceleration(path: Array, sample_s: float) -> Array:
    """Return second differences of a path that begins at rest, (n, d), one per sample."""
    speeds = np.diff(path, axis=0) / sample_s
    before = np.vstack([np.zeros((1, path.shape[1])), speeds[:-1]])
    return (speeds - before) / sample_s


class TestBench:
    """A compiled scene on which the runs of a test are simulated together."""

    __test__ = False  # no class of tests, whatever its name begins with

    def __init__(self, scene: TestedScene, threads: int = 1) -> None:
        self.scene, self.threads = scene, threads
        self.model = compiled(scene.xml)
        self.data = mujoco.MjData(self.model)
        self.body = self.model.body("object").id
        self.fingers = {
            self.model.body(name).id: finger
            for finger, names in enumerate(scene.fingers)
            for name in names
        }

    def run(self, runs: Sequence[Timeline], began: Array) -> tuple[Motion, ...]:
        """Simulate runs, all from the same fingers, `began` (u,)."""
        lengths = [len(each.commands) for each in runs]
        trials = batch.Batch(self.model, max(len(runs), 2), self.threads)
        trials.reset(np.arange(len(runs)), stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        joints = trials.bind("qpos")
        joints[: len(runs), :FREE], joints[: len(runs), FREE:] = AT_REST, began
        touching: list[list[frozenset[int]]] = [[] for _ in runs]

        def following(going: Indices, samples: Indices) -> Indices:
            for place, sample in zip(going.tolist(), samples.tolist(), strict=True):
                if sample in runs[place].looks:
                    touching[place].append(self._touching(trials.state[place]))
            return samples + 1

        told = self._told(trials, runs, max(lengths))
        done = stepped(self.model, trials, CHUNK, told, [joints[:, :FREE]], lengths, following)
        return tuple(
            Motion(done.series[0][place, :length], tuple(touching[place]), done.health[place].fault)
            for place, length in enumerate(lengths)
        )

    def _told(
        self, trials: "batch.Batch", runs: Sequence[Timeline], most: int
    ) -> list[tuple[Array, Array]]:
        """Return what is told in each sample: wrenches, commands and, if it moves, a palm's pose.

        After the end of a run it is zero.
        """
        commands = np.zeros((len(runs), most, len(runs[0].commands[0])))
        wrenches = np.zeros((len(runs), most, 6))
        for place, each in enumerate(runs):
            commands[place, : len(each.commands)] = each.commands
            wrenches[place, : len(each.wrenches)] = each.wrenches
        told = [(trials.bind("xfrc_applied")[:, self.body], wrenches)]
        if self.model.nmocap:
            told.append((trials.bind("mocap_pos")[:, 0], commands[..., :3]))
            told.append((trials.bind("mocap_quat")[:, 0], commands[..., 3:FREE]))
            commands = commands[..., FREE:]
        return [*told, (trials.bind("ctrl"), commands)]

    def _touching(self, state: Array) -> frozenset[int]:
        if not np.isfinite(state).all():
            return frozenset()
        signature = int(mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_setState(self.model, self.data, state, signature)
        mujoco.mj_forward(self.model, self.data)
        bodies = self.model.geom_bodyid[self.data.contact.geom]
        met = bodies[(bodies == self.body).any(axis=1)].ravel().tolist()
        return frozenset(self.fingers[body] for body in met if body in self.fingers)


def judged_run(number: int, motion: Motion, run: Timeline, passing: Passing) -> RunVerdict:
    """Judge one run at its looks, up to the first that does not pass."""
    moved, turned, seen, reason = 0.0, 0.0, list[int](), motion.fault
    for sample, fingers in zip(run.looks, map(len, motion.touching), strict=True):
        if reason:
            break
        pose = motion.poses[sample]
        shift = float(np.linalg.norm(pose[:3] - AT_REST[:3]))
        turn = float(np.degrees(rotation_angles(pose[None, 3:], AT_REST[None, 3:])[0]))
        moved, turned = max(moved, shift), max(turned, turn)
        seen.append(fingers)
        if not shift < passing.most_m:
            reason = f"the object moved by {1e3 * shift:.3g} mm, and {1e3 * passing.most_m:g}"
            reason += " is enough"
        elif not turn < passing.most_deg:
            reason = f"the object turned by {turn:.3g} deg, and {passing.most_deg:g} is enough"
        elif fingers < passing.fingers:
            reason = f"{fingers} fingers touched the object, and {passing.fingers} must"
    return RunVerdict(number, not reason, reason, moved, turned, min(seen, default=0))
