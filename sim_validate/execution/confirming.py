"""Runs lost trials again with short steps: a loss counts only if it does not depend on the step.

Where contacts open and close between fingertips that push lightly, an object rattles. With steps of
the usual length it bounces too much, and may fall where it would come to rest. Up to the first
contact that opens or slips, steps of that length are exact enough (see `gate`), so a run with steps
of `FINE_S` goes on from shortly before. It ends where the object is farther than it may be: the
loss is confirmed then, whatever comes later.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from scenes.execution.held_mjcf import held_physics
from scenes.execution.turns import hinged, rotations
from sim_validate.execution.bench import (
    HeldBench,
    HeldMotion,
    Lost,
    begun_motion,
    motions_joined,
)
from sim_validate.execution.drives import Drive, parted
from sim_validate.execution.settings import ExecutionSettings
from sim_validate.execution.slips import IDLE, first_trouble
from sim_validate.execution.trials import Trial

FINE_S = 1.25e-4
"""Length of steps that confirm a loss, at most [s]."""
FINER = 4
"""Number of such steps in a step of the usual length, at least."""
BEFORE = 4
"""Samples before the first trouble that is seen at which the second run begins: what happens within
a sample is not seen."""
SHORTEST_S = 1e-5
"""Shortest step that is taken [s]."""


def confirming_bench(bench: HeldBench) -> HeldBench | None:
    """Return a bench of the same scene with short steps; None if those of this one are as short."""
    step_s = min(FINE_S, held_physics(bench.scene.layout).timestep / FINER)
    count = round(bench.sample_s / max(step_s, SHORTEST_S))
    if count <= bench.chunk:
        return None
    return HeldBench(bench.scene, threads=bench.threads, step_s=bench.sample_s / count)


def run_again(
    bench: HeldBench, trials: Sequence[Trial], motions: Sequence[HeldMotion],
    settings: ExecutionSettings,
) -> Iterator[HeldMotion]:  # fmt: skip
    """Yield motions in which trials are simulated with short steps from before their trouble on."""
    begins = [_begin(trial, motion, bench) for trial, motion in zip(trials, motions, strict=True)]
    again = bench.run(
        [_rest(trial, begin) for trial, begin in zip(trials, begins, strict=True)],
        np.stack([motion.states[begin] for motion, begin in zip(motions, begins, strict=True)]),
        lost=[
            _lost(motion, trial.begun, settings)
            for trial, motion in zip(trials, motions, strict=True)
        ],
    )  # fmt: skip
    for motion, begin, rest in zip(motions, begins, again, strict=True):
        yield motions_joined(begun_motion(motion, begin + 1), rest)


def _begin(trial: Trial, motion: HeldMotion, bench: HeldBench) -> int:
    """Return the sample after which a trial is run again.

    It is the first where fingers that close do not come to hold the object, and where contacts slip
    within samples only, so that nothing says when.
    """
    layout = bench.scene.layout
    pushing = np.linalg.norm(layout.pushes, axis=1) > IDLE * float(np.abs(layout.pushes).max())
    if (motion.forces[trial.begun, pushing] == 0.0).all(axis=1).any():
        return 0
    trouble = first_trouble(motion, layout, layout.friction, trial.begun)
    return max(0, trouble - BEFORE) if trouble < len(motion.moved) else 0


def _rest(trial: Trial, begin: int) -> Drive:
    """Return what is applied after a sample.

    A trial that starts to move when its weight has come has its speed in later states; one that
    goes on from before gets it at once, as uniform motion changes nothing.
    """
    rest = parted(trial.drive, begin + 1)[1]
    return rest if begin < trial.weighing else replace(rest, velocity=np.zeros(3))


def _lost(motion: HeldMotion, begun: int, settings: ExecutionSettings) -> Lost:
    """Return how far from its planned place an object is surely too far from where it was."""
    palm = hinged(motion.palm[begun : begun + 1, 3:])[0]
    turned = palm.T @ rotations(motion.turned[begun : begun + 1])[0]
    angle = math.acos(min(max(0.5 * (float(np.trace(turned)) - 1.0), -1.0), 1.0))
    away = float(np.linalg.norm(motion.moved[begun] - motion.palm[begun, :3]))
    return Lost(settings.most_m + away, settings.most_rad + angle)
