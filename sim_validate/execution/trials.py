"""Which trials an execution consists of, and what each applies."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.objects.polyhedron import Polyhedron
from scenes.execution.held import HeldLayout
from sim_validate.execution import paths
from sim_validate.execution.drives import Drive, Table, joined
from sim_validate.execution.misplaced import met, misplacements
from sim_validate.execution.resting import resting
from sim_validate.execution.settings import ExecutionSettings, TrialKind

AXES = ("x", "y", "z")
SIDES = tuple((sign, axis) for axis in range(3) for sign in (1.0, -1.0))
"""Sign and axis of the six directions of stops and knocks."""
OF_NO_SIZE: dict[TrialKind, str] = {"shake": "shake_g", "knock": "knock_n_s"}
"""Setting whose zero leaves no trial of a kind."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One trial: what is applied, and from when on the object must stay where it is."""

    kind: TrialKind
    name: str
    drive: Drive
    begun: int
    """Index of the sample after which the load comes."""
    apart: bool = False
    """Whether the trial starts with open fingers, not from the squeezed object."""
    weighing: int = 0
    """Number of samples at the start in which the weight comes, as in other trials of the grasp."""
    turning: bool = False
    """Whether the load keeps turning, so that small slips add up."""
    expected: Drive | None = None
    """What the prediction is for, if not for the drive itself."""


@dataclass(frozen=True, slots=True)
class Skipped:
    """A kind of trial that was asked for and left out, and why."""

    kind: TrialKind
    reason: str


def trials_of(
    body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings, lowest_frequency: float
) -> tuple[tuple[Trial, ...], tuple[Skipped, ...]]:
    """Return the trials that are asked for, and the kinds that are left out with the reasons.

    Takes `lowest_frequency` [rad/s].
    """
    every = [
        each
        for kind in settings.trials
        for each in _of_kind(kind, body, layout, settings, lowest_frequency)
    ]
    return (
        tuple(each for each in every if isinstance(each, Trial)),
        tuple(each for each in every if isinstance(each, Skipped)),
    )


def _of_kind(
    kind: TrialKind, body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings,
    lowest_frequency: float,
) -> Iterable[Trial | Skipped]:  # fmt: skip
    """Return the trials of a kind, or why there is none."""
    if kind in OF_NO_SIZE and getattr(settings, OF_NO_SIZE[kind]) == 0.0:
        return [Skipped(kind, _no_size(OF_NO_SIZE[kind]))]
    if kind == "weight":
        return [Trial(kind, kind, paths.turned_weight(lowest_frequency), 0, turning=True)]
    if kind == "lift":
        return [_lift(body, layout, settings)]
    sized = {"shake": _shakes, "stop": _stops, "knock": _knocks, "misplaced": _misplaced}
    return sized[kind](layout, settings)


def _no_size(setting: str) -> str:
    """Say that a setting is zero, under its name in Python and as a flag."""
    return f"its size is 0 ({setting}, --{setting.replace('_', '-')})"


def _lift(body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings) -> Trial | Skipped:
    rest = resting(body, *layout.above_table)
    if rest is None:
        return Skipped(
            "lift", "a fingertip is in the way of the table on every face that the object rests on"
        )
    give_m = layout.mass_kg * GRAVITY_M_PER_S2 / layout.stiffness_along(rest.down)
    drive, begun = paths.lift(-rest.down, settings.lift_m, settings.lift_s, give_m)
    table = Table(rest.height * rest.down, -rest.down)
    return Trial("lift", "lift", replace(drive, table=table), begun - 1, apart=True)


def _shakes(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    size = GRAVITY_M_PER_S2 * settings.shake_g
    sizes = np.repeat([size, size / layout.radius_m], len(AXES))
    names = [f"shake {how} {axis}" for how in ("along", "about") for axis in AXES]
    for name, axis in zip(names, np.diag(sizes), strict=True):
        drive = paths.shake(layout.gravity, axis, settings.shake_hz)
        yield Trial("shake", name, drive, 0, weighing=paths.WEIGHING)


def _stops(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    for sign, axis in SIDES:
        way = sign * np.eye(3)[axis]
        drive = paths.stop(layout.gravity, way, settings.stop_m_per_s2, settings.stop_from_m_per_s)
        yield Trial("stop", f"stop {_side(sign, axis)}", drive, 0, weighing=paths.WEIGHING)


def _knocks(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    """Yield knocks along both sides of each axis, half the object's radius beside its middle."""
    for sign, axis in SIDES:
        point = 0.5 * layout.radius_m * np.eye(3)[(axis + 1) % 3]
        drive = paths.knock(layout.gravity, sign * settings.impulse_n_s * np.eye(3)[axis], point)
        yield Trial("knock", f"knock {_side(sign, axis)}", drive, 0, weighing=paths.WEIGHING)


def _misplaced(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    off_m, off_rad = settings.off_mm / 1000.0, math.radians(settings.off_deg)
    poses = misplacements(layout, off_m, off_rad, settings.misplacements, settings.seed)
    reached = met(layout, poses, off_m, off_rad)
    closing, weight = paths.closing(), paths.held_weight(layout.gravity)
    for place, (pose, tips) in enumerate(zip(poses, reached, strict=True)):
        drive = replace(joined(closing, weight), pose=pose, reached=tips)
        name = f"misplaced {place}"
        yield Trial("misplaced", name, drive, len(closing) - 1, apart=True, expected=weight)


def _side(sign: float, axis: int) -> str:
    return f"{'+' if sign > 0.0 else '-'}{AXES[axis]}"
