"""Executes several grasps of one object, in one process or in several, and films their trials."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from grasp_core.checked import one_of
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import NoForcesError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.drawing.clips import RATE, write_held_clip
from scenes.mujoco.held_mjcf import SAMPLE_S
from scenes.mujoco.mjcf_text import quaternion
from scenes.settings import PhysicsSettings
from sim_validate.execution.bench import HeldBench, facing
from sim_validate.execution.execute import chosen_squeeze, execute, held_scene, run_trials
from sim_validate.execution.predictions import held_dynamics
from sim_validate.execution.trials import trials_of
from sim_validate.execution.verdict import ExecutedGrasp, Execution, ExecutionTrial
from sim_validate.kit.processes import each, processes
from sim_validate.settings.executions import ExecutionSettings


@dataclass(frozen=True, slots=True)
class ExecutionJob:
    """One grasp to execute, as it is sent to a worker process."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    settings: ExecutionSettings
    physics: Mapping[str, object] = field(default_factory=dict[str, object])
    """Settings of the simulator that differ from the usual ones, by name."""
    threads: int = 1
    enough: bool = True


def executed(jobs: Sequence[ExecutionJob], processors: int) -> Iterator[ExecutedGrasp]:
    """Yield one result per job, in order; the number of processors does not change the results."""
    count = processes(len(jobs), processors)
    threads = max(1, processors // count)
    return each(executed_grasp, [replace(job, threads=threads) for job in jobs], jobs=count)


def executed_grasp(job: ExecutionJob) -> ExecutedGrasp:
    """Execute one grasp; a grasp without a squeeze is a result with a reason."""
    grasp = job.grasp
    about = grasp.id, grasp.family, contacts_sha256(grasp.contacts)
    try:
        found = execute(
            job.body, grasp, job.friction, job.settings,
            physics=physics_of(job), threads=job.threads, enough=job.enough,
        )  # fmt: skip
    except NoForcesError as error:
        return ExecutedGrasp(*about, None, str(error), getattr(error, "enough", None))
    return ExecutedGrasp(*about, found)


def physics_of(job: ExecutionJob) -> PhysicsSettings | None:
    """Return the usual settings for the grasp's springs and masses with the job's changes.

    It is None where the job changes nothing, or where no squeeze carries the weight.
    """
    if not job.physics:
        return None
    try:
        best = chosen_squeeze(job.body, job.grasp, job.friction, job.settings)
    except NoForcesError:
        return None
    return replace(held_scene(job.body, best.grip, job.settings).physics, **job.physics)


FRAMES = 60
"""Least number of frames of a clip, 2.4 s: shorter motions are slowed down by a whole number."""
VISIBLE_M = 1e-4
"""Least slip that is worth a clip, about a pixel of its picture [m]."""


def worth_seeing(found: Execution) -> tuple[ExecutionTrial, ...]:
    """Choose the trials to film: the lift, the worst shake, and the worst slip that can be seen.

    Shakes that slip before they differ are ordered by their predictions.
    """
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
