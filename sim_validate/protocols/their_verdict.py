"""Runs a published test on a scene: all runs of all copies together, each judged at its looks."""

import numpy as np

from grasp_core.arrays import Array
from scenes.mjcf_text import quaternion
from scenes.tested.tested_object import TestedScene
from sim_validate.protocols.bench import TestBench
from sim_validate.protocols.judgement import RunVerdict, judged_run
from sim_validate.protocols.published import PublishedProtocol
from sim_validate.protocols.timelines import timeline

AT_REST = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Pose of the object where it is planned to be."""


def their_verdict(
    protocol: PublishedProtocol, scene: TestedScene, seed: int = 0, threads: int = 1
) -> tuple[RunVerdict, ...]:
    """Simulate all runs of a test and judge each."""
    runs = [timeline(protocol, scene, run) for run in protocol.runs]
    starts = [start for copy in range(protocol.copies) for start in [_start(protocol, seed, copy)]]
    began = scene.opened if protocol.close_s else scene.shut
    motions = TestBench(scene, threads).run(
        runs * protocol.copies, np.repeat(starts, len(runs), axis=0), began
    )
    return tuple(
        judged_run((place % len(runs), place // len(runs)), motion, runs[place % len(runs)],
                   protocol.passing)
        for place, motion in enumerate(motions)
    )  # fmt: skip


def _start(protocol: PublishedProtocol, seed: int, copy: int) -> Array:
    """Draw where the object is before fingers close, (7,)."""
    pose = np.array(AT_REST)
    if not (protocol.noise_m or protocol.noise_deg):
        return pose
    rng = np.random.default_rng([seed, copy])
    pose[:3] = rng.uniform(-protocol.noise_m, protocol.noise_m, 3)
    angles = np.radians(rng.uniform(-protocol.noise_deg, protocol.noise_deg, 3))
    pose[3:] = quaternion(_turned(angles))
    return pose


def _turned(angles: Array) -> Array:
    """Return the rotation about x, then y, then z, (3, 3)."""
    (a, b, c), (d, e, f) = np.cos(angles).tolist(), np.sin(angles).tolist()
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, a, -d], [0.0, d, a]])
    about_y = np.array([[b, 0.0, e], [0.0, 1.0, 0.0], [-e, 0.0, b]])
    about_z = np.array([[c, -f, 0.0], [f, c, 0.0], [0.0, 0.0, 1.0]])
    return about_z @ about_y @ about_x
