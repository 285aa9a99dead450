"""Lays out the trials of closure tests: what load, which finger forces and friction in each sample.

Loads change smoothly, because long objects spring loose under a sudden start.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, cross, to_digits
from scenes.mujoco.closure_scene import Layout
from sim_validate.engine.stepping import Told


def samples(duration_s: float, sample_s: float) -> int:
    """Return the whole number of samples nearest to a duration, at least one."""
    return max(1, round(duration_s / sample_s))


def smooth(count: int) -> Array:
    """Return numbers that rise from zero to one with no slope at either end, (count,)."""
    time = np.arange(1, count + 1) / count
    return time**2 * (3.0 - 2.0 * time)


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Displacements that answer a trial [m]."""

    watched_m: float
    """Displacement since friction was lowered."""
    total_m: float = math.inf
    """Displacement from the planned pose to the start, and that since then."""


@dataclass(frozen=True, slots=True, eq=False)
class TrialLoad:
    """An external wrench with the contact forces planned to balance it."""

    wrench: Array
    """External wrench, (6,) [N, N m], torque about the centre of mass, world axes."""
    forces: Array
    """Contact forces on the object, (k, 3) [N], world axes."""


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Wrench (n, 6), finger forces (n, k, 3) and friction in each of the n samples of a trial."""

    wrenches: Array
    forces: Array
    friction: Array
    watched: int
    """Index of the first sample from which the object must stay where it is."""
    resting: int
    """Index of the first sample from which load and finger forces no longer change."""
    answer: Thresholds | None = None
    """Displacements that end the trial early; trials that run together have the same."""

    def told(self, layout: Layout) -> Told:
        """Return what the scene of a layout is told, rounded like its numbers (see `arrange`)."""
        wrenches = self.wrenches.copy()
        wrenches[:, 3:] -= cross(layout.center, wrenches[:, :3])
        wrenches = np.hstack([to_digits(wrenches[:, :3]), to_digits(wrenches[:, 3:])])
        commands = to_digits(layout.holder.efforts(self.forces)) / layout.holder.servo
        return Told(wrenches, commands, friction=to_digits(self.friction)[:, None])

    @staticmethod
    def between(
        start: TrialLoad, end: TrialLoad, shares: Array, frictions: tuple[float, float],
        watched: int, resting: int, answer: Thresholds | None = None,
    ) -> "Schedule":  # fmt: skip
        """Schedule shares of the way between loads; friction falls where watching begins."""
        friction = np.where(np.arange(len(shares)) < watched, *frictions)
        wrenches = start.wrench + shares[:, None] * (end.wrench - start.wrench)
        forces = start.forces + shares[:, None, None] * (end.forces - start.forces)
        return Schedule(wrenches, forces, friction, watched, resting, answer)


MOST_PLANNED = 2.0
"""Largest share of the limit for which forces are planned; for larger loads the forces stay the
same."""


def part(idle: TrialLoad, limit: TrialLoad, share: float) -> TrialLoad:
    """Return a share of a wrench, with forces between those without load and those at the limit."""
    planned = min(float(share), MOST_PLANNED)
    wrench = idle.wrench + share * (limit.wrench - idle.wrench)
    return TrialLoad(wrench, (1.0 - planned) * idle.forces + planned * limit.forces)
