"""Checks that steps are short enough where contacts open and close, on a box that is struck.

A blow along x with a little more force than that of all four pushes takes the box off the fingers
behind it and lets it slide along the others; springs and contacts bring it back. There is no closed
form, so the motion is compared with that in steps that are `SHORTER` times as short as usual.
"""

import math
from dataclasses import replace

import numpy as np

from grasp_core.checked import SMALLEST
from scenes.execution.held_mjcf import held_physics
from sim_validate.execution import paths
from sim_validate.execution.bench import HeldBench, HeldMotion
from sim_validate.execution.drives import Drive, idle
from sim_validate.execution.gate.held_case import FINGERS, SETTLE_S, HeldCase
from sim_validate.execution.slips import seen
from sim_validate.simulation.known_cases import Check

BLOW = 1.2
"""Largest force of the blow, relative to the pushes of all fingers."""
WATCHED = 1.0
"""Time for which the box is watched, in periods of its motion along an axis."""
LEAST_WATCHED = 8
"""Least number of samples for which it is watched."""
SHORTER = 4
"""How much shorter the steps are that it is compared with."""
CHANGED = 0.25
"""Largest difference, over the largest displacement: steps of the usual length differ by 0.02 to
0.1, in a few cases by 0.2; steps twice as long by 0.27 for boxes of some grams, four times as long
by 0.4 and more."""


def struck_box(case: HeldCase) -> Check:
    """Check how much short steps change the motion of a box that is struck off its fingers."""
    scene = case.held_box()
    usual = HeldBench(scene)
    step_s = held_physics(scene.layout).timestep / SHORTER
    motions = [_struck(case, bench) for bench in (usual, HeldBench(scene, step_s=step_s))]
    here, there = (seen(motion, scene.layout).moved for motion in motions)
    changed = float(np.abs(here - there).max()) / max(float(np.abs(there).max()), SMALLEST)
    name = "motion of a box struck off its fingers that short steps change, over the largest"
    faulty = any(motion.faults for motion in motions)
    return Check(name, math.nan if faulty else changed, 0.0, CHANGED)


def _struck(case: HeldCase, bench: HeldBench) -> HeldMotion:
    _, start = bench.settled(paths.closing(SETTLE_S))
    (motion,) = bench.run([_blow(case)], start)
    return motion


def _blow(case: HeldCase) -> Drive:
    """Return the drive of half a sine of force along x, as long as a knock, and what follows."""
    strike = paths.samples(paths.STRIKE_S)
    after = max(LEAST_WATCHED, paths.samples(WATCHED * 2.0 * np.pi / case.frequency))
    wrenches = np.zeros((strike + after, 6))
    shape = np.sin(np.pi * (np.arange(strike) + 0.5) / strike)
    wrenches[:strike, 0] = BLOW * FINGERS * case.push * shape
    return replace(idle(len(wrenches)), wrenches=wrenches)
