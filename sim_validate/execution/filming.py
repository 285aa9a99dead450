"""Chooses which trials of an execution are worth seeing, and films them."""

from pathlib import Path

import numpy as np

from grasp_core.allowed_values import one_of
from scenes.drawing.clips import RATE, write_held_clip
from scenes.settings import SAMPLE_S
from sim_validate.execution.confirming import run_trials
from sim_validate.execution.execute import ExecutionJob
from sim_validate.execution.holders import planned
from sim_validate.execution.simulate import HeldBench
from sim_validate.execution.verdict import Execution, ExecutionTrial

FRAMES = 60
"""Least number of frames of a clip, 2.4 s: shorter motions are slowed down by a whole number."""
VISIBLE_M = 1e-4
"""Least slip that is worth a clip, about a pixel of its picture [m]."""


def worth_seeing(found: Execution) -> tuple[ExecutionTrial, ...]:
    """Choose the trials to film: the lift, the worst shake, and the worst slip that can be seen."""
    shakes = sorted(
        found.of_kind("shake"),
        key=lambda each: (each.survived, each.simulated_first_slip, each.predicted_first_slip),
    )
    slips = [
        each for each in found.trials
        if each.dropped or (each.fate == "slipped" and each.slip_m >= VISIBLE_M)
    ]  # fmt: skip
    slips.sort(key=lambda each: (not each.dropped, -each.slip_m))
    chosen = [*found.of_kind("lift")[:1], *shakes[:1], *slips[:1]]
    return tuple({trial.name: trial for trial in chosen}.values())


def film(job: ExecutionJob, name: str, path: Path) -> Path:
    """Simulate one trial of an execution again and draw it."""
    best = job.holder.squeeze(job.settings)
    scene, _, trials, _ = planned(job.holder, job.settings, best)
    named = {trial.name: trial for trial in trials}
    one_of(name, tuple(named), "name")
    motion = run_trials(HeldBench(scene), [named[name]])[named[name]]
    stride = max(1, min(round(1.0 / (RATE * SAMPLE_S)), len(motion.joints) // FRAMES))
    slowed = 1.0 / (RATE * SAMPLE_S * stride)
    caption = name if slowed <= 1.0 else f"{name}, {slowed:.1f} times slower"
    table, gravity = named[name].drive.table, scene.layout.gravity
    up = -gravity / np.linalg.norm(gravity) if table is None else table.normal
    return write_held_clip(
        scene, motion.joints[::stride], path, caption, up=up,
        table=None if table is None else (table.point, table.quaternion),
    )  # fmt: skip
