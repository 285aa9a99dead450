import numpy as np
import pytest

from sim_validate.protocol import HoldProtocol
from sim_validate.simulate import HoldTrace
from sim_validate.verdict import Outcome, judge

SIZE = 0.05


def trace(**changes):
    """A still object: five samples, three fingers in contact."""
    still = {
        "times_s": np.arange(1, 6) * 0.01,
        "displacements_m": np.full(5, 1e-8),
        "rotations_rad": np.full(5, 1e-7),
        "slips_m": np.full((5, 3), 1e-9),
        "gaps_m": np.full((5, 3), -1e-6),
        "start_m": 1e-7,
        "finite": True,
        "warnings": 0,
        "clock_error_s": 0.0,
    }
    return HoldTrace(**still | changes)


MOVING = np.array([0, 0, 2.1e-4, 3e-4, 4e-4]) * SIZE
APART = np.where(np.arange(15).reshape(5, 3) == 7, 3e-4 * SIZE, -1e-6)


@pytest.mark.parametrize(
    ("changes", "outcome", "time"),
    [
        ({}, Outcome.HELD, None),
        ({"displacements_m": MOVING}, Outcome.SLIPPED, 0.03),
        ({"displacements_m": 0.9 * np.minimum(MOVING, 2e-4 * SIZE)}, Outcome.HELD, None),
        ({"start_m": 3e-4 * SIZE}, Outcome.INVALID_START, 0.01),
        ({"start_m": 1.9e-4 * SIZE, "displacements_m": 0.5 * MOVING}, Outcome.SLIPPED, 0.03),
        ({"gaps_m": APART}, Outcome.LOST_CONTACT, 0.03),
        ({"gaps_m": APART, "displacements_m": np.roll(MOVING, -2)}, Outcome.SLIPPED, 0.01),
        ({"finite": False}, Outcome.DIVERGED, None),
        ({"warnings": 1}, Outcome.DIVERGED, None),
        ({"clock_error_s": -0.2}, Outcome.DIVERGED, None),
    ],
)
def test_each_way_to_fail_has_its_name_and_time(changes, outcome, time):
    verdict = judge(trace(**changes), SIZE, HoldProtocol())
    assert verdict.outcome is outcome
    assert verdict.failed_after_s == (None if time is None else pytest.approx(time))


def test_a_number_that_is_not_finite_never_holds():
    """Comparisons with NaN are false, so a threshold alone would let it pass."""
    broken = trace(displacements_m=np.full(5, np.nan), finite=False)
    assert judge(broken, SIZE, HoldProtocol()).outcome is Outcome.DIVERGED


def test_the_largest_motion_is_reported():
    verdict = judge(
        trace(displacements_m=MOVING, slips_m=np.diag(np.arange(5.0))[:, :3]), SIZE, HoldProtocol()
    )
    assert verdict.displacement_m == MOVING.max()
    np.testing.assert_array_equal(verdict.slip_m, [0.0, 1.0, 2.0])
