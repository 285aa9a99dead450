"""Trace -> outcome: held, or what went wrong and when. Pure, so old traces can be re-judged."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from grasp_core.arrays import Array
from sim_validate.protocol import HoldProtocol
from sim_validate.simulate import HoldTrace

CLOCK_SLACK_S = 1e-9
"""Simulated time is a sum of equal steps; a reset would put it off by milliseconds."""


class Outcome(StrEnum):
    """How a trial ended."""

    HELD = "held"
    SLIPPED = "slipped"
    LOST_CONTACT = "lost_contact"
    DIVERGED = "diverged"
    INVALID_START = "invalid_start"
    TIMEOUT = "timeout"
    ERROR = "error"


@dataclass(frozen=True, slots=True, eq=False)
class HoldVerdict:
    """What a trace amounts to."""

    outcome: Outcome
    displacement_m: float
    """Largest while holding: motion between the contacts plus grasp size times rotation."""
    rotation_rad: float
    slip_m: Array
    """Largest tangential motion of each fingertip over its face, (k,)."""
    failed_after_s: float | None
    """When a threshold was first crossed."""


def judge(trace: HoldTrace, grasp_size_m: float, protocol: HoldProtocol) -> HoldVerdict:
    """Apply the thresholds of a protocol to a trace.

    Args:
        trace: Motion from the moment friction was lowered.
        grasp_size_m: The lever of the contacts; thresholds are relative to it.
        protocol: Where the thresholds come from.
    """
    sound = trace.finite and trace.warnings == 0 and abs(trace.clock_error_s) < CLOCK_SLACK_S
    limit = protocol.total_threshold * grasp_size_m
    moved = trace.displacements_m >= protocol.hold_threshold * grasp_size_m
    strayed = trace.start_m + trace.displacements_m >= limit
    apart = trace.gaps_m.max(axis=1) > protocol.gap_threshold * grasp_size_m
    failing = np.flatnonzero(moved | strayed | apart)
    first = int(failing[0]) if failing.size else None
    if not sound:
        outcome = Outcome.DIVERGED
    elif trace.start_m >= limit:
        outcome = Outcome.INVALID_START
    elif first is None:
        outcome = Outcome.HELD
    else:
        outcome = Outcome.LOST_CONTACT if apart[first] else Outcome.SLIPPED
    return HoldVerdict(
        outcome=outcome,
        displacement_m=float(trace.displacements_m.max()),
        rotation_rad=float(trace.rotations_rad.max()),
        slip_m=trace.slips_m.max(axis=0),
        failed_after_s=None if first is None else float(trace.times_s[first]),
    )
