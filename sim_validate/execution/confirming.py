"""Simulates and judges the trials of an execution, and confirms with short steps what was lost.

A trial that is lost is run again with short steps: a loss counts only if it does not depend on the
step. So is one whose object slips and is kept, but moves by more than `NEAR_LOSS` of what is
allowed: then the motion with short steps counts. Where contacts open and close between fingertips
that push lightly, an object rattles. With steps of the usual length it bounces too much, and may
fall where it would come to rest. Up to the first contact that opens or slips, steps of that length
are exact enough, so a run with steps of `FINE_S` goes on from shortly before. It ends where the
object is farther than it may be: a loss is confirmed then, whatever comes later.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from scenes.mujoco.held_scene import held_physics
from sim_validate.engine.simulated_friction import LEAST_PUSHING
from sim_validate.execution.paths import TrialDrive
from sim_validate.execution.simulate import (
    FULL_LOAD,
    HeldBench,
    HeldMotion,
    TrialFigures,
    cosines,
    first_trouble,
    outcome,
    sticking_multiple,
)
from sim_validate.execution.trials import Trial
from sim_validate.execution.verdict import ExecutionTrial
from sim_validate.settings import ExecutionSettings

FINE_S = 1.25e-4
"""Length of steps that confirm a loss, at most [s]."""
FINER_STEPS = 4
"""Number of such steps in a step of the usual length, at least."""
NEAR_LOSS = 0.5
"""Share of the motion allowed above which short steps find that of a kept object that slips."""
SAMPLES_BEFORE = 4
"""Samples before the first trouble that is seen at which the second run begins: what happens within
a sample is not seen."""
LEAST_STEP_S = 1e-5
STICKING = 20.0
"""Friction of contacts that stick, relative to the true one."""
DIVERGED = TrialFigures(math.inf, math.inf, math.inf, dropped=True, slipped=True, first_slip=0.0)


def confirmed_trials(
    bench: HeldBench, predicted: Mapping[Trial, tuple[float, float]], settings: ExecutionSettings
) -> dict[Trial, ExecutionTrial]:
    """Simulate trials and judge them; after a slip that loses the object, or nearly, once more."""
    motions = run_trials(bench, tuple(predicted))
    judged = {
        trial: _judged(trial, motion, predicted[trial], bench, settings)
        for trial, motion in motions.items()
    }
    again = {
        trial: motions[trial] for trial, each in judged.items()
        if each.fate != "stuck" and (not each.survived or _is_near(each, settings))
    }  # fmt: skip
    short = confirming_bench(bench) if again else None
    if short is not None:
        for trial, motion in run_again(short, again, settings).items():
            first, found = judged[trial], _judged(trial, motion, predicted[trial], short, settings)
            confirmed = not (found.survived or first.survived) and first.fate != "diverged"
            judged[trial] = replace(first, step_s=short.step_s) if confirmed else found
    return judged


def _is_near(trial: ExecutionTrial, settings: ExecutionSettings) -> bool:
    moved, turned = trial.displacement_m, trial.turn_rad
    return moved > NEAR_LOSS * settings.most_m or turned > NEAR_LOSS * settings.most_rad


def _judged(
    trial: Trial, motion: HeldMotion, predicted: tuple[float, float], bench: HeldBench,
    settings: ExecutionSettings,
) -> ExecutionTrial:  # fmt: skip
    if motion.health.fault:
        found = DIVERGED
    else:
        found = outcome(motion, trial.drive, motion.layout.friction, trial.begun)
    moved = found.displacement_m > settings.most_m or found.turn_rad > settings.most_rad
    survived = not (moved or found.dropped)
    held = "slipped" if found.slipped else "stuck"
    lost = "diverged" if motion.health.fault else "dropped"
    return ExecutionTrial(
        kind=trial.kind,
        name=trial.name,
        survived=survived,
        fate=lost if found.dropped else held,
        slip_m=found.slip_m,
        displacement_m=found.displacement_m,
        turn_rad=found.turn_rad,
        predicted_first_slip=predicted[0],
        predicted_loss=predicted[1],
        simulated_first_slip=found.first_slip,
        step_s=bench.step_s,
        starts_closed=trial.starts_closed,
        converged=not found.slipped or (survived and bench.chunk >= _short_steps(bench)),
    )


def run_trials(bench: HeldBench, trials: Sequence[Trial]) -> dict[Trial, HeldMotion]:
    """Simulate trials: some with open fingers, others from a squeezed object or its weight."""
    found = dict[Trial, HeldMotion]()
    if weighing := [trial for trial in trials if trial.weighing]:
        # The weight comes once for all. Hand and object get the speed that they start with when it
        # has come: uniform motion changes nothing.
        first = weighing[0].drive.rows(slice(weighing[0].weighing))
        weight, state = bench.settled(replace(first, velocity=np.zeros(3)), bench.squeezed)
        rests = [trial.drive.rows(slice(trial.weighing, None)) for trial in weighing]
        for trial, motion in zip(weighing, bench.run(rests, state), strict=True):
            health = motion.health.after(weight.health)
            found[trial] = replace(weight.then(motion), health=health)
    apart = [trial for trial in trials if trial.apart]
    others = [trial for trial in trials if not (trial.weighing or trial.apart)]
    for own, start in ((apart, None), (others, bench.squeezed)):
        if own:
            motions = bench.run([trial.drive for trial in own], start)
            found |= dict(zip(own, motions, strict=True))
    return {trial: found[trial] for trial in trials}


def confirming_bench(bench: HeldBench) -> HeldBench | None:
    """Return a bench of the same scene with short steps; None if those of this one are as short."""
    count = _short_steps(bench)
    if count <= bench.chunk:
        return None
    return HeldBench(bench.scene, threads=bench.threads, step_s=bench.sample_s / count)


def _short_steps(bench: HeldBench) -> int:
    step_s = min(FINE_S, held_physics(bench.scene.layout).timestep / FINER_STEPS)
    return round(bench.sample_s / max(step_s, LEAST_STEP_S))


def run_again(
    bench: HeldBench, motions: Mapping[Trial, HeldMotion], settings: ExecutionSettings
) -> dict[Trial, HeldMotion]:
    """Simulate trials with short steps from before their trouble on."""
    begins = [_begin(trial, motion) for trial, motion in motions.items()]
    drives, starts = list[TrialDrive](), list[Array]()
    for (trial, motion), begin in zip(motions.items(), begins, strict=True):
        rest = trial.drive.rows(slice(begin + 1, None))
        # later states have the speed of a trial that starts to move when its weight has come
        velocity = rest.velocity if begin < trial.weighing else np.zeros(3)
        lost = _lost(motion, trial.begun, settings)
        drives.append(replace(rest, velocity=velocity, lost=lost))
        starts.append(motion.states[begin])
    rests = bench.run(drives, np.stack(starts))
    return {  # faults came later than what is kept of a first run
        trial: replace(motion.rows(slice(begin + 1)), health=rest.health).then(rest)
        for (trial, motion), begin, rest in zip(motions.items(), begins, rests, strict=True)
    }


def _begin(trial: Trial, motion: HeldMotion) -> int:
    """Return the sample after which a trial is run again, zero if nothing says when it slips."""
    layout = motion.layout
    pushes, largest = np.linalg.norm(layout.pushes, axis=1), float(np.abs(layout.pushes).max())
    pushing = pushes > LEAST_PUSHING * largest
    if (motion.forces[trial.begun, pushing] == 0.0).all(axis=1).any():
        return 0
    trouble = first_trouble(motion, layout.friction, trial.begun)
    return max(0, trouble - SAMPLES_BEFORE) if trouble < len(motion.moved) else 0


def _lost(motion: HeldMotion, begun: int, settings: ExecutionSettings) -> tuple[float, float]:
    """Return how far from its planned place [m, rad] an object surely is lost."""
    (cosine,) = cosines(motion.turns[begun : begun + 1])
    angle = math.acos(min(max(float(cosine), -1.0), 1.0))
    away = float(np.linalg.norm(motion.shifts[begun]))
    return settings.most_m + away, settings.most_rad + angle


def with_first_slips(
    bench: HeldBench, judged: Mapping[Trial, ExecutionTrial]
) -> tuple[ExecutionTrial, ...]:
    """Measure the first slip of loads that come at once, by contacts that stick."""
    known, friction = dict(judged), bench.scene.layout.friction
    rough = {
        replace(trial, drive=replace(trial.drive, friction=STICKING * friction)): trial
        for trial, each in judged.items()
        if each.fate in {"slipped", "dropped"}
        and (trial.weighing or each.kind == "lift" or each.simulated_first_slip >= FULL_LOAD)
    }
    for trial, motion in (run_trials(bench, tuple(rough)) if rough else {}).items():
        multiple = sticking_multiple(motion, trial.drive, friction, trial.begun)
        sudden = rough[trial]
        known[sudden] = replace(known[sudden], simulated_first_slip=min(multiple, 1.0))
    return tuple(known.values())
