"""The largest multiple of each wrench that a grasp resists in simulation, by ramp or by bisection.

Both load the object with a share of the predicted limit and the forces planned for it: those of
the gentle squeeze plus that share of the way to the forces at the limit. They balance the load,
because both ends do. Below the limit they are inside the cones and the limits on the push, again
because both ends are. Above it they still balance, on paper: what lets go is friction, or a
finger that cannot push harder.

A ramp passes the limit slowly. The load left over grows in proportion to the time since, so the
displacement grows with its third power and the ramp ends late. A displacement eight times as
large is reached when twice as much time has passed since the limit; where
the two lead back to is a bound from below.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from sim_validate.rig import Rig
from sim_validate.schedules import Load
from sim_validate.traces import Trace
from sim_validate.verdict import Outcome, judge

LATER = 8.0
"""Displacement at the second reading of a ramp, in thresholds."""
OVERLOAD = 2.0
"""Forces are planned for loads up to this share of the limit; for larger ones they stay."""


@dataclass(frozen=True, slots=True)
class SimulatedLimit:
    """Where between two shares of the predicted limit the object lets go."""

    lower: float
    upper: float
    share: float
    """The best guess: where a ramp passed its threshold, or the middle of a bisection."""


def ramped_limits(rig: Rig, limits: Sequence[Load]) -> tuple[SimulatedLimit | None, ...]:
    """Shares of the predicted limits at which ramps let go; None where none did in any span.

    Args:
        rig: The squeezed object.
        limits: The wrench at each predicted limit, and the forces that balance it.
    """
    threshold = rig.setup.limit.ramp_threshold * rig.bench.scene.layout.grasp_size_m

    def search(chosen: Sequence[Load], span: float) -> list[SimulatedLimit | None]:
        traces, shares = rig.ramp(chosen, (1.0 - span, 1.0 + span))
        return [_onset(trace, shares, threshold) for trace in traces]

    return _in_some_span(rig, limits, search)


def _in_some_span(
    rig: Rig,
    limits: Sequence[Load],
    search: Callable[[Sequence[Load], float], Sequence[SimulatedLimit | None]],
) -> tuple[SimulatedLimit | None, ...]:
    """What a search finds near each predicted limit, or farther away."""
    found: dict[int, SimulatedLimit] = {}
    for span in rig.setup.limit.spans:
        rest = [place for place in range(len(limits)) if place not in found]
        if not rest:
            break
        answers = search([limits[place] for place in rest], span)
        found |= {place: at for place, at in zip(rest, answers, strict=True) if at is not None}
    return tuple(found.get(place) for place in range(len(limits)))


def _onset(trace: Trace, shares: Array, threshold: float) -> SimulatedLimit | None:
    """Where a ramp lets go, if it does, and not at its very start.

    Within a sample the displacement grows with the third power of time.
    """
    moved = trace.displacements_m
    passed = np.flatnonzero(moved >= threshold)
    if not passed.size or passed[0] == 0 or not trace.sound:
        return None
    first = int(passed[0])
    before, after = shares[first - 1], shares[first]
    roots = np.cbrt([moved[first - 1], threshold, moved[first]])
    at = before + (after - before) * (roots[1] - roots[0]) / (roots[2] - roots[0])
    later = np.flatnonzero(moved >= LATER * threshold)
    lower = 2.0 * before - shares[later[0]] if later.size else shares[0]
    return SimulatedLimit(lower=float(lower), upper=float(after), share=float(at))


def bisected_limits(rig: Rig, limits: Sequence[Load]) -> tuple[SimulatedLimit | None, ...]:
    """Shares of the predicted limits between holding and letting go; None where in no span.

    Args:
        rig: The squeezed object.
        limits: The wrench at each predicted limit, and the forces that balance it.
    """

    def search(chosen: Sequence[Load], span: float) -> list[SimulatedLimit | None]:
        lower, upper = np.full(len(chosen), 1.0 - span), np.full(len(chosen), 1.0 + span)
        inside = _held(rig, chosen, lower) & ~_held(rig, chosen, upper)
        lower, upper, near = lower[inside], upper[inside], list(compress(chosen, inside))
        for _ in range(rig.setup.limit.rounds if near else 0):
            middle = 0.5 * (lower + upper)
            held = _held(rig, near, middle)
            lower, upper = np.where(held, middle, lower), np.where(held, upper, middle)
        ends = zip(lower.tolist(), upper.tolist(), strict=True)
        brackets = (SimulatedLimit(low, high, 0.5 * (low + high)) for low, high in ends)
        return [next(brackets) if found else None for found in inside]

    return _in_some_span(rig, limits, search)


def _held(rig: Rig, limits: Sequence[Load], shares: Array) -> NDArray[np.bool_]:
    loads = [part(rig.idle, limit, share) for limit, share in zip(limits, shares, strict=True)]
    layout, protocol = rig.bench.scene.layout, rig.setup.hold
    ends = [judge(trace, layout, protocol).outcome for trace in rig.hold(loads)]
    return np.array([end is Outcome.HELD for end in ends])


def part(idle: Load, limit: Load, share: float) -> Load:
    """A share of a limiting wrench, with forces between those without load and at the limit.

    Args:
        idle: Forces that squeeze the unloaded object.
        limit: The largest wrench that is resisted, and the forces that do it.
        share: Of that wrench.
    """
    planned = min(float(share), OVERLOAD)
    wrench = idle.wrench + share * (limit.wrench - idle.wrench)
    return Load(wrench, (1.0 - planned) * idle.forces + planned * limit.forces)
