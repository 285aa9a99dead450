import re

import numpy as np
import pytest

from sim_validate.engine.held_or_let_go import Outcome, Trace, judge
from sim_validate.engine.stepping import Health
from sim_validate.settings import HoldProtocol


def trace(layout, **changes):
    """A still object: five samples, four fingers in contact; lengths in grasp sizes."""
    size = layout.grasp_size_m
    still = {
        "displacements_m": np.full(5, 1e-7), "shifts_m": np.full(5, 1e-7), "start_m": 1e-6,
        "slips_m": np.full((5, 4), 1e-8), "gaps_m": np.full((5, 4), -1e-5),
    }  # fmt: skip
    lengths = {name: size * changes.pop(name, value) for name, value in still.items()}
    rest = {
        "times_s": np.arange(1, 6) * 0.01,
        "rotations_rad": np.full(5, 1e-7),
        "touched_m": np.tile(layout.contacts, (5, 1, 1)),
        "health": Health(),
    }
    return Trace(**lengths, **rest | changes)


MOVING = np.array([0, 0, 2.1e-4, 3e-4, 4e-4])
APART = np.where(np.arange(20).reshape(5, 4) == 9, 3e-4, -1e-6)


@pytest.mark.parametrize(
    ("changes", "outcome", "time", "reason"),
    [
        ({}, Outcome.HELD, None, "^$"),
        ({"displacements_m": MOVING}, Outcome.SLIPPED, 0.03, "finger . slid .* turned by"),
        ({"displacements_m": 0.9 * np.minimum(MOVING, 2e-4)}, Outcome.HELD, None, "^$"),
        ({"start_m": 3e-4}, Outcome.SLIPPED, 0.01, "while it was loaded at high friction"),
        ({"start_m": 1.9e-4, "displacements_m": 0.5 * MOVING}, Outcome.SLIPPED, 0.03, "slid"),
        ({"gaps_m": APART}, Outcome.LOST_CONTACT, 0.03, "finger 1 is .* um off its face"),
        ({"gaps_m": APART, "displacements_m": np.roll(MOVING, -2)}, Outcome.SLIPPED, 0.01, "slid"),
        ({"health": Health(finite=False)}, Outcome.DIVERGED, None, "not finite"),
        ({"health": Health(warnings=1)}, Outcome.DIVERGED, None, "1 warnings"),
        ({"health": Health(clock_error_s=-0.2)}, Outcome.DIVERGED, None, "it was reset"),
        ({"health": Health(error="stack overflow")}, Outcome.ERROR, None, "stack overflow"),
        ({"health": Health(timed_out=True)}, Outcome.TIMEOUT, None, "stopped before its end"),
    ],
)
def test_each_way_to_fail_has_its_name_its_reason_and_its_time(
    layout, changes, outcome, time, reason
):
    verdict = judge(trace(layout, **changes), layout, HoldProtocol())
    assert verdict.outcome is outcome
    assert verdict.failed_after_s == (None if time is None else pytest.approx(time))
    assert re.search(reason, verdict.reason)


def test_a_fingertip_beyond_the_border_has_rolled_off(layout):
    touched = np.tile(layout.contacts, (5, 1, 1))
    touched[3:, 2] += 2.0 * layout.radius_m * layout.frames[2, :, 1]
    moving = np.array([0, 0, 0, 3e-4, 4e-4])
    verdict = judge(
        trace(layout, touched_m=touched, displacements_m=moving), layout, HoldProtocol()
    )
    assert verdict.outcome is Outcome.LOST_CONTACT
    assert verdict.reason == "finger 2 rolled off its face"
    assert verdict.failed_after_s == pytest.approx(0.04)
