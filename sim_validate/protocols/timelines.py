"""Lays out the runs of a published test in time: commands, wrenches and looks, by sample.

A palm that moves is a palm at rest with an object that is pulled back: at the mass m and the
inertia J, the palm's acceleration a and its angular acceleration b act as

    force = -m a,   torque = -J b                                                        (1)

in the frame of the palm. Accelerations are second differences of the path over one sample, so a
start at full speed takes one sample. Light fingertips are left out, and so is what a turn at
constant speed does to an object whose centre is not on its axis.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from scenes.tested.tested_object import TestedScene
from sim_validate.protocols.published import PublishedProtocol, Run, Step

CHUNK = 10
"""Simulation steps per sample: DexGraspBench moves its commands every ten steps."""


@dataclass(frozen=True, slots=True, eq=False)
class Timeline:
    """What is told to the servos and acts on the object in each of the n samples of a run."""

    commands: Array
    """Commands of the servos, (n, u) [m or rad], as in `TestedScene`."""
    wrenches: Array
    """Force and torque on the object, along the world's axes, (n, 6) [N, N m]."""
    looks: tuple[tuple[int, int], ...]
    """Pairs of a sample after which the object is looked at, and the first sample of its step."""
    closed: int
    """First sample of the run itself, after fingers have closed and begun to squeeze."""
    sample_s: float


def timeline(protocol: PublishedProtocol, scene: TestedScene, run: Run) -> Timeline:
    """Lay out one run: closing, squeezing, then its steps."""
    sample_s = CHUNK * scene.physics.timestep
    closing = _closing(protocol, scene, sample_s)
    counts = [_samples(step.seconds, sample_s) for step in run]
    begins = np.cumsum([len(closing), *counts])[:-1].tolist()
    looks = [
        (look, first)
        for first, count, step in zip(begins, counts, run, strict=True)
        for look in _looks(first, count, step, sample_s)
    ]
    n = len(closing) + sum(counts)
    wrenches = np.zeros((n, 6))
    wrenches[len(closing) :] = _wrenches(run, counts, scene, sample_s)
    wrenches = (wrenches.reshape(n, 2, 3) @ scene.axes.T).reshape(n, 6)
    held = np.broadcast_to(scene.squeezing, (sum(counts), len(scene.squeezing)))
    return Timeline(np.vstack([closing, held]), wrenches, tuple(looks), len(closing), sample_s)


def _samples(seconds: float, sample_s: float) -> int:
    return max(1, round(seconds / sample_s))


def _closing(protocol: PublishedProtocol, scene: TestedScene, sample_s: float) -> Array:
    """Return commands from open to touching, then to squeezing, at equal steps, (n, u)."""
    parts = [np.zeros((0, len(scene.shut)))]
    for seconds, begin, end in (
        (protocol.close_s, scene.opened, scene.shut),
        (protocol.squeeze_s, scene.shut, scene.squeezing),
    ):
        if seconds:
            parts.append(np.linspace(begin, end, _samples(seconds, sample_s) + 1)[1:])
    return np.vstack(parts)


def _looks(first: int, count: int, step: Step, sample_s: float) -> list[int]:
    every = count if step.look_s is None else _samples(step.look_s, sample_s)
    last = first + count - 1
    return sorted({*range(first + every - 1, last + 1, every), last})


def _wrenches(run: Run, counts: list[int], scene: TestedScene, sample_s: float) -> Array:
    """Return forces of the steps with what the palm's motion adds: (1), (n, 6)."""
    forces, paths, angles = list[Array](), [np.zeros((1, 3))], [np.zeros(1)]
    for step, count in zip(run, counts, strict=True):
        time = np.arange(1, count + 1) / count
        forces.append((time if step.rises else np.ones(count))[:, None] * step.force(scene.mass_kg))
        wave = np.sin(2.0 * np.pi * time)
        path = time[:, None] * np.array(step.line_m) + wave[:, None] * np.array(step.wave_m)
        paths.append(paths[-1][-1] + path)
        angles.append(angles[-1][-1] + time * np.radians(step.turn_deg))
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
