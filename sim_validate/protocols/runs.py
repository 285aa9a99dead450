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
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.declared import Declared
from grasp_core.kinds import Measured, Number
from scenes.mujoco.tested import TestedScene
from sim_validate.engine.bench import Bench, Motion, Told, mujoco, samples
from sim_validate.engine.traces import rotation_angles
from sim_validate.protocols.published import Passing, PublishedProtocol, Run

CHUNK = 10
"""Simulation steps per sample: DexGraspBench moves its commands every ten steps."""
FREE = 7
"""Coordinates of the object's free joint, which come first."""
AT_REST = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Pose of the object where it is planned to be, from which displacement and turn count."""


@dataclass(frozen=True, slots=True, eq=False)
class Timeline(Told):
    """What is told to the servos and acts on the object in each of the n samples of a run."""

    looks: tuple[int, ...] = ()
    """Samples after which the object is looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """The object at a look, and how many fingers touch it."""

    pose: Array
    """Position of the object's centre of mass and its orientation (w, x, y, z), (7,)."""
    fingers: int


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
    bench = Bench(scene, threads=threads, chunk=CHUNK, kept=("state",))
    begun = np.concatenate([AT_REST, scene.opened if protocol.close_s else scene.shut])
    root = FREE * bench.model.nmocap  # where one moves as told, its pose comes first
    runs = [
        replace(run, mocap=run.commands[:, :root] if root else None,
                commands=run.commands[:, root:], joints=begun)
        for run in (timeline(protocol, scene, steps) for steps in protocol.runs)
    ]  # fmt: skip
    return tuple(
        judged_run(number, looked(bench, motion, run.looks), motion.health.fault, protocol.passing)
        for number, (motion, run) in enumerate(zip(bench.simulated(runs), runs, strict=True))
    )


def looked(bench: Bench[TestedScene], motion: Motion, looks: Sequence[int]) -> list[Look]:
    """Look at the object after some samples of a motion."""
    model, (states,) = bench.model, motion.kept
    data, fingers = mujoco.MjData(model), bench.scene.fingers
    of = {model.body(name).id: own for own, names in enumerate(fingers) for name in names}
    found = list[Look]()
    for sample in looks:
        met = list[int]()
        if np.isfinite(states[sample]).all():
            mujoco.mj_setState(model, data, states[sample], mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_forward(model, data)
            bodies = model.geom_bodyid[data.contact.geom]
            met = bodies[(bodies == bench.body).any(axis=1)].ravel().tolist()
        touching = {of[body] for body in met if body in of}
        found.append(Look(motion.joints[sample, :FREE], len(touching)))
    return found


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
    return Timeline(wrenches, np.vstack([closing, held]), looks=tuple(looks))


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


def judged_run(number: int, looks: Sequence[Look], fault: str, passing: Passing) -> RunVerdict:
    """Judge one run at its looks, up to the first that does not pass."""
    moved, turned, seen, reason = 0.0, 0.0, list[int](), fault
    for look in looks:
        if reason:
            break
        shift = float(np.linalg.norm(look.pose[:3] - AT_REST[:3]))
        turn = float(np.degrees(rotation_angles(look.pose[None, 3:], AT_REST[None, 3:])[0]))
        moved, turned = max(moved, shift), max(turned, turn)
        seen.append(look.fingers)
        if not shift < passing.most_m:
            reason = f"the object moved by {1e3 * shift:.3g} mm, and {1e3 * passing.most_m:g}"
            reason += " is enough"
        elif not turn < passing.most_deg:
            reason = f"the object turned by {turn:.3g} deg, and {passing.most_deg:g} is enough"
        elif look.fingers < passing.fingers:
            reason = f"{look.fingers} fingers touched the object, and {passing.fingers} must"
    return RunVerdict(number, not reason, reason, moved, turned, min(seen, default=0))
