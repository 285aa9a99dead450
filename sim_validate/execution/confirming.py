"""Simulates and judges the trials of an execution, and confirms with short steps what is doubtful.

Where contacts open and close between fingertips that push lightly, an object rattles. With steps of
the usual length it bounces too much, and may fall where it would come to rest. So a trial whose
object slips and is lost, or moves by more than `NEAR_LOSS` of what is allowed, is run again with
shorter steps. Up to the first contact that opens or slips steps of the usual length are exact
enough, so a second run goes on from shortly before. It ends where the object is farther than it may
be: whatever comes later, it is lost. Only an object that is thrown about when fingers close on it,
far lighter than they or lighter and let go again by one, is followed again from the start.

Steps of half the length settle a trial if the object moves alike in both runs, up to where it is
lost; a loss only if the object goes far and the prediction shares it. Neither alone is enough:
predictions know nothing of rattling, and two runs that both rattle may fall together by chance.
What is left is run with steps of `FINE_S`, and their verdict counts.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
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
    moves,
    outcome,
    sticking_multiple,
)
from sim_validate.execution.trials import Trial
from sim_validate.execution.verdict import ExecutionTrial
from sim_validate.settings import ExecutionSettings

FINE_S = 1.25e-4
"""Length of steps whose verdict counts, whatever longer ones say, at most [s]."""
FINER_STEPS = 4
"""Number of such steps in a step of the usual length, at least."""
NEAR_LOSS = 0.3
"""Share of the motion allowed above which short steps find that of a kept object that slips."""
SAME_MOTION = 0.1
"""Difference of two motions, in those allowed, up to which they agree: the one with half the steps
is off by less than half of it then."""
SAMPLES_BEFORE = 4
"""Samples before the first trouble that is seen at which the second run begins: what happens within
a sample is not seen."""
FAR_LOST, SURE_LOSS = 2.0, 0.9
"""Motion, in what is allowed, beyond which a loss may be settled by half the steps, and the largest
predicted loss with which it may: contacts slide farther with longer steps."""
FAR_LIGHTER = 0.1
"""Mass of an object, in that of a fingertip, below which closing fingers always throw it about."""
LEAST_STEP_S = 1e-5
STICKING = 20.0
"""Friction of contacts that stick, relative to the true one."""
DIVERGED = TrialFigures(math.inf, math.inf, math.inf, dropped=True, slipped=True, first_slip=0.0)


def confirmed_trials(
    bench: HeldBench, motions: Mapping[Trial, HeldMotion],
    predicted: Mapping[Trial, tuple[float, float]], settings: ExecutionSettings,
) -> dict[Trial, ExecutionTrial]:  # fmt: skip
    """Judge trials; after a slip that loses the object, or nearly, with shorter steps."""
    settled = bench.chunk >= _short_steps(bench)
    judged = {
        trial: _judged(trial, motion, predicted[trial], bench, settings, settled=settled)
        for trial, motion in motions.items()
    }
    left = {
        trial: motions[trial] for trial, each in judged.items()
        if _is_thrown(trial, motions[trial])
        or (each.fate != "stuck" and (not each.survived or _share(each, settings) > NEAR_LOSS))
    }  # fmt: skip
    for short in confirming_benches(bench):
        if not left:
            break
        last = short.chunk >= _short_steps(bench)
        clear = {t: m for t, m in left.items() if last or _can_settle(t, judged[t], m, settings)}
        for trial, motion in run_again(short, clear, settings).items():
            first, runs = judged[trial], (motions[trial], motion)
            found = _judged(trial, motion, predicted[trial], short, settings, settled=True)
            if last or _agree(trial, (first, found), runs, settings):
                confirmed = not (found.survived or first.survived) and first.fate != "diverged"
                judged[trial] = replace(first, step_s=short.step_s) if confirmed else found
                del left[trial]
    return judged


def _agree(
    trial: Trial, judged: tuple[ExecutionTrial, ExecutionTrial],
    runs: tuple[HeldMotion, HeldMotion], settings: ExecutionSettings,
) -> bool:  # fmt: skip
    """Say whether a second run with half the steps settles what the first one found."""
    first, second = judged
    if first.survived != second.survived or "diverged" in {first.fate, second.fate}:
        return False
    moved, turned = np.transpose([moves(run, trial.begun) for run in runs], (1, 0, 2))
    used = np.maximum(moved / settings.most_m, turned / settings.most_rad)
    apart = np.abs(np.diff(np.maximum.accumulate(used, axis=1), axis=0))[0]
    lost = (used > 1.0).any(axis=0)
    return float(apart[: int(lost.argmax()) + 1 if lost.any() else None].max()) <= SAME_MOTION


def _share(trial: ExecutionTrial, settings: ExecutionSettings) -> float:
    return max(trial.displacement_m / settings.most_m, trial.turn_rad / settings.most_rad)


def _can_settle(
    trial: Trial, first: ExecutionTrial, motion: HeldMotion, settings: ExecutionSettings
) -> bool:  # fmt: skip
    clearly_lost = first.predicted_loss < SURE_LOSS and _share(first, settings) > FAR_LOST
    return (first.survived or clearly_lost) and not _is_thrown(trial, motion)


def _is_thrown(trial: Trial, motion: HeldMotion) -> bool:
    relative = motion.layout.object_kg / float(motion.layout.tip_masses.min())
    if not trial.apart or relative >= 1.0:
        return False
    touching = motion.pushes[: trial.begun + 1, :, 0] > 0.0
    return relative < FAR_LIGHTER or bool((touching[:-1] & ~touching[1:]).any())


def _judged(
    trial: Trial, motion: HeldMotion, predicted: tuple[float, float], bench: HeldBench,
    settings: ExecutionSettings, *, settled: bool = False,
) -> ExecutionTrial:  # fmt: skip
    """Judge a trial; `settled` says that shorter steps would not change its motion."""
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
        converged=not found.slipped or (survived and settled),
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


def confirming_benches(bench: HeldBench) -> Iterator[HeldBench]:
    """Yield benches of the scene with half the steps, and with short ones, if theirs are longer."""
    shortest = _short_steps(bench)
    for count in sorted({min(2 * bench.chunk, shortest), shortest}):
        if count > bench.chunk:
            step_s = bench.sample_s / count
            yield HeldBench(bench.scene, threads=bench.threads, lost_m=bench.lost_m, step_s=step_s)


def _short_steps(bench: HeldBench) -> int:
    step_s = min(FINE_S, held_physics(bench.scene.layout).timestep / FINER_STEPS)
    return round(bench.sample_s / max(step_s, LEAST_STEP_S))


def run_again(
    bench: HeldBench, motions: Mapping[Trial, HeldMotion], settings: ExecutionSettings
) -> dict[Trial, HeldMotion]:
    """Simulate trials with short steps from before their trouble on, to where they are lost."""
    whole = [trial for trial, motion in motions.items() if _is_thrown(trial, motion)]
    drives = {
        trial: replace(trial.drive, lost=_lost(motion, trial.begun, settings))
        for trial, motion in motions.items() if trial not in whole
    }  # fmt: skip
    return run_trials(bench, whole) | _gone_on(bench, motions, drives)


def _gone_on(
    bench: HeldBench, motions: Mapping[Trial, HeldMotion], drives: Mapping[Trial, TrialDrive]
) -> dict[Trial, HeldMotion]:
    """Simulate other drives of trials from before their trouble on, which alters nothing before."""
    if not drives:
        return {}
    begins = {trial: _begin(trial, motions[trial]) for trial in drives}
    rests, starts = list[TrialDrive](), list[Array]()
    for trial, begin in begins.items():
        rest = drives[trial].rows(slice(begin + 1, None))
        # later states have the speed of a trial that starts to move when its weight has come
        rests.append(rest if begin < trial.weighing else replace(rest, velocity=np.zeros(3)))
        starts.append(motions[trial].states[begin])
    ends = bench.run(rests, np.stack(starts))
    return {  # faults came later than what is kept of a first run
        trial: replace(motions[trial].rows(slice(begin + 1)), health=end.health).then(end)
        for (trial, begin), end in zip(begins.items(), ends, strict=True)
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
    bench: HeldBench, motions: Mapping[Trial, HeldMotion], judged: Mapping[Trial, ExecutionTrial]
) -> tuple[ExecutionTrial, ...]:
    """Measure the first slip of loads that come at once, by contacts that stick."""
    known, friction = dict(judged), bench.scene.layout.friction
    rough = {
        trial: replace(trial.drive, friction=STICKING * friction)
        for trial, each in judged.items()
        if each.fate in {"slipped", "dropped"}
        and (trial.weighing or each.kind == "lift" or each.simulated_first_slip >= FULL_LOAD)
    }
    for trial, motion in _gone_on(bench, motions, rough).items():
        multiple = sticking_multiple(motion, trial.drive, friction, trial.begun)
        known[trial] = replace(known[trial], simulated_first_slip=min(multiple, 1.0))
    return tuple(known.values())
