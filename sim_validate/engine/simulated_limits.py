"""Finds the largest multiples of wrenches that a squeezed object is held against.

They are found by a ramp or by bisection, where the object moves by a threshold. The mass must first
be accelerated, so a ramp finds the limit late, never early. Both load the object with a share of
the predicted limit and the forces planned for it, which lie that share of the way from the gentle
squeeze to the forces at the limit. They balance the load, because both ends do. Below the limit
they are inside the cones and the limits on the push, again because both ends are. Above it, up to
twice the limit, the forces still balance on paper, but friction gives way, or a finger cannot push
harder.

A ramp passes the limit slowly. The load left over grows in proportion to the time since, so the
displacement grows with its third power and the ramp ends late. A displacement eight times as large
is reached when twice as much time has passed since the limit. Extrapolating the two times back
gives a bound from below.
"""

from collections.abc import Callable, Sequence

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.declared import Declared, declared
from sim_validate.engine.held_or_let_go import Trace, holds
from sim_validate.engine.rig import Rig
from sim_validate.engine.schedules import TrialLoad, part

LATER = 8.0
"""Displacement at the second reading of a ramp, relative to the first; 8 = 2 cubed."""
STAYS, LETS_GO, UNSURE = 1, 0, -1


@declared
class SimulatedLimit(Declared):
    """Two shares of a wrench's predicted limit: the object holds the first and not the second."""

    lower: float
    upper: float
    share: float
    """Best estimate of where the object lets go: a ramp's threshold, or a bisection's middle."""


def ramped_limits(rig: Rig, limits: Sequence[TrialLoad]) -> tuple[SimulatedLimit | None, ...]:
    """Find by slowly rising loads the shares of the limits at which the object lets go."""
    threshold = rig.setup.limit.ramp_threshold * rig.bench.scene.layout.grasp_size_m

    def search(chosen: Sequence[TrialLoad], span: float) -> list[SimulatedLimit | None]:
        rises, shares = rig.ramps(chosen, (1.0 - span, 1.0 + span))
        return [_onset(trace, shares, threshold) for trace in rig.traced(rises)]

    return _in_some_span(rig, limits, search)


def _in_some_span(
    rig: Rig,
    limits: Sequence[TrialLoad],
    search: Callable[[Sequence[TrialLoad], float], Sequence[SimulatedLimit | None]],
) -> tuple[SimulatedLimit | None, ...]:
    """Search near each predicted limit first, then in wider intervals; None if nothing is found."""
    found: dict[int, SimulatedLimit] = {}
    for span in rig.setup.limit.spans:
        rest = [place for place in range(len(limits)) if place not in found]
        if not rest:
            break
        answers = search([limits[place] for place in rest], span)
        found |= {place: at for place, at in zip(rest, answers, strict=True) if at is not None}
    return tuple(found.get(place) for place in range(len(limits)))


def _onset(trace: Trace, shares: Array, threshold: float) -> SimulatedLimit | None:
    """Find where a ramp lets go; None if it does not let go, or does at its very start."""
    moved = trace.displacements_m
    passed = np.flatnonzero(moved >= threshold)
    if not passed.size or passed[0] == 0 or trace.health.fault:
        return None
    first = int(passed[0])
    before, after = shares[first - 1], shares[first]
    # Interpolate the cube root of the displacement, which is linear in time.
    roots = np.cbrt([moved[first - 1], threshold, moved[first]])
    at = before + (after - before) * (roots[1] - roots[0]) / (roots[2] - roots[0])
    later = np.flatnonzero(moved >= LATER * threshold)
    # Twice the time since the limit has passed at eight times the displacement, so the limit lies
    # as far before the first reading as the second lies after it.
    lower = 2.0 * before - shares[later[0]] if later.size else shares[0]
    return SimulatedLimit(lower=float(lower), upper=float(after), share=float(at))


def bisected_limits(rig: Rig, limits: Sequence[TrialLoad]) -> tuple[SimulatedLimit | None, ...]:
    """Find the shares of the limits at which the object lets go, by bisection."""

    def search(chosen: Sequence[TrialLoad], span: float) -> list[SimulatedLimit | None]:
        held, let_go = np.full(len(chosen), 1.0 - span), np.full(len(chosen), 1.0 + span)
        inside = (_ends(rig, chosen, held) == STAYS) & (_ends(rig, chosen, let_go) == LETS_GO)
        for _ in range(rig.setup.limit.rounds):
            open_places = np.flatnonzero(inside)
            if not open_places.size:
                break
            middle = 0.5 * (held + let_go)[open_places]
            ends = _ends(rig, [chosen[int(place)] for place in open_places], middle)
            held[open_places[ends == STAYS]] = middle[ends == STAYS]
            let_go[open_places[ends == LETS_GO]] = middle[ends == LETS_GO]
            inside[open_places[ends == UNSURE]] = False
        return [
            SimulatedLimit(float(low), float(high), float(0.5 * (low + high))) if found else None
            for low, high, found in zip(held, let_go, inside, strict=True)
        ]

    return _in_some_span(rig, limits, search)


def _ends(rig: Rig, limits: Sequence[TrialLoad], shares: Array) -> Indices:
    """Tell whether shares of loads hold: `STAYS`, `LETS_GO`, or `UNSURE` of an invalid trial."""
    loads = [part(rig.idle, limit, share) for limit, share in zip(limits, shares, strict=True)]
    layout, protocol = rig.bench.scene.layout, rig.setup.hold
    ends = [holds(trace, layout, protocol) for trace in rig.traced(rig.holds(loads))]
    return np.array([UNSURE if end is None else int(end) for end in ends])
