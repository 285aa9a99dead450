"""Judges a recorded trial: whether the object was held, or else what went wrong, where and when.

The functions are pure, so that old traces can be judged again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.by_value import ByValue
from grasp_core.objects.on_faces import within
from scenes.layout import Layout
from sim_validate.simulation.protocol import HoldProtocol
from sim_validate.simulation.traces import Trace


class Outcome(StrEnum):
    """How a trial ended."""

    HELD = "held"
    SLIPPED = "slipped"
    LOST_CONTACT = "lost_contact"
    DIVERGED = "diverged"
    INVALID_START = "invalid_start"
    TIMEOUT = "timeout"
    ERROR = "error"


LET_GO = (Outcome.SLIPPED, Outcome.LOST_CONTACT)
"""Outcomes which say that the object was not held. All other outcomes but `HELD` leave open whether
it is held."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HoldVerdict(ByValue):
    """The outcome of a trial, with the figures that led to it."""

    outcome: Outcome
    reason: str
    """What happened, in words; empty if the object was held."""
    displacement_m: float
    """Largest displacement while the object had to be held [m]: motion of the point between the
    contacts plus grasp size times rotation."""
    start_displacement_m: float
    """Displacement before friction was lowered, while the object was loaded at high friction
    [m]."""
    rotation_rad: float
    slip_m: Array
    """Largest tangential motion of each fingertip over its face, (k,) [m]."""
    failed_after_s: float | None
    """When a threshold was first crossed [s], from the moment friction was lowered; None if
    never."""


def judge(trace: Trace, layout: Layout, protocol: HoldProtocol) -> HoldVerdict:
    """Judge a trial: compare its motion with the thresholds of a protocol."""
    failing = _failing(trace, layout.grasp_size_m, protocol)
    first = int(failing[0]) if failing.size else None
    outcome, reason = _outcome(trace, layout, protocol, first)
    return HoldVerdict(
        outcome=outcome,
        reason=reason,
        displacement_m=float(trace.displacements_m.max(initial=0.0)),
        start_displacement_m=trace.start_m,
        rotation_rad=float(trace.rotations_rad.max(initial=0.0)),
        slip_m=trace.slips_m.max(axis=0, initial=0.0),
        failed_after_s=None if first is None else float(trace.times_s[first]),
    )


def holds(trace: Trace, layout: Layout, protocol: HoldProtocol) -> bool | None:
    """Tell whether a trace shows the object held; None if the trace does not decide it."""
    outcome = judge(trace, layout, protocol).outcome
    return outcome is Outcome.HELD if outcome in (Outcome.HELD, *LET_GO) else None


def invalid_start(verdict: HoldVerdict, reasons: Sequence[str]) -> HoldVerdict:
    """Replace the outcome of a verdict because fingertips cannot stand where they were put."""
    return replace(verdict, outcome=Outcome.INVALID_START, reason="; ".join(reasons))


def _failing(trace: Trace, size: float, protocol: HoldProtocol) -> Indices:
    """Find the samples in which displacement or gap crosses a threshold; return their indices."""
    moved = trace.displacements_m >= protocol.hold_threshold * size
    strayed = trace.start_m + trace.displacements_m >= protocol.total_threshold * size
    apart = (trace.gaps_m > protocol.gap_threshold * size).any(axis=1)
    return np.flatnonzero(moved | strayed | apart)


def _outcome(
    trace: Trace, layout: Layout, protocol: HoldProtocol, first: int | None
) -> tuple[Outcome, str]:
    if trace.error:
        return Outcome.ERROR, trace.error
    if trace.timed_out:
        return Outcome.TIMEOUT, trace.fault
    if trace.fault:
        return Outcome.DIVERGED, trace.fault
    if trace.start_m >= protocol.total_threshold * layout.grasp_size_m:
        moved = f"the object moved by {_um(trace.start_m)} while it was loaded at high friction"
        return Outcome.SLIPPED, moved
    if first is None:
        return Outcome.HELD, ""
    return _how_it_let_go(trace, layout, protocol, first)


def _how_it_let_go(
    trace: Trace, layout: Layout, protocol: HoldProtocol, first: int
) -> tuple[Outcome, str]:
    """Name the finger that lost its face, or slid farthest, when a threshold was first crossed."""
    gaps, slips = trace.gaps_m[first], trace.slips_m[first]
    rolled = np.flatnonzero([not on for on in _on_faces(trace.touched_m[first], layout)])
    if rolled.size:
        return Outcome.LOST_CONTACT, f"finger {rolled[0]} rolled off its face"
    finger = int(np.argmax(gaps))
    if gaps[finger] > protocol.gap_threshold * layout.grasp_size_m:
        return Outcome.LOST_CONTACT, f"finger {finger} is {_um(gaps[finger])} off its face"
    finger = int(np.argmax(slips))
    turned = f"the object turned by {1e3 * trace.rotations_rad[first]:.3g} mrad"
    if trace.displacements_m[first] < protocol.hold_threshold * layout.grasp_size_m:
        turned += f" after {_um(trace.start_m)} of motion while it was loaded"
    return Outcome.SLIPPED, f"finger {finger} slid {_um(slips[finger])} over its face, {turned}"


def _on_faces(touched: Array, layout: Layout) -> list[bool]:
    """Tell for each point whether it lies on its contact's face; True if that face is not known."""
    return [
        not border or any(within(point, piece, frame[:, 0], 0.0) for piece in border)
        for point, border, frame in zip(touched, layout.borders, layout.frames, strict=True)
    ]


def _um(length_m: float) -> str:
    return f"{1e6 * length_m:.3g} um"
