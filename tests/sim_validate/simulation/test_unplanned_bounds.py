"""What is found without planned forces is on the safe side of the predictions."""

import numpy as np
import pytest

from sim_validate.simulation.setup import Setup
from sim_validate.simulation.unplanned_bounds import Bounds, first_residual, independent_bounds
from tests.sim_validate.rigs import grasps, limiting_loads, rig_of

FAMILIES = ("concurrent", "pencil", "regulus", "free")


def test_rigid_fingers_and_a_fixed_squeeze_never_do_better_than_predicted():
    tested, found_friction, shares = 0, 0, []
    for name in ("wedge", "double-wedge-bar", "random-12-1"):
        for family in FAMILIES:
            body, found = grasps(name, 0.5, 1, (family,))
            for grasp in found:
                rig = rig_of(body, grasp, 0.5)
                limits = limiting_loads(body, grasp, 0.5, 4)
                critical = grasp.critical_friction
                bounds = independent_bounds(body, grasp, critical, rig, limits)
                assert bounds.agree(critical)
                if bounds.friction_at_most is not None:
                    assert bounds.friction_at_most >= critical
                    found_friction += 1
                shares += bounds.limit_shares
                tested += 1
    assert tested >= 8
    assert found_friction >= 4
    assert max(shares) <= 1.02
    assert np.median(shares) > 0.15


def test_the_first_instant_tells_closure_from_its_absence():
    """Half of the critical friction leaves a wrench unopposed; three times it opposes them all."""
    below, above = [], []
    for name in ("wedge", "random-12-1", "l-bracket", "double-wedge-bar"):
        body, found = grasps(name, 0.5, 4, ("regulus", "free"))
        for grasp in found:
            if grasp.critical_friction > 0.05:
                critical = grasp.critical_friction
                below.append(first_residual(body, grasp, 0.5 * critical, Setup()))
                above.append(first_residual(body, grasp, 3.0 * critical, Setup()))
    assert len(below) >= 8
    assert min(below) > 0.5
    assert max(above) < 0.3


@pytest.mark.parametrize(
    ("changes", "agrees"),
    [
        ({}, True),
        ({"friction_at_most": 0.19}, False),
        ({"friction_at_most": None}, True),
        ({"limit_shares": (0.4, 1.2)}, False),
    ],
)
def test_bounds_on_the_wrong_side_contradict_the_prediction(changes, agrees):
    usual = {
        "friction_at_most": 0.21, "friction_slipped": 0.2, "limit_shares": (0.5, 0.6),
        "residual": 0.01,
    }  # fmt: skip
    assert Bounds(**usual | changes).agree(0.2) is agrees
