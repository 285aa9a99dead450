"""Do lost grasps survive with the push, and stiffness, that are said to be enough?

Usage: python -m tests.benchmarks.enough_pushes [GRASPS_PER_OBJECT [SEED]]. Grasps of built-in
objects are executed with masses, pushes and stiffnesses drawn at random. Those that are lost, or
have no squeeze, are executed once more with what is said to be enough, in the same trials.
"""

import sys
import time
from collections import Counter
from dataclasses import replace

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.execution.enough import NoSqueezeError

OBJECTS = (
    "wedge", "box", "dodecahedron", "l-bracket", "tetrahedron", "icosahedron", "hex-nut",
    "double-wedge-bar", "hexagonal-pyramid",
)  # fmt: skip
FRICTION = 0.5
TRIALS = ("weight", "lift", "shake", "stop", "knock")
MASSES_KG, PUSHES_N, STIFFNESSES = (-2.0, 1.0), (-0.7, 1.3), (2.5, 4.0)
"""Ranges of the decimal logarithms."""


def drawn(rng):
    """Settings at random."""
    mass, push, stiffness = (
        float(10.0 ** rng.uniform(*ends)) for ends in (MASSES_KG, PUSHES_N, STIFFNESSES)
    )
    return sv.ExecutionSettings(mass, push, stiffness, trials=TRIALS)


def executed(body, grasp, settings):
    """What would be enough, or None where the grasp survives; the trials that were lost."""
    try:
        found = sv.execute(body, grasp, FRICTION, settings)
    except NoSqueezeError as error:
        return error.enough, ["no squeeze"]
    return found.enough, [trial.name for trial in found.trials if not trial.survived]


def main(count=8, seed=0):
    """Execute grasps twice, and print those that are lost again."""
    rng, ends, begun = np.random.default_rng(seed), Counter(), time.perf_counter()
    for name in OBJECTS:
        body = scenes.example_object(name)
        for grasp in gc.plan(body, FRICTION, limit=count, rank_by="diverse").grasps:
            settings = drawn(rng)
            try:
                enough, lost = executed(body, grasp, settings)
                if enough is None:
                    ends["survived at once"] += 1
                    continue
                hard = replace(
                    settings, push_n=enough.push_n, stiffness_n_per_m=enough.stiffness_n_per_m
                )
                _, again = executed(body, grasp, hard)
            except (gc.InputError, gc.UnfaithfulError) as error:
                ends["refused by the simulator"] += 1
                print(f"{name} {grasp.id}: {error}", flush=True)
                continue
            ends["lost again" if again else "lost, then survived"] += 1
            if again:
                print(f"{name} {grasp.id} {settings}: {enough}; {lost}, then {again}", flush=True)
    print(dict(ends), f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
