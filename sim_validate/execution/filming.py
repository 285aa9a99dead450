"""Draws a trial of an execution as a clip, slowed down where it is over in a moment."""

from pathlib import Path

import numpy as np

from grasp_core.checked import one_of
from scenes.drawing.clips import RATE, write_held_clip
from scenes.execution.held_mjcf import SAMPLE_S
from scenes.mjcf_text import quaternion
from sim_validate.execution.bench import HeldBench, facing
from sim_validate.execution.execute import chosen_squeeze, held_scene, run_trials
from sim_validate.execution.jobs import ExecutionJob, physics_of
from sim_validate.execution.predictions import held_dynamics
from sim_validate.execution.trials import trials_of
from sim_validate.execution.verdict import Execution, ExecutionTrial

FRAMES = 60
"""Least number of frames of a clip, 2.4 s: shorter motions are slowed down by a whole number."""
VISIBLE_M = 1e-4
"""Least slip that is worth a clip, about a pixel of its picture [m]."""


def worth_seeing(found: Execution) -> tuple[ExecutionTrial, ...]:
    """Choose the trials to film: the lift, the worst shake, and the worst slip that can be seen."""
    shakes = sorted(found.of_kind("shake"), key=_hardness)
    slips = sorted((trial for trial in found.trials if _seen_to_slip(trial)), key=_loss)
    chosen = [*found.of_kind("lift")[:1], *shakes[:1], *slips[:1]]
    return tuple({trial.name: trial for trial in chosen}.values())


def _seen_to_slip(trial: ExecutionTrial) -> bool:
    return trial.dropped or (trial.fate == "slipped" and trial.slip_m >= VISIBLE_M)


def _hardness(trial: ExecutionTrial) -> tuple[bool, float, float]:
    """Order trials, the worst first; those that slip before they differ, by their predictions."""
    return trial.survived, trial.simulated_first_slip, trial.predicted_first_slip


def _loss(trial: ExecutionTrial) -> tuple[bool, float]:
    return not trial.dropped, -trial.slip_m


def film(job: ExecutionJob, name: str, path: Path) -> Path:
    """Simulate one trial of an execution again and draw it."""
    body, settings = job.body, job.settings
    best = chosen_squeeze(body, job.grasp, job.friction, settings)
    scene = held_scene(body, best.grip, settings, physics_of(job))
    dynamics = held_dynamics(best.grip, scene.layout)
    trials, _ = trials_of(body, scene.layout, settings, dynamics.lowest_frequency)
    named = {trial.name: trial for trial in trials}
    one_of(name, tuple(named), "name")
    (motion,) = run_trials(HeldBench(scene), [named[name]])
    stride = max(1, min(round(1.0 / (RATE * SAMPLE_S)), len(motion.moved) // FRAMES))
    slowed = 1.0 / (RATE * SAMPLE_S * stride)
    caption = name if slowed <= 1.0 else f"{name}, {slowed:.1f} times slower"
    table, gravity = named[name].drive.table, scene.layout.gravity
    up = -gravity / np.linalg.norm(gravity) if table is None else table.normal
    return write_held_clip(
        scene, motion.joints[::stride], path, caption, up=up,
        table=None if table is None else (table.point, quaternion(facing(table))),
    )  # fmt: skip
