import numpy as np
import pytest

from sim_validate.engine.schedules import MOST_PLANNED, TrialLoad, part
from sim_validate.engine.simulated_limits import bisected_limits, ramped_limits
from tests.sim_validate.rigs import grasps, imbalance, limiting_loads, rig_of

FAMILIES = ("concurrent", "pencil", "regulus", "free")


def test_ramps_and_bisections_find_the_predicted_limits_of_every_family():
    ramped, bisected = [], []
    for name in ("wedge", "l-bracket"):
        for family in FAMILIES:
            body, found = grasps(name, 0.4, 1, (family,))
            for grasp in found:
                rig = rig_of(body, grasp, 0.4)
                limits = limiting_loads(body, grasp, 0.4, 2)
                ramped += ramped_limits(rig, limits)
                bisected += bisected_limits(rig, limits)
    assert len(ramped) == len(bisected) >= 8
    for ramp, bisection in zip(ramped, bisected, strict=True):
        assert ramp.share == pytest.approx(1.0, abs=0.005)
        assert bisection.share == pytest.approx(1.0, abs=0.005)
        assert ramp.lower < ramp.share <= ramp.upper
        assert bisection.upper - bisection.lower == pytest.approx(0.04 / 2**4)


def test_a_limit_that_is_not_where_it_is_predicted_is_found_farther_away_or_not_at_all():
    """Predictions off by 5 %, 30 % and a factor of three, either way."""
    body, (grasp, *_) = grasps("random-12-1", 0.5, 1)
    rig = rig_of(body, grasp, 0.5)
    (limit,) = limiting_loads(body, grasp, 0.5, 1)
    idle = rig.idle.forces
    wrong = [
        TrialLoad(factor * limit.wrench, idle + factor * (limit.forces - idle))
        for factor in (0.95, 1.05, 0.75, 1.3, 0.33, 3.0)
    ]
    for method in (ramped_limits, bisected_limits):
        found = method(rig, wrong)
        for factor, simulated in zip((0.95, 1.05, 0.75, 1.3), found, strict=False):
            assert simulated.share * factor == pytest.approx(1.0, abs=0.05)
        assert found[4:] == (None, None)


def test_planned_forces_balance_every_share_of_a_limit():
    """Below the limit, at it, and above it, where the fingers cannot apply them."""
    tested = 0
    for name in ("wedge", "random-12-1"):
        body, (grasp,) = grasps(name, 0.5, 1)
        idle = rig_of(body, grasp, 0.5).idle
        for limit in limiting_loads(body, grasp, 0.5, 3):
            for share in (0.0, 0.4, 1.0, 1.3, MOST_PLANNED):
                load = part(idle, limit, share)
                assert imbalance(load, body, grasp) < 1e-6
                np.testing.assert_allclose(load.wrench, share * limit.wrench)
                tested += 1
    assert tested == 30
